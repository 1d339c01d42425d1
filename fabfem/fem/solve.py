"""The march through the stages: increments that grow, halve, are tried again, and give up at a stated size.

`march` yields every converged increment. Where it cannot go on, its last item is a `Stopped` that says why and where;
nothing is raised and nothing that converged is lost.
"""

from collections.abc import Callable, Generator, Iterator
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from fabfem.fem.assembly import Pattern, find_pattern, stiffness
from fabfem.fem.linear import make_solver, norm
from fabfem.fem.loads import external_force
from fabfem.fem.model import Controls, Model, Refusal, States, elastic_tangents, initial_stress
from fabfem.fem.newton import Solved, solve_increment
from fabfem.fem.space import Space
from fabfem.fem.stages import Stage
from fabfem.fem.supports import constrain, reduction
from fabfem.fem.trial import PHASES, Equilibrium, System, Trial, relative
from fabfem.timing import Timer


@dataclass(frozen=True)
class Cutback:
    """An increment that was refused and tried again smaller."""

    stage: str
    fraction: float
    """Fraction of the stage that it started from."""
    size: float
    """Its size, as a fraction of the stage."""
    reason: str
    point: int
    """Worst point, -1 where no point is to blame."""


@dataclass(frozen=True)
class Increment:
    """A converged increment."""

    stage: str
    stage_index: int
    number: int
    """Counted from 1 through the run."""
    fraction: float
    """Fraction of the stage that is done, 0…1."""
    size: float
    time: float
    displacement: np.ndarray
    """(ndof,) since displacements were last set to zero."""
    states: States
    """State of each zone."""
    internal_force: np.ndarray
    """(ndof,) nodal forces of the stress, drag included."""
    external_force: np.ndarray
    """(ndof,) nodal forces of the loads."""
    iterations: int
    """Linear solves."""
    residuals: tuple[float, ...]
    """Relative residual of every trial."""
    out_of_balance: float
    """Relative residual under the new loads before anything moved."""
    drag: float
    """Norm of the nodal forces of the viscous stress, relative as the residual is; 0 without viscosity."""
    held: int
    """Points that kept their old stress and state because the material refused them; see `Controls`."""
    moved: float
    """Largest displacement of a node in this increment."""
    cutbacks: tuple[Cutback, ...]
    worst_point: int
    """Point with the largest integration error, and the error."""
    worst_error: float
    local_error: np.ndarray
    """(npoints,) integration error of every point in this increment."""
    tangent: np.ndarray
    """(npoints, 6, 6) tangent of every point."""
    timings: dict[str, float]
    """Seconds spent in material, assembly, linear_solve, tries that failed included."""


@dataclass(frozen=True)
class Stopped:
    """Why a run could not go on after its last increment."""

    stage: str
    stage_index: int
    fraction: float
    reason: str
    point: int
    cutbacks: tuple[Cutback, ...]
    timings: dict[str, float]
    """Seconds spent in each phase on the tries that failed."""


def march(model: Model) -> Iterator[Increment | Stopped]:
    """Iterate over the converged increments of all stages; a `Stopped` ends a run that cannot go on.

    Raises ValueError where a stage is impossible.
    """
    space = model.space
    pattern = find_pattern(space.dofs, space.ndof)
    elastic = stiffness(space, pattern, elastic_tangents(model.zones, model.states, space.npoints))
    shared = (pattern, Timer(PHASES), float(np.abs(elastic.diagonal()).max()))
    return _all_stages(model, [_system(model, stage, *shared) for stage in model.stages])


def reaction(space: Space, increment: Increment, boundary: str, component: str) -> float:
    """Force that the supports of a boundary exert on the body along a component."""
    dofs = space.dofs_on(boundary, component)
    return float((increment.internal_force - increment.external_force)[dofs].sum())


def _system(model: Model, stage: Stage, pattern: Pattern, timer: Timer, stiffest: float) -> System:
    constraints = constrain(model.space, stage.supports)
    reduce = reduction(pattern, constraints)
    solver = make_solver(model.solver, model.symmetric)
    return System(model.space, model.zones, model.controls, constraints, pattern, reduce, solver, timer, stiffest)


