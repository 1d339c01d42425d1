"""Element tests from cases: the conditions of every path, exact answers, limit points, results and bad input."""

import copy
import csv
import json
import subprocess
import sys
import tomllib
from pathlib import Path
from typing import Any

import meshio
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from fabfem import open_result
from fabfem.case import CaseError, case_from
from fabfem.case.toml import write_toml
from fabfem.cli import main
from fabfem.commands.status import STOPPED
from fabfem.laboratory.landmarks import Rows, landmarks
from fabfem.laboratory.plans import plan
from fabfem.laboratory.run import describe
from fabfem.laboratory.specimen import build
from fabfem.laboratory.stages import End, path
from fabfem.pictures.show import show
from fabfem.run import run_case
from umat import mandel
from umat.lanes import COMPILED
from umat.mandel import FACTOR, IDENTITY

pytestmark = pytest.mark.skipif(not COMPILED, reason="hundreds of rows take the compiler")

SAND = {
    "model": "chang_hicher",
    "preset": "toyoura",
    "void_ratio": 0.8,
    "directions": "lebedev_23",
    "fabric": {"law": "zhao_kruyt", "norm": 0.208},
}
ELASTIC = {"model": "elastic", "youngs_modulus": 30e3, "poisson_ratio": 0.2}
COULOMB = {"model": "mohr_coulomb", "youngs_modulus": 30e3, "poisson_ratio": 0.2, "friction_angle": 30.0}
COULOMB = {**COULOMB, "dilation_angle": 10.0}
MATERIALS = {"sand": SAND, "elastic": ELASTIC, "coulomb": COULOMB}
CASES = Path(__file__).parents[2] / "cases" / "element"
ALL = ["p", "q", "eta", "b", "alpha", "eps_v", "eps_q"]


def tables(material: dict, *stages: dict, **more: Any) -> dict:
    """Return the tables of a case."""
    named = [{"name": f"stage_{k}", **stage} for k, stage in enumerate(stages)]
    case = {"scene": {"kind": "element"}, "material": {"soil": material}, "initial": {"p": 100.0}, "stage": named}
    return copy.deepcopy(case | {"output": {"measures": ALL}} | more)


def run(folder: Path, *arguments: Any, **more: Any) -> tuple[dict[str, np.ndarray], dict]:
    """Return the columns of the history of a run and its report."""
    outcome = run_case(case_from(tables(*arguments, **more)), folder, quiet=True)
    return open_result(outcome.folder).history, json.loads((folder / "report.json").read_text(encoding="utf-8"))


SHEAR = {"drainage": "undrained", "increments": 8}
STAGES: dict[str, dict] = {
    "isotropic": {"kind": "isotropic", "to": [200.0, 120.0], "increments": 5},
    "k0": {"kind": "k0", "to": [180.0, 120.0], "increments": 5},
    "k0 strain": {"kind": "k0", "axial_strain": 0.002, "increments": 5},
    "stress": {"kind": "stress", "to": [90.0, 100.0, 130.0, 0.0, 10.0, 5.0], "increments": 5},
    "drained compression": {"kind": "triaxial", **SHEAR, "drainage": "drained", "axial_strain": 0.01},
    "drained extension": {"kind": "triaxial", **SHEAR, "drainage": "drained", "axial_strain": -0.005},
    "undrained compression": {"kind": "triaxial", **SHEAR, "axial_strain": 0.01},
    "undrained extension": {"kind": "triaxial", **SHEAR, "axial_strain": -0.005},
    "constant p": {"kind": "triaxial", **SHEAR, "drainage": "constant_p", "q": [30.0, -30.0]},
    "true triaxial": {"kind": "true_triaxial", **SHEAR, "drainage": "drained", "b": 0.3, "deviatoric_strain": 0.005},
    "torsion": {"kind": "hollow_cylinder", **SHEAR, "alpha": 30.0, "b": 0.5, "shear_strain": 0.01},
    "drained torsion": {"kind": "hollow_cylinder", **SHEAR, "drainage": "drained", "alpha": 60.0, "b": 0.5, "q": 30.0},
    "cycles": {"kind": "triaxial", **SHEAR, "q": [20.0, -20.0], "cycles": 2},
    "plane strain": {"kind": "plane_strain", **SHEAR, "axial_strain": 0.01},
    "drained plane strain": {"kind": "plane_strain", **SHEAR, "drainage": "drained", "q": 50.0},
    "simple shear": {"kind": "simple_shear", **SHEAR, "shear_strain": [0.01, -0.01]},
    "drained simple shear": {"kind": "simple_shear", **SHEAR, "drainage": "drained", "tau": 20.0},
    "free": {
        "kind": "free",
        "axes": [20.0, 30.0, 40.0],
        "conditions": [
            {"strain": {"zz": 1.0}, "value": 0.002},
            {"stress": {"xx": 1.0}, "value": 0.0},
            {"stress": {"yy": 1.0, "zz": -0.5}, "value": 0.0},
            {"stress": {"xy": 1.0}, "strain": {"xy": 1e4}, "value": 1.0},
            {"strain": {"yz": 1.0}, "value": 0.0},
            {"strain": {"xz": 1.0}, "value": 1e-4},
        ],
        "increments": 5,
    },
}


