"""The compiled assembly gives the matrices and vectors that scikit-fem's own forms give."""

import numpy as np
import pytest
import skfem
from scipy.sparse import csr_matrix

from fabfem.fem.assembly import diagonal, find_pattern, stiffness
from fabfem.fem.box import box_mesh
from fabfem.fem.constraints import Constraints, constrain
from fabfem.fem.kinematics import KINEMATICS
from fabfem.fem.linear import whole as mirrored
from fabfem.fem.loads import Gravity, Pressure, Traction, nodal_force
from fabfem.fem.reduction import Reduction
from fabfem.fem.space import Space, build_space
from fabfem.fem.supports import RigidBody, Support
from umat.mandel import from_tensor

FORMS = {
    "triangle": ("plane_strain", skfem.MeshTri, skfem.ElementTriP1, 2, 3),
    "triangle6": ("plane_strain", skfem.MeshTri, skfem.ElementTriP2, 2, 3),
    "triangle6 round": ("axisymmetric", skfem.MeshTri, skfem.ElementTriP2, 2, 3),
    "triangle6 twisted": ("axisymmetric_torsion", skfem.MeshTri, skfem.ElementTriP2, 2, 3),
    "quad8": ("plane_strain", skfem.MeshQuad, skfem.ElementQuadS2, 3, 4),
    "quad9 round": ("axisymmetric", skfem.MeshQuad, skfem.ElementQuad2, 5, 9),
    "tetra10": ("solid", skfem.MeshTet, skfem.ElementTetP2, 2, 4),
    "hexahedron20": ("solid", skfem.MeshHex, skfem.ElementHexS2, 3, 8),
    "hexahedron27": ("solid", skfem.MeshHex, skfem.ElementHex2, 5, 27),
}
"""Kinematics, and scikit-fem's mesh, element, quadrature order and points."""


def strain_of(kinematics, field, x):
    """Mandel strain (compression positive) of a scikit-fem field, (6, ...)."""
    h = np.zeros((3, 3, *x.shape[1:]))
    h[: field.grad.shape[0], : field.grad.shape[1]] = field.grad
    if kinematics.radial:
        h[2, 2] = field[0] / x[0]
    if len(kinematics.components) == 3 and kinematics.dim == 2:
        h[0, 2] = -field[2] / x[0]
    return -np.moveaxis(from_tensor(np.moveaxis(h, (0, 1), (-2, -1))), -1, 0)


def their_basis(space: Space, mesh_class, element, order: int) -> skfem.Basis:
    """scikit-fem's basis on the same corners; its hexahedra list them in the order of its reference element."""
    linear = space.mesh.cells[:, : len(space.mesh.element.corners)]
    corners = np.array(space.mesh.element.corners)
    wanted = np.array(mesh_class.elem().doflocs)
    pick = [int(np.flatnonzero((corners == x).all(axis=1))[0]) for x in wanted]
    used, new = np.unique(linear, return_inverse=True)
    mesh = mesh_class(space.mesh.points[used].T.copy(), new.reshape(linear.shape)[:, pick].T.copy())
    return skfem.Basis(mesh, skfem.ElementVector(element(), len(space.components)), intorder=order)


