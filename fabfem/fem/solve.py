"""The march through the stages: increments that grow, halve, are tried again, and give up at a stated size.

`march` yields every converged increment. Where it cannot go on, its last item is a `Stopped` that says why and where;
nothing is raised and nothing that converged is lost. What drives a stage is chosen by the type of its goal (`COURSES`):
without one, the fraction of its loads and motions.
"""

from collections.abc import Generator, Iterator, Mapping
from importlib import import_module

import numpy as np

from fabfem.fem.assembly import Pattern, find_pattern, stiffness
from fabfem.fem.increment import (
    Collapsed,
    Cutback,
    Factor,
    Increment,
    Place,
    Step,
    Stopped,
    advanced,
    increment,
)
from fabfem.fem.linear import make_solver
from fabfem.fem.loads import Loading, loading
from fabfem.fem.model import Controls, Model, Refusal, Zone, elastic_tangents, stress_of, symmetric, weaken
from fabfem.fem.newton import solve_increment
from fabfem.fem.pores import Pace, PorousSpace, Water, water_of
from fabfem.fem.space import Space
from fabfem.fem.stages import ArcLength, DisplacementControl, Stage, StrengthSearch
from fabfem.fem.supports import constrain, reduction
from fabfem.fem.trial import PHASES, Equilibrium, System, Trial
from fabfem.timing import Timer

__all__ = ["Collapsed", "Cutback", "Factor", "Increment", "Stopped", "march", "reaction", "systems_of"]

COURSES = {
    StrengthSearch: "fabfem.fem.safety",
    DisplacementControl: "fabfem.fem.follow",
    ArcLength: "fabfem.fem.follow",
}
"""Module whose `through` goes through a stage with such a goal."""

TOO_FAST = 4.0
"""Error of a time step, over what the stage allows, at which it is done again."""

Course = Generator[Increment | Stopped | Collapsed, None, tuple[Equilibrium | None, int]]


def march(model: Model) -> Iterator[Increment | Stopped | Collapsed]:
    """Iterate over the converged increments of all stages; a `Stopped` ends a run that cannot go on.

    A `Collapsed` ends a stage that searched for the factor of safety, and the run with it. Raises ValueError where a
    stage is impossible.
    """
    return _all_stages(model, systems_of(model))


def systems_of(model: Model) -> list[System]:
    """The equations of every stage; raises ValueError where a stage is impossible."""
    space = model.space
    pattern = find_pattern(space.dofs, space.ndof)
    elastic = stiffness(space, pattern, elastic_tangents(model.zones, model.states, space.npoints))
    shared = (pattern, Timer(PHASES), float(np.abs(elastic.diagonal()).max()))
    zones: Mapping[str, Zone] = model.zones
    systems: list[System] = []
    for stage in model.stages:
        zones = changed(zones, stage)
        systems.append(_system(model, stage, zones, *shared))
    return systems


def reaction(space: Space, increment: Increment, boundary: str, component: str) -> float:
    """Force that the supports of a boundary exert on the body along a component."""
    dofs = space.dofs_on(boundary, component)
    return float((increment.internal_force - increment.external_force)[dofs].sum())


def changed(zones: Mapping[str, Zone], stage: Stage) -> dict[str, Zone]:
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
    return np.flatnonzero(~kept)


def _system(
    model: Model, stage: Stage, zones: Mapping[str, Zone], pattern: Pattern, timer: Timer, stiffest: float
) -> System:
    gone = absent_dofs(model.space, {name: zones[name] for name in stage.absent})
    water = _water(model, stage, pattern)
    if isinstance(model.space, PorousSpace) and water is None:
        gone = np.union1d(gone, np.arange(model.space.nmotion, model.space.ndof))
    constraints = constrain(model.space, stage.supports, stage.bodies, gone)
    reduce = reduction(pattern, constraints)
    there = {name: zone for name, zone in zones.items() if name not in stage.absent}
    if not isinstance(stage.goal, StrengthSearch):
        there = weaken(there, stage.strength, stage.spared)
    solver = make_solver(model.solver, symmetric(there))
    return System(model.space, there, model.controls, constraints, pattern, reduce, solver, timer, stiffest, water)


def _water(model: Model, stage: Stage, pattern: Pattern) -> Water | None:
    """What pore water does in a stage; None where there is none, or its excess pressure is zero."""
    if model.water is None or not isinstance(model.space, PorousSpace) or stage.drainage == "drained":
        return None
    return water_of(model.space, pattern, model.water, stage.drainage == "seepage", stage.duration)


