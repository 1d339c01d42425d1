"""Equilibrium at the end of one increment: Newton with the consistent tangent.

A correction that overshoots or makes the residual rise too much is shortened a few times; where that does not help, the
elastic tangent is tried for one correction; then the increment is refused, with a sentence, and the caller makes it
smaller. The first trial carries the last increment on, or comes from the tangent of the last equilibrium (elastic where
a stage begins). The last correction is made with the factors of the one before where these promise balance: with r the
residual and ρ its fall in the last correction, old factors leave about ρ r, new ones ρ² r: both are balance if ρ r is.
"""

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np
from scipy.sparse import csr_matrix

from fabfem.fem.diagnosis import singularity
from fabfem.fem.linear import whole
from fabfem.fem.model import Controls
from fabfem.fem.points import Refusal, elastic_tangents
from fabfem.fem.trial import Equilibrium, System, Task, Trial, attempt, make_task, resisted, work

MARGIN = 0.1
"""What a correction with old factors must promise to leave, over the tolerance."""


class Solved(NamedTuple):
    """How an increment ended: in a trial that is in balance, or refused."""

    end: Trial | Refusal
    iterations: int
    """Linear solves."""
    residuals: tuple[float, ...]
    """Relative residual of every trial."""
    reused: int = 0
    """Linear solves, of all, with factors that were there."""


def solve_increment(
    system: System, old: Equilibrium, load: np.ndarray, size: float, guess: np.ndarray | None = None
) -> Solved:
    """Equilibrium under `load` (ndof,) a part `size` of the stage after `old`.

    `guess` is a displacement increment to start from; without one a solve with the old tangent makes it.
    """
    task = make_task(system, old, load, size)
    residuals: list[float] = []
    iterations = reused = 0
    trial: Trial | Refusal = Refusal("") if guess is None else attempt(system, old, task, guess)
    if isinstance(trial, Refusal):
        trial = _predicted(system, old, task)
        iterations += 1
    while isinstance(trial, Trial):
        residuals.append(trial.residual)
        if trial.residual <= system.controls.tolerance or trial.norm <= round_off(system, trial.step):
            break
        if iterations == system.controls.max_iterations:
            reason = f"no equilibrium in {iterations} iterations (residual {trial.residual:.1e})"
            trial = Refusal(reason, worst_point(system, trial))
            break
        iterations += 1
        if promise_balance(system.controls, residuals):
            trial = trial.without_tangent()
            again = _again(system, old, task, trial)
            if again is not None:
                trial, reused = again, reused + 1
                continue
            trial = _at(system, old, task, trial)
        matrix, trial = stiffness_of(system, task, trial.batch.tangent), trial.without_tangent()
        trial = _corrected(system, old, task, trial, matrix)
        del matrix
    return Solved(trial, iterations, tuple(residuals), reused)


def promise_balance(controls: Controls, residuals: Sequence[float]) -> bool:
    """Whether another correction with the last factors will end in balance, if it contracts as the last one did."""
    if len(residuals) < 2 or not controls.reuse:
        return False
    return residuals[-1] ** 2 <= MARGIN * controls.tolerance * residuals[-2]


def _again(system: System, old: Equilibrium, task: Task, trial: Trial) -> Trial | None:
    """The trial that a correction with the last factors leads to; None where it does not halve the residual."""
    with system.timer.phase("linear_solve"):
        solution = system.solver.solve(trial.unbalanced)
    new = attempt(system, old, task, trial.step + system.constraints.spread(solution.x)) if solution.ok else None
    return new if isinstance(new, Trial) and new.norm <= 0.5 * trial.norm else None


def _at(system: System, old: Equilibrium, task: Task, trial: Trial) -> Trial:
    """A trial again, with its tangent."""
    again = attempt(system, old, task, trial.step)
    assert isinstance(again, Trial), "points answer the same twice"
    return again


def round_off(system: System, step: np.ndarray) -> float:
    """The out-of-balance force that round-off alone makes; it matters where a body moves without strain."""
    return 1e-14 * system.stiffest * system.space.norm(step)


def _predicted(system: System, old: Equilibrium, task: Task) -> Trial | Refusal:
    """The trial that the old tangent leads to, or the elastic one where that fails."""
    return _first_that_works(
        lambda tangent: _extended(system, old, task, tangent),
        lambda: old.tangent,
        lambda: elastic_tangents(system.space, system.zones, old.states),
    )


def _corrected(system: System, old: Equilibrium, task: Task, trial: Trial, matrix: csr_matrix) -> Trial | Refusal:
    """The trial that a correction with a stiffness leads to, or one with the elastic tangent where that fails."""

    def elastic() -> csr_matrix:
        tangent = elastic_tangents(system.space, system.zones, trial.batch.states)
        return stiffness_of(system, task, tangent)

    return _first_that_works(lambda way: _searched(system, old, task, trial, way), lambda: matrix, elastic)


