"""Equilibrium at the end of one increment: Newton with the consistent tangent.

A correction that makes the residual rise too much is halved a few times; where that does not help, the elastic tangent
is tried for one correction; then the increment is refused, with a sentence, and the caller makes it smaller. The first
trial carries the last increment on, or comes from the tangent of the last equilibrium (elastic where a stage begins).
"""

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from time import perf_counter
from typing import NamedTuple

import numpy as np
from scipy.sparse import csr_matrix

from fabfem.assembly import Pattern, stiffness
from fabfem.linear import LinearSolver, norm
from fabfem.model import Batch, Controls, Refusal, States, Zone, elastic_tangents, update_points
from fabfem.space import Space
from fabfem.supports import Constraints, Reduction


class Clock:
    """Seconds spent in each phase."""

    def __init__(self) -> None:
        self.spent = {"material": 0.0, "assembly": 0.0, "linear_solve": 0.0}

    @contextmanager
    def phase(self, name: str) -> Iterator[None]:
        """Add the time of a block to a phase."""
        begun = perf_counter()
        try:
            yield
        finally:
            self.spent[name] += perf_counter() - begun

    def since(self, before: Mapping[str, float]) -> dict[str, float]:
        """Seconds spent in each phase after a copy of `spent` was made."""
        return {name: seconds - before[name] for name, seconds in self.spent.items()}


class System(NamedTuple):
    """The equations of a stage."""

    space: Space
    zones: Mapping[str, Zone]
    controls: Controls
    constraints: Constraints
    pattern: Pattern
    reduce: Reduction
    solver: LinearSolver
    clock: Clock
    stiffest: float
    """Largest diagonal entry of the elastic stiffness."""


class Equilibrium(NamedTuple):
    """A state at rest, and the step that led to it."""

    displacement: np.ndarray
    states: States
    force: np.ndarray
    """(ndof,) internal force."""
    tangent: np.ndarray
    """(npoints, 6, 6) what the first correction of the next increment uses."""


class Trial(NamedTuple):
    """A displacement increment and what it leaves out of balance."""

    step: np.ndarray
    """(ndof,) displacement since the last equilibrium."""
    batch: Batch
    force: np.ndarray
    unbalanced: np.ndarray
    """Out-of-balance force on free dofs."""
    norm: float
    residual: float
    """The norm relative to the forces at work."""


class Solved(NamedTuple):
    """How an increment ended: in a trial that is in balance, or refused."""

    end: Trial | Refusal
    iterations: int
    """Linear solves."""
    residuals: tuple[float, ...]
    """Relative residual of every trial."""


def solve_increment(
    system: System, old: Equilibrium, load: np.ndarray, motion: np.ndarray, guess: np.ndarray | None = None
) -> Solved:
    """Equilibrium under `load` (ndof,) with the held dofs moved by `motion` from `old`.

    `guess` is a displacement increment to start from; without one a solve with the old tangent makes it.
    """
    residuals: list[float] = []
    iterations = 0
    trial: Trial | Refusal = Refusal("") if guess is None else attempt(system, old, load, guess)
    if isinstance(trial, Refusal):
        trial = _predicted(system, old, load, motion)
        iterations += 1
    while isinstance(trial, Trial):
        residuals.append(trial.residual)
        if trial.residual <= system.controls.tolerance or trial.norm <= _round_off(system, trial.step):
            break
        if iterations == system.controls.max_iterations:
            reason = f"no equilibrium in {iterations} iterations (residual {trial.residual:.1e})"
            trial = Refusal(reason, _worst_point(system, trial))
            break
        trial = _corrected(system, old, load, trial)
        iterations += 1
    return Solved(trial, iterations, tuple(residuals))


def attempt(system: System, old: Equilibrium, load: np.ndarray, step: np.ndarray) -> Trial | Refusal:
    """What a displacement increment leaves out of balance, or why the points refuse it."""
    with system.clock.phase("material"):
        batch = update_points(system.zones, system.space.strain(step), old.states)
    if isinstance(batch, Refusal):
        return batch
    with system.clock.phase("assembly"):
        force = system.space.internal_force(batch.stress)
    unbalanced = (load - force)[system.constraints.free]
    size = norm(unbalanced)
    return Trial(step, batch, force, unbalanced, size, relative(size, force, load))


