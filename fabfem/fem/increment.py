"""What a march yields: increments that converged, and how it ended where it did not come to its end."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from fabfem.fem.model import States, Zone
from fabfem.fem.newton import Solved
from fabfem.fem.points import Refused
from fabfem.fem.stages import Stage
from fabfem.fem.start import Start
from fabfem.fem.trial import Equilibrium, System, Trial, begun, relative, work


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
    refused: Refused | None = None
    """The point alone, where its material refused it."""
    residuals: tuple[float, ...] = ()
    """Relative residual of every trial."""


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
    """(ndof,) nodal forces of the loads on the soil; what acts on a rigid body is handed on as its reaction."""
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
    timings: dict[str, float]
    """Seconds spent in material, assembly, linear_solve, tries that failed included."""
    zones: Mapping[str, Zone]
    """Zones that are there, with the material that they have."""
    step: np.ndarray
    """(ndof,) displacement in this increment."""
    before: States
    """States where the increment began."""
    tangent: np.ndarray
    """(npoints, k, k) consistent tangent at its end between active components; `points.tangents` has all."""
    resume: Start
    """Where a march can be taken up after it."""
    strength: float = 1.0
    """Factor by which the strength is divided."""
    reused: int = 0
    """Linear solves, of all, with factors that were there."""
    load_factor: float = 1.0
    """Share of the change of loads and motions of the stage that acts, where something else drives the stage."""


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


class Factor(NamedTuple):
    """A factor that a search for the factor of safety tried."""

    factor: float
    verdict: str
    """``equilibrium``, ``collapse`` or ``undecided``."""
    displacement: float
    """Largest displacement of a node since the search began [length]."""
    out_of_balance: float
    """Force that viscosity had to carry at the end, relative to the forces at work; 0 in equilibrium."""


@dataclass(frozen=True)
class Collapsed:
    """How a search for the factor of safety ended.

    Attributes
    ----------
    stage : str
    stage_index : int
    last_equilibrium, first_failure : float or None
        The bracket; None where the first factor failed, or no factor did.
    verdict : str
        ``collapse``, ``undecided``, or ``none`` where no factor failed.
    reason : str
        The verdict in a sentence.
    tried : tuple of Factor
        All factors, in the order in which they were tried.
    failing : Increment or None
        The flow at the first failure, the viscous step that is the last of it; it is no equilibrium.
    cutbacks : tuple of Cutback
    timings : dict
        Seconds spent in each phase since the last increment.
    """

    stage: str
    stage_index: int
    last_equilibrium: float | None
    first_failure: float | None
    verdict: str
    reason: str
    tried: tuple[Factor, ...]
    failing: Increment | None
    cutbacks: tuple[Cutback, ...]
    timings: dict[str, float]


class Place(NamedTuple):
    """A stage, what was before it, and where in it a march is taken up."""

    stage: Stage
    stage_index: int
    number: int
    """Increments so far."""
    time: float
    """Time when the stage begins."""
    origin: np.ndarray
    """(ndof,) internal force of the skeleton when the stage begins."""
    progress: Any = None
    """What an earlier march has come to in the stage; None at its beginning."""


class Step(NamedTuple):
    """An increment with all its tries."""

    solved: Solved
    fraction: float
    size: float
    load: np.ndarray
    """(ndof,) nodal forces of all loads at its end."""
    on_soil: np.ndarray
    """(ndof,) nodal forces of those that act on the soil."""
    cutbacks: tuple[Cutback, ...]


def advanced(old: Equilibrium, trial: Trial) -> Equilibrium:
    """The equilibrium that a trial ends in."""
    return Equilibrium(old.displacement + trial.step, trial.batch.states, trial.skeleton, trial.batch.tangent)


def increment(
    place: Place,
    system: System,
    old: Equilibrium,
    now: Equilibrium,
    step: Step,
    trial: Trial,
    timings: dict[str, float],
) -> Increment:
    """The record of an increment from `old` to `now`, after which the march has come to `place`."""
    force = begun(system, old, step.size)
    unbalanced = system.constraints.collect(step.load - force)
    start = float(np.sqrt(work(system, unbalanced, unbalanced)))
    return Increment(
        stage=place.stage.name,
        stage_index=place.stage_index,
        number=place.number,
        fraction=step.fraction,
        size=step.size,
        time=place.time + step.fraction * place.stage.duration,
        displacement=now.displacement,
        states=now.states,
        internal_force=trial.force,
        external_force=step.on_soil,
        iterations=step.solved.iterations,
        residuals=step.solved.residuals,
        out_of_balance=relative(system, start, force, step.load),
        drag=relative(system, system.space.norm(trial.drag), trial.force, step.load),
        held=trial.batch.held,
        moved=system.space.farthest(trial.step),
        cutbacks=step.cutbacks,
        worst_point=trial.batch.worst_point,
        worst_error=trial.batch.worst_error,
        local_error=trial.batch.error,
        timings=timings,
        zones=system.zones,
        step=trial.step,
        before=old.states,
        tangent=trial.batch.tangent,
        resume=Start(place.stage.name, place.stage_index, place.number, place.time, now, place.origin, place.progress),
        strength=place.stage.strength,
        reused=step.solved.reused,
        load_factor=step.fraction,
    )
