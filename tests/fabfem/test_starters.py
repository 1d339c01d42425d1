"""What helps to write a case: starters, the schema for editors, completion in the shell."""

import copy
import json
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path

import jsonschema
import pytest

from fabfem.case import CaseError, case_from, read_case
from fabfem.case.json_schema import schema
from fabfem.cli import main
from fabfem.commands.authoring import SHELLS
from fabfem.commands.status import BAD_INPUT, DONE
from fabfem.output.history import read_history
from fabfem.starters import KINDS, SCHEMA

ROOT = Path(__file__).parents[2]
SHIPPED = sorted((ROOT / "cases").rglob("*.toml"))
STARTERS = sorted((ROOT / "fabfem" / "starters").glob("*.toml"))
VALID = jsonschema.Draft202012Validator(schema())

ANSWERS = {
    "footing": ("q/(gamma B) [-]", 12.0, 20.0),  # bearing capacity of medium dense sand at 5 % of the width
    "slope": ("strength_factor [-]", 1.2, 1.4),  # Taylor's chart has 1.29 for c/(γH) = 0.1, φ = 20°, 45°
    "hollow_cylinder": ("mean_tau [kPa]", 45.0, 60.0),  # friction of 27° to 35° at σ = 100 kPa
    "element": ("eta [-]", 1.0, 1.5),  # near critical, where the sand has M = 1.25
}


@pytest.mark.parametrize("kind", KINDS)
def test_a_starter_runs_and_is_right(
    kind: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["new", kind]) == DONE
    assert f"fabfem solve {kind}.toml" in capsys.readouterr().out
    assert main(["check", f"{kind}.toml", "--quiet"]) == DONE
    assert main(["solve", f"{kind}.toml", "--quiet"]) == DONE
    headers, rows = read_history(tmp_path / "results" / kind / "history.csv")
    column, low, high = ANSWERS[kind]
    assert low < float(rows[-1][headers.index(column)]) < high