@pytest.mark.parametrize("material", MATERIALS)
@pytest.mark.parametrize("name", STAGES)
def test_conditions_of_every_path_are_met_in_every_row(name: str, material: str) -> None:
    """To 1e-8 of the stresses and strains in play; constant volume to 1e-12."""
    specimen = build(case_from(tables(MATERIALS[material], STAGES[name])))  # type: ignore[arg-type]
    stage = specimen.case.stage[0]
    todo = plan(stage, specimen.state.stress[0])  # type: ignore[arg-type]
    *points, end = path(specimen, stage, specimen.state, np.zeros(6))  # type: ignore[arg-type]
    assert isinstance(end, End)
    assert end.status == "completed", end.reason
    levels = np.vstack([np.zeros(6), todo.targets])
    scale = mandel.norm(todo.on_stress) * 100.0 + mandel.norm(todo.on_strain) * 0.005
    assert len(points) == 1 + stage.increments * len(todo.targets)
    for point in points:  # type: ignore[assignment]
        done = todo.on_stress @ (point.state.stress[0] - specimen.state.stress[0]) + todo.on_strain @ point.strain
        share = point.fraction * len(todo.targets)
        wanted = [np.interp(share, np.arange(len(levels)), level) for level in levels.T]
        assert (np.abs(done - wanted) / scale).max() < 1e-8
        if getattr(stage, "drainage", "") == "undrained":
            assert abs(mandel.trace(point.strain)) < 1e-12
    np.testing.assert_allclose(point.fraction, 1.0)


@pytest.mark.parametrize("material", MATERIALS)
@pytest.mark.parametrize("seed", range(4))
def test_any_six_conditions_are_met_in_any_axes(seed: int, material: str) -> None:
    """Six random combinations of `seed` stresses, 3 strains and 3 - `seed` sums of both along six orthogonal tensors.

    In random axes, whose components are found with scipy's rotations.
    """
    random = np.random.default_rng(seed)
    axes = random.uniform(-180.0, 180.0, 3)
    along = np.linalg.qr(random.normal(size=(6, 6)))[0] * FACTOR
    mixed = np.eye(6) + 0.3 * random.normal(size=(6, 6))
    share = np.array([1.0] * seed + [0.5] * (3 - seed) + [0.0] * 3)[:, None]
    on_stress, on_strain = mixed @ (share * along), mixed @ ((1.0 - share) * 6e4 * along)
    turn = Rotation.from_euler("ZYX", axes, degrees=True).as_matrix()
    wanted = on_strain @ _components(random.normal(size=6) * 3e-4, turn)
    names = ("xx", "yy", "zz", "yz", "xz", "xy")
    conditions = [
        {"stress": dict(zip(names, a, strict=True)), "strain": dict(zip(names, b, strict=True)), "value": value}
        for a, b, value in zip(on_stress.tolist(), on_strain.tolist(), wanted.tolist(), strict=True)
    ]
    stage = {"kind": "free", "axes": axes.tolist(), "conditions": conditions, "increments": 4}
    specimen = build(case_from(tables(MATERIALS[material], stage)))  # type: ignore[arg-type]
    *points, end = path(specimen, specimen.case.stage[0], specimen.state, np.zeros(6))  # type: ignore[arg-type]
    assert end.status == "completed", end.reason  # type: ignore[union-attr]
    scale = np.linalg.norm(on_stress, axis=1) * 100.0
    for point in points:  # type: ignore[assignment]
        stress = _components(point.state.stress[0] - specimen.state.stress[0], turn)  # type: ignore[union-attr]
        done = on_stress @ stress + on_strain @ _components(point.strain, turn)  # type: ignore[union-attr]
        assert (np.abs(done - point.fraction * wanted) / scale).max() < 1e-8  # type: ignore[union-attr]


