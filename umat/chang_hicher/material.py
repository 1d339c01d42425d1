"""The enhanced Chang–Hicher material (Zhao & Kruyt 2020): its parameters, its state, its start.

Grain size drops out of the dimensionless system (see `contact`): force over p_ref r² and displacement over 2r leave
√(f_ref p_ref)/k_n0 as the only elastic constant. So d50 is not a parameter here; `umat.sands` says where it went.
"""

from functools import lru_cache
from typing import Any, Literal, NamedTuple
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import ArrayLike

from ..directions import Directions
from ..fabric import Constant, ZhaoKruyt
from ..interface import checked_vectors
from ..mandel import DEVIATORIC, IDENTITY, SPHERICAL, Array, deviator, dot, norm, principal, to_tensor
from ..mandel import p as mean
from .planes import Rule, padded
from .pool import Constants


class ChangHicher(NamedTuple):
    """Parameters; k_n0, f_ref and p_ref in consistent units (MPa with N/mm and N, Pa with N/m and N, …)."""

    e_ref: float  #: void ratio of the critical state line at p = 0 [-]
    critical_slope: float  #: (λ_c) e_c = e_ref − λ_c (p/p_ref)^ξ [-]
    critical_exponent: float  #: (ξ) [-]
    normal_stiffness: float  #: (k_n0) of a contact at the force f_ref [force/length]
    friction_angle: float  #: (φ_μ) between grains [deg]
    tangential_ratio: float  #: (k_tR) k_t / k_n [-]
    plastic_ratio: float  #: (k_pR) k_p / k_n [-]
    reference_force: float  #: (f_ref) [force]
    reference_pressure: float  #: (p_ref) [stress]; also the unit in which the point computes
    law: Any = ZhaoKruyt()  #: record of a fabric law
    localisation: Literal["total", "rate"] = "total"
    open_pressure: float = 1e-4  #: mean pressure at which the packing opens, over p_ref [-]; see `opening`
    relaxation: float = 2.0**-14  #: least share of the sliding done in a relaxed sub-step; 1 refuses instead [-]
    open_stiffness: float = 0.01  #: tangent of an open point, over the elastic one at the open pressure [-]
    tolerance: float = 1e-3  #: on the local error of a sub-step: of the stress relative to its norm, of F [-]
    max_evaluations: int = 2000  #: bound on the work of one point


CLOSED = 2.0
"""Least mean pressure at the start, over the one at which the packing opens [-]: nearer to it, whether a point gains
strength or comes apart depends on the increment."""


class ChangHicherState(NamedTuple):
    """State of n points; N directions."""

    stress: Array
    """(n, 6) stress [as p_ref]."""
    fabric: Array
    """(n, 6) fabric anisotropy tensor (F) [-]."""
    void_ratio: Array
    """(n,) void ratio (e) [-]."""
    slip: Array
    """(n, N) accumulated sliding over the grain diameter (δ_t^p / 2r) [-]."""
    force: Array
    """(n, N, 3) contact forces over p_ref r² in the rate form; (n, 0, 3) in the total form, which needs none."""
    gap: Array
    """(n,) volumetric strain by which an open point must be compressed before its contacts close [-], positive."""


@lru_cache(maxsize=64)
def constants_of(material: ChangHicher) -> Constants:
    """Return the dimensionless constants; ValueError names a parameter that cannot be."""
    for name in ("normal_stiffness", "friction_angle", "tangential_ratio", "plastic_ratio", "reference_force",
                 "reference_pressure", "e_ref", "tolerance", "open_pressure"):  # fmt: skip
        if not getattr(material, name) > 0.0:
            raise ValueError(f"{name} must be positive, got {getattr(material, name)}")
    if material.localisation not in ("total", "rate"):
        raise ValueError(f"localisation must be 'total' or 'rate', got {material.localisation!r}")
    compliance = (material.reference_force * material.reference_pressure) ** 0.5 / material.normal_stiffness
    elastic = (compliance, 1.0 / material.tangential_ratio, 0.5 / material.plastic_ratio)
    return Constants(
        elastic=elastic,
        line=(float(material.e_ref), float(material.critical_slope), float(material.critical_exponent)),
        tan_mu=float(np.tan(np.radians(material.friction_angle))),
        total=material.localisation == "total",
        evolving=not isinstance(material.law, Constant),
        tolerance=float(material.tolerance),
        max_evaluations=int(material.max_evaluations),
        open_pressure=float(material.open_pressure),
        open_stiffness=float(material.open_stiffness),
        least_share=float(material.relaxation),
    )


