"""The errors that a run estimates of itself, against the true ones where they are known."""

import csv
import tomllib
from pathlib import Path
from typing import Any

import meshio
import numpy as np
import pytest

from fabfem.boundary_value.problem import build
from fabfem.case import BoundaryValueCase, CaseError, case_from
from fabfem.fem.box import box_mesh
from fabfem.fem.kinematics import KINEMATICS
from fabfem.fem.recovery import energy_density, fine_space, recovery, stress_within
from fabfem.fem.solve import Increment, march
from fabfem.fem.space import build_space
from fabfem.run import run_case
from fabfem.study.variants import Setting, variant
from umat import elastic_tangent

ROOT = Path(__file__).parents[2]
LAME = ROOT / "cases" / "studies" / "lame.toml"

SAND = """
[scene]
kind = "boundary_value"
kinematics = "plane_strain"
[mesh]
box = { lower = [0.0, 0.0], upper = [2.0, 1.0], cells = [2, 1] }
[material.sand]
model = "chang_hicher"
preset = "toyoura"
void_ratio = 0.7
unit_weight = 15.0
fabric = { norm = 0.2 }
[[support]]
boundary = "bottom"
fix = ["x", "y"]
[[support]]
boundary = ["left", "right"]
fix = ["x"]
[[stage]]
name = "rest"
kind = "geostatic"
surcharge = 50.0
pressure = [{ boundary = "top", value = 50.0 }]
[[stage]]
name = "shear"
kind = "load"
displacement = [{ boundary = "top", y = -0.01 }]
increments = { initial = 0.5, maximum = 0.5 }
[output]
fields = ["stress", "discretisation_error"]
[errors]
estimate = ["equilibrium", "integration", "discretisation", "directions"]
"""


def lame(shape: str, order: int, points: int | None, size: float) -> tuple[Any, Increment]:
    """Return the problem of the thick cylinder and its one increment."""
    settings = [
        Setting("", ("mesh.box",), {"lower": (1.0, 0.0), "upper": (2.0, 1.0), "size": size, "shape": shape}),
        Setting("", ("mesh.order",), order),
        Setting("", ("errors.estimate",), ("discretisation",)),
        *([Setting("", ("mesh.points",), points)] if points else []),
    ]
    tables = variant(tomllib.loads(LAME.read_text(encoding="utf-8")), settings)
    case = case_from(tables, LAME)
    assert isinstance(case, BoundaryValueCase)
    problem = build(case)
    (step,) = march(problem.model)
    assert isinstance(step, Increment)
    return problem, step


def lame_stress(radius: np.ndarray) -> np.ndarray:
    """Return the exact (n, 6) stress, compression positive."""
    exact = np.zeros((len(radius), 6))
    exact[:, 0], exact[:, 2] = -(1.0 - 4.0 / radius**2) / 3.0, -(1.0 + 4.0 / radius**2) / 3.0
    exact[:, 1] = 0.3 * (exact[:, 0] + exact[:, 2])
    return exact


def true_error(problem: Any, step: Increment) -> float:
    """Return the true error in the energy norm, over that of the exact stress, with the element's richest rule."""
    space = problem.model.space
    fine = build_space(space.mesh, space.kinematics, max(space.mesh.element.rules))
    elastic = elastic_tangent(problem.model.zones["all"].material, step.states["all"])[0]
    exact = lame_stress(fine.points[:, 0])
    there = np.broadcast_to(elastic, (fine.npoints, 6, 6))
    gap = energy_density(exact - fine.strain(step.displacement) @ elastic.T, there) @ fine.weights
    return float(np.sqrt(gap / (energy_density(exact, there) @ fine.weights)))


@pytest.mark.parametrize(
    ("shape", "order", "points"),
    [("quad", 1, None), ("quad", 2, None), ("quad", 2, 9), ("triangle", 1, None), ("triangle", 2, None)],
)
def test_the_recovered_stress_tells_the_error_of_the_mesh(shape: str, order: int, points: int | None) -> None:
    errors = []
    for size in (0.5, 0.25, 0.125):
        problem, step = lame(shape, order, points, size)
        errors.append(true_error(problem, step))
        assert 0.85 < problem.mesh_error.value(step) / errors[-1] < 1.3  # 1.25: triangles, mean dilation
        assert 0.5 < np.sqrt(np.mean(problem.mesh_error.field(step) ** 2)) / errors[-1] < 2.0
    assert np.log2(errors[1] / errors[2]) == pytest.approx(order, abs=0.2)


def test_the_points_of_the_reduced_rule_are_better_by_an_order() -> None:
    errors = []
    for size in (0.25, 0.125, 0.0625):
        problem, step = lame("quad", 2, None, size)
        exact = lame_stress(problem.model.space.points[:, 0])
        errors.append(np.abs(step.states["all"].stress - exact).max())
    assert np.log2(errors[1] / errors[2]) == pytest.approx(3.0, abs=0.2)


@pytest.mark.parametrize("cell_type", ["triangle", "triangle6", "quad", "quad8", "quad9", "tetra10", "hexahedron20"])
def test_a_stress_that_the_fit_can_follow_is_recovered_exactly(cell_type: str) -> None:
    dim = 3 if cell_type in ("tetra10", "hexahedron20") else 2
    mesh = box_mesh(cell_type, (3, 2, 2)[:dim], (0.0,) * dim, (3.0, 1.5, 1.0)[:dim])
    space = build_space(mesh, KINEMATICS["solid" if dim == 3 else "plane_strain"])
    fine = fine_space(space)
    degree = 2 if mesh.element.linear else 1

    def field(places: np.ndarray) -> np.ndarray:
        return 1.0 + places[:, :1] ** degree * np.arange(1.0, 7.0) - places[:, 1:2] * np.arange(6.0, 0.0, -1.0)

    matrix = recovery(space, fine, [np.arange(len(mesh.cells))])
    np.testing.assert_allclose(matrix @ field(space.points), field(fine.points), atol=1e-10)