def _components(tensor: np.ndarray, turn: np.ndarray) -> np.ndarray:
    """Return the six components of a Mandel vector in axes that are the columns of a rotation."""
    turned = turn.T @ mandel.to_tensor(tensor) @ turn
    return turned[[0, 1, 2, 1, 0, 0], [0, 1, 2, 2, 2, 1]]


@pytest.mark.parametrize(("alpha", "b"), [(0.0, 0.5), (30.0, 0.25), (45.0, 0.5), (75.0, 0.8)])
@pytest.mark.parametrize("drainage", ["drained", "undrained"])
def test_axes_and_intermediate_stress_are_held(alpha: float, b: float, drainage: str, tmp_path: Path) -> None:
    stage = {"kind": "hollow_cylinder", "drainage": drainage, "alpha": alpha, "b": b, "shear_strain": 0.005}
    columns, _ = run(tmp_path, SAND, {**stage, "increments": 10})
    np.testing.assert_allclose(columns["b"][1:], b, atol=1e-6)
    np.testing.assert_allclose(columns["alpha"][1:], alpha, atol=1e-6)


@pytest.mark.parametrize("drainage", ["drained", "undrained"])
def test_rotation_keeps_the_principal_stresses(drainage: str, tmp_path: Path) -> None:
    start = {"kind": "stress", "to": [100.0, 90.0, 140.0, 0.0, 0.0, 0.0], "increments": 4}
    turn = {"kind": "rotation", "angle": [90.0, 30.0], "drainage": drainage, "increments": 9}
    columns, _ = run(tmp_path, SAND, start, turn)
    chosen = columns["stage"] == "stage_1"
    np.testing.assert_allclose(columns["q"][chosen], columns["q"][chosen][0], rtol=1e-8)
    np.testing.assert_allclose(columns["b"][chosen], 0.2, atol=1e-7)
    angles = np.concatenate([[0.0], np.linspace(10.0, 90.0, 9), np.linspace(90.0, 30.0, 10)[1:]])
    np.testing.assert_allclose(columns["alpha"][chosen], angles, atol=1e-6)
    kept = columns["p"] if drainage == "drained" else columns["eps_v"]
    np.testing.assert_allclose(kept[chosen], kept[chosen][0], atol=1e-6 if drainage == "drained" else 1e-12)


G, NU = 30e3 / 2.4, 0.2
EXACT = {
    # stage, column, its last value
    "k0": ({"kind": "k0", "to": 300.0}, "stress_xx", 100.0 + NU / (1 - NU) * 200.0),
    "triaxial": ({"kind": "triaxial", "drainage": "drained", "axial_strain": 1e-3}, "stress_zz", 130.0),
    "constant volume": ({"kind": "triaxial", "drainage": "undrained", "axial_strain": 1e-3}, "q", 3 * G * 1e-3),
    "simple shear": ({"kind": "simple_shear", "drainage": "drained", "shear_strain": 2e-3}, "stress_xz", 2e-3 * G),
    "plane strain": ({"kind": "plane_strain", "drainage": "drained", "axial_strain": 1e-3}, "q", None),
    "torsion": (
        {"kind": "hollow_cylinder", "drainage": "undrained", "alpha": 45.0, "b": 0.5, "shear_strain": 2e-3},
        "stress_xz",
        2e-3 * G,
    ),
}
EXACT["plane strain"] = (EXACT["plane strain"][0], "stress_zz", 100.0 + 30.0 / (1 - NU**2))


@pytest.mark.parametrize("name", EXACT)
def test_elastic_answers_are_exact(name: str, tmp_path: Path) -> None:
    stage, column, value = EXACT[name]
    columns, _ = run(tmp_path, ELASTIC, {**stage, "increments": 3})
    assert columns[column][-1] == pytest.approx(value, rel=1e-10)


