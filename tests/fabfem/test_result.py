"""The program as a library: what a notebook gets from a run."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pandas
import pytest
import pyvista

import fabfem
from fabfem.case import CaseError

ROOT = Path(__file__).parents[2]


def test_solve_gives_a_result(folder: Path) -> None:
    result = fabfem.solve(folder / "case.toml", folder / "out")
    assert result.completed
    assert (result.status, result.reason) == ("completed", "")
    settlement, force = result.history["settlement"], result.history["force"]
    assert settlement.dtype == np.float64
    assert settlement[-1] == pytest.approx(0.04)
    assert result.units["settlement"] == "m"
    assert result.units["force"] == "kN/m"
    assert list(result.history["stage"]) == ["geostatic"] + ["settlement"] * (len(force) - 1)
    assert result.report["title"] == "small footing"
    assert "completed" in repr(result)


def test_the_history_is_one_for_pandas(result: Path) -> None:
    found = fabfem.open_result(result)
    table = found.dataframe()
    pandas.testing.assert_frame_equal(table, pandas.DataFrame(found.history))
    assert table.attrs["units"]["settlement"] == "m"
    assert table["settlement"].max() == pytest.approx(0.04)
    read = pandas.read_csv(result / "history.csv")
    np.testing.assert_array_equal(read["settlement [m]"], table["settlement"])
    assert table.groupby("stage")["settlement"].max()["geostatic"] == pytest.approx(0.0, abs=1e-15)


def test_a_grid_for_each_stored_increment(result: Path) -> None:
    found = fabfem.open_result(result)
    assert len(found.times) >= 5
    first, last = found.grid(0), found.grid()
    assert isinstance(last, pyvista.UnstructuredGrid)
    assert np.abs(first["displacement"]).max() < np.abs(last["displacement"]).max()
    assert last["displacement"][:, 1].min() == pytest.approx(-0.04)
    assert last.point_data["stress"].shape == (last.n_points, 6)
    with pytest.raises(IndexError, match="stored increments"):
        found.grid(len(found.times))


def test_tables_and_cases_are_taken_too(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    import tomllib

    monkeypatch.chdir(folder)
    tables = tomllib.loads(Path("case.toml").read_text(encoding="utf-8"))
    first = fabfem.solve(tables)
    assert first.folder == Path("results") / "case"
    second = fabfem.solve(fabfem.read_case("case.toml"), "again")
    np.testing.assert_array_equal(first.history["force"], second.history["force"])
    further = fabfem.solve("case.toml", "again", resume=True)
    np.testing.assert_array_equal(further.history["force"], second.history["force"])


def test_an_element_test_has_no_grid(tmp_path: Path) -> None:
    element = {
        "scene": {"kind": "element"},
        "material": {"soil": {"model": "elastic", "youngs_modulus": 100.0}},
        "initial": {"p": 1.0},
        "stage": [{"name": "more", "kind": "isotropic", "to": 2.0, "increments": 3}],
    }
    found = fabfem.solve(element, tmp_path)
    assert found.history["p"][-1] == pytest.approx(2.0)
    assert found.times == ()
    with pytest.raises(IndexError, match="has 0 stored increments"):
        found.grid()


def test_what_goes_wrong_is_raised_with_a_sentence(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(fabfem.CaseError, match="there is no such file"):
        fabfem.solve(folder / "nothing.toml")
    with pytest.raises(CaseError, match="holds no result"):
        fabfem.open_result(folder)
    with pytest.raises(AttributeError, match="no attribute 'sovle'"):
        fabfem.sovle  # noqa: B018
    assert {"solve", "Result", "open_result"} <= set(dir(fabfem))

    def full(*given: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("fabfem.output.history.History.write", full)
    with pytest.raises(OSError, match="cannot be written"):
        fabfem.solve(folder / "case.toml", folder / "out")


def test_a_stopped_run_is_a_result_too(folder: Path) -> None:
    text = (folder / "case.toml").read_text(encoding="utf-8")
    text = text.replace("initial = 0.25, maximum = 0.25", "initial = 0.25, minimum = 0.25, maximum = 0.25")
    (folder / "case.toml").write_text(text + "\n[solver]\niterations = 1\n", encoding="utf-8")
    found = fabfem.solve(folder / "case.toml", folder / "out")
    assert not found.completed
    assert found.status == "stopped"
    assert "stage settlement stopped" in found.reason


def test_the_program_as_a_module() -> None:
    done = subprocess.run([sys.executable, "-m", "fabfem", "--version"], capture_output=True, text=True, check=True)
    assert done.stdout == f"fabfem {fabfem.__version__}\n"


def test_a_reader_that_goes_away_is_no_error() -> None:
    command = f"{sys.executable} -m fabfem schema | head -c 1; echo ${{PIPESTATUS[0]}}"
    done = subprocess.run(["bash", "-c", command], cwd=ROOT, capture_output=True, text=True, check=True)
    assert (done.stdout, done.stderr) == ("{0\n", "")


def test_the_view_for_paraview_names_what_is_stored(result: Path) -> None:
    """The script is whole Python, and what it asks for is in the fields, as pyvista reads them."""
    text = (result / "view.py").read_text(encoding="utf-8")
    compile(text, "view.py", "exec")
    assert "COLOUR, STRETCH = 'q', 1.0" in text
    assert {"q", "displacement"} <= set(fabfem.open_result(result).grid().point_data)


@pytest.mark.skipif(not (shutil.which("pvpython") and shutil.which("xvfb-run")), reason="ParaView is not here")
def test_paraview_draws_the_view(result: Path, tmp_path: Path) -> None:
    """Moved away from where it was made; as a picture and as a state of ParaView's own."""
    shutil.copytree(result, tmp_path / "moved")
    environment = {key: value for key, value in os.environ.items() if not key.startswith("PYTHON")}
    for out in ("view.png", "view.pvsm"):
        command = ["xvfb-run", "-a", "pvpython", str(tmp_path / "moved" / "view.py"), str(tmp_path / out)]
        done = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=500, check=False)
        if "bad X server connection" in done.stderr:
            pytest.skip("the X server was not there in time")
        assert done.returncode == 0, done.stderr
    picture = pyvista.read(tmp_path / "view.png")["PNGImage"]
    assert len(np.unique(picture.reshape(-1, picture.shape[-1]), axis=0)) > 500
    state = (tmp_path / "view.pvsm").read_text(encoding="utf-8")
    assert str(tmp_path / "moved" / "fields.pvd") in state
