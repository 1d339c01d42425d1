"""The strip footing of the comparison by scikit-fem, as its examples do: forms in numpy, scipy's SuperLU.

python tests/benchmarks/peers/skfem_run.py 81k
"""

import sys
import time

import numpy as np
import skfem
from grid import CUTS, PRESSURE, report, returned, triangles
from skfem.helpers import grad


def strain(u):
    """Return xx, yy and the doubled xy of a displacement."""
    return np.array([grad(u)[0, 0], grad(u)[1, 1], grad(u)[0, 1] + grad(u)[1, 0]])


@skfem.BilinearForm
def stiffness(u, v, w):
    """The stiffness of the tangent `w.d` (3, 3, nel, nq)."""
    return np.einsum("i...,ij...,j...->...", strain(v), np.asarray(w.d), strain(u))


@skfem.LinearForm
def internal(v, w):
    """The forces of the stress `w.s` (3, nel, nq)."""
    return np.einsum("i...,i...->...", strain(v), np.asarray(w.s))


@skfem.LinearForm
def external(v, w):
    """The forces of the strip pressure."""
    return -PRESSURE * v[1]


def solve(cuts):
    """Return unknowns, seconds, settlement, iterations and seconds of processor time."""
    begin, used = time.perf_counter(), time.process_time()
    points, cells = triangles(cuts)
    mesh = skfem.MeshTri(points.T.copy(), cells.T.copy())
    basis = skfem.Basis(mesh, skfem.ElementVector(skfem.ElementTriP2()), intorder=2)
    strip = mesh.facets_satisfying(lambda x: np.isclose(x[1], 0.0) & (x[0] < 1.0))
    load = external.assemble(basis.boundary(strip))
    held = [basis.get_dofs(lambda x, end=end: np.isclose(x[0], end)).all(["u^1"]) for end in (0.0, 7.0)]
    held.append(basis.get_dofs(lambda x: np.isclose(x[1], -3.6)).all())
    fixed = np.unique(np.concatenate(held))
    shape = (mesh.nelements, len(basis.W))
    old, plastic, total, iterations = np.zeros((np.prod(shape), 4)), np.zeros(np.prod(shape)), basis.zeros(), 0
    for increment in range(1, 11):
        step = basis.zeros()
        for _ in range(30):
            moved = strain(basis.interpolate(step)).reshape(3, -1).T
            new, slipped, moduli = returned(old, plastic, moved)
            force = internal.assemble(basis, s=new[:, [0, 1, 3]].T.reshape(3, *shape))
            left = increment / 10.0 * load - force
            scale = max(np.linalg.norm(force), np.linalg.norm(load) * increment / 10.0)
            left[fixed] = 0.0
            if np.linalg.norm(left) <= 1e-8 * scale:
                break
            matrix = stiffness.assemble(basis, d=moduli.transpose(1, 2, 0).reshape(3, 3, *shape))
            step += skfem.solve(*skfem.condense(matrix, left, D=fixed))
            iterations += 1
        else:
            raise SystemExit(f"no equilibrium in increment {increment}")
        old, plastic, total = new, slipped, total + step
    wall, used = time.perf_counter() - begin, time.process_time() - used
    centre = basis.nodal_dofs[1, np.argmin(np.abs(mesh.p).sum(axis=0))]
    return int(basis.N), wall, -total[centre], iterations, used


solve(1)
dofs, wall, settlement, iterations, processor = solve(CUTS[sys.argv[1]])
report(f"scikit-fem {skfem.__version__} + SuperLU", dofs, wall, settlement, iterations, processor)
