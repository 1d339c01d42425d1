"""What a case may say about supports and stages, told apart by ``kind``."""

from itertools import pairwise
from typing import Annotated, Literal

from pydantic import Field, model_validator

from fabfem.case.table import Identifier, Names, NotNegative, Positive, Table, Text

COMPONENTS = {
    "plane_strain": ("x", "y"),
    "axisymmetric": ("r", "z"),
    "axisymmetric_torsion": ("r", "z", "theta"),
    "solid": ("x", "y", "z"),
}
"""Names of the displacement components of every kinematics, in the order in which they are stored."""

Component = Literal["x", "y", "z", "r", "theta"]
Fixed = Annotated[tuple[Component, ...], Field(min_length=1, strict=False)]


class Vector(Table):
    """Components of a vector on named boundaries; those left out are not touched."""

    boundary: Names
    """Boundaries of the mesh that it acts on."""
    x: float | None = None
    """Component along x."""
    y: float | None = None
    """Component along y."""
    z: float | None = None
    """Component along z."""
    r: float | None = None
    """Radial component."""
    theta: float | None = None
    """Component around the axis."""

    def components(self) -> dict[str, float]:
        """Return the components that were given."""
        given = {name: getattr(self, name) for name in ("x", "y", "z", "r", "theta")}
        return {name: value for name, value in given.items() if value is not None}

    @model_validator(mode="after")
    def _acts(self) -> "Vector":
        if not self.components():
            raise ValueError("gives no component; name at least one, such as y = 0.0")
        return self


class Support(Table):
    """Displacement components held at zero in all stages."""

    boundary: Names
    """Boundaries of the mesh that are held."""
    fix: Fixed
    """Components held."""


class Displacement(Vector):
    """Displacement added over the stage [length]."""


Ramp = Annotated[
    tuple[Annotated[tuple[NotNegative, float], Field(strict=False)], ...], Field(min_length=2, strict=False)
]
"""Pairs of (time since the stage began, factor), linear in between and constant beyond."""


class Ramped(Table):
    """A load that may follow a table in time."""

    ramp: Ramp | None = None
    """Pairs (time since the stage began, factor on the value); without it the value is reached linearly."""

    @model_validator(mode="after")
    def _in_time(self) -> "Ramped":
        times = [time for time, _ in self.ramp or ()]
        if any(later <= earlier for earlier, later in pairwise(times)):
            raise ValueError("has a ramp whose times do not increase")
        return self


class Traction(Vector, Ramped):
    """Force per area reached at the end of the stage [stress]."""


class Pressure(Ramped):
    """Pressure on a boundary reached at the end of the stage; positive pushes on the soil."""

    boundary: Names
    """Boundaries of the mesh that it acts on."""
    value: float
    """Size of the pressure [stress]."""


Motion = Literal["x", "y", "z", "r", "rotation", "rotation_x", "rotation_y", "rotation_z"]


class Rigid(Table):
    """A rigid body on a boundary, such as a footing or a platen, for the stage that names it."""

    boundary: Text
    """Boundary of the mesh that it lies on."""
    contact: Literal["rough", "smooth", "ribbed"] = "rough"
    """Whether the nodes follow it in all components, only across the boundary, which is then straight, or across it and
    around the axis, as on a platen whose radial ribs grip a hollow cylinder and let it widen."""
    point: Annotated[tuple[float, ...], Field(min_length=2, max_length=3, strict=False)] | None = None
    """Point that its motions and forces refer to; the middle of the boundary when left out."""
    motion: dict[Motion, float] = Field(default={})
    """Motions added over the stage [length, rad]; those left out are free."""
    force: dict[Motion, float] = Field(default={})
    """Forces and moments on it, reached at the end of the stage [force, force times length]."""

    @model_validator(mode="after")
    def _one_of_both(self) -> "Rigid":
        for name in self.force:
            if name in self.motion:
                raise ValueError(f"has both a motion and a force for '{name}'; one follows from the other")
        return self


class Change(Table):
    """Zones that are made of another material from the start of a stage on, under the stress that they have."""

    zones: Names
    """Zones of the mesh."""
    material: Identifier
    """Name of the material."""


class Term(Table):
    """A part of the displacement that controls a stage."""

    boundary: Names
    """Boundaries over whose nodes the mean is taken."""
    component: Component
    """Component of the displacement."""
    factor: float = 1.0
    """Factor on it."""


class DisplacementControl(Table):
    """A sum of displacements drives the stage; the loads and motions that the stage names follow in proportion."""

    kind: Literal["displacement"]
    """What drives the stage."""
    terms: Annotated[tuple[Term, ...], Field(min_length=1, strict=False)]
    """Displacements that are summed."""
    change: float
    """Change of the sum over the stage [length]."""


class ArcLength(Table):
    """The length of the path of all displacements drives the stage; its loads and motions follow in proportion."""

    kind: Literal["arc_length"]
    """What drives the stage."""
    length: Positive
    """Length of the path, root mean square over the nodes [length]."""


AnyControl = Annotated[DisplacementControl | ArcLength, Field(discriminator="kind")]


