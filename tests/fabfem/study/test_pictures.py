"""Pictures, states and measured curves of sweeps, and the gallery, with a material that costs nothing."""

import csv
import json
from pathlib import Path

import numpy as np
import pytest

from fabfem.case import CaseError, read_case
from fabfem.cli import main
from fabfem.gallery import case_files
from fabfem.study.states import exponential
from fabfem.study.sweep import sweep

CASE = """
title = "elastic compression"

[scene]
kind = "element"

[material.rock]
model = "elastic"
youngs_modulus = 1e4
poisson_ratio = 0.2

[initial]
p = 100.0

[[stage]]
name = "shear"
kind = "triaxial"
drainage = "drained"
axial_strain = 0.01
increments = 10

[output]
measures = ["p", "q", "gamma", "eps_axial"]

[sweep]
rows = "all"
workers = 1

[[sweep.parameter]]
name = "test"
at = "initial.p"
values = [100.0, 200.0]
along = { "material.rock.youngs_modulus" = [1e4, 2e4] }
labels = ["soft", "stiff"]
"""
PICTURE = """
[[sweep.picture]]
name = "stress"
x = ["gamma", "p"]
y = ["q", "q"]
until = { column = "eps_axial", value = 0.0055 }
"""
MEASURED = """
[sweep.measured]
data = "data.csv"
where = { name = "test" }
over = { data = "strain", history = "eps_axial", scale = 100.0 }
curve = [{ data = "stress", history = "q" }]
"""
DATA = "name,strain,stress\nsoft,0.0,1.0\nsoft,0.5,49.0\nsoft,2.0,0.0\nstiff,0.0,0.0\nstiff,1.0,200.0\n"


def written(folder: Path, text: str, name: str = "case.toml") -> Path:
    folder.mkdir(parents=True, exist_ok=True)
    (folder / name).write_text(text, encoding="utf-8")
    return folder / name


def rows(file: Path) -> list[dict[str, str]]:
    with file.open(encoding="utf-8") as lines:
        return list(csv.DictReader(lines))


@pytest.fixture(scope="module")
def swept(tmp_path_factory):
    folder = tmp_path_factory.mktemp("sweep")
    (folder / "data.csv").write_text(DATA, encoding="utf-8")
    file = written(folder, CASE + MEASURED + PICTURE)
    assert main(["sweep", str(file), "--out", str(folder / "out"), "--quiet"]) == 0
    return folder / "out"


@pytest.mark.parametrize(("label", "pressure", "modulus"), [("soft", 100.0, 1e4), ("stiff", 200.0, 2e4)])
def test_values_of_several_places_go_together(swept, label, pressure, modulus):
    mine = [row for row in rows(swept / "sweep.csv") if row["test"] == label]
    assert float(mine[0]["p [kPa]"]) == pressure
    assert float(mine[-1]["q [kPa]"]) == pytest.approx(0.01 * modulus, rel=1e-8)
    assert float(mine[-1]["gamma [-]"]) == pytest.approx(0.012, rel=1e-8)  # (1 + nu) times the axial strain


def test_no_two_columns_have_one_name(tmp_path):
    """A parameter p has the values asked for, a measure p those of the history: both are kept."""
    file = written(tmp_path, CASE.replace('name = "test"', 'name = "p"'))
    assert main(["sweep", str(file), "--out", str(tmp_path / "out"), "--quiet"]) == 0
    found = rows(tmp_path / "out" / "sweep.csv")
    assert {row["p"] for row in found} == {"soft", "stiff"}
    assert float(found[0]["p_history [kPa]"]) == 100.0
    assert "p [kPa]" not in found[0]


def test_measured_curves_are_compared_up_to_the_end_of_the_run(swept):
    found = {row["test"]: row for row in rows(swept / "measured.csv")}
    assert int(found["soft"]["points"]) == 2  # the point at 2 % lies beyond the end
    assert float(found["soft"]["root_mean_square"]) == pytest.approx(1.0, rel=1e-4)
    assert float(found["stiff"]["largest"]) == pytest.approx(0.0, abs=1e-6)
    assert float(found["all"]["root_mean_square"]) == pytest.approx(0.5**0.5, rel=1e-3)


def test_pictures_of_a_sweep_are_drawn_again_by_show(swept):
    pictures = [swept / "stress.png", swept / "measured.png"]
    for picture in pictures:
        picture.unlink()
    assert main(["show", str(swept), "--quiet"]) == 0
    assert all(picture.stat().st_size > 5000 for picture in pictures)