def test_the_footing_is_changed_to_a_whole_one_as_its_comments_say(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Whole, it carries what the half does, and less where the bedding is steep."""
    monkeypatch.chdir(tmp_path)
    assert main(["new", "footing", "--quiet"]) == DONE
    half = (tmp_path / "footing.toml").read_text(encoding="utf-8").replace("-0.05 }", "-0.02 }")
    whole = half.replace("elements = 3 }", "elements = 3, whole = 1 }").replace('["symmetry", "side"]', '"side"')
    whole = whole.replace("scale = -2.0", "scale = -1.0")
    inclined = whole.replace("bedding_angle = 0.0", "bedding_angle = 60.0")
    forces = {}
    for name, text in {"half": half, "whole": whole, "inclined": inclined}.items():
        (tmp_path / f"{name}.toml").write_text(text, encoding="utf-8")
        assert main(["solve", f"{name}.toml", "--quiet"]) == DONE
        headers, rows = read_history(tmp_path / "results" / name / "history.csv")
        forces[name] = float(rows[-1][headers.index("force [kN/m]")])
    assert forces["whole"] == pytest.approx(forces["half"], rel=5e-3)  # the tolerance of the case is 3e-3
    assert forces["inclined"] < 0.99 * forces["whole"]


@pytest.mark.parametrize("wrong", ["width = -1.0", "width = 10.0", "elements = 2.5", "elements = 0", "depth = 0.0"])
def test_a_footing_that_cannot_be_drawn(wrong: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["new", "footing", str(tmp_path), "--quiet"]) == DONE
    case, key = tmp_path / "footing.toml", wrong.split()[0]
    said = {"width": "width = 1.0", "elements": "elements = 3", "depth": "depth = 4.0"}[key]
    text = case.read_text(encoding="utf-8")
    assert said in text
    case.write_text(text.replace(said, wrong), encoding="utf-8")
    assert main(["check", str(case), "--quiet"]) == BAD_INPUT
    assert "drew no mesh: it needs 0 < width/2 < reach" in capsys.readouterr().err


def test_a_refused_initial_stress_is_shown(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["new", "footing", str(tmp_path), "--quiet"]) == DONE
    case = tmp_path / "footing.toml"
    case.write_text(case.read_text(encoding="utf-8").replace("k0 = 0.5", "k0 = 50.0"), encoding="utf-8")
    assert main(["check", str(case), "--quiet"]) == BAD_INPUT
    said = capsys.readouterr().err
    assert "q/p to 1.4" in said  # (50 − 1)/(2·50/3 + 1/3), horizontal over vertical
    assert "kPa" in said


def test_a_starter_overwrites_nothing(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "footing_mesh.py").write_text("mine")
    assert main(["new", "footing", str(tmp_path)]) == BAD_INPUT
    assert "is there already" in capsys.readouterr().err
    assert [file.name for file in tmp_path.iterdir()] == ["footing_mesh.py"]


@pytest.mark.parametrize("kind", KINDS)
def test_a_starter_is_commented_and_names_its_schema(kind: str, tmp_path: Path) -> None:
    assert main(["new", kind, str(tmp_path / "deep"), "--quiet"]) == DONE
    lines = (tmp_path / "deep" / f"{kind}.toml").read_text(encoding="utf-8").splitlines()
    assert lines[0] == f"#:schema {SCHEMA}"
    assert sum("# " in line for line in lines) >= 8
    assert json.loads((tmp_path / "deep" / SCHEMA).read_text(encoding="utf-8")) == schema()


@pytest.mark.parametrize("path", [*SHIPPED, *STARTERS], ids=lambda path: path.stem)
def test_cases_fit_the_schema(path: Path) -> None:
    VALID.validate(tomllib.loads(path.read_text(encoding="utf-8")))


FOOTING = tomllib.loads((ROOT / "cases" / "footing" / "strip_toyoura.toml").read_text(encoding="utf-8"))
WRONG = {
    "unknown key": ("solver", {"tolerence": 1e-3}),
    "text for a number": ("solver", {"tolerance": "1e-3"}),
    "below its bound": ("solver", {"tolerance": 0.0}),
    "unknown word": ("scene", {"kind": "boundary_value", "kinematics": "plane_stress"}),
    "missing table": ("mesh", None),
    "unknown model": ("material", {"sand": {"model": "sandy"}}),
    "list for a table": ("material", []),
    "both ways to name a routine": ("material", {"clay": {"model": "umat", "umat": "lib.so", "library": "lib.so"}}),
}


@pytest.mark.parametrize("name", WRONG)
def test_the_schema_refuses_what_the_reader_refuses(name: str) -> None:
    key, value = WRONG[name]
    tables = copy.deepcopy(FOOTING) | {key: value}
    if value is None:
        del tables[key]
    with pytest.raises(CaseError):
        case_from(tables)
    assert not VALID.is_valid(tables)


def test_the_schema_is_printed_or_written(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["schema"]) == DONE
    assert json.loads(capsys.readouterr().out) == schema()
    assert main(["schema", "--out", str(tmp_path / "s.json")]) == DONE
    assert json.loads((tmp_path / "s.json").read_text(encoding="utf-8")) == schema()
    jsonschema.Draft202012Validator.check_schema(schema())


@pytest.mark.skipif(not shutil.which("taplo"), reason="the editor's checker taplo is not here")
def test_an_editor_finds_the_schema(tmp_path: Path) -> None:
    main(["new", "element", str(tmp_path), "--quiet"])
    case = tmp_path / "element.toml"
    assert subprocess.run(["taplo", "lint", "element.toml"], cwd=tmp_path, check=False).returncode == 0
    case.write_text(case.read_text(encoding="utf-8").replace("axial_strain", "axial_strian"), encoding="utf-8")
    assert subprocess.run(["taplo", "lint", "element.toml"], cwd=tmp_path, check=False).returncode != 0


def test_a_routine_in_short_says_the_same(tmp_path: Path) -> None:
    """``umat = LIBRARY`` says the same as ``model = "umat"`` and ``library``."""
    long = {"model": "umat", "library": "lib.so", "properties": [1.0, 0.3]}
    short = {"umat": "lib.so", "properties": [1.0, 0.3]}
    given = [FOOTING | {"material": {"clay": table}} for table in (short, long)]
    assert case_from(given[0]) == case_from(given[1])
    assert "umat" not in given[1]["material"]["clay"]
    assert all(VALID.is_valid(tables) for tables in given)
    with pytest.raises(CaseError, match=r"material\.clay\.umat: says model and library in one; leave model out"):
        case_from(FOOTING | {"material": {"clay": long | {"umat": "lib.so"}}})
    with pytest.raises(CaseError, match=r"material\.clay\.library: must be text"):
        case_from(FOOTING | {"material": {"clay": {"umat": 3}}})


COMPLETE = """
source <({python} -m fabfem completion bash)
complete_line() {{
    COMP_LINE="$*"; COMP_POINT=${{#COMP_LINE}}; COMP_WORDS=("$@"); COMP_CWORD=$(($# - 1)); COMPREPLY=()
    _shtab_fabfem "$1" "${{@: -1}}" "${{@: -2:1}}"; echo "${{COMPREPLY[@]}}"
}}
"""
ASKED = {
    ("fabfem", "so"): {"solve"},
    ("fabfem", "solve", "--re"): {"--resume"},
    ("fabfem", "new", ""): set(KINDS),
    ("fabfem", "new", "fo"): {"footing"},
    ("fabfem", "solve", "ca"): {"case.toml"},
    ("fabfem", "show", "r"): {"results"},
}


@pytest.mark.skipif(not shutil.which("bash"), reason="there is no bash")
@pytest.mark.parametrize("words", ASKED, ids=" ".join)
def test_bash_completes(words: tuple[str, ...], tmp_path: Path) -> None:
    (tmp_path / "case.toml").touch()
    (tmp_path / "results").mkdir()
    line = " ".join(f"'{word}'" for word in words)
    script = COMPLETE.format(python=sys.executable) + f"complete_line {line}\n"
    said = subprocess.run(["bash", "-c", script], cwd=tmp_path, capture_output=True, text=True, check=False)
    assert {word.rstrip("/") for word in said.stdout.split()} >= ASKED[words], said.stderr


@pytest.mark.parametrize("shell", SHELLS)
def test_every_command_is_completed(shell: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["completion", shell]) == DONE
    said = capsys.readouterr().out
    for command in ("solve", "check", "new", "schema", "replay", "export-umat"):
        assert command in said
    if shutil.which(shell) and shell != "tcsh":
        subprocess.run([shell, "-n"], input=said, text=True, check=True)


def test_a_mesh_of_gmsh_2_has_its_names(tmp_path: Path) -> None:
    main(["new", "slope", str(tmp_path), "--quiet"])
    subprocess.run([sys.executable, "slope_mesh.py", "slope.msh", "angle=30", "size=2.5"], cwd=tmp_path, check=True)
    from fabfem.fem.mesh_files import read_mesh

    mesh = read_mesh(tmp_path / "slope.msh")
    assert set(mesh.zones) == {"slope", "ground"}
    assert set(mesh.boundaries) == {"left", "right", "bottom", "crest", "face", "toe"}
    assert sum(map(len, mesh.zones.values())) == len(mesh.cells)
    assert read_case(tmp_path / "slope.toml").title.startswith("Factor of safety")