class Increments(Table):
    """Size of the increments, as fractions of the stage."""

    initial: Annotated[float, Field(gt=0, le=1)] = 0.05
    """First increment."""
    minimum: Annotated[float, Field(gt=0, le=1)] = 1e-5
    """Increment at which the run gives up."""
    maximum: Annotated[float, Field(gt=0, le=1)] = 0.1
    """Largest increment."""

    @model_validator(mode="after")
    def _in_order(self) -> "Increments":
        if not self.minimum <= self.initial <= self.maximum:
            raise ValueError(
                f"must satisfy minimum <= initial <= maximum (got {self.minimum:g}, {self.initial:g}, {self.maximum:g})"
            )
        return self


class Stage(Table):
    """What every stage has."""

    name: Identifier
    """Name of the stage in results and messages."""
    kind: str
    """Which stage it is."""
    pressure: Annotated[tuple[Pressure, ...], Field(strict=False)] = ()
    """Pressures."""
    traction: Annotated[tuple[Traction, ...], Field(strict=False)] = ()
    """Tractions."""
    increments: Increments = Increments()
    """Control of the increments."""


class Geostatic(Stage):
    """The state before anything is built: self-weight in equilibrium with a given lateral stress.

    Displacements are set to zero at its end.
    """

    kind: Literal["geostatic"]
    k0: Positive = 0.5
    """Ratio of horizontal to vertical effective stress (K0)."""
    surcharge: NotNegative = 0.0
    """Vertical stress at the surface; balance it by a pressure on the surface [stress]."""
    increments: Increments = Increments(initial=1.0, maximum=1.0)
    """Control of the increments."""


class Gravity(Stage):
    """The state before anything is built, made by turning gravity on: for ground that is not level.

    The soil is there from the start, without stress unless the stage gives one. Displacements are zero at its end.
    """

    kind: Literal["gravity"]
    gravity: Positive = 1.0
    """Gravity at the end of the stage, as a multiple of the full one."""
    initial_stress: NotNegative = 0.0
    """Mean stress at the start; balance it by a pressure on the surface, which acts in full throughout [stress]."""
    strength_factor: Positive = 1.0
    """Factor by which the strength is divided, less than one to make a slope stand that fails under its weight."""
    increments: Increments = Increments(initial=0.25, maximum=0.5)
    """Control of the increments."""


class Load(Stage):
    """Loads and displacements that change in proportion to the time of the stage.

    Gravity, pressures and tractions that a stage does not name stay as they are; displacements and rigid bodies that it
    does not name are released.
    """

    kind: Literal["load"]
    duration: Positive = 1.0
    """Time that the stage lasts."""
    rigid: Annotated[tuple[Rigid, ...], Field(strict=False)] = ()
    """Rigid bodies on boundaries."""
    remove: Names | None = None
    """Zones that are taken away; the forces that they exerted on the rest fade over the stage."""
    add: Names | None = None
    """Zones that are put in place, without stress unless `initial_stress` gives one; their weight grows."""
    initial_stress: NotNegative = 0.0
    """Mean stress of the zones that are added [stress]."""
    change: Annotated[tuple[Change, ...], Field(strict=False)] = ()
    """Zones that change their material."""
    control: AnyControl | None = None
    """What drives the stage instead of its time, so that loads may fall."""
    drainage: Literal["drained", "undrained", "seepage"] = "drained"
    """Whether excess pore pressure is zero, stays where it arises, or flows off."""
    drains: Names | None = None
    """Boundaries where water flows off freely; the others let nothing through."""
    time_tolerance: NotNegative = 0.001
    """Error of a time step of seepage, relative to the largest excess pressure; 0 leaves steps to the increments."""
    zero_displacement: bool = False
    """Whether displacements count from zero again once the stage is done."""
    gravity: NotNegative | None = None
    """Gravity at the end of the stage, as a multiple of the full one."""
    displacement: Annotated[tuple[Displacement, ...], Field(strict=False)] = ()
    """Prescribed displacements."""


class StrengthReduction(Stage):
    """The search for the factor of safety: the strength is divided by a growing factor until the soil fails.

    The factor starts from that of the stage before; the report has the last factor with equilibrium and the first
    without. It is the last stage.
    """

    kind: Literal["strength_reduction"]
    excluded_zones: Names | None = None
    """Zones that keep their strength."""
    step: Positive = 0.1
    """By how much the factor rises as long as there is equilibrium."""
    largest: Positive = 10.0
    """Factor at which the search ends."""
    tolerance: Positive = 0.01
    """Width of the bracket at which the search ends."""
    growth: Positive = 10.0
    """Displacement at which a flow counts as failure, over the elastic displacement under the same loads."""
    failure_displacement: Positive | None = None
    """The same displacement itself [length], instead of `growth`: that of any node since the last equilibrium."""

    @model_validator(mode="after")
    def _one_limit(self) -> "StrengthReduction":
        if self.failure_displacement is not None and self.growth != type(self).model_fields["growth"].default:
            raise ValueError("growth and failure_displacement say the same thing in two ways; leave one of them out")
        return self


AnyStage = Annotated[Geostatic | Gravity | Load | StrengthReduction, Field(discriminator="kind")]
