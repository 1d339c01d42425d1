"""Non-associated Drucker–Prager plasticity with linear hardening, q = M p + k0 + H κ.

κ is the equivalent plastic shear strain ∫ √(2/3) ‖ė^p‖ dt.  See `umat.cone` for the
return to the cone and its apex.
"""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from umat.cone import Cone, return_slice
from umat.elastic import bulk_modulus, check, check_moduli, isotropic_tangent, shear_modulus
from umat.interface import (
    Response,
    elastic_tangent,
    initial_state,
    state_fields,
    symmetric_tangent,
    update,
    weakened,
)
from umat.mandel import Array, p, q
from umat.plastic import PlasticState, closed_form, unstrained


class DruckerPrager(NamedTuple):
    """Parameters of a Drucker–Prager material."""

    youngs_modulus: float
    """Young's modulus (E) [stress]."""
    poisson_ratio: float
    """Poisson's ratio (ν) [-]."""
    friction_slope: float
    """Slope of the yield surface in the p–q plane (M) [-]."""
    dilation_slope: float
    """Slope of the plastic potential (β) [-]: volume gained per plastic shear strain."""
    strength: float
    """q at yield where p = 0, before any plastic strain (k0) [stress]."""
    hardening_modulus: float = 0.0
    """Slope of that strength against plastic shear strain (H) [stress]."""


def _triaxial(sign: float) -> Callable[[float, float, float], tuple]:
    def match(cohesion: float, phi: float, psi: float) -> tuple[float, float, float]:
        divisor, dilation_divisor = 3.0 - sign * np.sin(phi), 3.0 - sign * np.sin(psi)
        slope, strength = 6.0 * np.sin(phi), 6.0 * cohesion * np.cos(phi)
        dilation = 6.0 * np.sin(psi) / dilation_divisor
        return slope / divisor, dilation, strength / divisor

    return match


def _plane_strain(cohesion: float, phi: float, psi: float) -> tuple:
    """Return M, β, k0 for which plastic flow in plane strain has the same strength.

    At the limit the out-of-plane plastic strain vanishes: s_z = 2βq/9.
    """
    dilation = 3.0 * np.sin(psi) / np.sqrt(3.0 + np.sin(psi) ** 2)
    divisor = np.sqrt((9.0 - dilation**2) / 27.0) + dilation * np.sin(phi) / 9.0
    return np.sin(phi) / divisor, dilation, cohesion * np.cos(phi) / divisor


MATCHES = {
    "compression": _triaxial(1.0),
    "extension": _triaxial(-1.0),
    "plane_strain": _plane_strain,
}


def matched_to_mohr_coulomb(
    youngs_modulus: float,
    poisson_ratio: float,
    cohesion: float,
    friction_angle: float,
    dilation_angle: float,
    match: str = "plane_strain",
) -> DruckerPrager:
    """Return the material with the strength of a Mohr–Coulomb material in one test.

    Cohesion in [stress], angles in [degrees]; `match` is `compression` or `extension`
    (triaxial), or `plane_strain` (limit load).
    """
    angles = np.radians([friction_angle, dilation_angle])
    slope, dilation, strength = map(float, MATCHES[match](cohesion, *angles))
    return DruckerPrager(youngs_modulus, poisson_ratio, slope, dilation, strength)


@update.register
def _(
    material: DruckerPrager,
    directions: Any,
    strain_increment: ArrayLike,
    old: PlasticState,
) -> Response:
    return closed_form(return_slice, _cone(material), strain_increment, old)


@initial_state.register
def _(material: DruckerPrager, directions: Any, stress: ArrayLike) -> PlasticState:
    check_moduli(material.youngs_modulus, material.poisson_ratio)
    check("friction_slope", material.friction_slope, 0.0, 3.0)
    check("dilation_slope", material.dilation_slope, 0.0, 3.0)
    check("strength", material.strength, 0.0)
    check("hardening_modulus", material.hardening_modulus, 0.0)
    return unstrained(stress)


@symmetric_tangent.register
def _(material: DruckerPrager) -> bool:
    hardens_at_apex = material.hardening_modulus > 0.0 and material.friction_slope > 0.0
    return material.friction_slope == material.dilation_slope and not hardens_at_apex


@state_fields.register
def _(material: DruckerPrager, state: PlasticState) -> dict[str, Array]:
    hardened = material.hardening_modulus * state.plastic_strain
    strength = material.strength + hardened + material.friction_slope * p(state.stress)
    with np.errstate(divide="ignore", invalid="ignore"):
        mobilised = q(state.stress) / strength
    return {"plastic_strain": state.plastic_strain, "mobilised_strength": mobilised}


elastic_tangent.register(DruckerPrager, isotropic_tangent)


@weakened.register
def _(material: DruckerPrager, factor: float) -> DruckerPrager:
    """Return M/F, k0/F, H/F and β, unless that is more than M/F; associated flow stays associated."""
    friction = material.friction_slope / factor
    associated = material.dilation_slope == material.friction_slope
    return material._replace(
        friction_slope=friction,
        dilation_slope=friction if associated else min(material.dilation_slope, friction),
        strength=material.strength / factor,
        hardening_modulus=material.hardening_modulus / factor,
    )


def _cone(material: DruckerPrager) -> Cone:
    return Cone(
        bulk_modulus(material.youngs_modulus, material.poisson_ratio),
        shear_modulus(material.youngs_modulus, material.poisson_ratio),
        friction=float(material.friction_slope),
        dilation=float(material.dilation_slope),
        strength=float(material.strength),
        hardening=float(material.hardening_modulus),
    )
