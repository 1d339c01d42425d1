"""A stage whose load is found: a displacement or the length of the path is given, and the load follows.

The loads and motions of the stage act with a factor λ that is an unknown: the displacement of an increment is
Δu = T v + Δλ g and the out-of-balance force Tᵀ (f(λ) - F(u)), f(λ) = f0 + λ q. One equation more says how far the
increment goes, with a row a and a value b,

* displacement control: a·Δu = Δs, a the mean of some components (an opening across a band, say), Δs its change;
* cylindrical arc length: |Δu|²/n = Δl² [Crisfield 1981], linearised at each iterate, a = 2Δu/n.

Each correction is δu = u_r + δλ u_q, both from one factorisation of the stiffness: u_r from the out-of-balance force,
u_q = g + T K⁻¹ Tᵀ(q - K g) [Batoz & Dhatt 1979]. The load may fall and, with either, the loaded displacement turn
back. The fraction of the stage is that of Δs, or Δl, so far.

Where the load does not change, as in a collapse of perfectly plastic ground, K is singular, not so the equations; a
little of the elastic tangent is then added to it. At a sharp peak the sphere of the arc length is met behind it too:
where the way on is not found along the last tangent, it is looked for along that of the first trial, up and down, and a
path that runs back along the last increment is refused.
"""

from collections.abc import Generator
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from fabfem.fem.control import Control, control
from fabfem.fem.increment import Cutback, Increment, Place, Step, Stopped, advanced, increment
from fabfem.fem.loads import Loading
from fabfem.fem.newton import Solved, pushed, stiffness_of, worst_point
from fabfem.fem.points import Refusal, elastic_tangents
from fabfem.fem.trial import Equilibrium, System, Task, Trial, attempt, viscous_tangent

EXACT = 1e-8
"""Relative misfit of the further equation that is left."""
SHIFT = 1e-7
"""Share of the elastic tangent that is added where the stiffness is singular."""
BACK = -0.999
"""Cosine between an increment and the last one below which the path runs back along itself."""


class Reached(NamedTuple):
    """Where the stage has come to."""

    now: Equilibrium
    load_factor: float
    last: np.ndarray | None
    """Displacement of the last increment."""


class Sought(NamedTuple):
    """The increment that is looked for."""

    system: System
    load: Loading
    equation: Control
    reached: Reached
    size: float
    """Part of the stage that it goes further."""

    def task(self, factor: float) -> Task:
        """What it has to balance with a load factor."""
        viscous = viscous_tangent(self.system, self.reached.now, self.size)
        return Task(self.load.total(factor), factor * self.system.constraints.motion, viscous)


class Progress(NamedTuple):
    """What a stage whose load is found has come to."""

    load_factor: float
    last: np.ndarray | None
    """(ndof,) displacement of the last increment."""
    fraction: float
    size: float
    """Size to try next."""


def through(
    place: Place, system: System, now: Equilibrium, load: Loading
) -> Generator[Increment | Stopped, None, tuple[Equilibrium | None, int]]:
    """Yield the increments of a stage; return its last equilibrium, None where it stopped, and their number so far."""
    stage, number = place.stage, place.number
    equation = control(stage.goal, system.space)
    factor, last, fraction, size = place.progress or Progress(0.0, None, 0.0, stage.first)
    reached = Reached(now, factor, last)
    while fraction < 1.0:
        spent = dict(system.timer.spent)
        step, factor = _tried(place, system, load, equation, reached, fraction, size)
        trial = step.solved.end
        timings = system.timer.since(spent)
        if isinstance(trial, Refusal):
            yield Stopped(stage.name, place.stage_index, fraction, trial.reason, trial.point, step.cutbacks, timings)
            return None, number
        number, fraction, old = number + 1, step.fraction, reached.now
        reached = Reached(advanced(old, trial), factor, trial.step)
        easy = step.solved.iterations <= system.controls.easy and not step.cutbacks
        size = min(step.size * (system.controls.growth if easy else 1.0), stage.largest)
        at = Progress(factor, trial.step, fraction, size)
        there = place._replace(number=number, progress=at)
        yield replace(increment(there, system, old, reached.now, step, trial, timings), load_factor=factor)
    return reached.now, number


def _tried(
    place: Place,
    system: System,
    load: Loading,
    equation: Control,
    reached: Reached,
    fraction: float,
    size: float,
) -> tuple[Step, float]:
    """The increment after `fraction`, halved until it converges or is too small, and its load factor."""
    stage = place.stage
    cutbacks: tuple[Cutback, ...] = ()
    while True:
        target = fraction + size if fraction + 1.001 * size < 1.0 else 1.0
        size = target - fraction
        solved, factor = _solve(Sought(system, load, equation, reached, size))
        forces = load.total(factor), load.on_soil(factor)
        if isinstance(solved.end, Trial):
            return Step(solved, target, size, *forces, cutbacks), factor
        cutbacks += (Cutback(stage.name, fraction, size, *solved.end, solved.residuals),)
        size *= 0.5
        if size < stage.smallest:
            return Step(solved, target, size, *forces, cutbacks), factor


