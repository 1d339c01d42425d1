"""Every element under every kinematics, on distorted meshes: linear fields are exact, rigid motion does nothing.

A new element or kinematics enters by its table in the package, a new material by a row of `MATERIALS`.
"""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.sparse.linalg import spsolve

from fabfem.fem.assembly import find_pattern, stiffness
from fabfem.fem.box import SIDES, box_mesh
from fabfem.fem.elements import ELEMENTS, quadrature, shape
from fabfem.fem.facets import outer_facets
from fabfem.fem.kinematics import KINEMATICS
from fabfem.fem.mesh import Mesh, quadratic
from fabfem.fem.model import Controls, Model, Zone
from fabfem.fem.patches import patches
from fabfem.fem.solve import Increment, march
from fabfem.fem.space import Space, build_space
from fabfem.fem.stages import Stage
from fabfem.fem.supports import Support
from umat import DruckerPrager, Elastic, MohrCoulomb, VonMises, elastic_tangent, initial_state, update
from umat.directions import directions
from umat.mandel import from_tensor
from umat.sands import toyoura

SOLIDS = [(e, "solid", n, False) for e, row in ELEMENTS.items() if row.dim == 3 for n in row.rules]
FLAT = [
    (e, k, n, False)
    for e, row in ELEMENTS.items()
    if row.dim == 2
    for k in ("plane_strain", "axisymmetric", "axisymmetric_torsion")
    for n in row.rules
]
MEAN = [
    (e, k, next(iter(row.rules)), True)
    for e, row in ELEMENTS.items()
    for k, table in KINEMATICS.items()
    if table.dim == row.dim
]
every_space = pytest.mark.parametrize(("cell_type", "kinematics", "points", "mean"), FLAT + SOLIDS + MEAN)

HOMOGENEOUS = {
    "plane_strain": [[1.0, 0.3], [-0.2, 0.7]],
    "axisymmetric": [[0.4, 0.0], [0.0, -0.9]],
    "axisymmetric_torsion": [[0.4, 0.0], [0.0, -0.9], [0.3, 0.0]],
    "solid": [[1.0, 0.3, -0.1], [-0.2, 0.7, 0.4], [0.6, 0.1, -0.5]],
}
"""Displacement gradients whose stress, in an isotropic material, is in equilibrium without body force."""

SAND = (toyoura(), directions("bazant_oh_37"), {"void_ratio": 0.75, "fabric": [-0.08, 0.16, -0.08, 0, 0, 0]})
MATERIALS = {
    "elastic": (Elastic(1e4, 0.3), None, {}),
    "von_mises": (VonMises(1e4, 0.3, 60.0, 500.0), None, {}),
    "drucker_prager": (DruckerPrager(1e4, 0.3, friction_slope=1.0, dilation_slope=0.3, strength=10.0), None, {}),
    "mohr_coulomb": (MohrCoulomb(1e4, 0.3, cohesion=5.0, friction_angle=30.0, dilation_angle=10.0), None, {}),
    "chang_hicher": SAND,
}
"""Material, directions, what its initial state needs besides an isotropic 100 kPa."""


def distorted(cell_type: str, seed: int = 1) -> Mesh:
    """A box away from the axis, its inner nodes moved."""
    element = ELEMENTS[cell_type]
    dim, linear = element.dim, element.linear or cell_type
    mesh = box_mesh(linear, (3, 3, 2)[:dim], (1.0, 0.0, 0.0)[:dim], (2.0, 1.5, 1.0)[:dim])
    inner = np.setdiff1d(np.arange(len(mesh.points)), np.concatenate([b.ravel() for b in mesh.boundaries.values()]))
    points = mesh.points.copy()
    points[inner] += 0.08 * np.random.default_rng(seed).uniform(-1.0, 1.0, (len(inner), dim))
    mesh = replace(mesh, points=points)
    return mesh if cell_type == linear else quadratic(mesh, cell_type)


def space_of(cell_type: str, kinematics: str, points: int | None, mean: bool) -> Space:
    return build_space(distorted(cell_type), replace(KINEMATICS[kinematics], mean_dilation=mean), points)


def linear_field(space: Space, gradient: np.ndarray) -> np.ndarray:
    return (space.mesh.points @ np.asarray(gradient).T).ravel()


