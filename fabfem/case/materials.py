"""What a case may say about its materials, one table ``[material.NAME]`` each, told apart by ``model``."""

from typing import Annotated, Any, Literal

from pydantic import Field, field_validator

from fabfem.case.sentences import CaseError
from fabfem.case.table import Angle, NotNegative, Positive, SomeNames, Table, Text

SOLID_FRACTION_LIMIT = 13.28 / 8.0
"""Void ratio at which the number of contacts per particle, 13.28 - 8 e, vanishes [ZK table 3]."""

LARGEST_FABRIC = 6.0**0.5
"""Norm at which the density of contacts 1 + F:nn of a deposit falls to zero across the deposition axis."""


class Material(Table):
    """What every material has."""

    model: str
    """Which material it is."""
    zones: SomeNames | None = None
    """Zones of the mesh made of this material at first, [] for none; all zones when left out."""
    unit_weight: NotNegative = 0.0
    """Unit weight that gravity acts on, above the water table."""
    saturated_unit_weight: Positive | None = None
    """Unit weight of soil and water together below the water table; gravity acts on it less that of water."""
    conductivity: NotNegative = 0.0
    """Hydraulic conductivity (k), for scenes where excess pore pressure flows off [length/time]."""
    porosity: Annotated[float, Field(gt=0, lt=1)] | None = None
    """Volume of pores over the whole, for compressible water; a Chang-Hicher material has it from its void ratio."""


class Isotropic(Material):
    """What every material of isotropic elasticity has."""

    youngs_modulus: Positive
    """Young's modulus [stress]."""
    poisson_ratio: Annotated[float, Field(gt=-1, lt=0.5)] = 0.3
    """Poisson's ratio."""


class Elastic(Isotropic):
    """Linear isotropic elasticity."""

    model: Literal["elastic"]


class VonMises(Isotropic):
    """Plasticity of a strength that does not depend on the mean stress."""

    model: Literal["von_mises"]
    yield_stress: Positive
    """Yield stress in uniaxial loading, which is the square root of 3 times the shear strength [stress]."""
    hardening_modulus: float = 0.0
    """Slope of the yield stress against plastic strain, negative for softening [stress]."""
    residual_stress: NotNegative = 0.0
    """Yield stress at which softening ends [stress]."""


class MohrCoulomb(Isotropic):
    """Mohr-Coulomb strength with its own dilation angle."""

    model: Literal["mohr_coulomb"]
    cohesion: NotNegative = 0.0
    """Cohesion [stress]."""
    friction_angle: Annotated[float, Field(ge=0, lt=90)]
    """Friction angle [degree]."""
    dilation_angle: Annotated[float, Field(ge=0, lt=90)] = 0.0
    """Dilation angle [degree]."""


class DruckerPrager(Isotropic):
    """A cone in the space of principal stresses, with linear hardening."""

    model: Literal["drucker_prager"]
    friction_slope: NotNegative
    """Slope of the yield surface in the p-q plane."""
    dilation_slope: NotNegative = 0.0
    """Slope of the plastic potential in the p-q plane."""
    strength: NotNegative = 0.0
    """Deviatoric stress at yield without mean stress [stress]."""
    hardening_modulus: NotNegative = 0.0
    """Slope of that strength against plastic shear strain [stress]."""


class Fabric(Table):
    """The fabric of a Chang-Hicher material; without this table it is isotropic and stays so."""

    law: Text = "zhao_kruyt"
    """Evolution law, by author; ``constant`` freezes the fabric."""
    norm: Annotated[float, Field(ge=0)] = 0.0
    """Size of the initial fabric anisotropy tensor (F), large along the deposition axis."""
    bedding_angle: Angle = 0.0
    """Angle between the bedding planes and the horizontal [degree]."""
    azimuth: Angle = 0.0
    """Horizontal direction in which the bedding dips, from the x axis [degree]."""
    parameters: dict[str, float] = Field(default={})
    """Parameters of the law that differ from the preset's."""

    @field_validator("norm")
    @classmethod
    def _keep_density_positive(cls, norm: float) -> float:
        if norm > LARGEST_FABRIC:
            raise ValueError(
                f"must be at most {LARGEST_FABRIC:.4g}, beyond which the density of contacts E(n) = 1 + F:nn "
                f"is negative in some direction (got {norm:g})"
            )
        return norm


class Turn(Table):
    """The rule of contact directions turned as a whole, such as into the frame of the stress to come."""

    axis: Literal["x", "y", "z"]
    """Axis of the rotation; z for a plane mesh, y from the vertical towards x in an element test."""
    angle: Angle
    """Right-handed angle of the rotation [degree]."""


class ChangHicher(Material):
    """The fabric-enhanced micromechanical model of granular soil."""

    model: Literal["chang_hicher"]
    preset: Text
    """Calibrated sand that the parameters come from."""
    void_ratio: Annotated[float, Field(gt=0)]
    """Initial void ratio (e)."""
    directions: Text = "bazant_oh_37"
    """Rule of contact directions; an element test takes gauss_16x20 when left out."""
    turn: Turn | None = None
    """Rotation of that rule; without it the rule stands in the axes of the scene."""
    localisation: Literal["total", "rate"] = "total"
    """How contact forces follow the stress: from its total, or accumulated from its rate."""
    parameters: dict[str, float] = Field(default={})
    """Parameters that differ from the preset's."""
    fabric: Fabric | None = None
    """Initial fabric and its evolution law."""

    @field_validator("void_ratio")
    @classmethod
    def _keep_contacts(cls, void_ratio: float) -> float:
        if void_ratio >= SOLID_FRACTION_LIMIT:
            raise ValueError(
                f"must be less than {SOLID_FRACTION_LIMIT:g}, where the contact density 13.28 - 8 e vanishes "
                f"(got {void_ratio:g})"
            )
        return void_ratio


class Umat(Material):
    """A compiled routine with the Abaqus UMAT argument list (small strain)."""

    model: Literal["umat"]
    library: Text
    """Shared library with the routine; relative to the case file."""
    properties: Annotated[tuple[float, ...], Field(strict=False)] = ()
    """PROPS, in the routine's own units and sign."""
    state_variables: Annotated[int, Field(ge=0)] = 0
    """Number of state variables (NSTATV)."""
    initial_state: Annotated[tuple[float, ...], Field(strict=False)] = ()
    """State variables (STATEV) before the first increment; those left out are zero."""
    components: Literal[4, 6] = 6
    """Stress components that the routine knows (NTENS): 6, or 4 where it knows plane strain and axisymmetry only."""
    time_step: Positive = 1.0
    """Time increment (DTIME) of every call."""
    thread_safe: bool = False
    """Whether several threads may be in the routine at once."""


AnyMaterial = Annotated[
    Elastic | VonMises | MohrCoulomb | DruckerPrager | ChangHicher | Umat, Field(discriminator="model")
]


def spelled_out(tables: dict[str, Any]) -> dict[str, Any]:
    """Return the tables of a case with every ``umat = LIBRARY`` as ``model = "umat"`` and ``library``."""
    materials = tables.get("material")
    if not isinstance(materials, dict):
        return tables
    return tables | {"material": {name: _spelled_out(name, table) for name, table in materials.items()}}


def _spelled_out(name: str, table: Any) -> Any:
    if not isinstance(table, dict) or "umat" not in table:
        return table
    for key in ("model", "library"):
        if key in table:
            raise CaseError(f"material.{name}.umat: says model and library in one; leave {key} out")
    rest = {key: value for key, value in table.items() if key != "umat"}
    return {"model": "umat", "library": table["umat"], **rest}
