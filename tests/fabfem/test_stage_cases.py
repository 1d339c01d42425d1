"""Stages as a case states them, from its file to its report."""

import json
from pathlib import Path

import numpy as np
import pytest

from fabfem.boundary_value.problem import build
from fabfem.case import CaseError, read_case
from fabfem.fem.box import box_mesh
from fabfem.output.history import read_history
from fabfem.run import run_case

HEAD = """
[scene]
kind = "boundary_value"
kinematics = "plane_strain"

[mesh]
file = "column.vtu"

[material.soil]
model = "elastic"
youngs_modulus = 1e4
poisson_ratio = 0.25
unit_weight = 20.0
zones = ["low", "high"]

[material.stiff]
model = "mohr_coulomb"
youngs_modulus = 3e4
poisson_ratio = 0.25
cohesion = 100.0
friction_angle = 30.0
zones = []

[[support]]
boundary = ["left", "right"]
fix = ["x"]

[[support]]
boundary = "bottom"
fix = ["x", "y"]

[[probe]]
name = "floor"
point = [0.5, 1.0]
component = "y"

[[probe]]
name = "head"
point = [0.5, 2.0]
component = "y"

[[reaction]]
name = "base"
boundary = "bottom"
component = "y"
"""
CLAY = """
[material.clay]
model = "mohr_coulomb"
youngs_modulus = 1e4
cohesion = 20.0
friction_angle = 0.0
unit_weight = 20.0

"""
SAFETY = '\n[[stage]]\nname = "safety"\nkind = "strength_reduction"\n'
FIELDS = '[output]\nfields = ["displacement_increment", "strain_increment", "displacement"]\n'
OEDOMETER = 12000.0
WEIGHT = '\n[[stage]]\nname = "weight"\nkind = "gravity"\n'
LEVEL = '\n[[stage]]\nname = "level"\nkind = "geostatic"\nk0 = 0.3333333333333333\n'


def write_column(path: Path) -> None:
    """Write a column of two elements, the zones "low" and "high", as an Abaqus file with element and facet sets."""
    mesh = box_mesh("quad", (1, 2), (0.0, 0.0), (1.0, 2.0))
    lines = ["*NODE"]
    lines += [f"{i}, {x}, {y}, 0.0" for i, (x, y) in enumerate(mesh.points, 1)]
    for name, cell in zip(("low", "high"), mesh.cells, strict=True):
        number = 1 if name == "low" else 2
        lines += [f"*ELEMENT, TYPE=CPE4, ELSET={name}", f"{number}, {', '.join(str(n + 1) for n in cell)}"]
    for name, facets in mesh.boundaries.items():
        lines += [f"*NSET, NSET={name}", ", ".join(str(n + 1) for n in np.unique(facets))]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")


def load(name: str, text: str = "") -> str:
    return f'\n[[stage]]\nname = "{name}"\nkind = "load"\n{text}\n'


@pytest.fixture
def home(tmp_path: Path) -> Path:
    write_column(tmp_path / "column.inp")
    return tmp_path


def ran(home: Path, stages: str) -> tuple[dict, list[dict[str, float | str]]]:
    (home / "case.toml").write_text(HEAD.replace("column.vtu", "column.inp") + stages, encoding="utf-8")
    outcome = run_case(home / "case.toml", home / "out", quiet=True)
    assert outcome.status == "completed", outcome.reason
    header, rows = read_history(home / "out" / "history.csv")
    names = [column.split(" [")[0] for column in header]
    table = [
        {name: value if name == "stage" else float(value) for name, value in zip(names, row, strict=True)}
        for row in rows
    ]
    return json.loads((home / "out" / "report.json").read_text()), table


def last(table: list[dict], stage: str) -> dict:
    return [row for row in table if row["stage"] == stage][-1]


def test_gravity_turned_on_settles_and_then_counts_from_zero(home: Path) -> None:
    report, table = ran(home, WEIGHT + load("rest"))
    assert last(table, "weight")["head"] == pytest.approx(-20.0 * 2.0**2 / 2.0 / OEDOMETER, rel=1e-8)
    assert last(table, "rest")["head"] == pytest.approx(0.0, abs=1e-12)
    assert report["audit"]["moved"] == pytest.approx(20.0 * 2.0 / OEDOMETER, rel=1e-8)
    assert report["audit"]["yielded"] is None
    assert report["audit"]["out_of_balance"] < 1e-6


