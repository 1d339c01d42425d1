"""The stages of an element case: paths of the laboratory, each a table of what is held and what is driven, and probes.

The vertical is z, and principal axes turn from it towards x. Strain is counted from the start of each stage. A target
that is a list is visited entry by entry, `cycles` times over; all of its entries count from the start of the stage,
those of a stress reached `to` from zero.
"""

from typing import Annotated, Literal

from pydantic import Field, model_validator

from fabfem.case.table import Factors, Identifier, NotNegative, Positive, Table

Six = Annotated[tuple[float, ...], Field(min_length=6, max_length=6, strict=False)]
Plane = Annotated[tuple[Six, ...], Field(min_length=2, max_length=2, strict=False)]
Fraction = Annotated[float, Field(ge=0, le=1)]
Count = Annotated[int, Field(ge=1)]
Components = dict[Literal["xx", "yy", "zz", "yz", "xz", "xy"], float]
Drainage = Literal["drained", "undrained", "constant_p"]


def exactly_one(table: Table, *names: str) -> None:
    """Refuse a table that does not give exactly one of some keys."""
    given = [name for name in names if getattr(table, name) is not None]
    if len(given) != 1:
        got = f"got {' and '.join(given)}" if given else "got none"
        raise ValueError(f"needs exactly one of {', '.join(names)} ({got})")


class ElementStage(Table):
    """What every stage has."""

    name: Identifier
    """Name of the stage in results and messages."""
    kind: str
    """Which path is followed."""
    increments: Count = 100
    """Rows of the history from one target to the next, equally spaced."""


class Path(ElementStage):
    """What every path has."""

    cycles: Count = 1
    """How many times the targets are visited in turn."""
    keep_strain: bool = False
    """Count strain on from the stage before."""
    strain_limit: Positive = 0.2
    """Deviatoric strain at which a stage ends whose stress cannot reach its target; strain leads beyond the peak."""
    liquefied: NotNegative = 0.005
    """Mean effective stress over the atmospheric pressure below which the stage ends as liquefied; 0 never."""


class Isotropic(Path):
    """Compression to an isotropic stress, straight from the stress that there is."""

    kind: Literal["isotropic"]
    to: Factors
    """Mean effective stress at the end [stress]."""


class K0(Path):
    """Compression without lateral strain."""

    kind: Literal["k0"]
    to: Factors | None = None
    """Vertical stress at the end [stress]."""
    axial_strain: Factors | None = None
    """Vertical strain at the end, instead."""

    @model_validator(mode="after")
    def _driven(self) -> "K0":
        exactly_one(self, "to", "axial_strain")
        return self


class Stress(Path):
    """A straight stress path."""

    kind: Literal["stress"]
    to: Six
    """Effective stress xx, yy, zz, yz, xz, xy at the end [stress]."""


class Shear(Path):
    """Shear along principal stress axes that stay where they are, b constant."""

    drainage: Drainage
    """Drained at constant minor stress, undrained, or drained at constant mean stress."""
    axial_strain: Factors | None = None
    """Strain along the major stress to reach; negative is extension."""
    shear_strain: Factors | None = None
    """Difference of the strains along the major and the minor stress to reach, instead."""
    deviatoric_strain: Factors | None = None
    """Strain that does work with q to reach, instead."""
    q: Factors | None = None
    """Change of the deviatoric stress to reach, instead [stress]."""

    @model_validator(mode="after")
    def _driven(self) -> "Shear":
        exactly_one(self, "axial_strain", "shear_strain", "deviatoric_strain", "q")
        return self


class Triaxial(Shear):
    """Triaxial compression, or extension to a negative strain."""

    kind: Literal["triaxial"]


class TrueTriaxial(Shear):
    """Three principal stresses along z, y and x."""

    kind: Literal["true_triaxial"]
    b: Fraction
    """Intermediate stress ratio (b) of the change of stress."""


class HollowCylinder(Shear):
    """Torsion of a hollow cylinder."""

    kind: Literal["hollow_cylinder"]
    alpha: Annotated[float, Field(ge=-90, le=90)]
    """Angle between the vertical and the major principal axis of the change of stress (α) [degree]."""
    b: Fraction
    """Intermediate stress ratio (b) of the change of stress."""


class PlaneStrain(Path):
    """Biaxial compression: no strain along y, the lateral direction is x."""

    kind: Literal["plane_strain"]
    drainage: Drainage
    """Drained at constant lateral stress, undrained, or drained at constant mean stress."""
    axial_strain: Factors | None = None
    """Vertical strain to reach."""
    q: Factors | None = None
    """Change of the vertical less the lateral stress to reach, instead [stress]."""

    @model_validator(mode="after")
    def _driven(self) -> "PlaneStrain":
        exactly_one(self, "axial_strain", "q")
        return self


class SimpleShear(Path):
    """Simple shear of the horizontal planes along x."""

    kind: Literal["simple_shear"]
    drainage: Literal["drained", "undrained"]
    """At constant vertical stress, or at constant height, which is constant volume."""
    shear_strain: Factors | None = None
    """Shear (γ), twice the tensor component, to reach."""
    tau: Factors | None = None
    """Change of the shear stress to reach, instead [stress]."""

    @model_validator(mode="after")
    def _driven(self) -> "SimpleShear":
        exactly_one(self, "shear_strain", "tau")
        return self


class Rotation(Path):
    """Rotation of the principal stress axes about y, their values constant."""

    kind: Literal["rotation"]
    drainage: Literal["drained", "undrained"] = "drained"
    """Whether p is constant or the volume; q and b are constant in both."""
    angle: Factors
    """Angle by which the axes turn from the vertical towards x [degree]."""


class Condition(Table):
    """One linear condition: coefficients times components of the change of stress and of strain add up to a value."""

    stress: Components = Field(default={})
    """Coefficient of each component of the change of stress."""
    strain: Components = Field(default={})
    """Coefficient of each tensor component of the strain."""
    value: float = 0.0
    """What they add up to at the end of the stage."""


class Free(Path):
    """Any six linear conditions on stress and strain."""

    kind: Literal["free"]
    axes: Annotated[tuple[float, ...], Field(min_length=3, max_length=3, strict=False)] = (0.0, 0.0, 0.0)
    """Axes of the components: turned about z, then about the new y, then about the new x [degree]."""
    conditions: Annotated[tuple[Condition, ...], Field(min_length=6, max_length=6, strict=False)]
    """The conditions."""


class Probe(ElementStage):
    """Small steps of one size in many directions, each from the state that there is, which stays as it is."""

    kind: Literal["probe"]
    of: Literal["stress", "strain"]
    """What has the given size and direction; the response is the other one."""
    size: Positive
    """Norm of the probes [stress], or of strain."""
    plane: Literal["triaxial", "biaxial", "deviatoric", "torsion"] | Plane = "triaxial"
    """Plane of the directions, or two tensors xx, yy, zz, yz, xz, xy that span it."""
    directions: Count = 72
    """Number of directions, equally spaced."""
    increments: Count = 1
    """Rows along each probe."""


AnyElementStage = Annotated[
    Isotropic
    | K0
    | Stress
    | Triaxial
    | TrueTriaxial
    | HollowCylinder
    | PlaneStrain
    | SimpleShear
    | Rotation
    | Free
    | Probe,
    Field(discriminator="kind"),
]
