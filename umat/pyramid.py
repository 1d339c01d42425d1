"""Return of the stress to a six-sided pyramid in the space of principal stresses.

With principal stresses σ1 ≥ σ2 ≥ σ3, compression positive, the yield function is
f = σ1 − k σ3 − σ_c and the plastic potential σ1 − m σ3.  The return is an affine map of
the principal trial stresses, one for each part of the pyramid:

* face, along r = D b/(aᵀD b) with a = (1, 0, −k), b = (1, 0, −m);
* edge σ2 = σ3 (triaxial compression), through (σ_c, 0, 0) along (k, 1, 1);
* edge σ1 = σ2 (triaxial extension), through (σ_c, σ_c, 0) along (k, k, 1);
* apex, σ1 = σ2 = σ3 = −σ_c/(k − 1); with k = 1 (Tresca) there is none.

Behind an edge lies what the flow of its two faces returns to it, behind the apex what
that of all six does (Clausen, Damkilde & Andersen 2006, 2007).  With m = 1 no plastic
flow leads to the apex; it is then the answer by convention.
"""

from typing import NamedTuple

import numpy as np
from numba import njit

from umat.mandel import Array
from umat.plastic import Batch
from umat.principal import fill_dyads, fill_spectral, principal_axes
from umat.status import BAD_INPUT, OK

INSIDE, FACE, COMPRESSION_EDGE, EXTENSION_EDGE, APEX = range(5)

_FACES = [0, 1, 2], [0, 2, 1], [1, 0, 2]
"""Order of the principal stresses on the face and on its neighbours at either edge."""


class Pyramid(NamedTuple):
    """Yield surface and the affine return to each part of it, σ = M σ_tr + o."""

    slope: float
    """Ratio of principal stresses at yield without cohesion (k) [-]."""
    strength: float
    """Uniaxial compressive strength (σ_c) [stress]."""
    apex: float
    """Pressure at the apex, −c cotφ, or −∞ [stress]."""
    shear: float
    """Shear modulus (G) [stress]."""
    elastic: Array
    """(6, 6) elastic stiffness (D) [stress]."""
    matrices: Array
    """(5, 3, 3) matrices of the return (M) [-]; INSIDE, FACE, …, APEX."""
    offsets: Array
    """(5, 3) offsets of the return (o) [stress]."""


def pyramid(elastic: Array, slope: float, dilation: float, strength: float) -> Pyramid:
    """Return the pyramid of k, m and σ_c with its affine returns; `elastic` is (6, 6)."""
    apex = -strength / (slope - 1.0) if slope > 1.0 else -np.inf
    flow = [_flow(elastic[:3, :3], slope, dilation, order) for order in _FACES]
    face = np.eye(3) - np.outer(flow[0], [1.0, 0.0, -slope]), strength * flow[0]
    compression = np.array([slope, 1.0, 1.0]), np.array([strength, 0.0, 0.0])
    extension = np.array([slope, slope, 1.0]), np.array([strength, strength, 0.0])
    returns = [
        (np.eye(3), np.zeros(3)),
        face,
        _to_line(*compression, np.cross(flow[0], flow[1])),
        _to_line(*extension, np.cross(flow[0], flow[2])),
        (np.zeros((3, 3)), np.full(3, apex)),
    ]
    matrices, offsets = map(np.array, zip(*returns, strict=True))
    shear = 0.5 * (elastic[0, 0] - elastic[0, 1])
    return Pyramid(slope, strength, apex, shear, elastic, matrices, offsets)


def _flow(elastic: Array, slope: float, dilation: float, order: list[int]) -> Array:
    """Return the (3,) stress r = D b/(aᵀD b) that plastic flow of one face relaxes."""
    yielding = np.array([1.0, 0.0, -slope])[order]
    relaxed = elastic @ np.array([1.0, 0.0, -dilation])[order]
    return relaxed / (yielding @ relaxed)


