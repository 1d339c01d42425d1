"""What elements can do: mean volume strain, patches, reduced integration, and the same answer from every kinematics."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.sparse import coo_matrix, csr_matrix
from scipy.sparse.linalg import spsolve

from fabfem.fem.assembly import find_pattern, stiffness
from fabfem.fem.box import box_mesh
from fabfem.fem.elements import ELEMENTS
from fabfem.fem.kinematics import KINEMATICS
from fabfem.fem.loads import Traction, nodal_force
from fabfem.fem.model import Controls, Model, Zone
from fabfem.fem.patches import patches
from fabfem.fem.solve import Increment, march
from fabfem.fem.space import Space, build_space
from fabfem.fem.stages import Stage
from fabfem.fem.supports import Support
from umat import Elastic, VonMises, elastic_tangent, initial_state, update

METAL = VonMises(1e4, 0.3, 30.0, 500.0)


def box_space(cell_type: str, kinematics: str, counts: tuple[int, ...], mean: bool, points: int | None = None) -> Space:
    """A box of these counts, its first corner at (1, 0, 0)."""
    lower = (1.0, *(0.0,) * (len(counts) - 1))
    mesh = box_mesh(cell_type, counts, lower, (2.0, *(1.0,) * (len(counts) - 1)))
    return build_space(mesh, replace(KINEMATICS[kinematics], mean_dilation=mean), points)


@pytest.mark.parametrize("kinematics", KINEMATICS)
@pytest.mark.parametrize("cell_type", ["triangle", "quad", "triangle6", "tetra", "hexahedron", "tetra10"])
def test_force_and_stiffness_belong_to_the_mean_strain(cell_type: str, kinematics: str) -> None:
    dim = KINEMATICS[kinematics].dim
    if ELEMENTS[cell_type].dim != dim:
        pytest.skip("another dimension")
    space = box_space(cell_type, kinematics, (3,) * dim, mean=True)
    random = np.random.default_rng(1)
    u, stress = random.normal(size=space.ndof), random.normal(size=(space.npoints, 6))
    work = (space.weights[:, None] * stress * space.strain(u)).sum()
    assert space.internal_force(stress) @ u == pytest.approx(work, rel=1e-12)
    tangent = random.normal(size=(space.npoints, 6, 6))
    matrix = stiffness(space, find_pattern(space.dofs, space.ndof), space.kinematics.between(tangent))
    force = space.internal_force((tangent @ space.strain(u)[:, :, None])[:, :, 0])
    np.testing.assert_allclose(matrix @ u, force, rtol=0, atol=1e-11 * np.abs(force).max())


def test_no_mean_costs_nothing() -> None:
    plain, mean = (box_space("triangle", "plane_strain", (4, 4), m) for m in (False, True))
    assert plain.dofs.shape[1] == 6
    assert plain.terms.shape[2:] == (3, 2)
    assert (mean.dofs.shape[1], mean.terms.shape[2:]) == (8, (4, 4))


@pytest.mark.parametrize(("cell_type", "sizes"), [("triangle", {2}), ("tetra", {6}), ("quad", {1}), ("tetra10", {1})])
def test_patches_of_a_box_have_the_sizes_of_its_element(cell_type: str, sizes: set[int]) -> None:
    dim = ELEMENTS[cell_type].dim
    found = np.bincount(patches(box_mesh(cell_type, (4,) * dim, (0.0,) * dim, (1.0,) * dim)))
    assert set(found.tolist()) == sizes


@pytest.mark.parametrize("cell_type", ["triangle", "tetra"])
def test_no_patch_crosses_a_zone_and_none_is_left_alone(cell_type: str) -> None:
    dim = ELEMENTS[cell_type].dim
    mesh = box_mesh(cell_type, (5,) * dim, (0.0,) * dim, (1.0,) * dim)
    rough = np.random.default_rng(4).permutation(len(mesh.cells))
    mesh = replace(mesh, cells=mesh.cells[rough])
    left = mesh.points[mesh.cells].mean(axis=1)[:, 0] < 0.4
    label = patches(replace(mesh, zones={"a": np.flatnonzero(left), "b": np.flatnonzero(~left)}))
    assert all(len(set(left[label == patch].tolist())) == 1 for patch in range(label.max() + 1))
    sizes = np.bincount(label)
    assert sizes.min() >= (2 if dim == 2 else 6)
    assert sizes.max() <= (4 if dim == 2 else 18)


RULES = [(name, n) for name, row in ELEMENTS.items() if row.dim > 1 for n in row.rules]


@pytest.mark.parametrize("mean", [False, True])
@pytest.mark.parametrize(("cell_type", "points"), RULES)
def test_no_deformation_of_a_mesh_is_without_energy(cell_type: str, points: int, mean: bool) -> None:
    dim = ELEMENTS[cell_type].dim
    space = box_space(cell_type, "plane_strain" if dim == 2 else "solid", (2,) * dim, mean, points)
    material = Elastic(1.0, 0.3)
    tangent = elastic_tangent(material, initial_state(material, None, np.zeros((space.npoints, 6))))
    matrix = stiffness(space, find_pattern(space.dofs, space.ndof), space.kinematics.between(tangent)).toarray()
    energies = np.linalg.eigvalsh(matrix)
    assert (energies < 1e-10 * energies.max()).sum() == (3 if dim == 2 else 6)


SLABS = [("quad8", "hexahedron20", False), ("quad", "hexahedron", True), ("quad9", "hexahedron27", True)]


@pytest.mark.parametrize(("flat", "thick", "mean"), SLABS)
def test_plane_strain_equals_a_slab(flat: str, thick: str, mean: bool) -> None:
    """One element of thickness held on both faces is plane strain."""
    plane = box_space(flat, "plane_strain", (4, 3), mean)
    slab = box_space(thick, "solid", (4, 1, 3), mean)
    pressed = (Support("left", "x"), Support("bottom", "y"), Support("top", "y", -0.02))
    held = (Support("left", "x"), Support("bottom", "z"), Support("top", "z", -0.02))
    faces = (Support("front", "y"), Support("back", "y"))
    a = marched(plane, pressed, (3.0, 5.0)).reshape(-1, 2)
    b = marched(slab, held + faces, (3.0, 0.0, 5.0)).reshape(-1, 3)
    at = matching(plane.mesh.points, slab.mesh.points[:, [0, 2]])
    np.testing.assert_allclose(b[:, [0, 2]], a[at], rtol=0, atol=1e-8 * 0.02)


def marched(space: Space, supports: tuple[Support, ...], push: tuple[float, ...]) -> np.ndarray:
    """(ndof,) displacement of a yielding body after four increments."""
    zone = Zone(METAL, None, initial_state(METAL, None, np.zeros((space.npoints, 6))), slice(None))
    stage = Stage("push", supports, (Traction("right", push),), first=0.25, largest=0.25)
    *_, last = march(Model(space, {"all": zone}, (stage,), Controls(tolerance=1e-12)))
    assert isinstance(last, Increment)
    plastic = last.states["all"].plastic_strain
    assert plastic.max() > 1e-3
    return last.displacement


def matching(flat: np.ndarray, places: np.ndarray) -> np.ndarray:
    """(n,) nodes of the flat mesh nearest to places (n, 2)."""
    return np.array([int(np.abs(flat - place).max(axis=1).argmin()) for place in places])


WEDGE = 1e-4
"""Angle between the wedge's planes; what a flat-sided wedge and a ring differ by goes with its square."""

