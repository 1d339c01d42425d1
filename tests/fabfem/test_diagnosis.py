"""A singular stiffness is named; condition and pivot growth agree with dense algebra; both solvers refuse alike."""

from dataclasses import replace
from importlib.util import find_spec

import numpy as np
import pytest
from scipy.linalg import hilbert
from scipy.sparse import csr_matrix

import umat
from fabfem.extremes import stiff
from fabfem.fem.box import box_mesh
from fabfem.fem.diagnosis import condition, singularity
from fabfem.fem.kinematics import KINEMATICS
from fabfem.fem.linear import whole
from fabfem.fem.loads import Pressure, Traction
from fabfem.fem.mesh import Mesh
from fabfem.fem.model import Controls, Model, Zone
from fabfem.fem.solve import Increment, Stopped, march
from fabfem.fem.space import build_space
from fabfem.fem.stages import Stage
from fabfem.fem.supports import Support
from fabfem.fem.systems import systems_of
from fabfem.verification.scene import solve
from umat.mandel import IDENTITY

SOLVERS = ["superlu", pytest.param("pardiso", marks=pytest.mark.skipif(not find_spec("pypardiso"), reason="absent"))]
HELD = (Support("bottom", "x"), Support("bottom", "y"))


def two_zones() -> Mesh:
    mesh = box_mesh("quad8", (2, 2), (0.0, 0.0), (1.0, 1.0))
    return replace(mesh, zones={"lower": np.array([0, 1]), "upper": np.array([2, 3])})


def torn() -> Mesh:
    """The upper half has nodes of its own along the joint."""
    mesh = two_zones()
    upper = np.unique(mesh.cells[2:])
    number = np.arange(len(mesh.points))
    number[upper] = len(mesh.points) + np.arange(len(upper))
    cells = mesh.cells.copy()
    cells[2:] = number[cells[2:]]
    top = number[mesh.boundary("top")]
    points = np.concatenate([mesh.points, mesh.points[upper]])
    used, cells_now = np.unique(cells, return_inverse=True)
    index = np.zeros(len(points), int)
    index[used] = np.arange(len(used))
    sides = {"bottom": index[mesh.boundary("bottom")], "top": index[top]}
    return Mesh(points[used], cells_now.reshape(cells.shape), mesh.cell_type, mesh.zones, sides)


def run(mesh: Mesh, stage: Stage, solver: str, **materials) -> Increment | Stopped:
    space = build_space(mesh, KINEMATICS["plane_strain"])
    zones = {}
    for name in mesh.zones:
        points = space.points_of(mesh.zone(name))
        material = materials.get(name, umat.Elastic(1e4, 0.3))
        state = umat.initial_state(material, None, np.zeros((len(space.weights[points]), 6)))
        zones[name] = Zone(material, None, state, points)
    return list(march(Model(space, zones, (stage,), Controls(), solver)))[-1]


@pytest.mark.parametrize("solver", SOLVERS)
def test_a_part_without_supports_is_named(solver: str) -> None:
    end = run(torn(), Stage("load", HELD, (Pressure("top", 1.0),), smallest=0.04), solver)
    assert isinstance(end, Stopped)
    assert "zone 'upper' can move without strain" in end.reason


#: stiffness left to shear and to volume in the upper zone -> what is said of it
TANGENTS = {
    (1.0, 1.0): "",
    (1e-6, 1e-6): "",
    (0.0, 0.0): "the stiffness matrix is singular: zone 'upper' has no stiffness",
    (0.0, 1.0): "the stiffness matrix is singular: a mechanism: zone 'upper' can deform without resistance",
}


@pytest.mark.parametrize(("left", "said"), TANGENTS.items())
def test_a_tangent_without_resistance_is_named(left: tuple[float, float], said: str) -> None:
    mesh = two_zones()
    space = build_space(mesh, KINEMATICS["plane_strain"])
    elastic = umat.Elastic(1e4, 0.3)
    state = umat.initial_state(elastic, None, np.zeros((space.npoints, 6)))
    zone = Zone(elastic, None, state, slice(None))
    (system,) = systems_of(Model(space, {"all": zone}, (Stage("load", HELD, (Pressure("top", 1.0),)),)))
    tangent = umat.elastic_tangent(elastic, state).copy()
    shear, volume = left
    bulk = 1e4 / (3.0 * (1.0 - 0.6)) * np.outer(IDENTITY, IDENTITY)
    upper = space.points_of(mesh.zone("upper"))
    tangent[upper] = shear * (tangent[upper] - bulk) + volume * bulk
    matrix = whole(system.reduction.stiffness(space.kinematics.between(tangent)), system.solver.triangle)
    assert singularity(system, matrix).startswith(said)
    assert bool(singularity(system, matrix)) == bool(said)
    assert (condition(matrix).number > 1e15) == bool(said)


@pytest.mark.parametrize("solver", SOLVERS)
def test_a_mechanism_is_named(solver: str) -> None:
    """A perfectly plastic layer sheared beyond its strength of one."""
    weak = umat.MohrCoulomb(1e4, 0.3, 1.0, 0.0)
    held = (*HELD, *(Support(side, "y") for side in ("left", "right", "top")))
    stage = Stage("shear", held, (Traction("top", (1.5, 0.0)),), smallest=1e-4)
    end = run(two_zones(), stage, solver, upper=weak, lower=weak)
    assert isinstance(end, Stopped)
    assert end.fraction == pytest.approx(1.0 / 1.5, abs=0.01)
    reasons = [cut.reason for cut in end.cutbacks] + [end.reason]
    assert any("mechanism" in reason or "no equilibrium" in reason for reason in reasons), reasons


@pytest.mark.parametrize("solver", SOLVERS)
@pytest.mark.parametrize("contrast", [1e6, 1e-6, 1e12])
def test_a_soft_zone_is_not_taken_for_a_singular_one(solver: str, contrast: float) -> None:
    stage = Stage("load", HELD, (Pressure("top", 1.0),), first=1.0, largest=1.0)
    end = run(two_zones(), stage, solver, upper=umat.Elastic(1e4 / contrast, 0.3))
    assert isinstance(end, Increment), end


@pytest.mark.parametrize("n", [3, 6, 9])
def test_condition_is_that_of_dense_algebra(n: int) -> None:
    dense = hilbert(n)
    scale = np.sqrt(np.diag(dense))
    expected = np.linalg.cond(dense / np.outer(scale, scale), 1)
    for factor in (1.0, 1e8):
        found = condition(csr_matrix(factor * dense))
        assert found.number == pytest.approx(expected, rel=1e-3)
        assert 0.0 < found.growth <= 2.0
    assert condition(csr_matrix(np.ones((5, 5)))).number > 1e15


def test_a_case_records_the_condition() -> None:
    """Both columns, finite and larger for a stiffer contrast; absent without `diagnose`."""
    found = {}
    for contrast in (1.0, 1e4):
        tables = dict(stiff.two(contrast, pressure=[{"boundary": "top", "value": 1.0}]), solver={"diagnose": True})
        row = solve(tables, stiff.stack()).history[-1]
        assert 0.0 < row["pivot_growth"] < 10.0
        found[contrast] = row["condition_number"]
    assert 10.0 < found[1.0] < 0.01 * found[1e4] < 1e10
    plain = solve(stiff.two(1.0, pressure=[{"boundary": "top", "value": 1.0}]), stiff.stack()).history[-1]
    assert "condition_number" not in plain