_RULES: WeakKeyDictionary[Directions, Rule] = WeakKeyDictionary()


def rule_of(directions: Directions) -> Rule:
    """Return the directions as the kernels read them, made once."""
    if directions not in _RULES:
        _RULES[directions] = padded(directions)
    return _RULES[directions]


def contact_forces(
    material: ChangHicher, directions: Directions, stress: Array, fabric: Array, void_ratio: Array
) -> Array:
    """Return f = σ G⁻¹ n / c(e), (n, N, 3), force over p_ref r² [ZK Table 3, total form]."""
    inverse = np.linalg.inv(np.eye(3) / 3.0 + 2.0 / 15.0 * to_tensor(fabric))
    density = 3.0 / (2.0 * np.pi) * (13.28 - 8.0 * void_ratio) / (1.0 + void_ratio)
    z = to_tensor(stress / material.reference_pressure) @ inverse / density[:, None, None]
    return np.einsum("pij,aj->pai", z, directions.normals)


def mobilised(material: ChangHicher, directions: Directions, force: Array) -> tuple[Array, Array]:
    """Return f_n and R = |f_t| / f_n of every direction, (n, N)."""
    normal = np.einsum("pai,ai->pa", force, directions.normals)
    tangential = np.linalg.norm(force - normal[..., None] * directions.normals, axis=-1)
    return normal, tangential / np.where(normal > 0.0, normal, np.nan)


def critical_void_ratio(material: ChangHicher, p: ArrayLike) -> Array:
    """Return e_c(p) [ZK Table 3]."""
    ratio = np.maximum(np.asarray(p, float) / material.reference_pressure, 0.0)
    return material.e_ref - material.critical_slope * ratio**material.critical_exponent


def start(
    material: ChangHicher, directions: Directions, stress: ArrayLike, *, void_ratio: ArrayLike, fabric: ArrayLike = 0.0
) -> ChangHicherState:
    """Return the state at the start of a path: the sliding done is what the forces need, so nothing slips at rest.

    stress: (n, 6); void_ratio: () or (n,); fabric: (6,) or (n, 6) Mandel components of F.
    Raises ValueError if a stress lies outside the domain of the contact law, p is below `CLOSED` times the pressure at
    which the packing opens, or E(n) = 1 + F:nn is not positive.
    """
    stress = checked_vectors("stress", stress)
    n = len(stress)
    void_ratio = np.broadcast_to(np.asarray(void_ratio, float), (n,)).copy()
    fabric = np.ascontiguousarray(np.broadcast_to(np.asarray(fabric, float), (n, 6)))
    constants = constants_of(material)
    lowest = np.linalg.eigvalsh(to_tensor(fabric)).min() if n else 0.0
    if lowest <= -1.0:
        raise ValueError(f"the fabric makes the density of contacts 1 + F:nn negative ({1 + lowest:.3g})")
    if np.any(void_ratio <= 0.0) or np.any(void_ratio >= 1.64):
        raise ValueError("the void ratio must lie between 0 and 1.64")
    least, opening = (mean(stress).min() if n else np.inf), material.open_pressure * material.reference_pressure
    if 0.0 < least < CLOSED * opening:
        raise ValueError(
            f"the mean pressure {least:.3g} is below {CLOSED:g} times the one at which the packing opens, "
            f"{opening:.3g}; begin at more or lower open_pressure"
        )
    force = contact_forces(material, directions, stress, fabric, void_ratio)
    normal, ratio = mobilised(material, directions, force)
    critical = critical_void_ratio(material, mean(stress))
    limit = (critical / void_ratio * constants.tan_mu)[:, None]
    if not (np.all(normal > 0.0) and np.all(ratio < limit)):
        raise ValueError(
            "the stress lies outside the domain of the contact law: some contact would pull or slide freely"
        )
    compliance, _, ease_p = constants.elastic
    slip = ease_p * compliance * np.sqrt(normal) * limit * ratio / (limit - ratio)
    kept = force if not constants.total else np.zeros((n, 0, 3))
    return ChangHicherState(
        stress, fabric, void_ratio, np.ascontiguousarray(slip), np.ascontiguousarray(kept), np.zeros(n)
    )