def test_the_audit_says_what_is_out_of_balance(home: Path) -> None:
    report, _ = ran(home, LEVEL)
    assert report["audit"]["why"] == "the guessed stress is in balance"
    report, _ = ran(home, LEVEL + "surcharge = 10.0\n")
    assert report["audit"]["out_of_balance"] > 0.01
    assert "most on" in report["audit"]["why"]
    assert "top" in report["audit"]["boundaries"]


def test_a_zone_is_dug_out_and_put_back_of_another_material(home: Path) -> None:
    """The floor heaves by γ h z/M, and goes down again by the same; the new zone is three times as stiff."""
    change = 'change = [{ zones = "high", material = "stiff" }]'
    dug = load("dig", 'remove = "high"')
    report, table = ran(home, LEVEL + dug + load("change", change) + load("fill", 'add = "high"'))
    heave = 20.0 * 1.0 / OEDOMETER
    assert last(table, "dig")["floor"] == pytest.approx(heave, rel=1e-8)
    assert last(table, "dig")["base"] == pytest.approx(20.0, rel=1e-8)
    assert last(table, "fill")["floor"] == pytest.approx(0.0, abs=1e-9)
    assert last(table, "fill")["base"] == pytest.approx(20.0 + 20.0, rel=1e-8)
    peaks = {entry["stage"]: entry for entry in report["peaks"] if entry["column"].startswith("base")}
    assert peaks["dig"]["last_over_peak"] == pytest.approx(20.0 / peaks["dig"]["peak"], rel=1e-8)


def test_a_zone_that_is_added_was_not_there(home: Path) -> None:
    _, table = ran(home, LEVEL + load("lift", 'add = "high"\nzero_displacement = true') + load("rest"))
    assert last(table, "level")["base"] == pytest.approx(20.0, rel=1e-8)
    assert last(table, "lift")["base"] == pytest.approx(40.0, rel=1e-8)
    assert last(table, "lift")["floor"] == pytest.approx(-20.0 / OEDOMETER, rel=1e-8)
    assert last(table, "rest")["floor"] == pytest.approx(0.0, abs=1e-12)


def test_a_ramp_ends_where_its_table_does_and_stays(home: Path) -> None:
    ramp = (
        'duration = 4.0\npressure = [{ boundary = "top", value = 30.0, ramp = [[0.0, 0.0], [1.0, 1.0], [4.0, 0.5]] }]'
    )
    _, table = ran(home, WEIGHT + load("ramp", ramp) + load("rest"))
    at = {row["time"]: row["head"] for row in table if row["stage"] == "ramp"}
    assert at[2.0] == pytest.approx(-30.0 * 2.0 / OEDOMETER, rel=1e-8)  # time 1 of the stage, after one of the first
    assert last(table, "ramp")["head"] == pytest.approx(-15.0 * 2.0 / OEDOMETER, rel=1e-8)
    assert last(table, "rest")["head"] == pytest.approx(-15.0 * 2.0 / OEDOMETER, rel=1e-8)


def test_a_platen_is_loaded_and_driven(home: Path) -> None:
    pushed = load("push", 'rigid = [{ boundary = "top", contact = "smooth", force = { y = -24.0 } }]')
    _, table = ran(home, pushed)
    assert last(table, "push")["head"] == pytest.approx(-24.0 * 2.0 / OEDOMETER, rel=1e-8)
    drive = 'control = { kind = "displacement", terms = [{ boundary = "top", component = "y" }], change = -0.002 }'
    driven = pushed + drive + "\nincrements = { initial = 0.5, maximum = 0.5 }\n"
    report, table = ran(home, driven)
    assert last(table, "push")["load_factor"] == pytest.approx(0.002 * OEDOMETER / 2.0 / 24.0, rel=1e-8)
    assert report["peaks"][0]["column"] == "load_factor [-]"


def test_the_factor_of_safety_of_a_column_under_its_own_weight(home: Path) -> None:
    """All of clay, its sides free above the base: the bottom element fails first; the result is in three places."""
    start = HEAD.index("[material.soil]")
    supports = '[[support]]\nboundary = "bottom"\nfix = ["x", "y"]\n'
    text = HEAD[:start] + CLAY + supports + WEIGHT + SAFETY + FIELDS
    (home / "case.toml").write_text(text.replace("column.vtu", "column.inp"), encoding="utf-8")
    outcome = run_case(home / "case.toml", home / "out", quiet=True)
    assert outcome.status == "completed", outcome.reason
    report = json.loads((home / "out" / "report.json").read_text())
    found = report["factor_of_safety"]
    assert found["verdict"] == "collapse"
    assert "the body flows" in found["reason"]
    assert 2.0 * 20.0 / 40.0 < found["last_equilibrium"] < 4.0 * 20.0 / 40.0  # 3.83 c/γH for a cut in a half-space
    assert 0.0 < found["first_failure"] - found["last_equilibrium"] <= 0.0100001
    header, rows = read_history(home / "out" / "strength_reduction.csv")
    assert [name.split(" ")[0] for name in header] == ["factor", "displacement", "out_of_balance", "verdict"]
    assert {row[3] for row in rows} == {"equilibrium", "collapse"}
    assert len(list((home / "out").glob("fields_*.vtu"))) == len(report["increments"]) + 1


