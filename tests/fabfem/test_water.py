"""Water as cases say it: weights and pressures under a table, undrained loading, consolidation, and what is refused."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fabfem.boundary_value.problem import build
from fabfem.boundary_value.water import nodal_pore_pressure
from fabfem.case import CaseError, case_from
from fabfem.fem.solve import Increment, march

MESH = Path(__file__).parents[2] / "meshes" / "strip_half.msh"


def layer(**changes: Any) -> dict[str, Any]:
    """Ground with its water table at the surface, consolidating under a surcharge."""
    material = {
        **{"model": "elastic", "youngs_modulus": 1e4, "poisson_ratio": 0.2, "unit_weight": 16.0},
        **{"saturated_unit_weight": 19.81, "conductivity": 1e-3},
    }
    top = ["surface", "footing"]
    tables: dict[str, Any] = {
        "scene": {"kind": "boundary_value", "kinematics": "plane_strain"},
        "mesh": {"file": str(MESH)},
        "water": {"unit_weight": 9.81, "level": 0.0, "excess": True},
        "material": {"soil": material},
        "support": [{"boundary": "bottom", "fix": ["x", "y"]}, {"boundary": ["symmetry", "side"], "fix": ["x"]}],
        "stage": [
            {"name": "ground", "kind": "geostatic", "k0": 0.5},
            {"name": "fill", "kind": "load", "drainage": "undrained", "pressure": [{"boundary": top, "value": 50.0}]},
            {"name": "wait", "kind": "load", "drainage": "seepage", "drains": top, "duration": 1e5},
        ],
        "probe": [{"name": "u", "kind": "pore_pressure", "point": [0.0, -4.5]}],
    }
    return tables | changes


def test_ground_water_is_hydrostatic_until_a_fill_is_consolidated() -> None:
    problem = build(case_from(layer()))
    steps = [step for step in march(problem.model) if isinstance(step, Increment)]
    ground, fill, last = steps[0], next(s for s in steps if s.stage == "fill" and s.fraction == 1.0), steps[-1]
    assert ground.out_of_balance < 1e-9
    space = problem.model.space
    stress = ground.states["soil"].stress
    np.testing.assert_allclose(stress[:, 1], -10.0 * space.points[:, 1])
    given = -9.81 * space.mesh.points[:, 1]
    np.testing.assert_allclose(nodal_pore_pressure(problem.case, space, ground), given)
    np.testing.assert_allclose(nodal_pore_pressure(problem.case, space, fill), given + 50.0, rtol=1e-6)
    assert last.stage == "wait"
    assert last.fraction == 1.0
    np.testing.assert_allclose(nodal_pore_pressure(problem.case, space, last), given, atol=0.5)
    np.testing.assert_allclose(last.states["soil"].stress[:, 1], 50.0 - 10.0 * space.points[:, 1], rtol=0.02)


def test_ground_above_and_below_the_table() -> None:
    """A table that goes through elements leaves out of balance what their points cannot see."""
    tables = layer(water={"unit_weight": 9.81, "level": -1.0})
    tables["stage"] = tables["stage"][:1]
    problem = build(case_from(tables))
    depth = -problem.model.space.points[:, 1]
    weight = 16.0 * np.minimum(depth, 1.0) + 10.0 * np.maximum(depth - 1.0, 0.0)
    np.testing.assert_allclose(problem.model.zones["soil"].state.stress[:, 1], weight)
    (ground,) = march(problem.model)
    assert ground.out_of_balance < 2e-3


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        ({"water": {"unit_weight": 9.81}}, "needs .water. with excess = true"),
        ({"water": {"unit_weight": 25.0, "level": 0.0, "excess": True}}, "less than the unit weight of water"),
        ({"water": {"unit_weight": 9.81, "excess": True, "bulk_modulus": 2e6}}, "porosity of 'soil' is missing"),
        ({"probe": [{"name": "u", "kind": "pore_pressure", "component": "x", "point": [0.0, 0.0]}]}, "component"),
    ],
)
def test_impossible_water_is_refused(changes: dict[str, Any], sentence: str) -> None:
    with pytest.raises(CaseError, match=sentence):
        build(case_from(layer(**changes)))


def test_what_is_drained_later_is_refused() -> None:
    tables = layer()
    tables["stage"][2] = {"name": "wait", "kind": "load"}
    with pytest.raises(CaseError, match="drained after excess"):
        case_from(tables)


def test_seepage_needs_a_conductivity() -> None:
    tables = layer()
    del tables["material"]["soil"]["conductivity"]
    with pytest.raises(CaseError, match="conductivity: is missing"):
        case_from(tables)