def exact_strain(space: Space, gradient: np.ndarray) -> np.ndarray:
    """The strain of a linear field, written out in cylindrical coordinates where there is an axis."""
    full = np.zeros((space.npoints, 3, 3))
    full[:, : gradient.shape[0], : gradient.shape[1]] = gradient
    if space.kinematics.radial:
        radius = space.points[:, 0]
        u = space.points @ gradient.T
        full[:, 2, 2] = u[:, 0] / radius
        if gradient.shape[0] == 3:
            full[:, 0, 2] = -u[:, 2] / radius
    return -from_tensor(full)


@every_space
def test_strain_of_a_linear_field_is_exact(cell_type: str, kinematics: str, points: int, mean: bool) -> None:
    space = space_of(cell_type, kinematics, points, mean)
    gradient = np.random.default_rng(2).uniform(-1.0, 1.0, (len(space.components), space.mesh.dim))
    strain = space.strain(linear_field(space, gradient))
    exact = exact_strain(space, gradient)
    if mean:
        exact[:, :3] += ((patch_mean(space, exact[:, :3].sum(axis=1)) - exact[:, :3].sum(axis=1)) / 3.0)[:, None]
    np.testing.assert_allclose(strain, exact, rtol=0, atol=1e-12)


def patch_mean(space: Space, values: np.ndarray) -> np.ndarray:
    """(npoints,) volume means over each point's patch of elements."""
    label = np.repeat(patches(space.mesh), space.nq)
    return (np.bincount(label, values * space.weights) / np.bincount(label, space.weights))[label]


@every_space
def test_rigid_motion_makes_no_strain(cell_type: str, kinematics: str, points: int, mean: bool) -> None:
    space = space_of(cell_type, kinematics, points, mean)
    for mode in space.kinematics.modes(space.mesh.points):
        np.testing.assert_allclose(space.strain(mode.ravel()), 0.0, atol=1e-12)


@every_space
def test_patch_of_constant_strain(cell_type: str, kinematics: str, points: int, mean: bool) -> None:
    """Held on its boundary by a linear field, an elastic patch takes that field inside."""
    space = space_of(cell_type, kinematics, points, mean)
    exact = linear_field(space, np.array(HOMOGENEOUS[kinematics]))
    ncomp = len(space.components)
    nodes = np.unique(np.concatenate([b.ravel() for b in space.mesh.boundaries.values()]))
    held = (nodes[:, None] * ncomp + np.arange(ncomp)).ravel()
    free = np.setdiff1d(np.arange(space.ndof), held)
    tangent = np.broadcast_to(elastic_of(MATERIALS["elastic"][0]), (space.npoints, 6, 6))
    matrix = stiffness(space, find_pattern(space.dofs, space.ndof), space.kinematics.between(tangent)).tocsc()
    u = np.where(np.isin(np.arange(space.ndof), held), exact, 0.0)
    u[free] = spsolve(matrix[free][:, free], -(matrix @ u)[free])
    np.testing.assert_allclose(u, exact, rtol=0, atol=1e-12)


@every_space
def test_patch_of_sliding_contacts(cell_type: str, kinematics: str, points: int, mean: bool) -> None:
    """The same with the enhanced Chang–Hicher model, sliding, by Newton from a disturbed field."""
    material, rule, needs = SAND
    space = space_of(cell_type, kinematics, points, mean)
    gradient = -5e-4 * np.array(HOMOGENEOUS[kinematics])
    exact = linear_field(space, gradient)
    ncomp = len(space.components)
    nodes = np.unique(np.concatenate([b.ravel() for b in space.mesh.boundaries.values()]))
    free = np.setdiff1d(np.arange(space.ndof), (nodes[:, None] * ncomp + np.arange(ncomp)).ravel())
    pattern, old = find_pattern(space.dofs, space.ndof), start(space.npoints, *SAND)
    u = exact.copy()
    u[free] += 1e-5 * np.random.default_rng(3).uniform(-1.0, 1.0, len(free))
    for _ in range(12):
        answer = update(material, rule, space.strain(u), old)
        assert not answer.status.any()
        force = space.internal_force(answer.stress)
        matrix = stiffness(space, pattern, space.kinematics.between(answer.tangent)).tocsc()
        u[free] -= spsolve(matrix[free][:, free], force[free])
    np.testing.assert_allclose(u, exact, rtol=0, atol=1e-12)
    alone = update(material, rule, exact_strain(space, gradient)[:1], start(1, *SAND))
    assert (alone.state.slip > old.slip[0]).sum() > 5
    np.testing.assert_allclose(answer.stress, np.broadcast_to(alone.stress, answer.stress.shape), atol=1e-8)
    assert needs["void_ratio"] != alone.state.void_ratio[0]


