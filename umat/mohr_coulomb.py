"""Non-associated Mohr–Coulomb plasticity with exact corners and apex, perfectly plastic.

τ = c + σ_n tanφ on the worst plane, that is σ1 = k σ3 + σ_c with k = tan²(45° + φ/2) and
σ_c = 2c√k; the plastic potential has ψ in the place of φ.  See `umat.pyramid` for the
return to faces, edges and apex.
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from umat.elastic import check, check_moduli, isotropic_tangent, stiffness
from umat.interface import (
    Response,
    elastic_tangent,
    initial_state,
    reduced_angle,
    state_fields,
    symmetric_tangent,
    update,
    weakened,
)
from umat.mandel import Array, principal
from umat.plastic import PlasticState, closed_form, unstrained
from umat.pyramid import Pyramid, pyramid, return_slice


class MohrCoulomb(NamedTuple):
    """Parameters of a Mohr–Coulomb material."""

    youngs_modulus: float
    """Young's modulus (E) [stress]."""
    poisson_ratio: float
    """Poisson's ratio (ν) [-]."""
    cohesion: float
    """Cohesion (c) [stress]."""
    friction_angle: float
    """Angle of friction (φ) [degrees]."""
    dilation_angle: float = 0.0
    """Angle of dilation (ψ) [degrees]."""


@update.register
def _(
    material: MohrCoulomb,
    directions: Any,
    strain_increment: ArrayLike,
    old: PlasticState,
) -> Response:
    return closed_form(return_slice, _pyramid(material), strain_increment, old)


@initial_state.register
def _(material: MohrCoulomb, directions: Any, stress: ArrayLike) -> PlasticState:
    check_moduli(material.youngs_modulus, material.poisson_ratio)
    check("cohesion", material.cohesion, 0.0)
    check("friction_angle", material.friction_angle, 0.0, 89.0)
    check("dilation_angle", material.dilation_angle, 0.0, material.friction_angle)
    return unstrained(stress)


@symmetric_tangent.register
def _(material: MohrCoulomb) -> bool:
    return material.friction_angle == material.dilation_angle


@state_fields.register
def _(material: MohrCoulomb, state: PlasticState) -> dict[str, Array]:
    """Return the plastic strain [-] and (σ1 − σ3) over its value at yield for one σ3."""
    major, _, minor = np.moveaxis(principal(state.stress), -1, 0)
    slope, strength = _slope(material.friction_angle), _strength(material)
    with np.errstate(divide="ignore", invalid="ignore"):
        mobilised = (major - minor) / ((slope - 1.0) * minor + strength)
    return {"plastic_strain": state.plastic_strain, "mobilised_strength": mobilised}


elastic_tangent.register(MohrCoulomb, isotropic_tangent)


@weakened.register
def _(material: MohrCoulomb, factor: float) -> MohrCoulomb:
    """Return c/F, tan φ/F and ψ, unless that is more than φ is then; associated flow stays associated."""
    friction = reduced_angle(material.friction_angle, factor)
    associated = material.dilation_angle == material.friction_angle
    dilation = friction if associated else min(material.dilation_angle, friction)
    return material._replace(cohesion=material.cohesion / factor, friction_angle=friction, dilation_angle=dilation)


def _pyramid(material: MohrCoulomb) -> Pyramid:
    elastic = stiffness(material.youngs_modulus, material.poisson_ratio)
    slope, dilation = _slope(material.friction_angle), _slope(material.dilation_angle)
    return pyramid(elastic, slope, dilation, _strength(material))


def _slope(angle: float) -> float:
    """Return (1 + sin)/(1 − sin) of an angle [degrees]."""
    sine = np.sin(np.radians(angle))
    return float((1.0 + sine) / (1.0 - sine))


def _strength(material: MohrCoulomb) -> float:
    """Return the uniaxial compressive strength 2c√k [stress]."""
    return 2.0 * material.cohesion * _slope(material.friction_angle) ** 0.5
