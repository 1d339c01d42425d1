"""Linear isotropic elasticity, σ̇ = (K − 2/3 G) tr(ε̇) 1 + 2 G ε̇."""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from umat.interface import (
    Response,
    checked_vectors,
    elastic_tangent,
    initial_state,
    state_fields,
    symmetric_tangent,
    update,
    weakened,
)
from umat.mandel import IDENTITY, SPHERICAL, Array, trace
from umat.status import BAD_INPUT, OK


class Elastic(NamedTuple):
    """Parameters of a linear elastic material."""

    youngs_modulus: float
    """Young's modulus (E) [stress]."""
    poisson_ratio: float
    """Poisson's ratio (ν) [-], between −1 and ½."""


class ElasticState(NamedTuple):
    """State of `n` elastic points."""

    stress: Array
    """(n, 6) stress, compression positive."""


def bulk_modulus(youngs_modulus: float, poisson_ratio: float) -> float:
    """Return the bulk modulus K = E/3(1 − 2ν) [stress]."""
    return youngs_modulus / (3.0 * (1.0 - 2.0 * poisson_ratio))


def shear_modulus(youngs_modulus: float, poisson_ratio: float) -> float:
    """Return the shear modulus G = E/2(1 + ν) [stress]."""
    return youngs_modulus / (2.0 * (1.0 + poisson_ratio))


def stiffness(youngs_modulus: float, poisson_ratio: float) -> Array:
    """Return the (6, 6) elastic stiffness [stress]."""
    bulk = bulk_modulus(youngs_modulus, poisson_ratio)
    shear = shear_modulus(youngs_modulus, poisson_ratio)
    return 3.0 * bulk * SPHERICAL + 2.0 * shear * (np.eye(6) - SPHERICAL)


def check(name: str, value: float, low: float, high: float = np.inf) -> None:
    """Raise ValueError naming a parameter that is not finite and in [low, high]."""
    if not (np.isfinite(value) and low <= value <= high):
        raise ValueError(f"{name} must lie between {low:g} and {high:g}, got {value:g}")


def check_moduli(youngs_modulus: float, poisson_ratio: float) -> None:
    """Raise ValueError for moduli without a positive definite stiffness."""
    check("youngs_modulus", youngs_modulus, np.finfo(float).tiny)
    check("poisson_ratio", poisson_ratio, np.nextafter(-1.0, 0), np.nextafter(0.5, 0))


@update.register
def _(material: Elastic, directions: Any, strain_increment: ArrayLike, old: ElasticState) -> Response:
    strain_increment = checked_vectors("strain_increment", strain_increment, len(old.stress))
    bulk, shear = bulk_modulus(*material), shear_modulus(*material)
    pressure = (bulk - 2.0 / 3.0 * shear) * trace(strain_increment)
    stress = old.stress + 2.0 * shear * strain_increment + pressure[:, None] * IDENTITY
    good = np.isfinite(stress).all(axis=1)
    stress = np.where(good[:, None], stress, old.stress)
    n_points = len(stress)
    return Response(
        stress=stress,
        tangent=elastic_tangent(material, old),
        state=ElasticState(stress),
        status=np.where(good, OK, BAD_INPUT).astype(np.int8),
        error=np.zeros(n_points),
        work=np.ones(n_points, dtype=np.int32),
    )


@initial_state.register
def _(material: Elastic, directions: Any, stress: ArrayLike) -> ElasticState:
    check_moduli(*material)
    return ElasticState(checked_vectors("stress", stress).copy())


@symmetric_tangent.register
def _(material: Elastic) -> bool:
    return True


@state_fields.register
def _(material: Elastic, state: ElasticState) -> dict[str, Array]:
    return {}


@weakened.register
def _(material: Elastic, factor: float) -> Elastic:
    """Return the material itself, which has no strength."""
    return material


@elastic_tangent.register(Elastic)
def isotropic_tangent(material: Any, state: Any) -> Array:
    """Return the (n, 6, 6) tangent of any material with a Young's modulus and a Poisson's ratio."""
    return np.tile(stiffness(material.youngs_modulus, material.poisson_ratio), (len(state.stress), 1, 1))
