"""What a case may say about supports and stages, told apart by ``kind``."""

from typing import Annotated, Literal

from pydantic import Field, model_validator

from fabfem.case.table import Identifier, Names, NotNegative, Positive, Table

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


class Traction(Vector):
    """Force per area reached at the end of the stage [stress]."""


class Pressure(Table):
    """Pressure on a boundary reached at the end of the stage; positive pushes on the soil."""

    boundary: Names
    """Boundaries of the mesh that it acts on."""
    value: float
    """Size of the pressure [stress]."""


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


class Load(Stage):
    """Loads and displacements that change in proportion to the time of the stage.

    Gravity, pressures and tractions that a stage does not name stay as they are; displacements that it does not name
    are released.
    """

    kind: Literal["load"]
    duration: Positive = 1.0
    """Time that the stage lasts."""
    gravity: NotNegative | None = None
    """Gravity at the end of the stage, as a multiple of the full one."""
    displacement: Annotated[tuple[Displacement, ...], Field(strict=False)] = ()
    """Prescribed displacements."""


AnyStage = Annotated[Geostatic | Load, Field(discriminator="kind")]
