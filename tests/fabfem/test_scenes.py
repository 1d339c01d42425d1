"""The scenes of docs/scenes.md, each in small: coarse meshes and the first part of the course.

The numbers were measured with these settings; they guard the scenes against change, and are no answers of their own.
"""

import json
from pathlib import Path
from typing import Any

import pytest

from fabfem.case import case_from, read_tables
from fabfem.output.history import read_history
from fabfem.run import run_case
from fabfem.study.variants import with_value

CASES = Path(__file__).parents[2] / "cases"
COARSE = {"mesh.file": "../../meshes/strip_half_coarse.msh"}
PUSH = {"stage[settlement].increments": {"initial": 0.5, "maximum": 0.5}}


def small(path: str, settings: dict[str, Any], folder: Path) -> dict[str, list[str]]:
    """Return the history of a shipped case with some settings, by column."""
    tables = {key: value for key, value in read_tables(CASES / path).items() if key not in ("output", "sweep")}
    for place, value in settings.items():
        tables = with_value(tables, place, value)
    outcome = run_case(case_from(tables, CASES / path), folder, quiet=True)
    assert outcome.status == "completed", outcome.reason
    header, rows = read_history(folder / "history.csv")
    names = [name.partition(" [")[0] for name in header]
    return {name: [row[place] for row in rows] for place, name in enumerate(names)}


def sunk(component: str, *rest: dict[str, Any]) -> dict[str, Any]:
    """Return the settings of a footing that settles by 2 mm in two increments."""
    moved = {"boundary": "footing", {"z": "r", "y": "x"}[component]: 0.0, component: -0.002}
    return {
        "stage[settlement].displacement": [moved],
        **PUSH,
        **{key: value for part in rest for key, value in part.items()},
    }


SCENES = [
    ("footing/circular_toyoura.toml", sunk("z", COARSE), "q/(gamma D)", 1.4322, 1e-3),
    ("footing/strip_toyoura_gmsh.toml", sunk("y"), "q/(gamma B)", 0.59195, 1e-3),
    ("footing/strip_toyoura_abaqus.toml", sunk("y"), "q/(gamma B)", 0.59195, 1e-3),
    (
        "footing/square_toyoura.toml",
        {
            "mesh.box.cells": [4, 4, 3],
            "stage[settlement].displacement": [{"boundary": "footing", "x": 0.0, "y": 0.0, "z": -0.002}],
            **PUSH,
        },
        "q/(gamma B)",
        1.02680,
        1e-3,
    ),
    (
        "specimen/triaxial_rough.toml",
        {
            "mesh.box.cells": [2, 4],
            "stage[shear].rigid[1].motion.z": -0.0002,
            "stage[shear].increments": {"initial": 0.25, "maximum": 0.25},
        },
        "q",
        74.387,
        1e-3,
    ),
    (
        "specimen/biaxial_band.toml",
        {
            "mesh.box.cells": [2, 4],
            "stage[shear].displacement": [{"boundary": "top", "x": 0.0, "y": -0.0004}],
            "stage[shear].increments": {"initial": 0.25, "maximum": 0.25},
        },
        "q",
        99.675,
        1e-3,
    ),
    (
        "specimen/biaxial_bedding.toml",
        {
            "material.sand.fabric.bedding_angle": 90.0,
            "mesh.box.cells": [2, 4],
            "stage[shear].displacement": [{"boundary": "top", "x": 0.0, "y": -0.0004}],
            "stage[shear].increments": {"initial": 0.25, "maximum": 0.25},
        },
        "q",
        83.0,
        1e-3,
    ),
    (
        "hollow_cylinder/torsion.toml",
        {"stage[shear].control.change": 0.0002, "stage[shear].increments": {"initial": 0.1, "maximum": 0.1}},
        "hgs_tau",
        45.483,
        1e-3,
    ),
    (
        "hollow_cylinder/thin_wall.toml",
        {"stage[shear].control.change": 0.0002, "stage[shear].increments": {"initial": 0.1, "maximum": 0.1}},
        "mean_tau",
        43.335,
        1e-3,
    ),
]