def numbering(space: Space, basis: skfem.Basis) -> np.ndarray:
    """For each of scikit-fem's dofs, ours: the same place, the same component (they cycle locally)."""
    ncomp = len(space.components)
    place = np.round(basis.doflocs.T, 9)
    order = np.lexsort(place.T)
    ours = np.lexsort(np.round(space.mesh.points, 9).T)
    result = np.empty(basis.N, int)
    result[order] = np.repeat(ours, ncomp) * ncomp
    assert np.abs(basis.doflocs.T - space.mesh.points[result // ncomp]).max() < 1e-9
    for component in range(ncomp):
        result[np.unique(basis.element_dofs[component::ncomp])] += component
    return result


def case(name: str) -> tuple[Space, skfem.Basis]:
    kinematics, mesh_class, element, order, points = FORMS[name]
    dim = KINEMATICS[kinematics].dim
    mesh = box_mesh(name.split()[0], (3, 2, 2)[:dim], (0.5, 0.0, 0.0)[:dim], (2.0, 1.0, 0.7)[:dim])
    space = build_space(mesh, KINEMATICS[kinematics], points)
    return space, their_basis(space, mesh_class, element, order)


@pytest.mark.parametrize("name", FORMS)
def test_stiffness_equals_that_of_a_form(name: str) -> None:
    space, basis = case(name)
    per_element = np.random.default_rng(3).uniform(-1.0, 1.0, (len(space.mesh.cells), 6, 6))
    tangent = np.repeat(per_element, space.nq, axis=0)

    @skfem.BilinearForm
    def form(u, v, w):
        volume = 2.0 * np.pi * w.x[0] if space.kinematics.radial else 1.0
        stress = np.einsum("eij,jeq->ieq", per_element, strain_of(space.kinematics, u, w.x))
        return volume * np.einsum("ieq,ieq->eq", strain_of(space.kinematics, v, w.x), stress)

    theirs = form.assemble(basis).tocoo()
    to_ours = numbering(space, basis)
    expected = csr_matrix((theirs.data, (to_ours[theirs.row], to_ours[theirs.col])), shape=theirs.shape)
    got = stiffness(space, find_pattern(space.dofs, space.ndof), space.kinematics.between(tangent))
    assert abs(got - expected).max() < 1e-12 * abs(expected).max()


def spread(constraints: Constraints, ndof: int) -> np.ndarray:
    """The matrix T of u = T v, a column for each unknown."""
    return np.stack([constraints.spread(unit) for unit in np.eye(constraints.nunknowns)], axis=1).reshape(ndof, -1)


@pytest.mark.parametrize("triangle", [False, True])
@pytest.mark.parametrize("bodies", [(), (RigidBody("top", ("x", "y"), (1.0, 1.0)),)], ids=["free", "rigid body"])
@pytest.mark.parametrize("name", ["triangle6", "quad8"])
def test_the_stiffness_of_the_unknowns_is_that_of_all_dofs_reduced(name: str, bodies: tuple, triangle: bool) -> None:
    space, _ = case(name)
    tangent = np.random.default_rng(5).uniform(-1.0, 1.0, (space.npoints, 6, 6))
    tangent = space.kinematics.between(tangent + tangent.transpose(0, 2, 1) if triangle else tangent)
    held = [Support("bottom", "x"), Support("bottom", "y"), Support("left", "x")]
    constraints = constrain(space, held[:2] if bodies else held, bodies)
    pattern = find_pattern(space.dofs, space.ndof)
    whole = stiffness(space, pattern, tangent).toarray()
    transfer = spread(constraints, space.ndof)
    expected = transfer.T @ whole @ transfer
    size = np.abs(expected).max()
    kinds = [Reduction(space, constraints, triangle, pattern)]
    kinds += [] if bodies else [Reduction(space, constraints, triangle)]
    for reduction in kinds:
        got = reduction.stiffness(tangent)
        assert got.has_canonical_format
        np.testing.assert_allclose(got.toarray(), np.triu(expected) if triangle else expected, atol=1e-13 * size)
        np.testing.assert_allclose(mirrored(got, triangle).toarray(), expected, atol=1e-13 * size)
    np.testing.assert_allclose(diagonal(space, tangent), whole.diagonal(), atol=1e-13 * size)
    assert kinds[0].same(Reduction(space, constrain(space, held[:2] if bodies else held, bodies), triangle, pattern))
    assert not kinds[0].same(Reduction(space, constraints, not triangle, pattern))


@pytest.mark.parametrize("name", FORMS)
def test_loads_equal_those_of_forms(name: str) -> None:
    space, basis = case(name)
    dim, ncomp = space.mesh.dim, len(space.components)
    to_ours = numbering(space, basis)
    round_ = space.kinematics.radial

    def volume(w):
        return 2.0 * np.pi * w.x[0] if round_ else 1.0

    weight = skfem.LinearForm(lambda v, w: -15.0 * v[dim - 1] * volume(w)).assemble(basis)
    np.testing.assert_allclose(nodal_force(Gravity({"all": 15.0}), space)[to_ours], weight, atol=1e-12)
    facets = basis.mesh.facets_satisfying(lambda x: np.isclose(x[0], 2.0))
    side = skfem.FacetBasis(basis.mesh, basis.elem, facets=facets, intorder=6)
    push = skfem.LinearForm(lambda v, w: -3.0 * sum(v[i] * w.n[i] for i in range(dim)) * volume(w)).assemble(side)
    np.testing.assert_allclose(nodal_force(Pressure("right", 3.0), space)[to_ours], push, atol=1e-12)
    traction = tuple(np.arange(1.0, ncomp + 1.0))
    drag = skfem.LinearForm(lambda v, w: sum(v[i] * traction[i] for i in range(ncomp)) * volume(w)).assemble(side)
    np.testing.assert_allclose(nodal_force(Traction("right", traction), space)[to_ours], drag, atol=1e-12)


def test_internal_force_is_the_transpose_of_strain() -> None:
    space, _ = case("triangle6 twisted")
    random = np.random.default_rng(4)
    u, stress = random.normal(size=space.ndof), random.normal(size=(space.npoints, 6))
    work = np.einsum("p,pi,pi->", space.weights, space.strain(u), stress)
    assert u @ space.internal_force(stress) == pytest.approx(work, rel=1e-12)


def test_pattern_stays_where_entries_vanish() -> None:
    space, _ = case("triangle6")
    pattern = find_pattern(space.dofs, space.ndof)
    matrix = stiffness(space, pattern, np.zeros((space.npoints, 3, 3)))
    assert matrix.nnz == len(pattern.indices)
    assert np.shares_memory(matrix.indices, pattern.indices)
    full = stiffness(space, pattern, np.broadcast_to(np.eye(3), (space.npoints, 3, 3)))
    assert np.array_equal(full.indices, matrix.indices)


def test_means_and_smoothing_keep_linear_fields() -> None:
    space, _ = case("quad8")
    values = 1.0 + space.points @ [2.0, -3.0]
    np.testing.assert_allclose(space.nodal(values), 1.0 + space.mesh.points @ [2.0, -3.0], atol=1e-12)
    centres = space.mesh.points[space.mesh.cells[:, :4]].mean(axis=1)
    np.testing.assert_allclose(space.cell_mean(np.stack([values] * 2, axis=1))[:, 1], 1.0 + centres @ [2.0, -3.0])


def test_bounded_smoothing_stays_within_the_points_around_a_node() -> None:
    space, _ = case("quad8")
    values = np.where(np.arange(space.npoints) == 0, 1.0, 0.0)
    assert space.nodal(values).min() < -0.1
    bounded = space.nodal_within(values)
    assert bounded.min() == 0.0 < bounded.max() <= 1.0
    smooth = 1.0 + 0.1 * space.points @ [2.0, -3.0]
    inner = np.ptp(space.nodal(smooth)) / len(space.mesh.cells) ** 0.5
    np.testing.assert_allclose(space.nodal_within(smooth), space.nodal(smooth), atol=inner)
