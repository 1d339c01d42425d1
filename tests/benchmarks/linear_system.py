"""Stiffness and linear solve of 20,000 six-node triangles (81k unknowns), beside scikit-fem's form.

    python tests/benchmarks/linear_system.py [--across 100]

Medians of five in one run, seconds. The tangent is unsymmetric and differs from point to point.
"""

import argparse
from collections.abc import Callable
from importlib.util import find_spec

import numpy as np
import skfem
from scipy.sparse import csr_matrix
from timing import median_time

from fabfem.fem.assembly import find_pattern, stiffness
from fabfem.fem.box import box_mesh
from fabfem.fem.constraints import constrain
from fabfem.fem.kinematics import KINEMATICS
from fabfem.fem.linear import make_solver, norm
from fabfem.fem.reduction import Reduction
from fabfem.fem.space import Space, build_space
from fabfem.fem.supports import Support
from umat import Elastic, elastic_tangent, initial_state


def tangents(space: Space) -> np.ndarray:
    """Return unsymmetric tangents (points, 6, 6), one for each element."""
    elastic = elastic_tangent(Elastic(1e4, 0.3), initial_state(Elastic(1e4, 0.3), None, np.zeros((1, 6))))[0]
    random = np.random.default_rng(0).uniform(-0.02, 0.02, (len(space.mesh.cells), 6, 6))
    return np.repeat(elastic * (1.0 + random), space.nq, axis=0)


def by_form(space: Space, tangent: np.ndarray) -> Callable[[], csr_matrix]:
    """Return a function that assembles the same stiffness with scikit-fem."""
    corners = space.mesh.cells[:, :3]
    mesh = skfem.MeshTri(space.mesh.points[np.unique(corners)].T, np.searchsorted(np.unique(corners), corners).T)
    basis = skfem.Basis(mesh, skfem.ElementVector(skfem.ElementTriP2()), intorder=2)
    flat = np.ix_(range(len(corners)), (0, 1, 5), (0, 1, 5))
    d = np.ascontiguousarray(tangent.reshape(-1, space.nq, 6, 6)[:, 0][flat].transpose(1, 2, 0))[..., None]

    def strain(u: skfem.DiscreteField) -> tuple[np.ndarray, ...]:
        return u.grad[0, 0], u.grad[1, 1], (u.grad[0, 1] + u.grad[1, 0]) / 2**0.5

    @skfem.BilinearForm
    def form(u, v, w):
        e, t = strain(u), strain(v)
        return sum(t[i] * (d[i, 0] * e[0] + d[i, 1] * e[1] + d[i, 2] * e[2]) for i in range(3))

    return lambda: form.assemble(basis)


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--across", type=int, default=100)
    across = parser.parse_args().across
    space = build_space(box_mesh("triangle6", (across, across), (0.0, 0.0), (1.0, 1.0)), KINEMATICS["plane_strain"])
    tangent, pattern = tangents(space), find_pattern(space.dofs, space.ndof)
    theirs, tangent = by_form(space, tangent), space.kinematics.between(tangent)
    ours = stiffness(space, pattern, tangent)
    assert abs(norm(theirs().data) / norm(ours.data) - 1.0) < 1e-12
    print(f"{len(space.mesh.cells)} triangles, {space.ndof} unknowns\n\n| | seconds | ratio |\n|---|---|---|")
    fast, slow = median_time(lambda: stiffness(space, pattern, tangent)), median_time(theirs, 3)
    print(f"| stiffness on the fixed pattern | {fast:.4f} | 1 |")
    print(f"| the same by scikit-fem's form | {slow:.4f} | {slow / fast:.0f} |")
    constraints = constrain(space, (Support("bottom", "x"), Support("bottom", "y")))
    matrix = Reduction(space, constraints).stiffness(tangent)
    rhs = np.random.default_rng(1).normal(size=matrix.shape[0])
    for name in ("superlu", "pardiso"):
        if name == "pardiso" and find_spec("pypardiso") is None:
            continue
        solver = make_solver(name)

        def solve(solver=solver) -> None:
            solver.factor(matrix)
            assert solver.solve(rhs).ok

        taken = median_time(solve, 3)
        print(f"| factorisation and checked solve, {name} | {taken:.3f} | {taken / fast:.0f} |")


if __name__ == "__main__":
    main()