@every_space
def test_constant_stress_is_in_balance_inside(cell_type: str, kinematics: str, points: int, mean: bool) -> None:
    space = space_of(cell_type, kinematics, points, mean)
    stress = np.tile(
        [3.0, 2.0, 3.0, 0.0, 0.0, 0.0] if space.kinematics.radial else [3.0, 2.0, 1.0, 0.4, 0.5, 0.6],
        (space.npoints, 1),
    )
    force = space.internal_force(stress).reshape(len(space.mesh.points), -1)
    outer = np.unique(np.concatenate([b.ravel() for b in space.mesh.boundaries.values()]))
    np.testing.assert_allclose(np.delete(force, outer, axis=0), 0.0, atol=1e-12)


def elastic_of(material: Elastic) -> np.ndarray:
    return elastic_tangent(material, initial_state(material, None, np.zeros((1, 6))))[0]


def run(model: Model) -> list[Increment]:
    steps = list(march(model))
    assert all(isinstance(step, Increment) for step in steps), steps[-1]
    return steps


COMPRESSIONS = [
    ("triangle6", "plane_strain", ("left", "bottom"), {"right": 0.003, "top": -0.01}),
    ("quad8", "axisymmetric", ("bottom",), {"right": 0.003, "top": -0.01}),
    ("quad9", "axisymmetric_torsion", ("bottom",), {"right": 0.003, "top": -0.01}),
    ("hexahedron20", "solid", ("left", "front", "bottom"), {"right": 0.003, "back": 0.002, "top": -0.01}),
]
"""Element, kinematics, sides of a unit box that are fixed along their normals, and those that are moved."""


@pytest.mark.parametrize("name", MATERIALS)
@pytest.mark.parametrize(("cell_type", "kinematics", "fixed", "moved"), COMPRESSIONS)
def test_one_element_equals_the_stress_point(
    name: str, cell_type: str, kinematics: str, fixed: tuple[str, ...], moved: dict[str, float]
) -> None:
    material, rule, needs = MATERIALS[name]
    dim = ELEMENTS[cell_type].dim
    space = build_space(box_mesh(cell_type, (1,) * dim, (0.0,) * dim, (1.0,) * dim), KINEMATICS[kinematics])
    normal = {side: space.components[axis] for axis, pair in enumerate(SIDES[dim]) for side in pair}
    supports = [Support(side, normal[side], moved.get(side, 0.0)) for side in (*fixed, *moved)]
    supports += [Support("bottom", c) for c in space.components if c == "theta"]
    zone = Zone(material, rule, start(space.npoints, material, rule, needs), slice(None))
    stage = Stage("compression", tuple(supports), first=0.25, largest=0.25)
    alone = start(1, material, rule, needs)
    for step in run(Model(space, {"all": zone}, (stage,), Controls(tolerance=1e-13))):
        alone = update(material, rule, step.size * unit_box_strain(space, moved), alone).state
        expected = np.broadcast_to(alone.stress, (space.npoints, 6))
        np.testing.assert_allclose(step.states["all"].stress, expected, rtol=1e-10, atol=1e-8)


def start(n: int, material: Any, rule: Any, needs: dict) -> Any:
    """State of `n` points under 100 kPa."""
    return initial_state(material, rule, np.tile([100.0, 100.0, 100.0, 0.0, 0.0, 0.0], (n, 1)), **needs)


def unit_box_strain(space: Space, moved: dict[str, float]) -> np.ndarray:
    """(1, 6) strain of a unit box whose sides move along their normals."""
    strain = np.zeros((1, 6))
    strain[0, : len(moved)] = [-move for move in moved.values()]
    if space.kinematics.radial:
        strain[0, 2] = -moved["right"]
    return strain


def test_facets_point_outwards() -> None:
    for name, row in ELEMENTS.items():
        if row.dim > 1:
            mesh = box_mesh(name, (2,) * row.dim, (-1.0,) * row.dim, (1.0,) * row.dim)
            facets = outer_facets(mesh.cells, name, np.arange(len(mesh.points)))
            facet = ELEMENTS[row.facet_type]
            where, weights = quadrature(facet)
            values, gradients = shape(facet, where)
            nodes = mesh.points[facets]
            tangents = np.einsum("fai,qaj->fqji", nodes, gradients)
            normals = (
                np.cross(tangents[..., 0, :], tangents[..., 1, :]) if row.dim == 3 else tangents[..., 0, ::-1] * [1, -1]
            )
            volume = np.einsum("fqi,fai,qa,q->", normals, nodes, values, weights) / row.dim
            assert volume == pytest.approx(2.0**row.dim), name