def _first_that_works(advance: Callable[[Any], Trial | Refusal], *ways: Callable[[], Any]) -> Trial | Refusal:
    """The first trial that `advance` makes of a tangent or stiffness, or the first refusal where none works."""
    refusals = []
    for way in ways:
        result = advance(way())
        if isinstance(result, Trial):
            return result
        refusals.append(result)
    return refusals[0]


def _extended(system: System, old: Equilibrium, task: Task, tangent: np.ndarray) -> Trial | Refusal:
    """The trial of one linear step from `old` to the new load and held dofs."""
    start = old.force if task.start is None else task.start
    rhs = system.constraints.collect(task.load - start - pushed(system, task, tangent, task.motion))
    correction = solved(system, stiffness_of(system, task, tangent), rhs)
    if isinstance(correction, Refusal):
        return correction
    return attempt(system, old, task, task.motion + system.constraints.spread(correction))


def _searched(system: System, old: Equilibrium, task: Task, trial: Trial, matrix: csr_matrix) -> Trial | Refusal:
    """The trial of one correction, shortened while the points refuse it, it overshoots or the residual rises too much.

    Where shortening does not end that, the trial with the smallest residual, unless it rises too much.
    """
    correction = solved(system, matrix, trial.unbalanced)
    if isinstance(correction, Refusal):
        return correction
    along = system.constraints.spread(correction)
    start = work(system, correction, trial.unbalanced)
    tried: list[Trial | Refusal] = []
    factor = 1.0
    for _ in range(system.controls.backtracks + 1):
        new = attempt(system, old, task, trial.step + factor * along)
        tried.append(new)
        left = work(system, correction, new.unbalanced) if isinstance(new, Trial) else 0.0
        if isinstance(new, Trial) and _content(system.controls, new.norm / trial.norm, start, left):
            return new
        factor *= float(np.clip(start / (start - left), 0.1, 0.5)) if left < 0.0 < start else 0.5
    return _least(system, trial, tried)


def _content(controls: Controls, rise: float, start: float, left: float) -> bool:
    """Whether a correction is taken: `start` and `left` are the residual's work along it before and after."""
    straight = abs(left) <= controls.turn * abs(start) if start > 0.0 else rise < 1.0
    return rise <= 0.5 or (rise < controls.rise and (straight or controls.turn == np.inf))


def _least(system: System, trial: Trial, tried: list[Trial | Refusal]) -> Trial | Refusal:
    """The trial with the smallest residual, or the refusal that stands in the way."""
    trials = [new for new in tried if isinstance(new, Trial)]
    if not trials:
        return tried[-1]
    best = min(trials, key=lambda new: new.norm)
    if best.norm < system.controls.rise * trial.norm:
        return best
    return Refusal(f"every correction makes the residual {trial.residual:.1e} rise", worst_point(system, trial))


def stiffness_of(system: System, task: Task, tangent: np.ndarray) -> csr_matrix:
    """The stiffness of the unknowns for a tangent (npoints, k, k), with the viscosity and the water of a task.

    The solver lets its last matrix go for it.
    """
    system.solver.forget()
    with system.timer.phase("assembly"):
        return system.reduction.stiffness(_with_viscosity(task, tangent), task.wet)


def pushed(system: System, task: Task, tangent: np.ndarray, motion: np.ndarray) -> np.ndarray:
    """The (ndof,) forces that a motion (ndof,) makes, with the same tangent, viscosity and water."""
    with system.timer.phase("assembly"):
        strain = system.space.strain(motion)
        force = resisted(system, _with_viscosity(task, tangent), strain)
        return force if task.wet is None else force + system.space.summed(task.wet @ motion)


def _with_viscosity(task: Task, tangent: np.ndarray) -> np.ndarray:
    return tangent if task.viscous is None else tangent + task.viscous


def solved(system: System, matrix: csr_matrix, rhs: np.ndarray) -> np.ndarray | Refusal:
    """The unknowns that a force on them moves, under their stiffness, or why not."""
    ranks = system.space.mesh.ranks
    if not ranks.largest(len(rhs)):  # everything is held
        return rhs
    with system.timer.phase("linear_solve"):
        system.solver.factor(matrix)
        solution = system.solver.solve(rhs)
        if solution.ok:
            return solution.x
        named = singularity(system, whole(matrix, system.solver.triangle)) if ranks.size == 1 else ""
    return Refusal(named or solution.reason)


def worst_point(system: System, trial: Trial) -> int:
    """A point of an element at the most unbalanced dof."""
    space, ranks = system.space, system.space.mesh.ranks
    size = np.abs(system.constraints.spread(trial.unbalanced))
    largest, nobody = ranks.largest(float(size.max())), np.iinfo(np.int64).max
    if largest == 0.0:
        return -1
    number = int(np.argmax((space.dofs == size.argmax()).any(axis=1))) * space.nq
    return ranks.least(ranks.point(number, space.nq) if size.max() == largest else nobody)
