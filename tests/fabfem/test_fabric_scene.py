"""Cases on fabric laws alone: every case in the folder, bad input, files of columns, results and pictures."""

import csv
import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fabfem.case import read_case
from fabfem.cli import main
from fabfem.commands.status import BAD_INPUT, DONE, STOPPED

CASES = Path(__file__).parents[2] / "cases" / "fabric"
LAW = '[scene]\nkind = "fabric"\n[law.mine]\nlaw = "li_dafalias"\n'
FILE = '[history]\nfile = "given.csv"\n'
PROBE = "[probe]\nstress = [60, 140, 100, 0, 0, 0]\n"
ROWS = ["strain_zz [-],strain_xx,strain_yy,stress_zz [kPa],stress_xx [kPa],stress_yy [kPa],psi,stage"] + [
    f"{2 * x:.4f},{-x:.4f},{-x:.4f},{100 + 4000 * x / (1 + 40 * x):.4f},100,100,-0.1,shear"
    for x in np.linspace(0.0, 0.1, 21)
]


def solve(folder: Path, text: str, rows: list[str] | None = None, expected: int = DONE) -> Path:
    """Run a case and return the folder of its results."""
    (folder / "case.toml").write_text(text, encoding="utf-8")
    (folder / "given.csv").write_text("\n".join(rows or ROWS) + "\n", encoding="utf-8")
    assert main(["solve", str(folder / "case.toml"), "--out", str(folder / "out"), "--quiet"]) == expected
    return folder / "out"


def history(folder: Path) -> list[dict[str, str]]:
    with (folder / "history.csv").open(encoding="utf-8", newline="") as file:
        return [{key.split(" [")[0]: value for key, value in row.items()} for row in csv.DictReader(file)]


def curves(folder: Path) -> list[dict[str, Any]]:
    return json.loads((folder / "report.json").read_text(encoding="utf-8"))["curves"]


# --- the cases of the figures -------------------------------------------------------------------------------------


@pytest.mark.parametrize("path", sorted(CASES.glob("*.toml")), ids=lambda path: path.stem)
def test_every_case_is_read_and_its_pictures_name_its_laws(path: Path) -> None:
    case = read_case(path)
    assert case.title
    assert case.scene.kind == "fabric"


def run(name: str, folder: Path) -> list[dict[str, Any]]:
    assert main(["solve", str(CASES / f"{name}.toml"), "--out", str(folder), "--quiet"]) == DONE
    return curves(folder)


def test_dense_sample_peaks_as_the_paper_says(tmp_path: Path) -> None:
    """[Y Fig 8]: peak F_q rises with b in the law with b and falls in the older one, peak q/p falls; F_b ends at b."""
    found = run("yuan_8_11_dense", tmp_path)
    with_b, older = ([one for one in found if one["law"] == name] for name in ("with_b", "older"))
    assert len(with_b) == len(older) == 6
    assert np.all(np.diff([one["F_q_peak"] for one in with_b]) > 0.0)
    assert older[-1]["F_q_peak"] < 0.9 * older[0]["F_q_peak"]
    assert with_b[-1]["eta_peak"] < 0.9 * with_b[0]["eta_peak"]
    assert with_b[0]["F_q_peak"] == pytest.approx(older[0]["F_q_peak"], rel=1e-4)
    assert all(one["F_q_peak_record"] > one["eta_peak_record"] for one in with_b)  # the lag of the fabric
    np.testing.assert_allclose([one["F_b_end"] for one in with_b], np.linspace(0.0, 1.0, 6), atol=1e-3)


@pytest.mark.parametrize("name", ["probe_015", "probe_030", "probe_040", "probe_044"])
def test_probes_are_sinusoidal_and_turn_with_the_strain(name: str, tmp_path: Path) -> None:
    found = {one["law"]: one for one in run(name, tmp_path)}
    for one in found.values():
        assert one["asymmetry_on_reversal"] == 0.0
        assert one["not_sinusoidal_Z"] < 1e-10 > one["not_sinusoidal_A"]
    assert found["four_refitted"]["distance_from_first"] < found["three_refitted"]["distance_from_first"]
    assert found["uniform"]["distance_from_first"] > 0.9