@pytest.mark.parametrize(("file", "module"), [("study.json", "work_precision"), ("calibration.json", "calibration")])
def test_show_draws_studies_and_calibrations_again(file, module, tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(f"fabfem.pictures.{module}.draw", lambda folder: folder / "drawn.png")
    (tmp_path / file).write_text("{}", encoding="utf-8")
    assert main(["show", str(tmp_path)]) == 0
    assert capsys.readouterr().out == f"{tmp_path / 'drawn.png'}\n"


def test_a_picture_ends_where_it_is_told(swept):
    from fabfem.pictures.sweep import _read, _runs

    until = {"until": {"column": "eps_axial", "value": 0.0055}}
    runs = _runs(_read(swept / "sweep.csv")[0], ["test"], until)
    assert [run["test"] for run in runs] == ["soft", "stiff"]
    assert all(run["columns"]["eps_axial"][-1] == pytest.approx(0.005) for run in runs)


@pytest.mark.parametrize(
    ("kept", "across", "points"), [('rows = "all"\ncolumns = ["p", "q"]', "p", 11), ('rows = "last"', "test", 2)]
)
def test_a_sweep_that_asks_for_no_picture_has_one(kept, across, points, tmp_path, monkeypatch):
    """Histories over their first column, a line for each run; ends over the parameter, by its labels."""
    from fabfem.pictures import sweep as pictures

    drawn = []
    monkeypatch.setattr(pictures, "_saved", lambda figure, folder, *_: drawn.append(figure) or folder / "sweep.png")
    file = written(tmp_path, CASE.replace('rows = "all"', kept))
    assert main(["sweep", str(file), "--out", str(tmp_path / "out"), "--quiet"]) == 0
    (figure,) = drawn
    axes = [ax for ax in figure.axes if "q" in ax.get_ylabel().split()]
    assert [pictures._label(across, {}) in ax.get_xlabel() for ax in axes] == [True]
    lines = axes[0].get_lines()
    assert [len(line.get_xdata()) for line in lines] == ([points] * 2 if across == "p" else [points])
    assert float(lines[-1].get_ydata()[-1]) == pytest.approx(200.0, rel=1e-6)


WRONG = {
    "there is no parameter 'tset'; did you mean 'test'": PICTURE + 'colour = "tset"\n',
    "x and y must be lists of one length": PICTURE.replace('["gamma", "p"]', '["gamma"]'),
    "2 values, but 1 along with them for material.rock.youngs_modulus": "",
    "2 values and 1 labels": "",
    "draws whole histories": PICTURE,
}
CHANGES = {
    "2 values, but 1 along with them for material.rock.youngs_modulus": ("[1e4, 2e4]", "[1e4]"),
    "2 values and 1 labels": ('"soft", "stiff"', '"soft"'),
    "draws whole histories": ('rows = "all"', 'rows = "last"'),
}


@pytest.mark.parametrize("sentence", WRONG)
def test_wrong_pictures_and_values_get_a_sentence(tmp_path, sentence):
    text = (CASE + WRONG[sentence]).replace(*CHANGES.get(sentence, ("", "")))
    with pytest.raises(CaseError, match=sentence):
        read_case(written(tmp_path, text))


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        (('y = ["q", "q"]', 'y = ["q", "qq"]'), "no column 'qq'; did you mean 'q'"),
        (('where = { name = "test" }', 'where = { nam = "test" }'), "no column 'nam'; did you mean 'name'"),
        (('data = "data.csv"', 'data = "date.csv"'), "cannot be read"),
    ],
)
def test_wrong_columns_are_named_and_no_run_is_lost(tmp_path, capsys, change, sentence):
    (tmp_path / "data.csv").write_text(DATA, encoding="utf-8")
    file = written(tmp_path, (CASE + MEASURED + PICTURE).replace(*change))
    assert main(["sweep", str(file), "--out", str(tmp_path / "out"), "--quiet"]) == 2
    assert sentence in capsys.readouterr().err
    assert len(rows(tmp_path / "out" / "sweep.csv")) == 22


@pytest.mark.parametrize(("factor", "rate"), [(0.5, -12.0), (0.8, 2.5)])
def test_exponentials_are_found(factor, rate):
    x = np.linspace(-0.1, 0.1, 9)
    best = exponential(x, factor * np.exp(rate * x))
    assert best is not None
    assert best == pytest.approx((factor, rate, 1.0, 9))
    assert exponential(x[:2], x[:2] + 1.0) is None
    assert exponential(np.ones(4), np.arange(1.0, 5.0)) is None


LIQUEFYING = """
[material.sand]
model = "chang_hicher"
preset = "toyoura"
void_ratio = 1.05
directions = "bazant_oh_37"
fabric = { norm = 0.0 }
"""