def _to_line(along: Array, through: Array, across: Array) -> tuple[Array, Array]:
    """Return matrix and offset of the projection to a line parallel to a plane.

    The plane is normal to `across` (3,).
    """
    weight = across / (across @ along)
    return np.outer(along, weight), through - along * (weight @ through)


@njit(cache=True, nogil=True)
def return_slice(start: int, stop: int, surface: Pyramid, batch: Batch) -> None:
    """Fill points start … stop of the batch."""
    trial, values, stress = np.empty(6), np.empty(3), np.empty(3)
    axes, dyads = np.empty((3, 3)), np.empty((6, 6))
    for point in range(start, stop):
        batch.status[point] = OK
        batch.plastic_strain[point] = batch.old_plastic_strain[point]
        _add_elastic(surface, batch.old_stress[point], batch.strain_increment[point], trial)
        if not np.isfinite(trial.sum() + batch.old_plastic_strain[point]):
            batch.status[point] = BAD_INPUT
            batch.stress[point] = batch.old_stress[point]
            batch.tangent[point] = surface.elastic
            continue
        principal_axes(trial, values, axes)
        part = return_principal(surface, values, stress)
        if part == INSIDE:
            batch.stress[point] = trial
            batch.tangent[point] = surface.elastic
            continue
        fill_dyads(axes, dyads)
        batch.plastic_strain[point] += _plastic_shear(surface.shear, values, stress)
        for a in range(6):
            batch.stress[point, a] = dyads[a, 0] * stress[0] + dyads[a, 1] * stress[1] + dyads[a, 2] * stress[2]
        _fill_tangent(surface, part, values, stress, dyads, batch.tangent[point])


@njit(cache=True, nogil=True)
def _add_elastic(surface, old_stress, strain_increment, trial):
    for a in range(6):
        trial[a] = old_stress[a]
        for b in range(6):
            trial[a] += surface.elastic[a, b] * strain_increment[b]


@njit(cache=True, nogil=True)
def return_principal(surface, trial, stress):
    """Fill the principal stresses (3,) returned from `trial`; return the part hit."""
    if trial[0] - surface.slope * trial[2] <= surface.strength:
        stress[:] = trial
        return INSIDE
    _return_to(surface, FACE, trial, stress)
    if stress[0] >= stress[1] >= stress[2]:
        return FACE
    edge = COMPRESSION_EDGE if stress[1] < stress[2] else EXTENSION_EDGE
    _return_to(surface, edge, trial, stress)
    if stress[2] >= surface.apex:
        return edge
    stress[:] = surface.apex
    return APEX


@njit(cache=True, nogil=True)
def _return_to(surface, part, trial, stress):
    for i in range(3):
        stress[i] = surface.offsets[part, i]
        for j in range(3):
            stress[i] += surface.matrices[part, i, j] * trial[j]


@njit(cache=True, nogil=True)
def _plastic_shear(shear, trial, stress):
    """Return √(2/3)‖e^p‖ = √(2/3)‖deviator of σ_tr − σ‖/2G."""
    gap = trial - stress
    gap -= gap.sum() / 3.0
    return np.sqrt(2.0 / 3.0 * (gap * gap).sum()) / (2.0 * shear)


@njit(cache=True, nogil=True)
def _fill_tangent(surface, part, trial, stress, dyads, tangent):
    """Fill the (6, 6) tangent; turning axes give 2G(σ_i − σ_j)/(σ_tr,i − σ_tr,j)."""
    normal_part, shear_part = np.zeros((3, 3)), np.zeros(3)
    for i in range(3):
        for j in range(3):
            for k in range(3):
                normal_part[i, j] += surface.matrices[part, i, k] * surface.elastic[k, j]
        j, k = (i + 1) % 3, (i + 2) % 3
        gap = abs(trial[j] - trial[k])
        if gap > 0.0:
            shear_part[i] = 2.0 * surface.shear * abs(stress[j] - stress[k]) / gap
    fill_spectral(dyads, normal_part, shear_part, tangent)