def _all_stages(model: Model, systems: list[System]) -> Iterator[Increment | Stopped]:
    space = model.space
    force = space.internal_force(initial_stress(model.zones, space.npoints))
    now = Equilibrium(np.zeros(space.ndof), model.states, force, np.zeros((0, 6, 6)))
    number, time = 0, 0.0
    for index, (stage, system) in enumerate(zip(model.stages, systems, strict=True)):
        now = now._replace(tangent=elastic_tangents(model.zones, now.states, space.npoints))
        place = _Place(stage, index, number, time)
        reached, number = yield from _through(place, system, now)
        if reached is None:
            return
        now = reached
        if stage.zero_displacement:
            now = now._replace(displacement=np.zeros(space.ndof))
        time += stage.duration


class _Place(NamedTuple):
    """A stage, and the increments and time before it."""

    stage: Stage
    stage_index: int
    number: int
    time: float


class _Step(NamedTuple):
    """An increment with all its tries."""

    solved: Solved
    fraction: float
    size: float
    load: np.ndarray
    cutbacks: tuple[Cutback, ...]


def _through(
    place: _Place, system: System, now: Equilibrium
) -> Generator[Increment | Stopped, None, tuple[Equilibrium | None, int]]:
    """Yield the increments of a stage; return its last equilibrium, None where it stopped, and their number so far."""
    stage, fraction, size, number = place.stage, 0.0, place.stage.first, place.number
    load, guess = external_force(system.space, stage.loads), None
    while fraction < 1.0:
        spent = dict(system.timer.spent)
        step = _tried(stage, system, load, now, fraction, size, guess)
        trial = step.solved.end
        if isinstance(trial, Refusal):
            timings = system.timer.since(spent)
            yield Stopped(stage.name, place.stage_index, fraction, *trial, step.cutbacks, timings)
            return None, number
        number, fraction, old = number + 1, step.fraction, now
        now = Equilibrium(
            old.displacement + trial.step, trial.batch.states, trial.force - trial.drag, trial.batch.tangent
        )
        yield _increment(place, number, system, old, now, step, trial, system.timer.since(spent))
        size = _next_size(stage, system.controls, step)
        guess = _extrapolated(system, trial.step, step.size, min(size, 1.0 - fraction))
    return now, number


def _tried(
    stage: Stage,
    system: System,
    load: Callable[[float], np.ndarray],
    now: Equilibrium,
    fraction: float,
    size: float,
    guess: np.ndarray | None,
) -> _Step:
    """The increment after `fraction`, made smaller until it converges or its size is below the stage's smallest."""
    cutbacks: tuple[Cutback, ...] = ()
    while True:
        target = fraction + size if fraction + 1.001 * size < 1.0 else 1.0
        size = target - fraction
        forces = load(target)
        solved = solve_increment(system, now, forces, size, guess)
        if isinstance(solved.end, Trial):
            return _Step(solved, target, size, forces, cutbacks)
        cutbacks += (Cutback(stage.name, fraction, size, *solved.end),)
        size, guess = 0.5 * size, None
        if size < stage.smallest:
            return _Step(solved, target, size, forces, cutbacks)


def _next_size(stage: Stage, controls: Controls, step: _Step) -> float:
    """The size to try next: larger after an easy increment that needed no cut-back."""
    easy = step.solved.iterations <= controls.easy and not step.cutbacks
    return min(step.size * (controls.growth if easy else 1.0), stage.largest)


def _extrapolated(system: System, last: np.ndarray, last_size: float, size: float) -> np.ndarray | None:
    """The last displacement increment carried on to the next size, where the controls ask for that."""
    return last * (size / last_size) if system.controls.extrapolate else None


def _increment(
    place: _Place,
    number: int,
    system: System,
    old: Equilibrium,
    now: Equilibrium,
    step: _Step,
    trial: Trial,
    timings: dict[str, float],
) -> Increment:
    start = norm((step.load - old.force)[system.constraints.free])
    return Increment(
        stage=place.stage.name,
        stage_index=place.stage_index,
        number=number,
        fraction=step.fraction,
        size=step.size,
        time=place.time + step.fraction * place.stage.duration,
        displacement=now.displacement,
        states=now.states,
        internal_force=trial.force,
        external_force=step.load,
        iterations=step.solved.iterations,
        residuals=step.solved.residuals,
        out_of_balance=relative(start, old.force, step.load),
        drag=relative(norm(trial.drag), trial.force, step.load),
        held=trial.batch.held,
        moved=float(np.linalg.norm(system.space.displacement(trial.step), axis=1).max()),
        cutbacks=step.cutbacks,
        worst_point=trial.batch.worst_point,
        worst_error=trial.batch.worst_error,
        local_error=trial.batch.error,
        tangent=trial.batch.tangent,
        timings=timings,
    )