def test_stress_control_passes_the_limit_of_mohr_coulomb(tmp_path: Path) -> None:
    """Drained compression at 100 kPa, φ = 30°: q = 200 kPa; beyond it strain leads, 2 sin ψ/(1 − sin ψ) of dilation."""
    stage = {"kind": "triaxial", "drainage": "drained", "q": 400.0, "strain_limit": 0.05, "increments": 20}
    columns, report = run(tmp_path, COULOMB, stage)
    assert report["status"] == "completed"
    assert report["stages"][0]["status"] == "beyond_peak"
    assert columns["q"].max() == pytest.approx(200.0, rel=1e-7)
    assert columns["eps_q"][-1] >= 0.05
    late = columns["eps_q"] > 0.02
    slope = np.polyfit(columns["strain_zz"][late], columns["eps_v"][late], 1)[0]
    assert -slope == pytest.approx(2 * np.sin(np.radians(10)) / (1 - np.sin(np.radians(10))), rel=1e-4)


UNDRAINED = {
    # stage, largest and least stress where ψ = 0: σ1 = 3 σ3, p = 100 kPa
    "compression": ({"kind": "triaxial", "axial_strain": 0.05}, 180.0, 60.0),
    "extension": ({"kind": "triaxial", "axial_strain": -0.05}, 900.0 / 7.0, 300.0 / 7.0),
    "true triaxial": ({"kind": "true_triaxial", "b": 0.5, "shear_strain": 0.05}, 150.0, 50.0),
    "torsion": ({"kind": "hollow_cylinder", "alpha": 45.0, "b": 0.5, "shear_strain": 0.05}, 150.0, 50.0),
    "turned torsion": (
        {"kind": "hollow_cylinder", "alpha": 30.0, "b": 0.25, "shear_strain": 0.05},
        1800 / 11,
        600 / 11,
    ),
    "plane strain": ({"kind": "plane_strain", "axial_strain": 0.05}, 150.0, 50.0),
    "simple shear": ({"kind": "simple_shear", "shear_strain": 0.05}, 150.0, 50.0),
    "by stress": ({"kind": "hollow_cylinder", "alpha": 45.0, "b": 0.5, "q": 200.0}, 150.0, 50.0),
}


@pytest.mark.parametrize("dilation", [0.0, 10.0, 30.0])
@pytest.mark.parametrize("name", UNDRAINED)
def test_undrained_mohr_coulomb_goes_on_after_yield(name: str, dilation: float, tmp_path: Path) -> None:
    """φ = 30°: with ψ = 0 the stress stays where p and the cone meet, with ψ > 0 it climbs along σ1 = 3 σ3."""
    stage, major, minor = UNDRAINED[name]
    material = {**COULOMB, "dilation_angle": dilation}
    output = {"measures": ["p", "sigma_1", "sigma_3"]}
    columns, report = run(tmp_path, material, {**stage, "drainage": "undrained", "increments": 10}, output=output)
    ended = "beyond_peak" if dilation == 0.0 and "q" in stage else "completed"
    assert report["stages"][0]["status"] == ended
    if dilation == 0.0:
        assert columns["sigma_1"][-1] == pytest.approx(major, rel=1e-7)
        assert columns["sigma_3"][-1] == pytest.approx(minor, rel=1e-7)
    else:
        assert columns["sigma_1"][-1] == pytest.approx(3.0 * columns["sigma_3"][-1], rel=1e-7)
        assert columns["p"][-1] > 110.0


def test_stress_control_passes_the_peak_of_sand_on_the_curve_of_strain_control(tmp_path: Path) -> None:
    by_stress = {"kind": "triaxial", "drainage": "drained", "q": 350.0, "strain_limit": 0.15, "increments": 40}
    by_strain = {"kind": "triaxial", "drainage": "drained", "axial_strain": 0.15, "increments": 60}
    dense = {**SAND, "void_ratio": 0.69}
    led, report = run(tmp_path / "stress", dense, by_stress)
    driven, _ = run(tmp_path / "strain", dense, by_strain)
    entry = report["stages"][0]
    assert entry["status"] == "beyond_peak"
    assert {"characteristic", "peak"} <= set(entry["states"])
    assert led["q"][-1] < 0.95 * led["q"].max()
    along = driven["strain_zz"][5:][driven["strain_zz"][5:] < led["strain_zz"][-1]]
    assert along[-1] > 0.1
    expected = np.interp(along, driven["strain_zz"], driven["q"])
    np.testing.assert_allclose(np.interp(along, led["strain_zz"], led["q"]), expected, rtol=0.005)


