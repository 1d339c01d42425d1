"""Cases with a compiled UMAT, the commands for UMATs, and their sentences."""

import csv
from pathlib import Path

import numpy as np
import pytest

from fabfem.case import CaseError, case_from, read_case
from fabfem.cli import main
from fabfem.commands.status import BAD_INPUT, DONE, RED
from fabfem.run import run_case
from tests.fabfem.conftest import CASE, write_mesh
from tests.umat.compiled import compiled
from umat.lanes import COMPILED

PARAMETERS = "[2e4, 0.3, 1.0, 30.0, 5.0]"
OWN = """model = "mohr_coulomb"
youngs_modulus = 2e4
friction_angle = 30
dilation_angle = 5
cohesion = 1
"""
EXTERNAL = f"""model = "umat"
library = "mohr_coulomb.so"
properties = {PARAMETERS}
state_variables = 1
"""


@pytest.fixture(scope="module")
def scene(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the small footing's mesh, the routine, and the case with it."""
    folder = tmp_path_factory.mktemp("umat")
    write_mesh(folder / "small.inp")
    compiled("mohr_coulomb.c", folder)
    compiled("faulty.c", folder)
    assert OWN in CASE
    (folder / "own.toml").write_text(CASE, encoding="utf-8")
    (folder / "umat.toml").write_text(CASE.replace(OWN, EXTERNAL), encoding="utf-8")
    flat = EXTERNAL + "components = 4\n"
    (folder / "flat.toml").write_text(CASE.replace(OWN, flat), encoding="utf-8")
    return folder


def history(folder: Path) -> np.ndarray:
    with (folder / "history.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    names = [name for name in rows[0] if name.startswith(("settlement", "force"))]
    return np.array([[float(row[name]) for name in names] for row in rows])


@pytest.mark.parametrize("name", ["umat", "flat"])
def test_the_footing_is_the_one_of_our_own_material(scene: Path, tmp_path: Path, name: str) -> None:
    outcomes = [run_case(scene / f"{each}.toml", tmp_path / each, quiet=True) for each in ("own", name)]
    assert [outcome.status for outcome in outcomes] == ["completed", "completed"]
    ours, theirs = history(tmp_path / "own"), history(tmp_path / name)
    assert ours.shape == theirs.shape
    assert np.abs(ours[-1]).max() > 1.0
    np.testing.assert_allclose(theirs, ours, rtol=1e-5, atol=1e-6 * np.abs(ours).max())


BAD = {
    "no library": (
        'library = "mohr_coulomb.so"', 'library = "mohr_coulumb.so"', "material.sand: there is no library '",
    ),
    "no number of state variables": ("state_variables = 1", "state_variables = -1", "material.sand.state_variables"),
    "too many": (
        "state_variables = 1", "state_variables = 1\ninitial_state = [1, 2]",
        "material.sand.initial_state: has 2 numbers, but state_variables is 1",
    ),
    "plane stress": ("state_variables = 1", "components = 3", "material.sand.components: must be"),
    "no such key": ("properties", "propertes", "did you mean 'properties'?"),
    "field": ('"stress"', '"sdv2"', "output.fields: no material here has a field 'sdv2'; did you mean 'sdv1'?"),
}  # fmt: skip


@pytest.mark.parametrize(("old", "new", "sentence"), BAD.values(), ids=BAD)
def test_bad_cases_get_a_sentence(
    scene: Path, capsys: pytest.CaptureFixture, old: str, new: str, sentence: str
) -> None:
    text = (scene / "umat.toml").read_text(encoding="utf-8")
    assert old in text
    case = scene / "bad.toml"
    case.write_text(text.replace(old, new), encoding="utf-8")
    assert main(["check", str(case)]) == BAD_INPUT
    assert sentence in capsys.readouterr().err


def test_strength_of_a_routine_cannot_be_divided(scene: Path) -> None:
    case = read_case(scene / "umat.toml")
    tables = case.model_dump(exclude_none=True)
    tables["stage"] = [*tables["stage"][:1], {"name": "safety", "kind": "strength_reduction"}]
    with pytest.raises(CaseError, match=r"material\.sand: is an external routine"):
        case_from(tables, scene / "umat.toml")


def test_check_umat_finds_what_is_bad(scene: Path, capsys: pytest.CaptureFixture) -> None:
    good = [str(scene / "mohr_coulomb.so"), "--state-variables", "1", "--properties", *PARAMETERS[1:-1].split(", ")]
    assert main(["check-umat", *good]) == DONE
    assert "DDSDDE is the derivative of STRESS" in capsys.readouterr().out
    assert main(["check-umat", str(scene / "faulty.so"), "--properties", "1"]) == RED
    captured = capsys.readouterr()
    assert "bad   The routine changes its inputs: DSTRAN." in captured.out
    assert "findings are bad" in captured.err


WORDS = {
    "no library": (["check-umat", "none.so"], "there is no library 'none.so'"),
    "stress": (["check-umat", "none.so", "--stress", "1", "2"], "--stress takes 3 or 6 numbers, got 2"),
    "sand": (["export-umat", "--material", "toyora", "--out", "x.so"], "did you mean 'toyoura'?"),
    "units": (["export-umat", "--material", "toyoura", "--out", "x.so", "--units", "kN"], "--units: 'kN' is not"),
    "folder": (["export-umat", "--material", "toyoura", "--out", "none/x.so"], "there is no folder 'none'"),
    "processor": (["export-umat", "--material", "toyoura", "--out", "x.so", "--cpu", "i8088"], "no processor 'i8088'"),
    "rule": (
        ["export-umat", "--material", "toyoura", "--out", "x.so", "--directions", "lebedev_4"],
        "there is no Lebedev rule of degree 4",
    ),
}


@pytest.mark.parametrize(("words", "sentence"), WORDS.values(), ids=WORDS)
def test_wrong_words_get_a_sentence(words: list[str], sentence: str, capsys: pytest.CaptureFixture) -> None:
    assert main(words) == BAD_INPUT
    error = capsys.readouterr().err
    assert sentence in error
    assert error.count("\n") == 1


def test_only_the_sand_of_a_case_can_be_exported(scene: Path, capsys: pytest.CaptureFixture) -> None:
    words = ["export-umat", "--material", "sand", "--out", "x.so", "--case", str(scene / "own.toml")]
    assert main(words) == BAD_INPUT
    assert "only the model chang_hicher can be exported" in capsys.readouterr().err


@pytest.mark.skipif(not COMPILED, reason="machine code needs numba's compiler")
def test_the_sand_of_a_case_is_exported(scene: Path, tmp_path: Path, capsys: pytest.CaptureFixture) -> None:
    """With its own parameters, rule and fabric; the routine then conforms to the contract it was written for."""
    sand = """model = "chang_hicher"
preset = "toyoura"
void_ratio = 0.8
directions = "bazant_oh_21"
fabric = { norm = 0.2, bedding_angle = 30.0 }
"""
    case = tmp_path / "sand.toml"
    case.write_text(CASE.replace(OWN, sand), encoding="utf-8")
    library = tmp_path / "libch.so"
    code = main(["export-umat", "--material", "sand", "--case", str(case), "--out", str(library)])
    captured = capsys.readouterr()
    if "no linker was found" in captured.err:
        pytest.skip(captured.err)
    assert code == DONE
    assert "NSTATV = 32, stress in kPa" in captured.out
    assert "PROPS of the case: 0.8, 0.2, 30, 0" in captured.out
    words = ["check-umat", str(library), "--properties", "0.8", "0.2", "30", "--state-variables", "32"]
    assert main(words) == DONE
    report = capsys.readouterr().out
    assert "does not turn with the strain" in report, "the bedding is a direction of the sand"
    assert "bad" not in report.split()
