"""Stages: what a part of the run holds, moves, loads, takes away or weakens, and how finely it is stepped."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, NamedTuple

from fabfem.fem.loads import Gravity, Load
from fabfem.fem.supports import RigidBody, Support


class Change(NamedTuple):
    """What a zone is made of from the start of a stage on."""

    material: Any
    """Parameter record of `umat`."""
    directions: Any
    """Contact directions, or None."""
    begin: Callable[[Any], Any]
    """The state that the new material starts from, of the old material's state."""


@dataclass(frozen=True)
class StrengthSearch:
    """Makes a stage look for the factor of safety; see `fabfem.fem.safety`.

    Attributes
    ----------
    step : float
        By how much the factor rises as long as there is equilibrium.
    largest : float
        Factor beyond which the search ends.
    tolerance : float
        Width of the bracket at which it ends.
    growth : float
        Displacement at which a flow counts as failure, over that of the elastic body under the same loads.
    displacement : float or None
        The same displacement itself [length]; `growth` then has no say.
    """

    step: float = 0.1
    largest: float = 10.0
    tolerance: float = 0.01
    growth: float = 10.0
    displacement: float | None = None

    def __post_init__(self) -> None:
        """Refuse a search that cannot end."""
        if not 0.0 < self.tolerance <= self.step or self.growth <= 0.0:
            raise ValueError("a search for the factor of safety needs 0 < tolerance <= step and growth > 0.")
        if self.displacement is not None and self.displacement <= 0.0:
            raise ValueError("a search for the factor of safety needs a displacement > 0, or none.")


@dataclass(frozen=True)
class DisplacementControl:
    """Makes a displacement drive a stage and its load follow; see `fabfem.fem.follow`.

    Attributes
    ----------
    terms : tuple of (boundary, component, factor)
        The displacement is the sum of these factors times the mean displacements of the boundaries' nodes.
    change : float
        By how much it changes over the stage [length].
    """

    terms: tuple[tuple[str, str, float], ...]
    change: float


@dataclass(frozen=True)
class ArcLength:
    """Makes the length of the displacement's path drive a stage and its load follow; see `fabfem.fem.follow`.

    Attributes
    ----------
    length : float
        Length of the path over the stage, measured by the root mean square over the nodes [length].
    """

    length: float


Goal = StrengthSearch | DisplacementControl | ArcLength


@dataclass(frozen=True)
class Stage:
    """One part of a run. It holds only what it names: repeat fixities and gravity in every stage.

    Attributes
    ----------
    name : str
    supports : tuple of Support
        Held components of boundaries; a support's displacement is added in equal parts over the stage.
    loads : tuple of Load
        Each goes from its start to its end factor over the stage.
    first, largest, smallest : float
        Size of an increment, as a fraction of the stage: at first, at most, and where the run gives up.
    zero_displacement : bool
        Whether displacements count from zero again once the stage is done.
    duration : float
        Time that the stage takes.
    bodies : tuple of RigidBody
        Rigid bodies on boundaries.
    absent : tuple of str
        Zones that are not there; the nodes of them alone stay where they are.
    changes : mapping of str to Change
        Zones that are made of something else from the start of this stage on.
    released : bool
        Whether the forces that are out of balance when the stage begins, such as those that a removed zone exerted,
        fade away in equal parts over the stage instead of at once.
    strength : float
        Factor by which the strength of the materials is divided (`umat.weakened`); where a stage searches, at first.
    spared : tuple of str
        Zones whose strength is not divided.
    drainage : str
        What water does where the model has any: ``drained``, its excess pressure is zero; ``undrained``, it stays where
        it is; ``seepage``, it flows.
    time_tolerance : float
        Error of a time step's pressures, relative to the largest, that is allowed where water flows; 0 asks nothing.
    goal : StrengthSearch, DisplacementControl, ArcLength or None
        What drives the stage, where it is not the fraction of its loads and motions.
    """

    name: str
    supports: tuple[Support, ...]
    loads: tuple[Load, ...] = ()
    first: float = 0.05
    largest: float = 0.05
    smallest: float = 1e-4
    zero_displacement: bool = False
    duration: float = 1.0
    bodies: tuple[RigidBody, ...] = ()
    absent: tuple[str, ...] = ()
    changes: Mapping[str, Change] = field(default_factory=dict)
    released: bool = False
    strength: float = 1.0
    spared: tuple[str, ...] = ()
    drainage: str = "drained"
    time_tolerance: float = 0.0
    goal: Goal | None = None

    @property
    def marks(self) -> tuple[float, ...]:
        """Fractions of the stage at which an increment must end: where a load's table bends, and the end."""
        tables = [load.table for load in self.loads if not isinstance(load, Gravity)]
        return (*sorted({at for table in tables for at, _ in table if 0.0 < at < 1.0}), 1.0)

    def __post_init__(self) -> None:
        """Refuse sizes that cannot step through the stage."""
        if not 0.0 < self.smallest <= self.first <= self.largest <= 1.0:
            raise ValueError(f"stage '{self.name}' needs 0 < smallest <= first <= largest <= 1 for its increments.")
        if self.strength <= 0.0:
            raise ValueError(f"stage '{self.name}' divides the strength by {self.strength:g}, which is not positive.")
        if self.goal is not None and len(self.marks) > 1:
            raise ValueError(f"stage '{self.name}' is not driven by its time, so no load of it can follow a ramp.")
        moving = [support.displacement for support in self.supports] + [
            value for body in self.bodies for value in body.motion.values()
        ]
        if isinstance(self.goal, StrengthSearch) and any(moving):
            raise ValueError(f"stage '{self.name}' searches for the factor of safety, so nothing may be moved in it.")