RINGS = [
    ("quad8", "hexahedron20", False, "axisymmetric"),
    ("quad", "hexahedron", True, "axisymmetric"),
    ("quad8", "hexahedron20", False, "axisymmetric_torsion"),
    ("quad", "hexahedron", True, "axisymmetric_torsion"),
]


@pytest.mark.parametrize(("flat", "thick", "mean", "kinematics"), RINGS)
def test_a_ring_equals_a_wedge(flat: str, thick: str, mean: bool, kinematics: str) -> None:
    """A solid wedge moves by symmetry as its planes do: radially, along and, with torsion, around the axis."""
    ring = box_space(flat, kinematics, (4, 3), mean)
    ncomp = len(ring.components)
    turning = (Support("bottom", "theta"), Support("top", "theta", 0.03)) if ncomp == 3 else ()
    pressed = (Support("bottom", "z"), Support("top", "z", -0.02), *turning)
    push = (3.0, 5.0, 1.0)[:ncomp]
    wedge = wedge_space(thick, mean)
    a = marched(ring, pressed, push)
    b = marched_as_ring(wedge, tie(ring, wedge), ring, pressed, push)
    np.testing.assert_allclose(b, a, rtol=0, atol=1e-8 * 0.02)


def wedge_space(cell_type: str, mean: bool) -> Space:
    """One element between planes at ± half the angle, mesh axes (r, θ, z) turned into x, y, z."""
    mesh = box_mesh(cell_type, (4, 1, 3), (1.0, -1.0, 0.0), (2.0, 1.0, 1.0))
    r, across, z = mesh.points.T
    places = np.stack([r * np.cos(0.5 * WEDGE), across * r * np.sin(0.5 * WEDGE), z], axis=1)
    return build_space(replace(mesh, points=places), replace(KINEMATICS["solid"], mean_dilation=mean))


