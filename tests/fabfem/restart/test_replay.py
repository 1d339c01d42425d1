"""A failure kept by a run ends the same way when it is run again alone."""

import json
import shutil
from pathlib import Path

import pytest
from restart_scenes import FABRIC, GROUND, MOHR, SAND, pushed, scene

from fabfem.case import CaseError
from fabfem.case.toml import write_toml
from fabfem.cli import main
from fabfem.failures import FILE, KEPT
from fabfem.replay import replay
from fabfem.run import run_case

LOWEST = {"increments": {"initial": 0.5, "maximum": 0.5, "minimum": 0.2}}
LIMITED = SAND | FABRIC | {"parameters": {"max_evaluations": 3}}
OVERLOADED = {"name": "press", "kind": "load", "pressure": [{"boundary": "top", "value": 5000.0}], **LOWEST}


def failed(folder: Path, tables: dict) -> dict:
    """Run a case that stops and return its report."""
    case = folder / "case.toml"
    case.write_text(write_toml(tables), encoding="utf-8")
    assert run_case(case, folder / "out", quiet=True).status == "stopped"
    return json.loads((folder / "out" / "report.json").read_text())


def test_a_point_that_runs_out_of_evaluations(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The folder is moved away from its result: nothing else is needed."""
    report = failed(tmp_path, scene(LIMITED, pushed(0.3, **LOWEST)))
    homes = sorted((tmp_path / "out" / "replay").glob("point_*"))
    assert 1 <= len(homes) <= KEPT
    alone = tmp_path / "alone"
    shutil.copytree(homes[-1], alone)
    shutil.rmtree(tmp_path / "out")
    assert main(["replay", str(alone)]) == 0
    told = capsys.readouterr().out
    cutback = report["cutbacks"][-1]
    assert cutback["reason"].split(": ")[1] in told
    assert f"point {cutback['point']} of zone 'all'" in told
    assert "local iteration, without the compiler" in told
    lines = told.split("residual  ")[1].splitlines()[1:]
    assert len([line for line in lines if line.split()[:1] and line.split()[0].isdigit()]) >= 3
    assert told.rstrip().endswith("the same as then")


@pytest.mark.parametrize("tables", [scene(MOHR, OVERLOADED), scene(MOHR, OVERLOADED, stage=[OVERLOADED])])
def test_a_stage_that_finds_no_equilibrium(tables: dict, tmp_path: Path) -> None:
    report = failed(tmp_path, tables | {"stage": [GROUND, OVERLOADED]} if "stage" not in tables else tables)
    (found,) = [one for one in replay(tmp_path / "out") if one.folder.name == "stage"]
    assert found.same, found.lines
    assert any(report["cutbacks"][-1]["reason"] in line for line in found.lines)


def test_a_path_that_the_material_refuses(tmp_path: Path) -> None:
    tables = {
        "scene": {"kind": "element"},
        "material": {"sand": {key: value for key, value in LIMITED.items() if key != "unit_weight"}},
        "initial": {"p": 100.0},
        "stage": [
            {"name": "more", "kind": "isotropic", "to": 110.0, "increments": 5},
            {"name": "shear", "kind": "triaxial", "drainage": "undrained", "axial_strain": 0.1, "increments": 5},
        ],
    }
    failed(tmp_path, tables)
    (found,) = replay(tmp_path / "out")
    assert found.same, found.lines


def test_what_is_no_failure_is_refused(tmp_path: Path) -> None:
    with pytest.raises(CaseError, match="no failure to run again"):
        list(replay(tmp_path))
    (tmp_path / FILE).write_bytes(b"nonsense")
    with pytest.raises(CaseError, match="is damaged"):
        list(replay(tmp_path))
