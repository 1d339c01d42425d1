"""Whether a body that Newton's method finds no equilibrium for has one: it is let flow against viscosity.

Every point also carries the stress η/Δt D_e Δε (`fabfem.fem.trial`), so that each increment has an answer, and the load
stays. With Δt doubling, a body that has an equilibrium creeps into it: the viscous forces fade, faster than Δt grows. A
body that has none flows without end: the viscous forces tend to what its strength cannot carry, and the displacement
grows in proportion to the time. So the flow is a failure when it has moved the body by many times what the loads move
it by elastically, or by as much as the case says, while the last doubling of the displacement has not lessened the
viscous forces by half.

The flow begins with a viscous stiffness of the elastic one. Its last increment is the mechanism. An increment need not
balance better than to a share of the viscous forces, for what it leaves is in the load of the next; where points of a
softening material jump, more would be refused time and again. At rest balance is asked for in full.
"""

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from fabfem.fem.increment import advanced
from fabfem.fem.newton import solve_increment, solved, stiffness_of
from fabfem.fem.points import Refusal, elastic_tangents
from fabfem.fem.trial import Equilibrium, System, Task, Trial, relative

EQUILIBRIUM, COLLAPSE, UNDECIDED = "equilibrium", "collapse", "undecided"
STEADY = 0.5
"""Share of the viscous forces that the last doubling of the displacement must leave in a failure."""
SHARE = 0.5
"""Force that an increment of a flow may leave out of balance, over the viscous forces of the one before."""
STEPS = 150
HALVINGS = 8
"""Increments of a flow at most, and how often one is halved where it has no answer."""
PATIENCE = 3
"""Increments after a halving before the size is doubled again."""


class Flow(NamedTuple):
    """How a flow ended."""

    verdict: str
    reason: str
    old: Equilibrium
    now: Equilibrium
    """Where its last increment began and ended."""
    trial: Trial | None
    drag: float
    """Viscous forces at its end, relative to the forces at work."""
    moved: float
    """Largest displacement of a node in it [length]."""
    iterations: int
    """Linear solves of all its increments."""
    residuals: tuple[float, ...] = ()
    """Relative residual of every trial of the last one."""


def flow(system: System, now: Equilibrium, load: np.ndarray, enough: float) -> Flow:
    """What becomes of a body under `load` (ndof,) when it may move by more than `enough` [length]."""
    slow = system._replace(controls=replace(system.controls, viscosity=1.0, extrapolate=False))
    start, drags, size, iterations, halvings, patience = now, [(0.0, np.inf)], 1.0, 0, 0, 0
    why = ""
    reached = Flow(UNDECIDED, "", now, now, None, 1.0, 0.0, 0)
    while len(drags) <= STEPS and halvings <= HALVINGS:
        answer = solve_increment(_loosened(slow, system.controls.tolerance, drags[-1][1]), now, load, size)
        iterations += answer.iterations
        trial = answer.end
        if isinstance(trial, Refusal):
            size, halvings, patience, why = 0.5 * size, halvings + 1, PATIENCE, trial.reason
            continue
        old, now = now, advanced(now, trial)
        drag, moved = (
            relative(system, system.space.norm(trial.drag), trial.force, load),
            system.space.farthest(now.displacement - start.displacement),
        )
        reached = Flow(UNDECIDED, "", old, now, trial, drag, moved, iterations, answer.residuals)
        if max(drag, trial.residual) <= system.controls.tolerance:
            return reached._replace(verdict=EQUILIBRIUM)
        if moved > enough and drag > STEADY * _drag_at(drags, 0.5 * moved):
            return reached._replace(verdict=COLLAPSE, reason=_flows(moved, drag, _drag_at(drags, 0.5 * moved)))
        drags.append((moved, drag))
        halvings, patience = 0, max(patience - 1, 0)
        size *= 1.0 if patience else 2.0
    reason = f"no equilibrium was found, nor a steady flow after a displacement of {reached.moved:.3g}"
    return reached._replace(reason=f"{reason} ({why})" if halvings > HALVINGS else reason)


def _flows(moved: float, drag: float, halfway: float) -> str:
    """Why a flow is a failure."""
    pace = "accelerates" if drag > halfway else "does not come to rest"
    return (
        f"the body flows and {pace}: a displacement of {moved:.3g} has left {drag:.1e} of the forces out of balance, "
        f"a displacement of half of that {halfway:.1e}"
    )


def _loosened(slow: System, tolerance: float, drag: float) -> System:
    """The system of a flow whose increments need balance only to a share of the viscous forces `drag`."""
    share = SHARE * drag if np.isfinite(drag) else 0.0
    return slow._replace(controls=replace(slow.controls, tolerance=max(tolerance, share)))


def elastic_displacement(system: System, now: Equilibrium, load: np.ndarray) -> float:
    """Largest displacement of a node of the elastic body under `load` alone [length], infinite where there is none."""
    tangent = elastic_tangents(system.space, system.zones, now.states)
    task = Task(load, np.zeros(len(load)), None)
    answer = solved(system, stiffness_of(system, task, tangent), system.constraints.collect(load))
    return np.inf if isinstance(answer, Refusal) else system.space.farthest(system.constraints.spread(answer))


def _drag_at(drags: list[tuple[float, float]], moved: float) -> float:
    """The viscous forces when the displacement was last at most `moved`."""
    return next(drag for at, drag in reversed(drags) if at <= moved)
