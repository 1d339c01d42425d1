"""What a case on fabric laws alone may say: laws, and one drive that they all get."""

from collections.abc import Iterator
from typing import Annotated, Literal

from pydantic import Field

from fabfem.case.materials import AnyMaterial, ChangHicher
from fabfem.case.schema import AnyScene, Case
from fabfem.case.table import Angle, Factors, Identifier, NotNegative, Positive, Table, Text, suggest

Six = Annotated[tuple[float, ...], Field(min_length=6, max_length=6, strict=False)]
"""Components xx, yy, zz, yz, xz, xy of a symmetric tensor."""


class Scene(AnyScene):
    """Fabric laws on their own."""

    kind: Literal["fabric"]
    """Kind of scene."""


class Law(Table):
    """A fabric law with its parameters; the key of the table is the name of its curves."""

    law: Text
    """Evolution law, by author."""
    parameters: dict[str, float] = Field(default={})
    """Parameters that differ from the law's own."""
    form: Text = "full"
    """Reduced form of the law: older (yuan); four, three, four_refitted, three_refitted (probe_2d)."""
    sample: Positive | None = None
    """Stress ratio q/p of the sample whose parameters are taken (probe_2d)."""
    update: Literal["explicit", "implicit"] = "explicit"
    """Sub-steps with control of the error, or one backward Euler step from record to record."""
    tolerance: Positive = 1e-8
    """Error of an explicit sub-step."""


class Start(Table):
    """The fabric at the start; without this table that of the material, or of the sample, or none."""

    norm: NotNegative = 0.0
    """Size of the fabric anisotropy tensor (F) of a deposit, large along the deposition axis z."""
    bedding_angle: Angle = 0.0
    """Angle between the bedding planes and the horizontal [degree]."""
    components: Six | None = None
    """Components xx, yy, zz, yz, xz, xy of F instead; of a law in the plane the whole F_ij, whose trace is Z."""


class History(Table):
    """A history of stress and strain read from a file of columns, compression positive."""

    file: Text
    """CSV file with a header; relative to the case file."""
    columns: dict[str, str] = Field(default={})
    """Name in the file of a column that is called otherwise there; see docs/fabric_laws.md for the names."""
    stage: Text | None = None
    """Stage to take, of a file with a column ``stage``, such as the history of an element test."""
    plastic: Literal["given", "total"] = "given"
    """Plastic strain from its own columns, or the total strain in its place, as [Y 8.2] does."""


class Leg(Table):
    """A leg of a path."""

    kind: Literal["isotropic", "constant_p", "undrained", "triaxial"]
    """What is held: shear stress zero, mean pressure, volume, or lateral stress."""
    strain: float | None = None
    """Shear strain of the leg, axial in triaxial compression; negative shears back."""
    pressure: float | None = None
    """Change of the mean pressure, of an isotropic leg."""
    records: Annotated[int, Field(ge=1)] = 100
    """Records of the leg."""


class Loading(Table):
    """A path that the case's Chang-Hicher material computes; one for each pair of b and alpha."""

    pressure: Positive
    """Isotropic stress at the start."""
    b: Factors = (0.0,)
    """Intermediate stress, (s2 - s3)/(s1 - s3); a number or a list."""
    alpha: Factors = (0.0,)
    """Angle of the major stress from the vertical z towards x [degree]; a number or a list."""
    leg: Annotated[tuple[Leg, ...], Field(min_length=1, strict=False)]
    """Legs, in order."""


class Probe(Table):
    """Strain probes of unit size, in all directions: (cos chi, sin chi) along x and y and the shear between them."""

    stress: Six
    """Stress that is probed, xx, yy, zz, yz, xz, xy."""
    state_parameter: float = 0.0
    """State parameter (psi)."""
    directions: Annotated[int, Field(ge=4)] = 72
    """Directions chi in the plane of I and the stress deviator."""
    inclinations: Annotated[int, Field(ge=1)] = 1
    """Inclinations theta from the shear strain, 90 degrees only if 1."""


class Surface(Table):
    """The critical state that a law names, over all Lode angles."""

    angles: Annotated[int, Field(ge=2)] = 181
    """Lode angles from 0 (compression) to 60 degrees (extension)."""