def test_the_stress_between_points_is_that_of_the_strain_where_all_is_elastic() -> None:
    problem, step = lame("quad", 2, None, 0.25)
    space = problem.model.space
    fine = fine_space(space)
    elastic = elastic_tangent(problem.model.zones["all"].material, step.states["all"])
    stress = step.states["all"].stress
    found = stress_within(space, fine, stress, elastic, step.displacement)
    np.testing.assert_allclose(found, fine.strain(step.displacement) @ elastic[0].T, atol=1e-12)


@pytest.fixture
def sand(tmp_path: Path) -> dict[str, Any]:
    return tomllib.loads(SAND)


def history(tables: dict[str, Any], folder: Path) -> dict[str, float]:
    """Return the last row of a run's history, by the name of the column."""
    assert run_case(case_from(tables), folder, quiet=True).status == "completed"
    with (folder / "history.csv").open(encoding="utf-8") as file:
        last = list(csv.DictReader(file))[-1]
    return {name.removesuffix(" [-]"): float(value) for name, value in last.items() if name.startswith("error")}


def test_a_run_carries_its_errors(sand: dict[str, Any], tmp_path: Path) -> None:
    found = history(sand, tmp_path)
    assert found.keys() == {f"error_{name}" for name in sand["errors"]["estimate"]}
    assert 0.0 < found["error_equilibrium"] <= 1e-6
    assert 0.0 < found["error_integration"] < 0.05
    assert 0.0 < found["error_discretisation"] < 0.5
    assert 0.0 < found["error_directions"] < 0.1
    stored = meshio.read(sorted(tmp_path.glob("fields_*.vtu"))[-1])
    assert stored.cell_data["discretisation_error"][0].max() > 0.0


def test_the_error_of_directions_vanishes_with_the_same_rule_and_sees_a_poor_one(
    sand: dict[str, Any], tmp_path: Path
) -> None:
    sand["errors"] = {"estimate": ["directions"], "rule": "bazant_oh_37"}
    sand["output"]["fields"] = ["stress"]
    assert history(sand, tmp_path)["error_directions"] < 1e-11
    poor = variant(sand, [Setting("", ("errors.rule",), "lebedev_23"), Setting("", (RULE,), "bazant_oh_21")])
    good = variant(sand, [Setting("", ("errors.rule",), "lebedev_23"), Setting("", (RULE,), "lebedev_17")])
    assert history(good, tmp_path)["error_directions"] < 0.5 * history(poor, tmp_path)["error_directions"]


RULE = "material.sand.directions"


def test_a_tighter_point_has_a_smaller_error(sand: dict[str, Any], tmp_path: Path) -> None:
    sand["errors"] = {"estimate": ["integration"]}
    sand["output"]["fields"] = ["stress"]
    sand["stage"][1]["increments"] = {"initial": 1.0, "maximum": 1.0}
    loose, tight = (
        history(variant(sand, [Setting("", ("material.sand.parameters.tolerance",), size)]), tmp_path)
        for size in (1e-2, 1e-4)
    )
    assert tight["error_integration"] < 0.2 * loose["error_integration"]


@pytest.mark.parametrize(
    ("place", "value", "sentence"),
    [
        ("errors.rule", "bazant_oh_38", "errors.rule: "),
        ("errors.estimate", ("mesh",), "errors.estimate[1]: must be one of"),
        ("errors.estimate", ("integration",), "no material here has a field 'discretisation_error'"),
    ],
)
def test_impossible_errors_get_a_sentence(sand: dict[str, Any], place: str, value: Any, sentence: str) -> None:
    with pytest.raises(CaseError) as caught:
        build(case_from(variant(sand, [Setting("", (place,), value)])))  # type: ignore[arg-type]
    assert sentence in str(caught.value)


def ended(tables: dict[str, Any], tolerance: float) -> tuple[np.ndarray, float]:
    """Return the stress (n, 6) at the end of a run of the sand, and the error of its sub-steps."""
    case = case_from(variant(tables, [Setting("", ("material.sand.parameters.tolerance",), tolerance)]))
    assert isinstance(case, BoundaryValueCase)
    problem = build(case)
    (column,) = (column for column in problem.columns if column.name == "error_substeps")
    for step in march(problem.model):
        assert isinstance(step, Increment)
        said = column.value(step)
    return step.states["all"].stress, float(said)


def test_the_error_of_substeps_is_the_true_one(sand: dict[str, Any]) -> None:
    sand["errors"] = {"estimate": ["substeps"]}
    sand["output"]["fields"] = ["stress"]
    exact, _ = ended(sand, 1e-6)
    for tolerance in (1e-2, 1e-3):
        stress, said = ended(sand, tolerance)
        assert 0.5 < said / (np.linalg.norm(stress - exact) / np.linalg.norm(exact)) < 2.0


def test_substeps_need_a_material_that_takes_them(sand: dict[str, Any]) -> None:
    sand["material"]["sand"] = {"model": "elastic", "youngs_modulus": 1e4, "poisson_ratio": 0.3}
    sand["errors"] = {"estimate": ["substeps"]}
    sand["output"]["fields"] = ["stress"]
    with pytest.raises(CaseError, match=r"errors\.estimate: no material here has contact directions"):
        build(case_from(sand))