def packed_void_ratio(state: ChangHicherState) -> Array:
    """Return the void ratio of the packing that closes again, without the gap."""
    return (1.0 + state.void_ratio) * np.exp(-state.gap) - 1.0


def fields(material: ChangHicher, state: ChangHicherState) -> dict[str, Array]:
    """Return the derived fields of a state.

    void_ratio, of the packing, and gap, the volumetric strain by which an open packing has come apart;
    state_parameter ψ = e − e_c; fabric (n, 6) F and fabric_norm ‖F‖; anisotropy F:n with n the direction
    of the stress deviator; mobilised_friction, the angle of (σ1 − σ3)/(σ1 + σ3) = sin φ [deg].
    """
    floor = 1e-12 * material.reference_pressure
    s = deviator(state.stress)
    major, _, minor = np.moveaxis(principal(state.stress), -1, 0)
    void_ratio = packed_void_ratio(state)
    return {
        "void_ratio": void_ratio,
        "gap": state.gap,
        "state_parameter": void_ratio - critical_void_ratio(material, mean(state.stress)),
        "fabric": state.fabric,
        "fabric_norm": norm(state.fabric),
        "anisotropy": dot(state.fabric, s) / np.maximum(norm(s), floor),
        "mobilised_friction": np.degrees(
            np.arcsin(np.clip((major - minor) / np.maximum(major + minor, floor), 0.0, 1.0))
        ),
    }


def elastic(material: ChangHicher, state: ChangHicherState) -> Array:
    """Return the (n, 6, 6) elastic tangent of an isotropic packing at the state's pressure and void ratio.

    With F = 0, f = (3/c) σ n and ⟨n_i n_j n_k n_l⟩ = (δ_ij δ_kl + δ_ik δ_jl + δ_il δ_jk)/15 the averages of [ZK
    Table 3] close:
    ε = (9/c) [(C_n − C_t) (tr σ I + 2σ)/15 + C_t σ/3], C_n = compliance / (2 √f_n), C_t = C_n / k_tR.
    In the total form a change of the contact density at the same forces changes the stress too: dσ = σ dc/c,
    de = −(1+e) dε_v.
    """
    constants = constants_of(material)
    compliance, ease_t, _ = constants.elastic
    e = np.minimum(packed_void_ratio(state), 1.5)
    p = np.maximum(mean(state.stress) / material.reference_pressure, material.open_pressure)
    density = 3.0 / (2.0 * np.pi) * (13.28 - 8.0 * e) / (1.0 + e)
    normal = 0.5 * compliance / np.sqrt(3.0 * p / density) * 9.0 / density
    bulk = 1.0 / normal  # strain/3 of each axis is normal p / 3
    shear = 1.0 / (normal * (2.0 / 15.0 + ease_t / 5.0))
    tangent = (bulk[:, None, None] * 3.0 * SPHERICAL + shear[:, None, None] * DEVIATORIC) * material.reference_pressure
    if constants.total:
        by_volume = (8.0 * (1.0 + e) / (13.28 - 8.0 * e) + 1.0)[:, None] * state.stress  # −(1+e) σ c'/c
        tangent += by_volume[:, :, None] * IDENTITY
    return tangent