class Contacts(Table):
    """Contact normals, read from a file or drawn from the density of contacts."""

    file: Text | None = None
    """CSV file with columns nx, ny and, in space, nz; relative to the case file."""
    count: Annotated[int, Field(ge=2)] = 10000
    """Normals to draw, where no file is given."""
    dimension: Literal[2, 3] = 3
    """Dimensions of the density that normals are drawn from."""
    intensity: NotNegative = 0.0
    """Intensity (Delta) of the density in the plane, at most 0.5."""
    direction: Angle = 0.0
    """Its major direction (phi) from the x axis [degree]."""
    seed: Annotated[int, Field(ge=0)] = 0
    """Seed of the draw."""
    stress: Six | None = None
    """Stress for A and the joint invariants L1 to L4."""


class Picture(Table):
    """A picture of two columns of the history."""

    name: Identifier
    """Name of the file."""
    x: Text
    """Column across."""
    y: Text
    """Column upwards; of a polar picture the radius, x being the angle in degrees."""
    panels: Annotated[tuple[Annotated[tuple[Identifier, ...], Field(strict=False)], ...], Field(strict=False)] = ()
    """Curves of each panel, by the names of their laws; one panel for each law when left out."""
    polar: bool = False
    """Draw the deviatoric plane; x is the Lode angle."""
    equal: bool = False
    """Same scale across and upwards."""


DRIVES = ("history", "loading", "probe", "surface", "contacts")


class FabricCase(Case):
    """Fabric laws along a history, under probes, or in their critical state."""

    scene: Scene
    """What is solved."""
    material: dict[Identifier, AnyMaterial] = Field(default={})
    """The material that computes the path."""
    law: dict[Identifier, Law] = Field(default={})
    """Laws by name."""
    start: Start | None = None
    """Fabric at the start."""
    history: History | None = None
    """A history from a file."""
    loading: Loading | None = None
    """A path of the Chang-Hicher model."""
    probe: Probe | None = None
    """Strain probes."""
    surface: Surface | None = None
    """Critical states."""
    contacts: Contacts | None = None
    """Contact normals."""
    picture: Annotated[tuple[Picture, ...], Field(strict=False)] = ()
    """Pictures for fabfem show."""

    @property
    def drive(self) -> Table:
        """The one of its drives that the case has."""
        return next(table for name in DRIVES if (table := getattr(self, name)) is not None)


def contradictions(case: FabricCase) -> Iterator[tuple[str, str]]:
    """Yield (place, what) for what no single table can see."""
    given = [name for name in DRIVES if getattr(case, name) is not None]
    if len(given) != 1:
        yield "the file", f"needs exactly one of {', '.join(f'[{name}]' for name in DRIVES)} (got {len(given)})"
    if case.contacts is None and not case.law:
        yield "law", "is missing; a case needs at least one [law.NAME]"
    yield from _loading(case)
    for picture in case.picture:
        for name in (name for panel in picture.panels for name in panel if name not in case.law):
            yield f"picture[{picture.name}].panels", f"there is no law '{name}'{suggest(name, case.law)}"


def _loading(case: FabricCase) -> Iterator[tuple[str, str]]:
    if case.loading is None:
        if case.material:
            yield "material", "is only for a [loading]; here nothing would use it"
        return
    if len(case.material) != 1 or not isinstance(next(iter(case.material.values())), ChangHicher):
        yield "material", "[loading] needs exactly one material, of model 'chang_hicher'"
    elif (material := next(iter(case.material.values()))).localisation != "total":  # type: ignore[union-attr]
        yield (
            f"material.{next(iter(case.material))}.localisation",
            "must be 'total', where the plastic strain of a path follows from its records "
            f"(got {material.localisation!r})",  # type: ignore[union-attr]
        )
    for number, leg in enumerate(case.loading.leg, 1):
        wanted, other = ("pressure", "strain") if leg.kind == "isotropic" else ("strain", "pressure")
        if getattr(leg, wanted) is None:
            yield f"loading.leg[{number}].{wanted}", f"is missing; a leg of kind '{leg.kind}' needs it"
        if leg.kind == "triaxial" and any(case.loading.b + case.loading.alpha):
            yield f"loading.leg[{number}].kind", "'triaxial' is along z with b = 0; use 'constant_p' with b and alpha"
        if getattr(leg, other) is not None:
            yield f"loading.leg[{number}].{other}", f"means nothing to a leg of kind '{leg.kind}'"
