"""The mesh and material of the comparison, in numpy alone, for programs that bring none of their own.

Squares cut along alternating diagonals, and the return to von Mises' cylinder with linear hardening; tension positive.
"""

import json
import os
import resource

import numpy as np

CUTS = {"5k": 1, "20k": 2, "81k": 4, "300k": 8}
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


def returned(stress: np.ndarray, plastic: np.ndarray, strain: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return stress, plastic strain and in-plane tangent (n, 3, 3) after strain increments (n, 3).

    Stress is (n, 4): xx, yy, zz, xy; strain xx, yy, xy, the shear doubled.
    """
    unit = np.array([1.0, 1.0, 1.0, 0.0])
    volume = strain[:, 0] + strain[:, 1]
    full = np.stack([strain[:, 0], strain[:, 1], 0.0 * volume, 0.5 * strain[:, 2]], axis=1)
    trial = stress + 2.0 * SHEAR * full + ((BULK - 2.0 / 3.0 * SHEAR) * volume)[:, None] * unit
    deviator = trial - trial[:, :3].mean(axis=1)[:, None] * unit
    size = np.sqrt(deviator**2 @ np.array([1.0, 1.0, 1.0, 2.0]))
    q = np.sqrt(1.5) * size
    excess = q - YIELD - HARDENING * plastic
    excess[excess < 1e-9 * YIELD] = 0.0  # or round-off would decide which points begin an increment as plastic
    slip = np.maximum(excess, 0.0) / (3.0 * SHEAR + HARDENING)
    shrink = 1.0 - 3.0 * SHEAR * slip / np.maximum(q, 1e-300)
    new = trial - (1.0 - shrink)[:, None] * deviator
    normal = (deviator / np.maximum(size, 1e-300)[:, None])[:, [0, 1, 3]]
    one = unit[[0, 1, 3]]
    elastic = BULK * np.outer(one, one) + 2.0 * SHEAR * (np.diag([1.0, 1.0, 0.5]) - np.outer(one, one) / 3.0)
    radial = 2.0 * SHEAR * (np.diag([1.0, 1.0, 0.5]) - np.outer(one, one) / 3.0)
    along = np.where(slip > 0.0, 2.0 * SHEAR * (3.0 * SHEAR / (3.0 * SHEAR + HARDENING) - (1.0 - shrink)), 0.0)
    tangent = elastic - (1.0 - shrink)[:, None, None] * radial
    tangent -= along[:, None, None] * normal[:, :, None] * normal[:, None, :]
    return new, plastic + slip, tangent


def report(program: str, dofs: int, wall: float, settlement: float, iterations: int, processor: float) -> None:
    """Print the JSON object that `footing.py` prints."""
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0
    row = {"program": program, "dofs": dofs, "wall_s": round(wall, 3), "settlement_m": settlement}
    row |= {"cpu_s": round(processor, 3), "peak_mb": round(peak, 1), "iterations": iterations}
    print(json.dumps(row | {"load_average": os.getloadavg()[0]}))