BAD = {
    "geostatic later": (WEIGHT + LEVEL, "stage[level].kind: a geostatic stage must be the first"),
    "search not last": (
        '[[stage]]\nname = "safety"\nkind = "strength_reduction"\n' + load("rest"),
        "stage[safety].kind: a search for the factor of safety must be the last stage",
    ),
    "zone gone twice": (
        load("a", 'remove = "low"') + load("b", 'remove = "low"'),
        "stage[b].remove: zone 'low' is no longer",
    ),
    "zone there already": (
        load("a", 'add = "low"') + load("b", 'add = "low"'),
        "stage[b].add: zone 'low' is already there",
    ),
    "unknown zone": (load("a", 'remove = "lov"'), "stage[a].remove: the mesh has no zone 'lov'; did you mean 'low'"),
    "unknown material": (
        load("a", 'change = [{ zones = "low", material = "stif" }]'),
        "stage[a].change[1].material: there is no material 'stif'; did you mean 'stiff'?",
    ),
    "unknown platen": (
        load("a", 'rigid = [{ boundary = "tip" }]'),
        "stage[a].rigid[1].boundary: the mesh has no boundary",
    ),
    "motion of another scene": (
        load("a", 'rigid = [{ boundary = "top", motion = { z = 1.0 } }]'),
        "stage[a]: a rigid body has no motion 'z' here; it has x, y, rotation",
    ),
    "motion and force": (
        load("a", 'rigid = [{ boundary = "top", motion = { y = 1.0 }, force = { y = 1.0 } }]'),
        "stage[a].rigid[1]: has both a motion and a force for 'y'",
    ),
    "slipping force": (
        load("a", 'rigid = [{ boundary = "top", contact = "smooth", force = { x = 1.0 } }]'),
        "stage[a]: a smooth body on boundary 'top' cannot hand on a force along it",
    ),
    "ramp backwards": (
        load("a", 'pressure = [{ boundary = "top", value = 1.0, ramp = [[1.0, 0.0], [0.5, 1.0]] }]'),
        "stage[a].pressure[1]: has a ramp whose times do not increase",
    ),
    "ramp under control": (
        load(
            "a",
            'pressure = [{ boundary = "top", value = 1.0, ramp = [[0.0, 0.0], [0.5, 1.0]] }]\n'
            'control = { kind = "arc_length", length = 1.0 }',
        ),
        "stage[a]: stage 'a' is not driven by its time",
    ),
    "control without a boundary": (
        load("a", 'control = { kind = "displacement", terms = [{ boundary = "tip", component = "y" }], change = 1.0 }'),
        "stage[a].control.terms[1].boundary: the mesh has no boundary 'tip'",
    ),
    "control of what is not": (
        load("a", 'control = { kind = "displacement", terms = [{ boundary = "top", component = "z" }], change = 1.0 }'),
        "stage[a].control.terms[1].component: 'z' is no component",
    ),
    "bracket wider than the step": (
        '[[stage]]\nname = "s"\nkind = "strength_reduction"\nstep = 0.01\ntolerance = 0.1\n',
        "stage[s]: a search for the factor of safety needs 0 < tolerance <= step",
    ),
    "two limits of a flow": (
        '[[stage]]\nname = "s"\nkind = "strength_reduction"\ngrowth = 5.0\nfailure_displacement = 0.1\n',
        "growth and failure_displacement say the same thing in two ways",
    ),
    "a negative limit of a flow": (
        '[[stage]]\nname = "s"\nkind = "strength_reduction"\nfailure_displacement = -0.1\n',
        "stage[s].failure_displacement: must be",
    ),
}


@pytest.mark.parametrize("name", BAD)
def test_what_cannot_be_gets_one_sentence_with_its_place(home: Path, name: str) -> None:
    stages, words = BAD[name]
    (home / "case.toml").write_text(HEAD.replace("column.vtu", "column.inp") + stages, encoding="utf-8")
    with pytest.raises(CaseError) as caught:
        build(read_case(home / "case.toml"))
    assert words in str(caught.value)
    assert str(caught.value).startswith("case.toml: ")
