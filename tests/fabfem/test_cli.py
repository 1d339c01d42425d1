"""The command line: its exit statuses, its sentences, and what it does not import."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from fabfem.cli import main
from fabfem.commands.status import BAD_INPUT, DONE, STOPPED

HEAVY = ("numpy", "scipy", "numba", "vtkmodules", "pyvista", "meshio", "pydantic", "rich", "matplotlib")

BAD = {
    "missing mesh": ("small.inp", "smal.inp", "mesh.file: "),
    "unknown boundary": (
        'boundary = "bottom"',
        'boundary = "botom"',
        "support[1].boundary: the mesh has no boundary 'botom'",
    ),
    "unknown zone": ("unit_weight", 'zones = "sand"\nunit_weight', "material.sand.zones: the mesh has no zone 'sand'"),
    "unknown field": (
        '"stress"',
        '"stres"',
        "output.fields: no material here has a field 'stres'; did you mean 'stress'?",
    ),
    "nothing holds": ('fix = ["x", "y"]', 'fix = ["x"]', "stage[geostatic]: "),
    "wrong dimension": ('"plane_strain"', '"solid"', "scene.kinematics: "),
    "pull in the ground": ("k0 = 0.5", "k0 = -0.5", "stage[geostatic].k0: must be greater than 0 (got -0.5)"),
    "unknown key": ("friction_angle", "friction_angel", "did you mean 'friction_angle'?"),
}


def test_help_is_quick_and_imports_nothing_heavy() -> None:
    def seconds() -> float:
        """Processor time, which other programs on the machine do not lengthen."""
        begun = os.times()
        subprocess.run([sys.executable, "-m", "fabfem", "--help"], check=True, capture_output=True)
        ended = os.times()
        return ended.children_user - begun.children_user + ended.children_system - begun.children_system

    assert min(seconds() for _ in range(5)) < 0.3
    code = f"import sys, fabfem.cli; print([name for name in {HEAVY} if name in sys.modules])"
    assert (
        subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True).stdout.strip() == "[]"
    )


def test_solve_draws_a_summary_and_says_where_to_look(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["solve", str(folder / "case.toml"), "--out", str(folder / "out")]) == DONE
    said = capsys.readouterr()
    assert "completed after" in said.out
    assert str(folder / "out" / "fields.pvd") in said.out
    assert "geostatic: out of balance by" in said.err


def test_quiet_is_quiet(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["solve", str(folder / "case.toml"), "--out", str(folder / "out"), "--quiet"]) == DONE
    assert capsys.readouterr() == ("", "")


def test_results_go_to_a_folder_named_after_the_case(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(folder)
    assert main(["solve", "case.toml", "--quiet"]) == DONE
    assert (folder / "results" / "case" / "report.json").is_file()


def test_check_prints_the_case_and_what_it_leaves_out(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["check", str(folder / "case.toml")]) == DONE
    said = capsys.readouterr().out
    assert "[solver]\ntolerance = 1e-06" in said
    assert "no pore pressure" in said
    assert "no third displacement" in said
    assert "unknowns" in said
    assert not (folder / "results").exists()


@pytest.mark.parametrize("name", BAD)
@pytest.mark.parametrize("command", ["check", "solve"])
def test_bad_input_exits_2_with_one_sentence(
    name: str, command: str, folder: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(folder)
    old, new, expected = BAD[name]
    text = Path("case.toml").read_text(encoding="utf-8")
    assert old in text
    Path("case.toml").write_text(text.replace(old, new, 1), encoding="utf-8")
    assert main([command, "case.toml"]) == BAD_INPUT
    said = capsys.readouterr()
    assert expected in said.err
    assert said.err.count("\n") == 1
    assert "Traceback" not in said.err
    assert not Path("results").exists()


def test_a_name_the_mesh_lacks_lists_those_it_has(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    text = (folder / "case.toml").read_text(encoding="utf-8").replace('boundary = "bottom"', 'boundary = "floor"')
    (folder / "case.toml").write_text(text, encoding="utf-8")
    assert main(["check", str(folder / "case.toml")]) == BAD_INPUT
    assert "bottom, footing, left, right, surface" in capsys.readouterr().err


def test_debug_shows_the_traceback(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="no such file"):
        main(["check", str(tmp_path / "nothing.toml"), "--debug"])


def test_a_run_that_cannot_go_on_exits_3_and_keeps_what_converged(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    text = (folder / "case.toml").read_text(encoding="utf-8")
    text = text.replace("initial = 0.25, maximum = 0.25", "initial = 0.25, minimum = 0.25, maximum = 0.25")
    text += "\n[solver]\niterations = 1\n"
    (folder / "case.toml").write_text(text, encoding="utf-8")
    assert main(["solve", str(folder / "case.toml"), "--out", str(folder / "out"), "--quiet"]) == STOPPED
    said = capsys.readouterr().err
    assert "stage settlement stopped at" in said
    assert "all increments that converged are kept" in said
    assert (folder / "out" / "history.csv").read_text(encoding="utf-8").count("\n") >= 2
    report = (folder / "out" / "report.json").read_text(encoding="utf-8")
    assert '"status": "stopped"' in report


@pytest.mark.skipif(os.name == "nt" or os.geteuid() == 0, reason="every folder can be written")
def test_a_folder_that_cannot_be_written(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (folder / "locked").mkdir(mode=0o500)
    assert main(["solve", str(folder / "case.toml"), "--out", str(folder / "locked" / "out")]) == BAD_INPUT
    assert "results cannot be written there" in capsys.readouterr().err


def test_a_file_in_place_of_the_folder(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (folder / "out").touch()
    assert main(["solve", str(folder / "case.toml"), "--out", str(folder / "out")]) == BAD_INPUT
    assert "results cannot be written there" in capsys.readouterr().err
