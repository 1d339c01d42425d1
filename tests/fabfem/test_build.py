"""From what a case says to what the finite-element side is given: fabric, directions, stages, initial stress."""

import tomllib
from pathlib import Path

import numpy as np
import pytest

from fabfem.boundary_value.problem import build
from fabfem.case import CaseError, case_from, read_case
from fabfem.case.materials import Fabric, Turn
from fabfem.fem.loads import Gravity, Pressure
from fabfem.substance import deposit, rule_for
from umat.directions import directions, rotation
from umat.mandel import norm, to_tensor, trace


def test_a_deposit_is_large_along_the_vertical() -> None:
    fabric = deposit(Fabric(norm=0.208), vertical=1)
    np.testing.assert_allclose(fabric[:3], [-0.0849, 0.1698, -0.0849], atol=1e-4)


@pytest.mark.parametrize("vertical", [1, 2])
@pytest.mark.parametrize("bedding_angle", [0.0, 30.0, 45.0, 90.0])
@pytest.mark.parametrize("azimuth", [0.0, 50.0, 90.0])
def test_bedding_turns_the_fabric_and_keeps_its_size(vertical: int, bedding_angle: float, azimuth: float) -> None:
    fabric = deposit(Fabric(norm=0.3, bedding_angle=bedding_angle, azimuth=azimuth), vertical)
    assert norm(fabric) == pytest.approx(0.3)
    assert trace(fabric) == pytest.approx(0.0, abs=1e-15)
    values, vectors = np.linalg.eigh(to_tensor(fabric))
    assert values[2] == pytest.approx(0.3 * np.sqrt(2.0 / 3.0))
    assert abs(vectors[vertical, 2]) == pytest.approx(np.cos(np.radians(bedding_angle)), abs=1e-12)


def test_no_fabric_table_is_an_isotropic_fabric() -> None:
    np.testing.assert_array_equal(deposit(None, 1), np.zeros(6))


def test_directions_equal_by_symmetry_are_stored_once_and_said_to_be() -> None:
    rule, said = rule_for("bazant_oh_37", flat=True)
    assert len(rule) < len(directions("bazant_oh_37"))
    assert f"{37 - len(rule)} of 37 contact directions" in said[0]
    whole, silent = rule_for("bazant_oh_37", flat=False)
    assert (len(whole), silent) == (37, ())


def test_a_rule_turned_in_the_plane_of_a_flat_mesh_is_still_mirrored() -> None:
    turn = Turn(axis="z", angle=45.0)
    whole, _ = rule_for("lebedev_17", flat=False, turn=turn)
    half, _ = rule_for("lebedev_17", flat=True, turn=turn)
    np.testing.assert_allclose(whole.normals, directions("lebedev_17").normals @ rotation("z", 45.0).T)
    assert (len(whole), len(half)) == (55, 31)
    upright, _ = rule_for("lebedev_17", flat=True, turn=Turn(axis="x", angle=30.0))
    assert len(upright) == 55


def test_loads_stay_until_a_stage_changes_them(folder: Path) -> None:
    text = (folder / "case.toml").read_text(encoding="utf-8")
    tables = tomllib.loads(text)
    tables["stage"].append({"name": "unload", "kind": "load", "pressure": [{"boundary": "surface", "value": 0.5}]})
    case = case_from(tables, folder / "case.toml")
    first, second, third = build(case).model.stages
    ends = [
        {(load.boundary, load.start, load.end) for load in stage.loads if isinstance(load, Pressure)}
        for stage in (first, second, third)
    ]
    assert ends[0] == ends[1] == {("footing", 2.0, 2.0), ("surface", 2.0, 2.0)}
    assert ends[2] == {("footing", 2.0, 2.0), ("surface", 2.0, 0.5)}
    weights = [load for stage in (first, second, third) for load in stage.loads if isinstance(load, Gravity)]
    assert [(load.start, load.end) for load in weights] == [(1.0, 1.0)] * 3
    assert (first.zero_displacement, second.zero_displacement) == (True, False)


def test_gravity_can_be_turned_on(folder: Path) -> None:
    tables = tomllib.loads((folder / "case.toml").read_text(encoding="utf-8"))
    tables["stage"] = [{"name": "weight", "kind": "load", "gravity": 1.0}]
    (stage,) = build(case_from(tables, folder / "case.toml")).model.stages
    (gravity,) = stage.loads
    assert (gravity.start, gravity.end) == (0.0, 1.0)


def test_the_ground_carries_its_weight(folder: Path) -> None:
    model = build(read_case(folder / "case.toml")).model
    depth = -model.space.points[:, 1]
    stress = model.zones["soil"].state.stress
    np.testing.assert_allclose(stress[:, 1], 2.0 + 15.3 * depth)
    np.testing.assert_allclose(stress[:, 0], 0.5 * stress[:, 1])
    assert not stress[:, 3:].any()


@pytest.mark.parametrize(
    ("said", "mean", "points"),
    [
        ({}, False, 3),
        ({"order": 1}, True, 1),
        ({"order": 1, "volume_strain": "pointwise"}, False, 1),
        ({"volume_strain": "mean", "points": 6}, True, 6),
    ],
)
def test_linear_elements_have_a_mean_volume_strain(folder: Path, said: dict, mean: bool, points: int) -> None:
    tables = tomllib.loads((folder / "case.toml").read_text(encoding="utf-8"))
    tables["mesh"] |= said
    space = build(case_from(tables, folder / "case.toml")).model.space
    assert (space.kinematics.mean_dilation, space.nq) == (mean, points)


def test_a_rule_that_an_element_lacks_is_refused(folder: Path) -> None:
    tables = tomllib.loads((folder / "case.toml").read_text(encoding="utf-8"))
    tables["mesh"]["points"] = 5
    with pytest.raises(
        CaseError, match=r"^case.toml: mesh.points: triangle6 has no rule of 5 points; it has \[3, 6, 7\]$"
    ):
        build(case_from(tables, folder / "case.toml"))