def test_coordination_number_of_the_isobaric_test(tmp_path: Path) -> None:
    """Z = 3.846 at A = .320 [P Table 1], from the parameters of [P Table 2]."""
    run("probe_2d_isobaric", tmp_path)
    end = [row for row in history(tmp_path) if row["law"] == "by_anisotropy"][-1]
    assert float(end["A"]) == pytest.approx(0.320, abs=1e-3)
    assert float(end["Z"]) == pytest.approx(3.846, abs=2e-3)
    assert end["F_q"] == end["F_b"] == ""


def test_critical_surfaces_have_the_extremes_of_their_sources(tmp_path: Path) -> None:
    """[Y §3]: M_ct = .62, M_Ft = .77; [ZK 7, 8]: the product of M and F_c does not depend on the Lode angle."""
    found = {one["law"]: one for one in run("critical_surfaces", tmp_path)}
    assert found["yuan"]["M_extension"] == pytest.approx(0.62, abs=2e-3)
    assert found["yuan"]["F_extension"] == pytest.approx(0.77)
    assert found["zhao_kruyt"]["spread_of_M_F"] < 1e-12
    assert found["zhao_kruyt"]["M_extension"] == pytest.approx(0.75 * 1.25)
    b = [float(row["b"]) for row in history(tmp_path) if row["law"] == "yuan"]
    assert (b[0], b[60], b[-1]) == pytest.approx((0.0, 0.5, 1.0), abs=1e-12)


@pytest.mark.parametrize(("name", "key", "value"), [("contacts_2d", "Delta", 0.228), ("contacts_3d", "F_norm", 0.208)])
def test_drawn_contacts_have_the_statistics_of_their_density(name: str, key: str, value: float, tmp_path: Path) -> None:
    found = run(name, tmp_path)[-1]
    assert found["contacts"] == 100000
    error = found["Delta_error" if key == "Delta" else "error_norm"]
    assert found[key] == pytest.approx(value, abs=4.0 * error)
    assert error < 0.02


# --- files of columns ---------------------------------------------------------------------------------------------


def test_a_history_from_a_file_is_integrated(tmp_path: Path) -> None:
    """Li & Dafalias with the total strain as plastic: F = F_c0 (1 − exp(−c1 ‖e‖)) along n, to the tolerance."""
    out = solve(tmp_path, LAW + FILE + 'plastic = "total"\n')
    rows = history(out)
    assert len(rows) == 21
    shear = 6.0**0.5 * np.linspace(0.0, 0.1, 21)
    np.testing.assert_allclose([float(row["F_norm"]) for row in rows], 0.48 * (1.0 - np.exp(-10.0 * shear)), atol=1e-6)
    assert float(rows[-1]["state_parameter"]) == -0.1
    assert rows[0]["F_b"] == rows[0]["angle"] == ""
    assert float(rows[-1]["angle"]) == pytest.approx(0.0, abs=1e-4)


def test_columns_that_are_called_otherwise_and_several_paths(tmp_path: Path) -> None:
    rows = [ROWS[0].replace("strain_zz [-]", "axial").replace("stage", "path")]
    rows += [line.replace("shear", name) for name in ("one", "two") for line in ROWS[1:]]
    text = LAW + FILE + 'plastic = "total"\ncolumns = { strain_zz = "axial" }\n'
    found = curves(solve(tmp_path, text, rows))
    assert [one["path"] for one in found] == ["one", "two"]
    assert found[0]["F_q_end"] == found[1]["F_q_end"] > 0.1


