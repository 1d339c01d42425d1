"""What a run leaves behind, and what is left of it when it is killed."""

import json
import math
import signal
import subprocess
import sys
import time
from pathlib import Path
from xml.etree import ElementTree

import meshio
import numpy as np
import pytest
import pyvista
from vtkmodules.vtkIOXML import vtkXMLUnstructuredGridReader

from fabfem.boundary_value.fields import point_fields
from fabfem.boundary_value.frame import in_vtk_order
from fabfem.boundary_value.problem import build
from fabfem.case import read_case
from fabfem.fem.solve import Increment, march
from fabfem.output.atomic import write_atomic
from fabfem.output.history import History, read_history
from fabfem.output.report import WORST, Report
from fabfem.output.vtu import CELL_TYPES, FieldFiles, Frame
from fabfem.run import run_case
from umat.mandel import from_tensor

PHASES = {"read", "mesh", "material", "assembly", "linear_solve", "output", "other", "total"}


def _frames(folder: Path) -> list[tuple[float, Path]]:
    sets = ElementTree.parse(folder / "fields.pvd").getroot().iter("DataSet")
    return [(float(entry.attrib["timestep"]), folder / entry.attrib["file"]) for entry in sets]


def test_history_has_units_and_a_row_per_increment(result: Path) -> None:
    headers, rows = read_history(result / "history.csv")
    assert headers[:4] == ["stage", "increment [-]", "time [-]", "iterations [-]"]
    assert headers[4:] == ["settlement [m]", "force [kN/m]", "q/(gamma B) [-]"]
    assert [int(row[1]) for row in rows] == list(range(1, len(rows) + 1))
    assert float(rows[-1][4]) == pytest.approx(0.04)
    assert float(rows[-1][6]) == pytest.approx(float(rows[-1][5]) / 15.3)
    assert float(rows[-1][5]) > 0.0


def test_three_readers_open_the_fields(result: Path) -> None:
    _, path = _frames(result)[-1]
    by_meshio, by_pyvista = meshio.read(path), pyvista.read(path)
    reader = vtkXMLUnstructuredGridReader()
    reader.SetFileName(str(path))
    reader.Update()
    stress = reader.GetOutput().GetPointData().GetArray("stress")
    assert [stress.GetComponentName(i) for i in range(6)] == ["XX", "YY", "ZZ", "XY", "YZ", "XZ"]
    np.testing.assert_array_equal(by_meshio.point_data["stress"], by_pyvista.point_data["stress"])
    np.testing.assert_array_equal(by_meshio.cell_data["p"][0], by_pyvista.cell_data["p"])
    assert by_pyvista.field_data["compression_positive"] == [1]
    assert by_pyvista.field_data["TimeValue"] == [2.0]
    assert set(by_pyvista.point_data) == {"displacement", "stress", "strain", "p", "q"}
    assert set(by_pyvista.cell_data) == {"stress", "strain", "p", "q"}


def test_soil_below_the_footing_is_compressed(result: Path) -> None:
    grid = pyvista.read(_frames(result)[-1][1])
    deepest = int(np.argmin(grid.points[:, 1]))
    assert grid.point_data["stress"][deepest, 1] > 10.0
    assert grid.point_data["displacement"][:, 1].min() == pytest.approx(-0.04)


def test_report_says_what_happened(result: Path) -> None:
    report = json.loads((result / "report.json").read_text(encoding="utf-8"))
    _, rows = read_history(result / "history.csv")
    assert report["status"] == "completed"
    assert set(report["wall_time"]) == PHASES
    assert sum(report["wall_time"].values()) == pytest.approx(2.0 * report["wall_time"]["total"], abs=1e-2)
    assert all(seconds >= 0.0 for seconds in report["wall_time"].values())
    assert len(report["increments"]) == len(rows)
    assert all(entry["residuals"][-1] <= 1e-6 for entry in report["increments"])
    assert report["resolved_case"]["solver"]["tolerance"] == 1e-6
    assert report["peak_memory"] > 10.0
    assert {"fabfem", "numpy", "numba"} <= set(report["versions"])


def test_every_and_at_and_fields_are_obeyed(folder: Path) -> None:
    text = (folder / "case.toml").read_text(encoding="utf-8")
    text = text[: text.index("[output]")] + '[output]\nfields = ["p"]\nevery = 1000\nat = ["cells"]\n'
    (folder / "case.toml").write_text(text, encoding="utf-8")
    run_case(folder / "case.toml", folder / "out", quiet=True)
    frames = _frames(folder / "out")
    assert [moment for moment, _ in frames] == [1.0, 2.0]
    grid = pyvista.read(frames[-1][1])
    assert (list(grid.point_data), list(grid.cell_data)) == ([], ["p"])


def test_no_output_table_stores_no_fields(folder: Path) -> None:
    text = (folder / "case.toml").read_text(encoding="utf-8")
    (folder / "case.toml").write_text(text[: text.index("[output]")], encoding="utf-8")
    run_case(folder / "case.toml", folder / "out", quiet=True)
    left = {file.name for file in (folder / "out").iterdir() if file.suffix != ".npz"}
    assert left == {"history.csv", "report.json"}


