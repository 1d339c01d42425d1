"""The mesh and material of the comparison, in numpy alone, for programs that bring none of their own.

Squares cut along alternating diagonals, and the return to von Mises' cylinder with linear hardening; tension positive.
"""

import itertools
import json
import os
import resource

import numpy as np

CUTS = {"5k": 1, "20k": 2, "81k": 4, "300k": 8}
SOLIDS = {"solid-50k": (15, 15, 9), "solid-150k": (20, 20, 15)}
YOUNG, POISSON, YIELD, HARDENING, PRESSURE = 1e4, 0.3, 10.0 * 3.0**0.5, 100.0, 50.0
SHEAR, BULK = YOUNG / 2.0 / (1.0 + POISSON), YOUNG / 3.0 / (1.0 - 2.0 * POISSON)


def triangles(cuts: int) -> tuple[np.ndarray, np.ndarray]:
    """Return points (n, 2) of the box 7.0 × 3.6 m and corners (nel, 3) of its triangles."""
    nx, ny = 35 * cuts, 18 * cuts
    x, y = np.meshgrid(np.linspace(0.0, 7.0, nx + 1), np.linspace(-3.6, 0.0, ny + 1))
    number = np.arange((nx + 1) * (ny + 1)).reshape(ny + 1, nx + 1)
    a, b, c, d = (q.ravel() for q in (number[:-1, :-1], number[:-1, 1:], number[1:, 1:], number[1:, :-1]))
    i, j = (q.ravel() for q in np.meshgrid(np.arange(nx), np.arange(ny)))
    rising = np.stack([a, b, c, a, c, d], axis=1)
    falling = np.stack([a, b, d, b, c, d], axis=1)
    cells = np.where(((i + j) % 2 == 0)[:, None], rising, falling).reshape(-1, 3)
    return np.stack([x.ravel(), y.ravel()], axis=1), cells


def tetrahedra(counts: tuple[int, ...]) -> tuple[np.ndarray, np.ndarray]:
    """Return points (n, 3) of the box 5 × 5 × 3 m and corners (nel, 4), six to a cell about its long diagonal."""
    axes = [np.linspace(*ends, n + 1) for ends, n in zip(((0.0, 5.0), (0.0, 5.0), (-3.0, 0.0)), counts, strict=True)]
    points = np.stack([x.ravel(order="F") for x in np.meshgrid(*axes, indexing="ij")], axis=1)
    strides = np.cumprod([1, *(n + 1 for n in counts[:-1])])
    first = sum(
        (number * stride for number, stride in zip(np.meshgrid(*map(np.arange, counts)), strides, strict=True)),
        start=np.zeros((), int),
    )
    paths = np.array([np.cumsum([0, *strides[list(order)]]) for order in itertools.permutations(range(3))])
    return points, (first.reshape(-1, 1, 1) + paths).reshape(-1, 4)


def with_middles(points: np.ndarray, cells: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return points and cells with a node in the middle of each side."""
    sides = np.sort(cells[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    sides, number = np.unique(sides, axis=0, return_inverse=True)
    middles = len(points) + number.reshape(-1, 3)
    return np.concatenate([points, points[sides].mean(axis=1)]), np.concatenate([cells, middles], axis=1)


def strip_load(points: np.ndarray, cuts: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the nodes of the strip and the area of each: 1/6, 4/6, 1/6 of a side of length 0.2/cuts."""
    strip = np.flatnonzero((np.abs(points[:, 1]) < 1e-9) & (points[:, 0] < 1.0 + 1e-9))
    place = np.rint(points[strip, 0] * 10.0 * cuts).astype(int)
    side = 0.2 / cuts
    shares = np.where(place % 2 == 1, 4.0, 2.0) * side / 6.0
    shares[(place == 0) | (place == place.max())] = side / 6.0
    return strip, shares


def returned(stress: np.ndarray, plastic: np.ndarray, strain: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return stress, plastic strain and tangent (n, k, k) after strain increments (n, k), shears doubled.

    Stress is (n, 4): xx, yy, zz, xy with strain xx, yy, xy in plane strain; (n, 6): xx, yy, zz, xy, xz, yz in solids.
    """
    size = stress.shape[1]
    kept = [0, 1, 3] if size == 4 else list(range(6))
    unit, twice = np.repeat([1.0, 0.0], [3, size - 3]), np.repeat([1.0, 2.0], [3, size - 3])
    full = np.zeros(stress.shape)
    full[:, kept] = strain / twice[kept]
    volume = full[:, :3].sum(axis=1)
    trial = stress + 2.0 * SHEAR * full + ((BULK - 2.0 / 3.0 * SHEAR) * volume)[:, None] * unit
    deviator = trial - trial[:, :3].mean(axis=1)[:, None] * unit
    length = np.sqrt(deviator**2 @ twice)
    q = np.sqrt(1.5) * length
    excess = q - YIELD - HARDENING * plastic
    excess[excess < 1e-9 * YIELD] = 0.0  # or round-off would decide which points begin an increment as plastic
    slip = np.maximum(excess, 0.0) / (3.0 * SHEAR + HARDENING)
    shrink = 1.0 - 3.0 * SHEAR * slip / np.maximum(q, 1e-300)
    new = trial - (1.0 - shrink)[:, None] * deviator
    normal = (deviator / np.maximum(length, 1e-300)[:, None])[:, kept]
    one = unit[kept]
    radial = 2.0 * SHEAR * (np.diag(1.0 / twice[kept]) - np.outer(one, one) / 3.0)
    along = np.where(slip > 0.0, 2.0 * SHEAR * (3.0 * SHEAR / (3.0 * SHEAR + HARDENING) - (1.0 - shrink)), 0.0)
    tangent = BULK * np.outer(one, one) + shrink[:, None, None] * radial
    tangent -= along[:, None, None] * normal[:, :, None] * normal[:, None, :]
    return new, plastic + slip, tangent


def report(
    program: str,
    dofs: int,
    wall: float,
    settlement: float,
    iterations: int,
    processor: float,
    who: int = resource.RUSAGE_SELF,
) -> None:
    """Print the JSON object that `footing.py` prints."""
    peak = resource.getrusage(who).ru_maxrss / 1024.0
    row = {"program": program, "dofs": dofs, "wall_s": round(wall, 3), "settlement_m": settlement}
    row |= {"cpu_s": round(processor, 3), "peak_mb": round(peak, 1), "iterations": iterations}
    print(json.dumps(row | {"load_average": os.getloadavg()[0]}))