def test_implicit_update_tends_to_the_explicit_one(tmp_path: Path) -> None:
    text = LAW + '[law.rough]\nlaw = "li_dafalias"\nupdate = "implicit"\n' + FILE + 'plastic = "total"\n'
    one, other = curves(solve(tmp_path, text))
    assert one["F_q_end"] != other["F_q_end"]
    assert other["F_q_end"] == pytest.approx(one["F_q_end"], rel=0.05)


def test_a_path_that_the_material_cannot_follow_is_kept_to_where_it_stopped(tmp_path: Path) -> None:
    """Pulled apart to no pressure: what was reached is written, and the reason says so."""
    text = LAW + (
        '[material.sand]\nmodel = "chang_hicher"\npreset = "toyoura"\nvoid_ratio = 0.8\n'
        'fabric = { law = "zhao_kruyt" }\n'
        '[loading]\npressure = 100.0\n[[loading.leg]]\nkind = "isotropic"\npressure = -150.0\nrecords = 6\n'
    )
    out = solve(tmp_path, text, expected=STOPPED)
    report = json.loads((out / "report.json").read_text(encoding="utf-8"))
    assert report["status"] == "stopped"
    assert "the material stopped after" in report["reason"]
    assert 1 < len(history(out)) < 7


def test_pictures_are_drawn(tmp_path: Path) -> None:
    text = LAW + FILE + 'plastic = "total"\n[[picture]]\nname = "deviator"\nx = "eta"\ny = "F_q"\n'
    out = solve(tmp_path, text)
    assert main(["show", str(out), "--quiet"]) == DONE
    assert (out / "deviator.png").stat().st_size > 5000


