"""The strip footing of the comparison by FElupe and PARDISO; `pip install felupe pypardiso` in its own environment.

python tests/benchmarks/peers/felupe_run.py 81k

FElupe's own plane strain field, material and Newton's method, and its 6-node triangle but for the gradient: that of
FElupe 11.3 differs from finite differences of its functions in two terms, which makes the settlement .06 % smaller.
"""

import sys
import time

import felupe
import numpy as np
from grid import CUTS, HARDENING, POISSON, PRESSURE, YIELD, YOUNG, report, strip_load, triangles, with_middles
from pypardiso import spsolve


def gradient(element, where):
    """Return the derivatives (6, 2) of the functions of the 6-node triangle."""
    r, s = where
    t = 1.0 - r - s
    return np.array(
        [
            [1.0 - 4.0 * t, 1.0 - 4.0 * t],
            [4.0 * r - 1.0, 0.0 * r],
            [0.0 * s, 4.0 * s - 1.0],
            [4.0 * (t - r), -4.0 * r],
            [4.0 * s, 4.0 * r],
            [-4.0 * s, 4.0 * (t - s)],
        ]
    )


felupe.element.QuadraticTriangle.gradient = gradient


def solve(cuts):
    """Return unknowns, seconds, settlement, iterations and seconds of processor time."""
    begin, used = time.perf_counter(), time.process_time()
    corners, cells = triangles(cuts)
    points, cells = with_middles(corners, cells)
    mesh = felupe.Mesh(points, cells, "triangle6")
    field = felupe.FieldContainer([felupe.FieldPlaneStrain(felupe.RegionQuadraticTriangle(mesh), dim=2)])
    first, second = YOUNG * POISSON / (1.0 + POISSON) / (1.0 - 2.0 * POISSON), YOUNG / 2.0 / (1.0 + POISSON)
    metal = felupe.MaterialStrain(
        material=felupe.constitution.linear_elastic_plastic_isotropic_hardening,
        λ=first,
        μ=second,
        σy=YIELD,
        K=HARDENING,
        statevars=(1, (3, 3)),
    )
    body = felupe.SolidBody(metal, field)
    held = {"left": (0.0, None), "right": (7.0, None)}
    supports = {name: felupe.Boundary(field[0], fx=at, skip=(0, 1)) for name, (at, _) in held.items()}
    supports["bottom"] = felupe.Boundary(field[0], fy=-3.6)
    dof0, dof1 = felupe.dof.partition(field, supports)
    strip, shares = strip_load(points, cuts)
    load = felupe.PointLoad(field, strip)
    iterations = 0
    for increment in range(1, 11):
        force = np.zeros((len(strip), 2))
        force[:, 1] = -PRESSURE * increment / 10.0 * shares
        load.update(force)
        done = felupe.newtonraphson(items=[body, load], dof0=dof0, dof1=dof1, solver=spsolve, tol=1e-8, verbose=0)
        iterations += done.iterations
    settlement = -field[0].values[np.argmin(np.abs(points).sum(axis=1)), 1]
    return 2 * len(points), time.perf_counter() - begin, settlement, iterations, time.process_time() - used


dofs, wall, settlement, iterations, processor = solve(CUTS[sys.argv[1]])
report(f"FElupe {felupe.__version__} + PARDISO", dofs, wall, settlement, iterations, processor)
