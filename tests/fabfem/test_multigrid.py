"""Multigrid of the elastic stiffness solves others like it, and hands on what it does not solve."""

from dataclasses import replace
from importlib.util import find_spec

import numpy as np
import pytest
from scipy.sparse import csr_matrix, diags

from fabfem.fem import multigrid
from fabfem.fem.assembly import find_pattern
from fabfem.fem.box import box_mesh
from fabfem.fem.constraints import constrain
from fabfem.fem.kinematics import KINEMATICS
from fabfem.fem.linear import make_solver
from fabfem.fem.loads import Pressure
from fabfem.fem.model import Controls, Model, Zone
from fabfem.fem.multigrid import MultigridSolver, near, worth_while
from fabfem.fem.reduction import Reduction
from fabfem.fem.solve import march
from fabfem.fem.space import Space, build_space
from fabfem.fem.stages import Stage
from fabfem.fem.supports import RigidBody, Support
from umat import Elastic, MohrCoulomb, VonMises, elastic_tangent, initial_state

pytestmark = pytest.mark.skipif(find_spec("pyamg") is None, reason="pyamg is not installed")

BLOCK = tuple(Support(*at) for at in (("left", "x"), ("front", "y"), ("bottom", "z"), ("bottom", "x"), ("bottom", "y")))
PLANE = tuple(Support(*at) for at in (("left", "x"), ("bottom", "x"), ("bottom", "y")))
BODY = RigidBody("top", ("x", "y", "z"), (0.0, 0.0, 1.0), {"x": 0.0, "y": 0.0})
SCENES = {
    "solid": ("tetra10", (4, 4, 4), "solid", BLOCK, ()),
    "solid, linear": ("hexahedron", (6, 6, 6), "solid", BLOCK, ()),
    "solid under a rigid body": ("tetra10", (3, 3, 3), "solid", BLOCK[2:], (BODY,)),
    "plane strain": ("triangle6", (12, 12), "plane_strain", PLANE, ()),
}
"""Element, cells, kinematics, supports, rigid bodies."""
MATERIALS = {
    "symmetric": VonMises(1e4, 0.3, 20.0, 200.0),
    "unsymmetric": MohrCoulomb(1e4, 0.3, cohesion=5.0, friction_angle=25.0, dilation_angle=5.0),
}


def space_of(cells: str, counts: tuple[int, ...], kinematics: str) -> Space:
    """The unit box."""
    return build_space(box_mesh(cells, counts, [0.0] * len(counts), [1.0] * len(counts)), KINEMATICS[kinematics])


def solver_and_matrix(name: str) -> tuple[MultigridSolver, csr_matrix]:
    """The solver of a scene and its elastic stiffness."""
    cells, counts, kinematics, supports, bodies = SCENES[name]
    space = space_of(cells, counts, kinematics)
    constraints = constrain(space, supports, bodies)
    elastic = Elastic(1e4, 0.3)
    tangent = elastic_tangent(elastic, initial_state(elastic, None, np.zeros((space.npoints, 6))))
    pattern = find_pattern(space.dofs, space.ndof) if bodies else None
    matrix = Reduction(space, constraints, whole=pattern).stiffness(space.kinematics.between(tangent))
    return MultigridSolver(lambda: near(space, constraints, matrix), make_solver("superlu"), symmetric=True), matrix


@pytest.mark.parametrize("name", SCENES)
def test_elastic_stiffness_takes_few_iterations(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    solver, matrix = solver_and_matrix(name)
    monkeypatch.setattr(multigrid, "PATIENCE", 25)
    rhs = np.random.default_rng(0).normal(size=matrix.shape[0])
    solver.factor(matrix)
    answer = solver.solve(rhs)
    assert answer.ok
    assert 1e-12 < answer.residual <= 2.0 * multigrid.EXACT, "it was not the iteration"
    assert np.linalg.norm(matrix @ answer.x - rhs) <= 2.0 * multigrid.EXACT * np.linalg.norm(rhs)


def test_an_answer_does_not_depend_on_earlier_ones() -> None:
    first, matrix = solver_and_matrix("solid")
    second, _ = solver_and_matrix("solid")
    rhs = np.ones(matrix.shape[0])
    second.factor(matrix * 2.0)
    second.solve(np.arange(matrix.shape[0]) * 1.0)
    np.random.default_rng().normal()
    answers = []
    for solver in (first, second):
        solver.factor(matrix)
        answers.append(solver.solve(rhs).x)
    assert (answers[0] == answers[1]).all()


def test_what_it_does_not_solve_is_solved_directly() -> None:
    solver, matrix = solver_and_matrix("solid")
    signs = np.where(np.random.default_rng(0).random(matrix.shape[0]) < 0.5, -1.0, 1.0)
    strange = csr_matrix(matrix + diags(signs * matrix.diagonal() * 3.0))
    solver.factor(strange)
    for rhs in (signs, np.ones(len(signs))):
        answer = solver.solve(rhs)
        assert answer.ok
        assert answer.residual < 1e-10


@pytest.mark.parametrize(("value", "word"), [(0.0, "singular"), (np.nan, "not finite")])
def test_failure_is_a_sentence(value: float, word: str) -> None:
    solver, matrix = solver_and_matrix("plane strain")
    solver.factor(matrix * value)
    answer = solver.solve(np.ones(matrix.shape[0]))
    assert not answer.ok
    assert word in answer.reason
    solver.factor(matrix)
    assert solver.solve(np.ones(matrix.shape[0])).ok
    assert "not finite" in solver.solve(np.full(matrix.shape[0], np.nan)).reason


@pytest.mark.parametrize("name", MATERIALS)
def test_a_footing_settles_as_with_a_direct_solver(name: str) -> None:
    material = MATERIALS[name]
    space = space_of("tetra10", (4, 4, 3), "solid")
    top, points = space.mesh.boundary("top"), space.mesh.points
    strip = top[(points[top][:, :, :2] < 0.51).all(axis=(1, 2))]
    space = replace(space, mesh=replace(space.mesh, boundaries=space.mesh.boundaries | {"footing": strip}))
    zone = Zone(material, None, initial_state(material, None, np.zeros((space.npoints, 6))), slice(None))
    stage = Stage("load", BLOCK, (Pressure("footing", 45.0),), 0.25, 0.25)
    ends = []
    for solver in ("multigrid", "superlu"):
        steps = list(march(Model(space, {"all": zone}, (stage,), Controls(tolerance=1e-9), solver)))
        assert sum(step.iterations for step in steps) > 6, "nothing yields"
        ends.append(steps[-1].displacement)
    np.testing.assert_allclose(ends[0], ends[1], atol=1e-7 * np.abs(ends[1]).max())


def test_it_is_for_large_solids() -> None:
    plane, solid = space_of(*SCENES["plane strain"][:3]), space_of(*SCENES["solid"][:3])
    large = space_of("tetra10", (12, 12, 10), "solid")
    held = constrain(plane, PLANE), constrain(solid, BLOCK), constrain(large, BLOCK)
    assert [worth_while(*at) for at in zip((plane, solid, large), held, strict=True)] == [False, False, True]
