"""The equations of every stage: what is there, what is held, the pattern of the stiffness and the solver."""

from collections.abc import Callable, Mapping
from importlib.util import find_spec

import numpy as np

from fabfem.fem.assembly import Pattern, diagonal, find_pattern
from fabfem.fem.constraints import Constraints, constrain
from fabfem.fem.linear import LinearSolver, make_solver
from fabfem.fem.model import Model, Zone, symmetric, weaken
from fabfem.fem.multigrid import MultigridSolver, Near, near, worth_while
from fabfem.fem.points import elastic_tangents
from fabfem.fem.pores import Water, water_of
from fabfem.fem.porous_space import PorousSpace
from fabfem.fem.reduction import Reduction
from fabfem.fem.space import Space
from fabfem.fem.stages import Stage, StrengthSearch
from fabfem.fem.trial import PHASES, System, balanced
from fabfem.timing import Timer


def systems_of(model: Model) -> list[System]:
    """The equations of every stage; raises ValueError where a stage is impossible."""
    space = model.space
    elastic = diagonal(space, elastic_tangents(space, model.zones, model.states))
    stiffest = space.mesh.ranks.largest(float(np.abs(space.summed(elastic)).max()))
    coupled = model.water is not None or any(stage.bodies for stage in model.stages)
    shared = (find_pattern(space.dofs, space.ndof) if coupled else None, Timer(PHASES), stiffest)
    zones: Mapping[str, Zone] = model.zones
    systems: list[System] = []
    for stage in model.stages:
        zones = _changed(zones, stage)
        systems.append(_system(model, stage, zones, [system.reduction for system in systems], *shared))
    return systems


def _changed(zones: Mapping[str, Zone], stage: Stage) -> dict[str, Zone]:
    """All zones with the materials that a stage gives them; raises ValueError for zones that there are not."""
    for name in (*stage.absent, *stage.changes, *stage.spared):
        if name not in zones:
            raise ValueError(f"stage '{stage.name}' names a zone '{name}' that the model does not have.")
    new = {
        name: zones[name]._replace(material=change.material, directions=change.directions)
        for name, change in stage.changes.items()
    }
    return {**zones, **new}


def absent_dofs(space: Space, absent: Mapping[str, Zone]) -> np.ndarray:
    """Dofs of nodes that only elements of absent zones have."""
    there = np.ones(space.npoints, bool)
    for zone in absent.values():
        there[zone.points] = False
    kept = np.zeros(space.ndof, bool)
    kept[space.dofs[there.reshape(-1, space.nq).any(axis=1)]] = True
    return np.flatnonzero(space.summed(kept.astype(float)) == 0.0)


def _system(
    model: Model,
    stage: Stage,
    zones: Mapping[str, Zone],
    known: list[Reduction],
    pattern: Pattern | None,
    timer: Timer,
    stiffest: float,
) -> System:
    """The equations of a stage; it shares the pattern of an earlier one with the same unknowns, one of `known`."""
    gone = absent_dofs(model.space, {name: zones[name] for name in stage.absent})
    water = _water(model, stage, pattern)
    if isinstance(model.space, PorousSpace) and water is None:
        gone = np.union1d(gone, np.arange(model.space.nmotion, model.space.ndof))
    constraints = constrain(model.space, stage.supports, stage.bodies, gone)
    there = {name: zone for name, zone in zones.items() if name not in stage.absent}
    if not isinstance(stage.goal, StrengthSearch):
        there = weaken(there, stage.strength, stage.spared)
    solver = model.space.mesh.ranks.solver(constraints, model.space)

    def elastic() -> Near:
        tangent = elastic_tangents(model.space, there, model.states)
        return near(model.space, constraints, reduction.stiffness(tangent))

    solver = solver or _solver(model, there, constraints, elastic)
    direct = water is None and not constraints.ties.shape[1]
    mine = Reduction(model.space, constraints, solver.triangle, None if direct else pattern)
    reduction = next((one for one in known if one.same(mine)), mine)
    counted = balanced(model.space, constraints, water)
    return System(
        *(model.space, there, model.controls, constraints, reduction, solver, timer, stiffest, water, counted)
    )


def _solver(
    model: Model, zones: Mapping[str, Zone], constraints: Constraints, elastic: Callable[[], Near]
) -> LinearSolver:
    """The linear solver of a stage: a direct one, or multigrid where that is asked for or worth while."""
    usual = model.water is None and worth_while(model.space, constraints)
    if model.solver != "multigrid" and not (model.solver == "auto" and usual):
        return make_solver(model.solver, symmetric(zones), coupled=model.water is not None)
    if model.water is not None or find_spec("pyamg") is None:
        reason = "not for pore water" if model.water else "not installed; pip install pyamg brings it"
        raise ValueError(f"the linear solver 'multigrid' is {reason}.")

    return MultigridSolver(elastic, make_solver("auto", symmetric(zones)), symmetric(zones))


def _water(model: Model, stage: Stage, pattern: Pattern | None) -> Water | None:
    """What pore water does in a stage; None where there is none, or its excess pressure is zero."""
    if pattern is None or model.water is None or not isinstance(model.space, PorousSpace):
        return None
    if stage.drainage == "drained":
        return None
    return water_of(model.space, pattern, model.water, stage.drainage == "seepage", stage.duration)