def tie(ring: Space, wedge: Space) -> csr_matrix:
    """(ndof of the wedge, ndof of the ring): displacement of the wedge's nodes by that of the ring's."""
    x, y, z = wedge.mesh.points.T
    node = matching(ring.mesh.points, np.stack([np.hypot(x, y), z], axis=1))
    angle, number, ncomp = np.arctan2(y, x), np.arange(len(x)), len(ring.components)
    entries = [(0, 0, np.cos(angle)), (1, 0, np.sin(angle)), (2, 1, np.ones(len(x)))]
    if ncomp == 3:
        entries += [(0, 2, -np.sin(angle)), (1, 2, np.cos(angle))]
    rows = np.concatenate([3 * number + i for i, _, _ in entries])
    columns = np.concatenate([ncomp * node + j for _, j, _ in entries])
    values = np.concatenate([value for *_, value in entries])
    return coo_matrix((values, (rows, columns)), shape=(wedge.ndof, ring.ndof)).tocsr()


def marched_as_ring(
    wedge: Space, tied: csr_matrix, ring: Space, supports: tuple[Support, ...], push: tuple[float, ...]
) -> np.ndarray:
    """(ndof of the ring,) displacement after four increments, forces and stiffness the wedge's."""
    share = 2.0 * np.pi / WEDGE
    moved = {int(d): s.displacement for s in supports for d in ring.dofs_on(s.boundary, s.component)}
    held = np.array(sorted(moved))
    free = np.setdiff1d(np.arange(ring.ndof), held)
    load, pattern = nodal_force(Traction("right", push), ring), find_pattern(wedge.dofs, wedge.ndof)
    old, total = initial_state(METAL, None, np.zeros((wedge.npoints, 6))), np.zeros(ring.ndof)
    step = np.zeros(ring.ndof)
    step[held] = [0.25 * moved[d] for d in held]
    fixed = np.isin(np.arange(ring.ndof), held)
    tangent = elastic_tangent(METAL, old)
    for quarter in range(1, 5):
        new, trial = old, np.zeros(ring.ndof)
        for _ in range(20):
            left = 0.25 * quarter * load - share * (tied.T @ wedge.internal_force(new.stress))
            if trial.any() and np.linalg.norm(left[free]) < 1e-12 * np.linalg.norm(left):
                break
            matrix = share * (tied.T @ stiffness(wedge, pattern, wedge.kinematics.between(tangent)) @ tied).tocsc()
            ahead = step - trial  # the held dofs move in the first, linear, correction
            ahead[free] = spsolve(matrix[free][:, free], (left - matrix @ np.where(fixed, ahead, 0.0))[free])
            trial = trial + ahead
            answer = update(METAL, None, wedge.strain(tied @ trial), old)
            new, tangent = answer.state, answer.tangent
        total, old = total + trial, new
    return total