def relative(size: float, force: np.ndarray, load: np.ndarray) -> float:
    """The norm of an out-of-balance force over the larger of internal and external force."""
    scale = max(norm(force), norm(load))
    return size / scale if scale > 0.0 else 0.0


def _round_off(system: System, step: np.ndarray) -> float:
    """The out-of-balance force that round-off alone makes; it matters where a body moves without strain."""
    return 1e-14 * system.stiffest * norm(step)


def _predicted(system: System, old: Equilibrium, load: np.ndarray, motion: np.ndarray) -> Trial | Refusal:
    """The trial that the old tangent leads to, or the elastic one where that fails."""
    return _first_that_works(
        lambda tangent: _extended(system, old, load, motion, tangent),
        lambda: old.tangent,
        lambda: elastic_tangents(system.zones, old.states, system.space.npoints),
    )


def _corrected(system: System, old: Equilibrium, load: np.ndarray, trial: Trial) -> Trial | Refusal:
    """The trial that a Newton correction leads to, or one with the elastic tangent where that fails."""
    return _first_that_works(
        lambda tangent: _searched(system, old, load, trial, tangent),
        lambda: trial.batch.tangent,
        lambda: elastic_tangents(system.zones, trial.batch.states, system.space.npoints),
    )


def _first_that_works(
    advance: Callable[[np.ndarray], Trial | Refusal], *tangents: Callable[[], np.ndarray]
) -> Trial | Refusal:
    """The first trial that `advance` makes of a tangent, or the first refusal where none works."""
    refusals = []
    for tangent in tangents:
        result = advance(tangent())
        if isinstance(result, Trial):
            return result
        refusals.append(result)
    return refusals[0]


def _extended(
    system: System, old: Equilibrium, load: np.ndarray, motion: np.ndarray, tangent: np.ndarray
) -> Trial | Refusal:
    """The trial of one linear step from `old` to the new load and held dofs."""
    step = np.zeros(system.space.ndof)
    step[system.constraints.held] = motion
    matrix = _stiffness(system, tangent)
    correction = _solved(system, matrix, (load - old.force - matrix @ step)[system.constraints.free])
    if isinstance(correction, Refusal):
        return correction
    step[system.constraints.free] = correction
    return attempt(system, old, load, step)


def _searched(system: System, old: Equilibrium, load: np.ndarray, trial: Trial, tangent: np.ndarray) -> Trial | Refusal:
    """The trial of one correction, halved while the points refuse it or the residual rises too much."""
    correction = _solved(system, _stiffness(system, tangent), trial.unbalanced)
    if isinstance(correction, Refusal):
        return correction
    new: Trial | Refusal = Refusal("")
    for halvings in range(system.controls.backtracks + 1):
        step = trial.step.copy()
        step[system.constraints.free] += 0.5**halvings * correction
        new = attempt(system, old, load, step)
        if isinstance(new, Trial) and new.norm < system.controls.rise * trial.norm:
            return new
    if isinstance(new, Refusal):
        return new
    return Refusal(f"every correction makes the residual {trial.residual:.1e} rise", _worst_point(system, trial))


def _stiffness(system: System, tangent: np.ndarray) -> csr_matrix:
    with system.clock.phase("assembly"):
        return stiffness(system.space, system.pattern, tangent)


def _solved(system: System, matrix: csr_matrix, rhs: np.ndarray) -> np.ndarray | Refusal:
    with system.clock.phase("linear_solve"):
        system.solver.factor(system.reduce(matrix))
        solution = system.solver.solve(rhs)
    return solution.x if solution.ok else Refusal(solution.reason)


def _worst_point(system: System, trial: Trial) -> int:
    """A point of an element at the most unbalanced dof."""
    if not len(trial.unbalanced):
        return -1
    dof = system.constraints.free[np.abs(trial.unbalanced).argmax()]
    return int(np.argmax((system.space.dofs == dof).any(axis=1))) * system.space.nq
