"""Manufactured solutions: the error of every element under every kinematics falls at the order of its polynomials.

The displacement u_i = sin(k_i·x + φ_i) fulfils equilibrium with the body force −(λ + μ) ∇(∇·u) − μ Δu, in cylindrical
coordinates where there is an axis. It is given on the whole boundary; meshes are smoothly distorted, each twice as fine
as the one before. With polynomials of degree k the error is of order k + 1 in u and k in the strain.
"""

from collections.abc import Iterator
from dataclasses import replace
from time import perf_counter
from typing import NamedTuple

import numpy as np

from fabfem.fem.box import box_mesh
from fabfem.fem.constraints import Constraints
from fabfem.fem.elements import ELEMENTS
from fabfem.fem.kinematics import KINEMATICS, Kinematics
from fabfem.fem.linear import make_solver
from fabfem.fem.mesh import Mesh, quadratic
from fabfem.fem.reduction import Reduction
from fabfem.fem.space import Space, build_space
from fabfem.verification.row import Row
from umat import Elastic, elastic_tangent, initial_state
from umat.elastic import bulk_modulus, shear_modulus

MATERIAL = Elastic(1.0, 0.3)
WAVES = np.array([[1.1, 0.7, 0.5], [-0.6, 1.3, 0.8], [0.9, -0.5, 1.2]])
"""Wave vector (k) of each component."""
PHASES = np.array([0.3, 1.1, 0.7])
CELLS = {(2, 1): 16, (2, 2): 6, (3, 1): 8, (3, 2): 3}
"""(dimension, degree) -> cells along each axis of the coarser mesh."""


class Errors(NamedTuple):
    """Root mean square errors of displacement and strain, relative to the exact ones."""

    displacement: float
    strain: float


def degree(cell_type: str) -> int:
    """Return the degree (k) of the polynomials that an element holds."""
    return 2 if ELEMENTS[cell_type].linear else 1


def rows() -> Iterator[Row]:
    """Yield the orders of every element under every kinematics; linear ones with a mean volume strain."""
    for kinematics, table in KINEMATICS.items():
        for cell_type, element in ELEMENTS.items():
            if element.dim == table.dim:
                yield from orders(cell_type, kinematics)


def orders(cell_type: str, kinematics: str, mean: bool | None = None) -> Iterator[Row]:
    """Yield the orders at which displacement and strain converge."""
    k, start = degree(cell_type), perf_counter()
    table = replace(KINEMATICS[kinematics], mean_dilation=k == 1 if mean is None else mean)
    cells = CELLS[table.dim, k]
    coarse, fine = (errors(cell_type, table, n) for n in (cells, 2 * cells))
    rate = np.log2(np.array(coarse) / np.array(fine))
    note = f"error {fine.displacement:.1e} with {2 * cells} cells"
    yield Row(f"order of u, {cell_type}, {kinematics}", k + 1, float(rate[0]), 0.05, perf_counter() - start, note)
    yield Row(f"order of strain, {cell_type}, {kinematics}", k, float(rate[1]), 0.05, 0.0, f"error {fine.strain:.1e}")


def errors(cell_type: str, kinematics: Kinematics, cells: int) -> Errors:
    """Return the errors on a mesh of `cells` cells along each axis."""
    mesh = _mesh(cell_type, cells)
    space = build_space(mesh, kinematics)
    sharp = build_space(mesh, replace(kinematics, mean_dilation=False), max(mesh.element.rules))
    u = _solution(space, sharp)
    exact, gradient = _field(sharp.points, kinematics)
    values = np.einsum("qa,eac->eqc", sharp.values, u.reshape(len(mesh.points), -1)[mesh.cells])
    return Errors(
        _relative(sharp.weights, values.reshape(exact.shape) - exact, exact),
        _relative(sharp.weights, sharp.strain(u) - gradient, gradient),
    )