def test_a_killed_run_leaves_a_readable_result(folder: Path) -> None:
    text = (
        (folder / "case.toml")
        .read_text(encoding="utf-8")
        .replace("initial = 0.25, maximum = 0.25", "initial = 1e-3, maximum = 1e-3")
    )
    (folder / "case.toml").write_text(text, encoding="utf-8")
    out = folder / "out"
    run = subprocess.Popen(
        [sys.executable, "-m", "fabfem", "solve", str(folder / "case.toml"), "--out", str(out), "--quiet"]
    )
    while run.poll() is None and not (out / "fields_0004.vtu").is_file():
        time.sleep(0.02)
    run.kill()
    run.wait()
    frames = _frames(out)
    _, rows = read_history(out / "history.csv")
    report = json.loads((out / "report.json").read_text(encoding="utf-8"))
    assert len(frames) >= 4
    assert len(rows) >= len(frames)
    assert report["status"] == "running"
    assert all(np.isfinite(pyvista.read(path).point_data["stress"]).all() for _, path in frames)


def test_an_interrupted_run_ends_well(folder: Path) -> None:
    text = (folder / "case.toml").read_text(encoding="utf-8")
    text = text.replace("initial = 0.25, maximum = 0.25", "initial = 1e-3, maximum = 1e-3")
    (folder / "case.toml").write_text(text, encoding="utf-8")
    out = folder / "out"
    run = subprocess.Popen(
        [sys.executable, "-m", "fabfem", "solve", str(folder / "case.toml"), "--out", str(out), "--quiet"]
    )
    while run.poll() is None and not (out / "fields_0004.vtu").is_file():
        time.sleep(0.02)
    run.send_signal(signal.SIGINT)
    assert run.wait() == 130
    report = json.loads((out / "report.json").read_text(encoding="utf-8"))
    assert report["status"] == "interrupted"
    assert len(report["increments"]) == len(read_history(out / "history.csv")[1])


def test_a_line_cut_short_is_dropped(tmp_path: Path) -> None:
    (tmp_path / "history.csv").write_text("a [-],b [m]\n1,2.5\n3,4", encoding="utf-8")
    assert read_history(tmp_path / "history.csv") == (["a [-]", "b [m]"], [["1", "2.5"]])


def test_a_row_that_does_not_fit_is_refused(tmp_path: Path) -> None:
    history = History(tmp_path / "history.csv", ["a", "b"])
    with pytest.raises(ValueError, match="does not fit 2 columns"):
        history.write((1.0,))
    history.write((math.pi, "x"))
    history.close()
    assert float(read_history(tmp_path / "history.csv")[1][0][0]) == math.pi


def test_writing_aside_leaves_no_trace(tmp_path: Path) -> None:
    write_atomic(tmp_path / "file", "old")
    write_atomic(tmp_path / "file", b"new")
    assert [(file.name, file.read_text()) for file in tmp_path.iterdir()] == [("file", "new")]


def test_report_keeps_the_worst_points_once_each(tmp_path: Path) -> None:
    report = Report(tmp_path / "report.json")
    for number in range(20):
        report.worst({"point": number % 8, "error": 1.0 + number % 8 if number < 8 else 0.5})
    assert [entry["point"] for entry in report.content["worst_points"]] == [7, 6, 5, 4, 3][:WORST]


@pytest.mark.parametrize("cell_type", CELL_TYPES)
def test_every_element_can_be_stored(cell_type: str, tmp_path: Path) -> None:
    count = {"triangle": 3, "quad": 4, "tetra": 4, "hexahedron": 8, "triangle6": 6, "quad8": 8, "quad9": 9}.get(
        cell_type, int("".join(filter(str.isdigit, cell_type)) or 0)
    )
    files = FieldFiles(
        tmp_path, np.random.default_rng(1).random((count, 3)), np.arange(count)[None, :], cell_type, "note"
    )
    path = files.write(Frame(0.0, {"a": np.arange(float(count))}, {"b": np.ones((1, 6))}))
    assert meshio.read(path).cells[0].type == cell_type
    assert pyvista.read(path).n_cells == 1


def test_tensors_are_plain_components_in_vtk_order() -> None:
    tensor = np.array([[1.0, 2.0, 3.0], [2.0, 4.0, 5.0], [3.0, 5.0, 6.0]])
    np.testing.assert_allclose(in_vtk_order(from_tensor(tensor)[None, :]), [[1.0, 4.0, 6.0, 2.0, 5.0, 3.0]])


def test_fields_that_nobody_asks_for_cost_nothing(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    problem = build(read_case(folder / "case.toml"))
    step = next(march(problem.model))
    assert isinstance(step, Increment)

    def refuse(*_: object) -> dict:
        raise AssertionError("the state was asked for fields that nobody wants")

    monkeypatch.setattr("umat.state_fields", refuse)
    gathered = point_fields(problem.model.space, step, ("p", "displacement"))
    assert list(gathered) == ["p"]
