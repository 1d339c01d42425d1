"""Von Mises plasticity with linear isotropic hardening, q = σ_y + H ε_p, or softening to a residual σ_r.

ε_p is the equivalent plastic strain ∫ √(2/3) ‖ε̇^p‖ dt.
"""

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
from umat.mandel import Array, q
from umat.plastic import PlasticState, closed_form, unstrained


class VonMises(NamedTuple):
    """Parameters of a von Mises material."""

    youngs_modulus: float
    """Young's modulus (E) [stress]."""
    poisson_ratio: float
    """Poisson's ratio (ν) [-]."""
    yield_stress: float
    """Yield stress in uniaxial loading (σ_y) [stress]; √3 times the shear strength."""
    hardening_modulus: float = 0.0
    """Slope of the yield stress against plastic strain (H) [stress]; negative softens, above −3 G."""
    residual_stress: float = 0.0
    """Yield stress at which softening ends (σ_r) [stress]."""


@update.register
def _(material: VonMises, directions: Any, strain_increment: ArrayLike, old: PlasticState) -> Response:
    return closed_form(return_slice, _cylinder(material), strain_increment, old)


@initial_state.register
def _(material: VonMises, directions: Any, stress: ArrayLike) -> PlasticState:
    check_moduli(material.youngs_modulus, material.poisson_ratio)
    check("yield_stress", material.yield_stress, 0.0)
    softest = -3.0 * shear_modulus(material.youngs_modulus, material.poisson_ratio)
    check("hardening_modulus", material.hardening_modulus, np.nextafter(softest, 0.0))
    check("residual_stress", material.residual_stress, 0.0, material.yield_stress)
    return unstrained(stress)


@symmetric_tangent.register
def _(material: VonMises) -> bool:
    return True


@state_fields.register
def _(material: VonMises, state: PlasticState) -> dict[str, Array]:
    plastic_strain = state.plastic_strain
    strength = np.maximum(material.yield_stress + material.hardening_modulus * plastic_strain, material.residual_stress)
    return {
        "plastic_strain": plastic_strain,
        "mobilised_strength": q(state.stress) / strength,
    }


elastic_tangent.register(VonMises, isotropic_tangent)


@weakened.register
def _(material: VonMises, factor: float) -> VonMises:
    """Return σ_y/F, H/F and σ_r/F."""
    return material._replace(
        yield_stress=material.yield_stress / factor,
        hardening_modulus=material.hardening_modulus / factor,
        residual_stress=material.residual_stress / factor,
    )


def _cylinder(material: VonMises) -> Cone:
    """Return the cone without slope that the yield surface is."""
    return Cone(
        bulk_modulus(material.youngs_modulus, material.poisson_ratio),
        shear_modulus(material.youngs_modulus, material.poisson_ratio),
        friction=0.0,
        dilation=0.0,
        strength=float(material.yield_stress),
        hardening=float(material.hardening_modulus),
        residual=float(material.residual_stress),
    )
