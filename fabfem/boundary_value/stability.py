"""Flags of instability at the points: second-order work and the determinant of the acoustic tensor.

Second-order work, d²W = Δσ : Δε over an increment, is positive as long as a point resists the increment it undergoes
[Hill 1958]. A band with normal n may localise when the acoustic tensor A_jk = n_i C_ijkl n_l of the tangent C is
singular [Rudnicki & Rice 1975]; the field is the least of det A(n) over directions n, over that of the elastic tangent
of the same state: one where the point is elastic, zero or less where a band may form. The tangent is the consistent one
of the increment, which for small increments is that of the rates. In a flat scene n lies in its plane.
"""

from typing import Any

import numpy as np

import umat
from fabfem.fem.increment import Increment
from fabfem.fem.points import tangents
from fabfem.fem.space import Space
from umat.mandel import COLUMN, FACTOR, ROW, Array

ANGLES = 90
"""Directions in the plane, over half a turn."""
LATITUDES = 12
"""Circles of directions on half a sphere, for solids."""
CLOSER = 3
"""Times that the directions are drawn closer around the best."""
LOST = 1e-4
"""Determinant over the elastic one at which a band may form; perfectly plastic materials come to zero from above."""
BATCH = 1000
"""Points treated at once."""


def second_order_work(space: Space, increment: Increment) -> Array:
    """Return Δσ : Δε (npoints,) of an increment [stress]."""
    strain, work = space.strain(increment.step), np.zeros(space.npoints)
    for name, zone in increment.zones.items():
        change = increment.states[name].stress - increment.before[name].stress
        work[zone.points] = np.einsum("pi,pi->p", change, strain[zone.points])
    return work


def acoustic_determinant(space: Space, increment: Increment) -> Array:
    """Return the least determinant (npoints,) of the acoustic tensor over that of the elastic tangent [-]."""
    normals = normals_of(space.mesh.dim)
    ratio = np.ones(space.npoints)
    tangent = tangents(space, increment.zones, space.strain(increment.step), increment.before)
    for name, zone in increment.zones.items():
        elastic = umat.elastic_tangent(zone.material, increment.states[name])
        ratio[zone.points] = least_ratio(tangent[zone.points], elastic, normals)
    return ratio


def localisation(space: Space, increment: Increment) -> dict[str, Any]:
    """Return the report's entry on the first increment after which a band may form, empty as long as none may."""
    least = acoustic_determinant(space, increment)
    ranks = space.mesh.ranks
    lost = ranks.sum(int((least <= LOST).sum()))
    if not lost:
        return {}
    lowest = ranks.least(float(least.min()))
    mine = space.points[least == lowest][:1].tolist()
    return {
        "localisation": {
            **{"stage": increment.stage, "increment": increment.number, "points": lost},
            **{"at": ranks.one(mine), "determinant": lowest},
            "meaning": "from here on a band may form, as wide as an element: what follows depends on the mesh",
        }
    }


def least_ratio(tangent: Array, elastic: Array, normals: Array) -> Array:
    """Return the least ratio (n,) over directions (m, 3), then over closer and closer ones around the best."""
    found = np.empty(len(tangent))
    for begin in range(0, len(tangent), BATCH):
        part = slice(begin, begin + BATCH)
        pair = tangent[part], elastic[part]
        around = np.broadcast_to(normals, (len(pair[0]), *normals.shape))
        apart = np.pi / ANGLES if not normals[:, 2].any() else 0.5 * np.pi / LATITUDES
        for _ in range(CLOSER):
            ratio = _ratio(*pair, around)
            best = np.take_along_axis(around, ratio.argmin(axis=1)[:, None, None], axis=1)
            around, apart = _about(best, apart, normals), 0.25 * apart
        found[part] = np.minimum(ratio.min(axis=1), _ratio(*pair, around).min(axis=1))
    return found


def _about(best: Array, apart: float, normals: Array) -> Array:
    """Return directions (n, k, 3) within an angle of the best ones (n, 1, 3), those among them; flat stays flat."""
    steps = apart * np.arange(-4, 5) / 4.0
    if not normals[:, 2].any():
        offsets = np.stack([-best[..., 1], best[..., 0], np.zeros_like(best[..., 0])], axis=-1) * np.tan(steps)[:, None]
    else:
        offsets = np.stack(np.meshgrid(steps, steps, steps), axis=-1).reshape(1, -1, 3)
    turned = best + offsets
    return turned / np.linalg.norm(turned, axis=-1, keepdims=True)


def _ratio(tangent: Array, elastic: Array, normals: Array) -> Array:
    with np.errstate(divide="ignore", invalid="ignore"):
        return determinants(tangent, normals) / determinants(elastic, normals)


def determinants(tangent: Array, normals: Array) -> Array:
    """Return det A(n) (n, m) of tangents (n, 6, 6) and each one's directions (n, m, 3), A_jk = n_i C_ijkl n_l.

    With the (6, 3) operator N that makes the Mandel vector of sym(n ⊗ g) from g, A = Nᵀ C N.
    """
    operator = np.zeros((*normals.shape[:2], 6, 3))
    for a in range(6):
        i, j = ROW[a], COLUMN[a]
        operator[..., a, i] += 0.5 * FACTOR[a] * normals[..., j]
        operator[..., a, j] += 0.5 * FACTOR[a] * normals[..., i]
    return np.linalg.det(operator.swapaxes(-1, -2) @ (tangent[:, None] @ operator))


def normals_of(dim: int) -> Array:
    """Return unit vectors (m, 3): over half a turn in the plane, or over half a sphere."""
    if dim == 2:
        angle = np.pi * np.arange(ANGLES) / ANGLES
        return np.stack([np.cos(angle), np.sin(angle), np.zeros(ANGLES)], axis=1)
    rows = []
    for polar in 0.5 * np.pi * np.arange(LATITUDES + 1) / LATITUDES:
        turns = 2.0 * np.pi * np.arange(n := max(1, round(4 * LATITUDES * np.sin(polar)))) / n
        rows.append(
            np.stack([np.sin(polar) * np.cos(turns), np.sin(polar) * np.sin(turns), np.full(n, np.cos(polar))], 1)
        )
    return np.concatenate(rows)