def _all_stages(model: Model, systems: list[System]) -> Iterator[Increment | Stopped | Collapsed]:
    space = model.space
    now = Equilibrium(np.zeros(space.ndof), model.states, np.zeros(space.ndof), np.zeros((0, 6, 6)))
    number, time = 0, 0.0
    for index, (stage, system) in enumerate(zip(model.stages, systems, strict=True)):
        try:
            now = _begun(now, stage, system)
        except ValueError as error:
            yield Stopped(stage.name, index, 0.0, f"a zone cannot change its material: {error}", -1, (), {})
            return
        reached, number = yield from _course(Place(stage, index, number, time), system, now)
        if reached is None:
            return
        now = reached
        if stage.zero_displacement:
            now = now._replace(displacement=space.at_rest(now.displacement))
        time += stage.duration


def _begun(now: Equilibrium, stage: Stage, system: System) -> Equilibrium:
    """The state in which a stage begins: materials changed, forces those of the zones that are there."""
    states = now.states | {name: change.begin(now.states[name]) for name, change in stage.changes.items()}
    npoints = system.space.npoints
    force = system.space.internal_force(stress_of(system.zones, states, npoints))
    return Equilibrium(now.displacement, states, force, elastic_tangents(system.zones, states, npoints))


def _course(place: Place, system: System, now: Equilibrium) -> Course:
    """The way through a stage that its goal asks for."""
    load = loading(system.space, place.stage.loads)
    if place.stage.released:
        load = load.released(system.constraints.keep_unknown(now.force - load.total(0.0)))
    if place.stage.goal is None:
        return _through(place, system, now, load)
    return import_module(COURSES[type(place.stage.goal)]).through(place, system, now, load)


def _through(place: Place, system: System, now: Equilibrium, load: Loading) -> Course:
    """Yield the increments of a stage; return its last equilibrium, None where it stopped, and their number so far."""
    stage, fraction, size, number = place.stage, 0.0, place.stage.first, place.number
    guess, pace = None, Pace(system.water, stage.time_tolerance)
    while fraction < 1.0:
        spent = dict(system.timer.spent)
        step = _tried(stage, system, load, now, fraction, size, guess, pace)
        trial = step.solved.end
        if isinstance(trial, Refusal):
            timings = system.timer.since(spent)
            yield Stopped(stage.name, place.stage_index, fraction, *trial, step.cutbacks, timings)
            return None, number
        number, fraction, old = number + 1, step.fraction, now
        now = advanced(old, trial)
        yield increment(place, number, system, old, now, step, trial, system.timer.since(spent))
        size = _next_size(stage, system.controls, step, pace.error(old.displacement, trial.step, step.size))
        pace.keep(old.displacement, trial.step, step.size)
        guess = _extrapolated(system, trial.step, step.size, min(size, 1.0 - fraction))
    return now, number


def _tried(
    stage: Stage,
    system: System,
    load: Loading,
    now: Equilibrium,
    fraction: float,
    size: float,
    guess: np.ndarray | None,
    pace: Pace,
) -> Step:
    """The increment after `fraction`, made smaller until it converges or its size is below the stage's smallest."""
    cutbacks: tuple[Cutback, ...] = ()
    end = next(mark for mark in stage.marks if mark > fraction + 1e-9)
    while True:
        target = fraction + size if fraction + 1.001 * size < end else end
        size = target - fraction
        forces = load.total(target)
        solved = solve_increment(system, now, forces, size, guess)
        answer = solved.end
        may_shrink = 0.5 * size >= stage.smallest
        if isinstance(answer, Trial) and may_shrink and pace.error(now.displacement, answer.step, size) > TOO_FAST:
            answer = Refusal("the pore pressure changes faster than the time step can follow")
        if isinstance(answer, Trial):
            return Step(solved, target, size, forces, load.on_soil(target), cutbacks)
        cutbacks += (Cutback(stage.name, fraction, size, *answer),)
        size, guess = 0.5 * size, None
        if size < stage.smallest:
            return Step(solved._replace(end=answer), target, size, forces, forces, cutbacks)


def _next_size(stage: Stage, controls: Controls, step: Step, pace: float) -> float:
    """The size to try next: larger after an easy increment without cut-back, as far as the flow of water allows."""
    easy = step.solved.iterations <= controls.easy and not step.cutbacks
    growth = controls.growth if easy else 1.0
    if pace > 0.0:
        growth = float(np.clip(0.9 * pace**-0.5, 0.3, growth))
    return float(np.clip(step.size * growth, stage.smallest, stage.largest))


def _extrapolated(system: System, last: np.ndarray, last_size: float, size: float) -> np.ndarray | None:
    """The last displacement increment carried on to the next size, where the controls ask for that."""
    if system.water is not None:  # a drain lets pressures fall in one step only
        return None
    return last * (size / last_size) if system.controls.extrapolate else None