def test_states_of_all_runs_are_gathered(tmp_path):
    text = CASE.replace(CASE[CASE.index("[material") : CASE.index("[initial]")], LIQUEFYING + "\n")
    text = (
        text.replace('"drained"', '"undrained"').replace("0.01", "0.018").replace("increments = 10", "increments = 36")
    )
    text = text.replace('"gamma"', '"eta", "psi", "gamma"').replace('rows = "all"', "")
    text = text[: text.index("[[sweep.parameter]]")] + (
        '[[sweep.parameter]]\nname = "p0"\nat = "initial.p"\nvalues = [100.0, 150.0, 200.0]\n'
        '[[sweep.picture]]\nname = "unstable"\nx = "start_psi"\ny = "eta"\nstates = ["instability"]\n'
    )
    assert main(["sweep", str(written(tmp_path, text)), "--out", str(tmp_path / "out"), "--quiet"]) == 0
    found = [row for row in rows(tmp_path / "out" / "states.csv") if row["state"] == "instability"]
    assert [row["p0"] for row in found] == ["100", "150", "200"]
    assert all(float(row["p"]) < float(row["p0"]) and 0.3 < float(row["eta"]) < 1.2 for row in found)
    fit = json.loads((tmp_path / "out" / "sweep.json").read_text(encoding="utf-8"))["fits"]["unstable"][0]
    assert fit["points"] == 3
    assert (tmp_path / "out" / "unstable.png").stat().st_size > 5000


@pytest.fixture(scope="module")
def shown(tmp_path_factory):
    folder = tmp_path_factory.mktemp("gallery")
    written(folder / "cases", CASE[: CASE.index("[sweep]")], "a_single.toml")
    written(folder / "cases", CASE.replace("increments", "incremnts"), "b_misspelt.toml")
    written(folder / "cases", CASE + PICTURE, "c_sweep.toml")
    status = main(["gallery", str(folder / "cases"), "--out", str(folder / "out"), "--pictures", str(folder / "kept")])
    return folder, status


def test_a_gallery_goes_on_past_a_failure_and_says_so(shown):
    folder, status = shown
    assert status == 3
    said = {row["case"]: row for row in json.loads((folder / "out" / "gallery.json").read_text(encoding="utf-8"))}
    assert [row["status"] for row in said.values()] == ["completed", "refused", "completed"]
    assert "incremnts" in said["b_misspelt"]["reason"]
    assert said["c_sweep"]["runs"] == 2
    assert all(row["seconds"] > 0.0 for row in said.values() if row["status"] == "completed")


def test_a_gallery_keeps_copies_of_its_pictures(shown):
    assert sorted(file.name for file in (shown[0] / "kept").iterdir()) == ["a_single_curves.png", "c_sweep_stress.png"]


def test_a_gallery_repeats_no_run(shown, monkeypatch):
    folder, _ = shown
    before = {file: file.stat().st_mtime_ns for file in (folder / "out").rglob("history.csv")}
    main(["gallery", str(folder / "cases"), "--out", str(folder / "out"), "--quiet"])
    assert before == {file: file.stat().st_mtime_ns for file in (folder / "out").rglob("history.csv")}


@pytest.mark.parametrize("where", ["nowhere", "cases"])
def test_a_gallery_of_nothing_is_refused(tmp_path, monkeypatch, capsys, where):
    (tmp_path / "cases").mkdir()
    monkeypatch.chdir(tmp_path)
    assert main(["gallery", where]) == 2
    assert "case" in capsys.readouterr().err


ROOT = Path(__file__).parents[3]


@pytest.mark.parametrize("name", ["element", "fabric"])
def test_every_case_of_the_gallery_is_one_and_is_described(monkeypatch, name):
    monkeypatch.chdir(ROOT)
    text = (ROOT / "cases" / "README.md").read_text(encoding="utf-8")
    for file in case_files(Path(name)):
        assert read_case(file).scene.kind == name
        assert f"`{file.stem}`" in text


def test_the_tests_of_khayyer_are_108():
    case = read_case(ROOT / "cases" / "element" / "khayyer_13_15_states.toml")
    assert case.sweep is not None
    (parameter,) = case.sweep.parameter
    tests = zip(parameter.values, *parameter.along.values(), strict=True)
    wanted = [f"CI{'U' if how == 'undrained' else 'D'}-{p:.0f}-{e:.3f}" for p, e, how in tests]
    assert list(parameter.labels or ()) == wanted
    assert [sum(name.startswith(kind) for name in wanted) for kind in ("CIU", "CID")] == [54, 54]


def test_a_sweep_takes_the_processes_it_is_given(swept):
    class Refusing:
        def run(self, jobs):
            assert not jobs  # all runs are kept from before
            return iter(())

    done = sweep(swept.parent / "case.toml", swept, quiet=True, pool=Refusing())  # type: ignore[arg-type]
    assert (done.runs, done.completed) == (2, 2)
