"""One trial of an increment: a displacement step and the force that it leaves out of balance.

With viscosity η (see `Controls`) the points also carry the stress η/Δt D_e Δε, D_e the elastic tangent where the
increment begins and Δt the increment's part of the stage. It is no part of the state; its nodal forces are the drag.
"""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from scipy.sparse import csr_matrix

from fabfem.fem.constraints import Constraints
from fabfem.fem.linear import LinearSolver
from fabfem.fem.model import Controls, States, Zone
from fabfem.fem.points import Batch, Refusal, elastic_tangents, update_points
from fabfem.fem.pores import Water
from fabfem.fem.reduction import Reduction
from fabfem.fem.space import Space
from fabfem.timing import Timer

PHASES = ("material", "assembly", "linear_solve")


class System(NamedTuple):
    """The equations of a stage."""

    space: Space
    zones: Mapping[str, Zone]
    controls: Controls
    constraints: Constraints
    reduction: Reduction
    solver: LinearSolver
    timer: Timer
    stiffest: float
    """Largest diagonal entry of the elastic stiffness."""
    water: Water | None = None
    """What pore water does, where its pressure is unknown."""
    balanced: np.ndarray | slice = slice(None)
    """Unknowns whose forces count on this rank in lengths and products: all, or those that are no pressures and its."""


class Equilibrium(NamedTuple):
    """A state at rest, and the step that led to it."""

    displacement: np.ndarray
    states: States
    force: np.ndarray
    """(ndof,) internal force of the skeleton, without drag."""
    tangent: np.ndarray
    """(npoints, k, k) what the first correction of the next increment uses."""


class Task(NamedTuple):
    """What an increment has to balance."""

    load: np.ndarray
    """(ndof,) external force at its end."""
    motion: np.ndarray
    """(ndof,) displacement in it of the dofs that are no unknowns."""
    viscous: np.ndarray | None
    """(npoints, k, k) viscous stress by strain increment, where there is viscosity."""
    start: np.ndarray | None = None
    """(ndof,) internal force at its start, where that is not the skeleton's alone."""
    wet: csr_matrix | None = None
    """What water adds to the stiffness of all dofs."""


class Trial(NamedTuple):
    """A displacement increment and what it leaves out of balance."""

    step: np.ndarray
    """(ndof,) displacement since the last equilibrium."""
    batch: Batch
    force: np.ndarray
    """(ndof,) internal force, drag included."""
    drag: np.ndarray
    """(ndof,) nodal forces of the viscous stress."""
    water: np.ndarray
    """(ndof,) nodal forces of the pore pressure, and volumes of water that go nowhere."""
    unbalanced: np.ndarray
    """Out-of-balance force on the unknowns."""
    norm: float
    residual: float
    """The norm relative to the forces at work."""

    @property
    def skeleton(self) -> np.ndarray:
        """(ndof,) internal force of the skeleton, without drag."""
        return self.force - self.drag - self.water

    def without_tangent(self) -> "Trial":
        """The trial where its tangent, which is large, is not needed any more."""
        return self._replace(batch=self.batch._replace(tangent=np.zeros((0, 0, 0))))


def make_task(system: System, old: Equilibrium, load: np.ndarray, size: float) -> Task:
    """What an increment has to balance that takes a part `size` of the stage."""
    motion, viscous = size * system.constraints.motion, viscous_tangent(system, old, size)
    if system.water is None:
        return Task(load, motion, viscous)
    _let_out(system, old, motion)
    return Task(load, motion, viscous, begun(system, old, size), system.water.matrix(size))


def viscous_tangent(system: System, old: Equilibrium, size: float) -> np.ndarray | None:
    """The (npoints, k, k) stress that viscosity makes of a strain in a part `size` of the stage; None without it."""
    eta = system.controls.viscosity
    return eta / size * elastic_tangents(system.space, system.zones, old.states) if eta > 0.0 else None


def _let_out(system: System, old: Equilibrium, motion: np.ndarray) -> None:
    """Take held pressures to their value at once: a drain does not open slowly."""
    constraints, nmotion = system.constraints, system.water.nmotion if system.water else 0
    held = np.setdiff1d(np.arange(nmotion, system.space.ndof), constraints.free)
    motion[held] = constraints.motion[held] - old.displacement[held]


def begun(system: System, old: Equilibrium, size: float) -> np.ndarray:
    """The (ndof,) internal force at the start of an increment, water included."""
    if system.water is None:
        return old.force
    return old.force + system.space.summed(system.water.start(old.displacement, size))


def attempt(system: System, old: Equilibrium, task: Task, step: np.ndarray) -> Trial | Refusal:
    """What a displacement increment leaves out of balance, or why the points refuse it."""
    strain = system.space.strain(step)
    with system.timer.phase("material"):
        batch = update_points(system.space, system.zones, strain, old.states, system.controls.held)
    batch = system.space.mesh.ranks.agreed(batch, system.space.nq, system.controls.held)
    if isinstance(batch, Refusal):
        return batch
    with system.timer.phase("assembly"):
        drag = _drag(system, task, strain)
        water = _water(system, old, task, step)
        force = system.space.internal_force(batch.stress) + drag + water
    unbalanced = system.constraints.collect(task.load - force)
    size = float(np.sqrt(work(system, unbalanced, unbalanced)))
    residual = relative(system, size, force, task.load)
    if system.water is not None:
        residual = max(residual, system.water.misfit(step, water, system.constraints.free))
    return Trial(step, batch, force, drag, water, unbalanced, size, residual)


def work(system: System, a: np.ndarray, b: np.ndarray) -> float:
    """The product of forces and motions of the unknowns, without the volumes of water."""
    return system.space.mesh.ranks.sum(float((a * b)[system.balanced].sum()))


def balanced(space: Space, constraints: Constraints, water: Water | None) -> np.ndarray | slice:
    """Which unknowns count in `work`, each on one rank."""
    counted = constraints.counted(space)
    if water is None:
        return counted
    forces = np.ones(constraints.nunknowns, bool)
    forces[: len(constraints.free)] = constraints.free < water.nmotion
    return forces if isinstance(counted, slice) else forces & counted


def _water(system: System, old: Equilibrium, task: Task, step: np.ndarray) -> np.ndarray:
    if task.wet is None or task.start is None:
        return np.zeros(len(step))
    return task.start - old.force + system.space.summed(task.wet @ step)


def _drag(system: System, task: Task, strain: np.ndarray) -> np.ndarray:
    if task.viscous is None:
        return np.zeros(system.space.ndof)
    return resisted(system, task.viscous, strain)


def resisted(system: System, tangent: np.ndarray, strain: np.ndarray) -> np.ndarray:
    """The (ndof,) nodal forces of the stress that tangents (npoints, k, k) make of a strain (npoints, 6)."""
    active, stress = system.space.kinematics.active, np.zeros_like(strain)
    stress[:, active] = (tangent @ strain[:, active, None])[:, :, 0]
    return system.space.internal_force(stress)


def relative(system: System, size: float, force: np.ndarray, load: np.ndarray) -> float:
    """The norm of an out-of-balance force over the larger of internal and external force (ndof,)."""
    forces = slice(None if system.water is None else system.water.nmotion)
    scale = max(system.space.norm(force[forces]), system.space.norm(load))
    return size / scale if scale > 0.0 else 0.0