def test_a_liquefied_stage_is_reported_as_such_and_the_next_one_goes_on(tmp_path: Path) -> None:
    """An isotropic unloading to 0.2 kPa passes 0.5 kPa, the default of 0.005 atmospheres."""
    unload = {"kind": "isotropic", "to": 0.2, "increments": 10}
    again = {"kind": "isotropic", "to": 50.0, "increments": 5}
    columns, report = run(tmp_path, SAND, unload, again)
    assert [stage["status"] for stage in report["stages"]] == ["liquefied", "completed"]
    assert "mean effective stress fell to" in report["stages"][0]["reason"]
    assert report["status"] == "completed"
    assert columns["p"][columns["stage"] == "stage_0"].min() < 0.005 * 101.3
    assert columns["p"][-1] == pytest.approx(50.0)


def test_static_liquefaction_after_instability(tmp_path: Path) -> None:
    run_case(CASES / "static_liquefaction.toml", tmp_path, quiet=True)
    (stage,) = json.loads((tmp_path / "report.json").read_text(encoding="utf-8"))["stages"]
    assert stage["status"] == "liquefied"
    assert {"instability", "second_order_work_lost"} == set(stage["states"])
    instability = stage["states"]["instability"]
    columns = open_result(tmp_path).history
    assert instability["q"] == pytest.approx(columns["q"].max(), rel=0.01)
    assert instability["psi"] == pytest.approx(1.05 - (0.934 - 0.019 * (instability["p"] / 101.3) ** 0.7), abs=1e-4)


CURVES = {
    "drained": {"kind": "triaxial", "drainage": "drained", "axial_strain": 0.1, "increments": 10},
    "torsion": {"kind": "hollow_cylinder", "drainage": "undrained", "alpha": 45.0, "b": 0.5, "shear_strain": 0.05},
}


@pytest.mark.parametrize("name", CURVES)
def test_curves_are_as_accurate_as_the_case_states(name: str, tmp_path: Path) -> None:
    """Against ten times finer; few rows, so that the steps between them are chosen by their error."""
    stage = {**CURVES[name], "increments": 10}
    coarse, _ = run(tmp_path / "a", SAND, stage)
    fine, _ = run(tmp_path / "b", SAND, stage, accuracy={"curve": 0.0005})
    for column in ("p", "q", "eps_q", "eps_v"):
        assert np.abs(coarse[column] - fine[column]).max() <= 0.005 * np.abs(fine[column]).max() + 1e-12