def test_a_picture_of_no_column(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = solve(tmp_path, LAW + PROBE + '[[picture]]\nname = "deviator"\nx = "chi"\ny = "dZZ"\n')
    assert main(["show", str(out), "--quiet"]) == BAD_INPUT
    assert "picture[deviator]: the history has no column 'dZZ'; did you mean 'dZ'?" in capsys.readouterr().err


# --- bad input ----------------------------------------------------------------------------------------------------

SAND = '[material.sand]\nmodel = "chang_hicher"\npreset = "toyoura"\nvoid_ratio = 0.8\n'
LEG = '[[loading.leg]]\nkind = "constant_p"\nstrain = 0.1\n'
PLANE = '[scene]\nkind = "fabric"\n[law.mine]\nlaw = "probe_2d"\n'
BAD = {
    "no drive": (LAW, "the file: needs exactly one of [history], [loading], [probe], [surface], [contacts] (got 0)"),
    "two drives": (LAW + PROBE + "[surface]\n", "(got 2)"),
    "no law": ('[scene]\nkind = "fabric"\n' + PROBE, "law: is missing"),
    "unknown law": (
        LAW.replace("li_daf", "li_duf") + PROBE,
        "law.mine.law: there is no fabric law 'li_dufalias'",
    ),
    "unknown parameter": (
        LAW + "parameters = { rat = 1.0 }\n" + PROBE,
        "law.mine.parameters.rat: is not a known",
    ),
    "no such form": (
        LAW + 'form = "older"\n' + PROBE,
        "law.mine.form: the law 'li_dafalias' has no form 'older'",
    ),
    "no such sample": (PLANE + "sample = 0.2\n" + PROBE, "law.mine.sample: no sample was probed at q/p = 0.2"),
    "sample of another law": (LAW + "sample = 0.15\n" + PROBE, "law.mine.sample: the law 'li_dafalias' has no samples"),
    "no start in the plane": (PLANE + PROBE, "start.components: is missing; the law 'mine' is of the plane"),
    "no critical state": (LAW + "[surface]\n", "law.mine: names no critical q/p"),
    "no file": (LAW + '[history]\nfile = "lost.csv"\n', "history.file: lost.csv cannot be read (No such file"),
    "no plastic strain": (
        LAW + FILE,
        "history.file: has no plastic_strain, which the law 'mine' reads; plastic",
    ),
    "no such column": (
        LAW + FILE + 'columns = { strain_zz = "axial" }\n',
        "history.columns.strain_zz: the file has no column 'axial'",
    ),
    "no column of a history": (
        LAW + FILE + 'columns = { strain_zx = "psi" }\n',
        "strain_zx: is no column of",
    ),
    "no such stage": (
        LAW + FILE + 'stage = "creep"\n',
        "has no stage 'creep' of two records at least; there",
    ),
    "no material": (LAW + "[loading]\npressure = 100.0\n" + LEG, "material: [loading] needs exactly one material"),
    "idle material": (LAW + SAND + PROBE, "material: is only for a [loading]"),
    "rate form": (
        LAW + SAND + 'localisation = "rate"\n[loading]\npressure = 100.0\n' + LEG,
        "material.sand.localisation: must be 'total'",
    ),
    "leg without strain": (
        LAW + SAND + "[loading]\npressure = 100.0\n" + LEG.replace("strain", "pressure"),
        "loading.leg[1].strain: is missing",
    ),
    "inclined triaxial": (
        LAW + SAND + "[loading]\npressure = 100.0\nb = 0.5\n" + LEG.replace("constant_p", "triaxial"),
        "loading.leg[1].kind: 'triaxial' is along z with b = 0",
    ),
    "picture of no law": (
        LAW + PROBE + '[[picture]]\nname = "a"\nx = "chi"\ny = "dZ"\npanels = [["min"]]\n',
        "picture[a].panels: there is no law 'min'; did you mean 'mine'?",
    ),
    "impossible density": (
        '[scene]\nkind = "fabric"\n[contacts]\ndimension = 2\nintensity = 0.7\n',
        "contacts: the intensity of a density with one harmonic lies between 0 and 0.5",
    ),
    "no normals": (
        '[scene]\nkind = "fabric"\n[contacts]\nfile = "given.csv"\n',
        "given.csv needs columns nx",
    ),
}


@pytest.mark.parametrize("command", ["check", "solve"])
@pytest.mark.parametrize("name", BAD)
def test_bad_input_exits_2_with_one_sentence(
    name: str, command: str, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    text, expected = BAD[name]
    Path("case.toml").write_text(text, encoding="utf-8")
    Path("given.csv").write_text("\n".join(ROWS) + "\n", encoding="utf-8")
    assert main([command, "case.toml"]) == BAD_INPUT
    said = capsys.readouterr().err
    assert expected in said
    assert said.count("\n") == 1
    assert not Path("results").exists()


@pytest.mark.parametrize(
    ("line", "expected"),
    [("0.1,x,0,100,100,100,0,shear", "row 23, column 'strain_xx': no number ('x')"),
     ("0.1,nan,0,100,100,100,0,shear", "row 23, column 'strain_xx': not finite (nan)"),
     ("0.1", "row 23: has 1 entries where the header has 8"),
     ("0,0,0,-100,-100,-100,0,shear", "the mean pressure must be positive"),
     ("0,0,0,100,100,100,0,creep", "has the stages shear, creep; history.stage must say which")],
)  # fmt: skip
def test_a_bad_row_is_named(line: str, expected: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    text = '[scene]\nkind = "fabric"\n[law.mine]\nlaw = "yuan"\n' + FILE + 'plastic = "total"\n'
    solve(tmp_path, text, [*ROWS, line], expected=BAD_INPUT)
    assert expected in capsys.readouterr().err


def test_a_case_on_laws_imports_nothing_of_the_finite_elements(tmp_path: Path) -> None:
    (tmp_path / "case.toml").write_text(LAW + PROBE, encoding="utf-8")
    heavy = ("fabfem.fem", "fabfem.boundary_value", "skfem", "meshio", "matplotlib", "umat.chang_hicher")
    code = (
        "import sys; from fabfem.cli import main; "
        f"main(['solve', 'case.toml', '--out', 'out', '--quiet']); print([n for n in {heavy} if n in sys.modules])"
    )

    done = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, check=True, capture_output=True, text=True)
    assert done.stdout.strip() == "[]"