@pytest.mark.parametrize(("path", "settings", "column", "measured", "within"), SCENES)
def test_a_scene_in_small_gives_what_was_measured(
    path: str, settings: dict[str, Any], column: str, measured: float, within: float, tmp_path: Path
) -> None:
    history = small(path, settings, tmp_path / "out")
    assert float(history[column][-1]) == pytest.approx(measured, rel=within)


def test_a_slope_in_sand_with_inclined_bedding_flows_in_the_end(tmp_path: Path) -> None:
    """In steps five times as large as the case's, the search brackets its answer, 1.95 to 1.975, and moves as far."""
    settings = {
        "material.sand.fabric.bedding_angle": 30.0,
        "stage[safety].step": 0.5,
        "stage[safety].tolerance": 0.5,
        "stage[safety].failure_displacement": 0.3,
    }
    small("slope/toyoura_bedding.toml", settings, tmp_path / "out")
    found = json.loads((tmp_path / "out" / "report.json").read_text())["factor_of_safety"]
    assert (found["last_equilibrium"], found["first_failure"]) == (1.5, 2.0)
    assert found["verdict"] == "collapse"
    assert "the body flows" in found["reason"]
    assert [round(one["displacement"], 2) for one in found["tried"]][1] == pytest.approx(0.14, abs=0.011)


def test_a_crest_load_settles_the_slope_of_an_abaqus_mesh(tmp_path: Path) -> None:
    path = "slope/toyoura_crest_load.toml"
    weight, load, _ = read_tables(CASES / path)["stage"]
    load["pressure"][0]["value"] = 10.0
    load["increments"] = {"initial": 0.5, "maximum": 0.5}
    history = small(path, {"stage": [weight, load]}, tmp_path / "out")
    assert float(history["crest"][-1]) == pytest.approx(-0.0040523, rel=1e-3)


def test_a_ring_without_torque_is_the_element_test(tmp_path: Path) -> None:
    # α = 0: the stress is uniform, so laboratory averages, volume means and the stress point agree
    settings = {
        "stage[shear].pressure[1].value": 33.333333333333336,
        "stage[shear].pressure[2].value": 233.33333333333334,
        "stage[shear].traction[1].theta": 0.0,
        "stage[shear].control": {
            "kind": "displacement",
            "change": 0.0002,
            "terms": [{"boundary": "top", "component": "z", "factor": -1.0}],
        },
        "stage[shear].increments": {"initial": 0.1, "maximum": 0.1},
    }
    ring = small("hollow_cylinder/torsion.toml", settings, tmp_path / "ring")
    path = "hollow_cylinder/torsion_element.toml"
    (shear,) = read_tables(CASES / path)["stage"]
    shear |= {"alpha": 0.0, "b": 0.0, "axial_strain": 0.01, "increments": 10}
    del shear["shear_strain"]
    point = small(path, {"stage": [shear]}, tmp_path / "point")
    for way in ("hgs", "mean"):
        assert float(ring[f"{way}_sigma_z"][-1]) == pytest.approx(float(point["stress_zz"][-1]), rel=3e-3)
    assert float(ring["deviation_q"][-1]) < 0.01 * float(ring["mean_q"][-1])


def test_a_circular_footing_on_clay_carries_the_exact_load(tmp_path: Path) -> None:
    pytest.importorskip("gmsh")
    history = small("footing/circular_clay.toml", {}, tmp_path / "out")
    assert float(history["q/c"][-1]) == pytest.approx(6.05, rel=0.02)  # [Eason & Shield 1960]


def test_inclined_bedding_pushes_a_guided_footing_sideways(tmp_path: Path) -> None:
    pytest.importorskip("gmsh")
    history = small("footing/strip_toyoura_bedding.toml", sunk("y", {"mesh.parameters.size": 4.0}), tmp_path / "out")
    assert float(history["q/(gamma B)"][-1]) == pytest.approx(0.58349, rel=1e-3)
    assert float(history["horizontal_force"][-1]) < -0.01 * float(history["footing_force"][-1])