def test_roses_and_the_surface_hold_what_the_fabric_says(tmp_path: Path) -> None:
    stage = {"kind": "triaxial", "drainage": "drained", "axial_strain": 0.02, "increments": 10}
    output = {"measures": ["F_xx", "F_zz"], "roses": {"increments": [0, 10]}}
    columns, _ = run(tmp_path, SAND, stage, output=output)
    with (tmp_path / "roses.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert [row["increment [-]"] for row in (rows[0], rows[-1])] == ["0", "10"]
    for row in (rows[0], rows[len(rows) // 2]):  # the vertical
        increment = int(row["increment [-]"])
        assert float(row["angle [deg]"]) == 0.0
        assert float(row["4 pi E [-]"]) == pytest.approx(1.0 + columns["F_zz"][increment], rel=1e-12)
        assert float(row["f_t / f_n [-]"]) == pytest.approx(0.0, abs=1e-9)
    surface = meshio.read(tmp_path / "fields_0001.vtu")
    radius = np.linalg.norm(surface.points, axis=1)
    np.testing.assert_allclose(radius, surface.point_data["contact_density"], rtol=1e-5)
    assert radius.max() == pytest.approx(1.0 + columns["F_zz"][-1], rel=1e-5)


def test_elastic_envelopes_are_the_ellipses_of_the_moduli(tmp_path: Path) -> None:
    probe = {"kind": "probe", "of": "strain", "size": 1e-5, "plane": "deviatoric", "directions": 12}
    hydro = {**probe, "of": "stress", "size": 1.0, "plane": "triaxial"}
    run(tmp_path, ELASTIC, probe, hydro)
    with (tmp_path / "probes.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 24
    for row in rows:
        stress, strain = (
            np.array([float(value) for key, value in row.items() if key.startswith(f"d_{what}_")]) * FACTOR
            for what in ("stress", "strain")
        )
        bulk = 30e3 / (3 * (1 - 2 * NU))
        expected = 2 * G * mandel.deviator(strain) + bulk * mandel.trace(strain) * IDENTITY
        np.testing.assert_allclose(stress, expected, atol=1e-9)
        size = mandel.norm(strain) / 1e-5 if row["stage"] == "stage_0" else mandel.norm(stress)
        assert size == pytest.approx(1.0, rel=1e-9)


def test_probes_go_in_all_directions_of_any_plane(tmp_path: Path) -> None:
    """Of one length, in the plane of two tensors, opposite ones opposite; sand answers a full envelope."""
    first, second = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0], [0.2, 0.3, 0.5, 0.0, 0.7, -0.4]
    probe = {"kind": "probe", "of": "stress", "size": 0.5, "plane": [first, second], "directions": 8}
    run(tmp_path, SAND, probe, {**probe, "of": "strain", "size": 1e-6})
    with (tmp_path / "probes.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 16
    plane = np.array([first, second]) * FACTOR
    for number, row in enumerate(rows):
        what, size = ("stress", 0.5) if number < 8 else ("strain", 1e-6)
        driven = np.array([float(value) for key, value in row.items() if key.startswith(f"d_{what}_")]) * FACTOR
        part = np.linalg.lstsq(plane.T, driven, rcond=None)
        np.testing.assert_allclose(plane.T @ part[0], driven, atol=1e-6 * size)
        assert mandel.norm(driven) == pytest.approx(size, rel=1e-6)
    assert show(tmp_path).pictures


def test_states_are_found_where_a_curve_has_them() -> None:
    """Parabolas with known vertices between the rows: q at 0.31, p at 0.52 of the way."""
    way = np.linspace(0.0, 1.0, 21)
    q, p = 50.0 - 100.0 * (way - 0.31) ** 2, 100.0 + 200.0 * (way - 0.52) ** 2
    direction = np.array([-1.0, -1.0, 2.0, 0.0, 0.0, 0.0]) / np.sqrt(6.0)
    stress = p[:, None] * IDENTITY + np.sqrt(2 / 3) * q[:, None] * direction
    rows = Rows(stress, way[:, None] * direction, np.full(21, 0.8), np.full(21, 0.3))
    found = landmarks(rows)
    assert found["instability"] == pytest.approx(0.31 * 20, abs=1e-9)
    assert found["phase_transformation"] == pytest.approx(0.52 * 20, abs=1e-9)
    assert "critical" not in found
    flat = Rows(np.repeat(stress[:1], 21, axis=0), rows.strain, rows.void_ratio, rows.fabric_norm)
    assert landmarks(flat) == {"critical": 0.0}
    assert landmarks(flat._replace(ending=False)) == {}


BAD = {
    # what is changed, and what the sentence must say
    "no start": (lambda t: t.pop("initial"), "initial: is missing"),
    "two starts": (
        lambda t: t["initial"].update(stress=[1.0] * 6),
        "initial: needs exactly one of p, stress (got p",
    ),
    "unknown path": (lambda t: t["stage"][0].update(kind="triaxal"), "stage[stage_0].kind: must be one of"),
    "no target": (lambda t: t["stage"][0].pop("axial_strain"), "stage[stage_0]: needs exactly one of axial_strain"),
    "two targets": (lambda t: t["stage"][0].update(q=1.0), "(got axial_strain and q)"),
    "b beyond 1": (
        lambda t: t["stage"][0].update(kind="true_triaxial", b=1.5),
        "stage[stage_0].b: must be at most 1 (got 1.5)",
    ),
    "unknown measure": (lambda t: t["output"].update(measures=["etta"]), "no measure 'etta'; did you mean 'eta'?"),
    "zeta without weight": (lambda t: t["output"].update(measures=["zeta"]), "output.e_A: is missing"),
    "fabric of an elastic": (
        lambda t: (t["material"].update(soil=dict(ELASTIC)), t["output"].update(measures=["A"])),
        "output.measures: 'A' needs a fabric, which the material soil has not",
    ),
    "roses of an elastic": (
        lambda t: (t["material"].update(soil=dict(ELASTIC)), t["output"].update(roses={"strain": [0.0]})),
        "output.roses: the material soil has no contacts",
    ),
    "roses of no stage": (
        lambda t: t["output"].update(roses={"strain": [0.0], "stage": "stage_1"}),
        "output.roses.stage: there is no path 'stage_1'; did you mean 'stage_0'?",
    ),
    "stress beyond the limit": (
        lambda t: t.update(initial={"stress": [10.0, 10.0, 500.0, 0.0, 0.0, 0.0]}),
        "material.soil: the stress lies outside the domain",
    ),
    "two materials": (lambda t: t["material"].update(other=dict(ELASTIC)), "an element has one material"),
    "probes of no plane": (
        lambda t: t.update(
            stage=[{"name": "f", "kind": "probe", "of": "stress", "size": 1.0, "plane": [[1.0] * 6] * 2}]
        ),
        "stage[f]: plane: its two tensors must differ in direction",
    ),
    "five conditions": (
        lambda t: t.update(stage=[{"name": "f", "kind": "free", "conditions": [{"stress": {"xx": 1.0}}] * 5}]),
        "stage[f].conditions: must hold at least 6 entries",
    ),
}


@pytest.mark.parametrize("name", BAD)
def test_bad_input_gets_a_sentence_naming_the_place(name: str) -> None:
    change, expected = BAD[name]
    case = tables(SAND, {"kind": "triaxial", "drainage": "drained", "axial_strain": 0.1})
    change(case)
    with pytest.raises(CaseError) as caught:
        describe(case_from(case))  # type: ignore[arg-type]
    assert expected in str(caught.value)
    assert "\n" not in str(caught.value)


CASE = """
title = "small"
scene = { kind = "element" }
initial = { p = 100.0 }
[material.soil]
model = "chang_hicher"
preset = "toyoura"
void_ratio = 0.8
fabric = { norm = 0.2 }
[[stage]]
name = "shear"
kind = "triaxial"
drainage = "undrained"
axial_strain = 0.002
increments = 3
[output]
roses = { strain = [0.0] }
"""


def test_command_line_runs_checks_and_draws(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "case.toml").write_text(CASE, encoding="utf-8")
    assert main(["check", str(tmp_path / "case.toml")]) == 0
    said = capsys.readouterr().out
    assert "one point, whose stress and strain are uniform" in said
    text = said[: said.index("# What")]
    assert case_from(tomllib.loads(text)) == case_from(tomllib.loads(CASE))
    assert main(["solve", str(tmp_path / "case.toml"), "--out", str(tmp_path / "out")]) == 0
    assert "completed after 3 increments" in capsys.readouterr().out
    assert main(["show", str(tmp_path / "out")]) == 0
    pictures = {file.name for file in (tmp_path / "out").glob("*.png")}
    assert pictures == {"curves.png", "roses.png"}


def test_an_element_case_imports_nothing_of_the_finite_element_side(tmp_path: Path) -> None:
    (tmp_path / "case.toml").write_text(CASE, encoding="utf-8")
    code = (
        "import sys, pathlib; from fabfem.run import run_case;"
        f"run_case(pathlib.Path({str(tmp_path / 'case.toml')!r}), pathlib.Path({str(tmp_path / 'o')!r}), quiet=True);"
        "heavy = ('skfem', 'meshio', 'scipy.sparse', 'vtkmodules', 'pyvista', 'matplotlib', 'fabfem.fem');"
        "print([name for name in heavy if name in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True)
    assert done.stdout.strip() == "[]"


def test_a_stop_keeps_what_converged_and_says_why(tmp_path: Path) -> None:
    """Two different strains of one component cannot be met."""
    names = ("xx", "xx", "yy", "yz", "xz", "xy")
    twice = [{"strain": {name: 1.0}, "value": 1e-4 * (k + 1)} for k, name in enumerate(names)]
    before = {"kind": "triaxial", "drainage": "drained", "axial_strain": 0.001, "increments": 4}
    columns, report = run(tmp_path, ELASTIC, before, {"kind": "free", "conditions": twice})
    assert report["status"] == "stopped"
    assert [stage["status"] for stage in report["stages"]] == ["completed", "stopped"]
    assert "stage stage_1 stopped at 0 % of the way" in report["reason"]
    assert "no strain increment, however small, meets the six conditions" in report["reason"]
    assert len(columns["p"]) == 6  # the rows of the first stage and the start of the second
    (tmp_path / "c.toml").write_text(write_toml(tables(ELASTIC, {"kind": "free", "conditions": twice})), "utf-8")
    assert main(["solve", str(tmp_path / "c.toml"), "--out", str(tmp_path / "out"), "--quiet"]) == STOPPED