def _mesh(cell_type: str, cells: int) -> Mesh:
    """A distorted unit box, one length away from the axis."""
    element = ELEMENTS[cell_type]
    dim, linear = element.dim, element.linear or cell_type
    mesh = box_mesh(linear, (cells,) * dim, (0.0,) * dim, (1.0,) * dim)
    wave = 0.06 * np.sin(np.pi * mesh.points).prod(axis=1)
    mesh = replace(mesh, points=mesh.points + wave[:, None] * np.array([1.0, -0.8, 0.6])[:dim] + np.eye(dim)[0])
    return mesh if cell_type == linear else quadratic(mesh, cell_type)


def _solution(space: Space, sharp: Space) -> np.ndarray:
    """The (ndof,) displacement under the body force, integrated with the rule of `sharp`."""
    state = initial_state(MATERIAL, None, np.zeros((space.npoints, 6)))
    tangent = elastic_tangent(MATERIAL, state)
    u = _field(space.mesh.points, space.kinematics)[0].ravel()
    edge = np.unique(np.concatenate([facets.ravel() for facets in space.mesh.boundaries.values()]))
    ncomp = len(space.components)
    held = (edge[:, None] * ncomp + np.arange(ncomp)).ravel()
    free = np.setdiff1d(np.arange(space.ndof), held)
    given = np.zeros(space.ndof)
    given[held] = u[held]
    moved = space.internal_force((tangent @ space.strain(given)[:, :, None])[:, :, 0])
    solver, none = make_solver(symmetric=True), np.zeros(0, int)
    constraints = Constraints(free, np.zeros(space.ndof), none, np.zeros((0, 0)))
    solver.factor(Reduction(space, constraints, solver.triangle).stiffness(space.kinematics.between(tangent)))
    given[free] = solver.solve((_body_force(sharp) - moved)[free]).x
    return given


def _field(x: np.ndarray, kinematics: Kinematics) -> tuple[np.ndarray, np.ndarray]:
    """Exact displacement (n, ncomp) and Mandel strain (n, 6), compression positive, at places x (n, dim)."""
    ncomp, dim = len(kinematics.components), kinematics.dim
    phase = x @ WAVES[:ncomp, :dim].T + PHASES[:ncomp]
    u = np.sin(phase)
    terms = np.cos(phase)[:, :, None] * WAVES[:ncomp, :dim]
    if kinematics.radial:
        terms = np.concatenate([terms, (u / x[:, :1])[:, :, None]], axis=2)
    operator = replace(kinematics, mean_dilation=False).operator
    return u, np.einsum("kct,nct->nk", operator, terms)


def _body_force(space: Space) -> np.ndarray:
    """The (ndof,) nodal forces of the body force."""
    mesh, ncomp = space.mesh, len(space.components)
    density = (_density(space.points, space.kinematics) * space.weights[:, None]).reshape(-1, space.nq, ncomp)
    shares = np.einsum("eqc,qa->eac", density, space.values)
    dofs = mesh.cells[:, :, None] * ncomp + np.arange(ncomp)
    return np.bincount(dofs.ravel(), shares.ravel(), space.ndof)


def _density(x: np.ndarray, kinematics: Kinematics) -> np.ndarray:
    """(n, ncomp) force per volume that the field needs."""
    ncomp, dim = len(kinematics.components), kinematics.dim
    waves = WAVES[:ncomp, :dim]
    phase = x @ waves.T + PHASES[:ncomp]
    sine, cosine = np.sin(phase), np.cos(phase)
    of_volume = -np.einsum("nc,cc,cj->nj", sine[:, :dim], waves[:dim], waves[:dim])
    laplacian = -sine * (waves**2).sum(axis=1)
    if kinematics.radial:
        r = x[:, 0]
        of_volume += cosine[:, :1] * waves[0] / r[:, None]
        of_volume[:, 0] -= sine[:, 0] / r**2
        laplacian += cosine * waves[:, 0] / r[:, None]
        laplacian[:, ::2] -= sine[:, ::2] / r[:, None] ** 2
    shear = shear_modulus(*MATERIAL)
    force = -shear * laplacian
    force[:, :dim] -= (bulk_modulus(*MATERIAL) + shear / 3.0) * of_volume
    return force


def _relative(weights: np.ndarray, error: np.ndarray, exact: np.ndarray) -> float:
    """Root of the integral of a squared error over that of the exact field."""
    return float(np.sqrt((weights @ error**2).sum() / (weights @ exact**2).sum()))