def _solve(sought: Sought) -> tuple[Solved, float]:
    """The increment that is sought, and the load factor at its end."""
    reached = sought.reached
    first, factor = _predicted(sought, reached.now.tangent, 0.0)
    answer, at = _iterated(sought, first, factor)
    if isinstance(answer.end, Trial) or isinstance(first, Refusal):
        return answer, at
    for sense in (1.0, -1.0):
        start, factor = _predicted(sought, first.batch.tangent, sense)
        other, at = _iterated(sought, start, factor)
        if isinstance(other.end, Trial):
            return other, at
    return answer, reached.load_factor


def _iterated(sought: Sought, trial: Trial | Refusal, factor: float) -> tuple[Solved, float]:
    """Newton's corrections of a trial."""
    system, _, equation, reached, size = sought
    residuals: list[float] = []
    iterations = 1
    while isinstance(trial, Trial):
        residuals.append(trial.residual)
        met = abs(equation.misfit(trial.step, size)) <= EXACT * equation.scale(size)
        if met and trial.residual <= system.controls.tolerance:
            break
        if iterations == system.controls.max_iterations:
            reason = f"no equilibrium in {iterations} iterations (residual {trial.residual:.1e})"
            trial = Refusal(reason, worst_point(system, trial))
            break
        trial, factor = _corrected(sought, trial, factor)
        iterations += 1
    if isinstance(trial, Trial) and reached.last is not None and _cosine(system, trial.step, reached.last) < BACK:
        trial = Refusal("the path runs back along the last increment")
    return Solved(trial, iterations, tuple(residuals)), factor


def _cosine(system: System, step: np.ndarray, last: np.ndarray) -> float:
    space = system.space
    return space.dot(step, last) / max(space.norm(step) * space.norm(last), 1e-300)


def _predicted(sought: Sought, tangent: np.ndarray, sense: float) -> tuple[Trial | Refusal, float]:
    """The first trial along a tangent, and its load factor."""
    system, load, equation, reached, size = sought
    old = reached.now
    unbalanced = system.constraints.collect(load.total(reached.load_factor) - old.force)
    both = _directions(system, load, old, tangent, unbalanced)
    if isinstance(both, Refusal):
        return both, reached.load_factor
    at_rest, along = both
    change = equation.first(along, size, reached.last, sense)
    if not np.isfinite(change):
        return Refusal("the load does not move what is controlled"), reached.load_factor
    factor = reached.load_factor + change
    return attempt(system, old, sought.task(factor), at_rest + change * along), factor


def _corrected(sought: Sought, trial: Trial, factor: float) -> tuple[Trial | Refusal, float]:
    """The trial of one correction, halved while the points refuse it or the residual rises too much."""
    system, load, equation, reached, size = sought
    both = _directions(system, load, reached.now, trial.batch.tangent, trial.unbalanced)
    if isinstance(both, Refusal):
        return both, factor
    at_rest, along = both
    row = equation.row(trial.step)
    slope = system.space.dot(row, along)
    if not slope:
        return Refusal("the load does not move what is controlled"), factor
    change = (equation.misfit(trial.step, size) - system.space.dot(row, at_rest)) / slope
    share = 1.0
    new: Trial | Refusal = Refusal("")
    for _ in range(system.controls.backtracks + 1):
        at = factor + share * change
        new = attempt(system, reached.now, sought.task(at), trial.step + share * (at_rest + change * along))
        if (
            isinstance(new, Trial)
            and new.norm < system.controls.rise * trial.norm + system.space.norm(trial.force) * 1e-3
        ):
            return new, at
        share *= 0.5
    return new, factor


def _directions(
    system: System, load: Loading, old: Equilibrium, tangent: np.ndarray, unbalanced: np.ndarray
) -> tuple[np.ndarray, np.ndarray] | Refusal:
    """The displacements (ndof,) that the out-of-balance force and a unit of the load factor make."""
    result = _both(system, load, tangent, unbalanced)
    if isinstance(result, Refusal):
        elastic = elastic_tangents(system.space, system.zones, old.states)
        return _both(system, load, tangent + SHIFT * elastic, unbalanced)
    return result


def _both(
    system: System, load: Loading, tangent: np.ndarray, unbalanced: np.ndarray
) -> tuple[np.ndarray, np.ndarray] | Refusal:
    constraints = system.constraints
    task = Task(load.total(0.0), constraints.motion, None)
    moving = pushed(system, task, tangent, constraints.motion)
    matrix, unit = stiffness_of(system, task, tangent), load.total(1.0) - load.total(0.0)
    with system.timer.phase("linear_solve"):
        system.solver.factor(matrix)
        answers = [system.solver.solve(rhs) for rhs in (unbalanced, constraints.collect(unit - moving))]
    for answer in answers:
        if not answer.ok:
            return Refusal(answer.reason)
    return constraints.spread(answers[0].x), constraints.motion + constraints.spread(answers[1].x)
