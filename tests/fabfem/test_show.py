"""Pictures of a result, with and without off-screen OpenGL."""

import json
import shutil
import sys
from pathlib import Path

import matplotlib.image
import numpy as np
import pytest

from fabfem.case import CaseError
from fabfem.cli import main
from fabfem.commands.status import NO_PICTURE
from fabfem.pictures import show as module
from fabfem.pictures.show import NO_OPENGL, show


@pytest.fixture
def copied(result: Path, tmp_path: Path) -> Path:
    """A copy of a finished run."""
    return Path(shutil.copytree(result, tmp_path / "result"))


def _colours(picture: Path) -> int:
    pixels = matplotlib.image.imread(picture)[..., :3]
    return len(np.unique((pixels.reshape(-1, 3) * 15).astype(int), axis=0))


def test_pictures_are_drawn(copied: Path) -> None:
    shown = show(copied)
    if shown.trouble == NO_OPENGL:
        pytest.skip("no off-screen OpenGL")
    assert [picture.name for picture in shown.pictures] == ["curve.png", "shear_strain.png"]
    assert shown.trouble == ""
    assert _colours(copied / "shear_strain.png") > 20


@pytest.mark.parametrize(
    ("low", "high", "first", "last"),
    [(0.0, 0.143, 0.0, 0.16), (0.0, 97.3, 0.0, 100.0), (0.078, 0.542, 0.0, 0.6), (0.2022, 0.2023, 0.201, 0.207)],
)
def test_the_labels_of_colours_are_round_and_tell_values_apart(
    low: float, high: float, first: float, last: float
) -> None:
    frame = pytest.importorskip("fabfem.pictures.frame")
    found = frame.span(low, high)
    assert found == pytest.approx((first, last))
    labels = [f"{value:.4g}" for value in np.linspace(*found, frame.LABELS + 1)]
    assert len(set(labels)) == frame.LABELS + 1


def test_a_twisted_section_is_drawn_in_its_plane() -> None:
    draw, pyvista = pytest.importorskip("fabfem.pictures.draw"), pytest.importorskip("pyvista")
    section = pyvista.ImageData(dimensions=(3, 3, 1)).cast_to_unstructured_grid()
    section.point_data["displacement"] = np.tile([0.5, 0.25, 0.125], (section.n_points, 1))
    assert draw.moved_to(section).bounds == pytest.approx((0.5, 2.5, 0.25, 2.25, 0.0, 0.0))


CYLINDER = "lift [m],mean_tau [kPa],mean_sigma_z [kPa],mean_eps_z [-],mean_gamma [-]"
SLOPE = "crest [m],strength_factor [-]"


@pytest.mark.parametrize(
    ("header", "rows", "drawn"),
    [
        (CYLINDER, ["0,5,100,1e-4,2e-2"], ("mean γ", "mean τ [kPa]", [(2e-2, 5.0)])),
        (CYLINDER, ["0,5,100,3e-2,2e-2"], ("mean ε z", "mean σ z [kPa]", [(3e-2, 100.0)])),
        (SLOPE, ["-0.2,1", "-0.3,1.5", ",1.6"], ("crest [m]", "strength factor", [(-0.3, 1.5)])),
    ],
)
def test_what_is_drawn_over_what(
    header: str,
    rows: list[str],
    drawn: tuple[str, str, list[tuple[float, float]]],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A hollow cylinder by what strains most, a slope by its factor of safety, in the stage that looks for it."""
    lines = [f"{'weight' if len(rows) > 1 and number == 0 else 'last'},{row}" for number, row in enumerate(rows)]
    (tmp_path / "history.csv").write_text("\n".join([f"stage,{header}", *lines, ""]), encoding="utf-8")
    (tmp_path / "report.json").write_text(json.dumps({"columns": {"probe": header.split(",")[:1]}}), encoding="utf-8")
    found = []

    def plot(folder: Path, across: str, up: str, points: list[tuple[float, float]]) -> Path:
        found.append((module._axis(across), module._axis(up), points))
        return folder

    monkeypatch.setattr(module, "_plot", plot)
    show(tmp_path)
    assert found == [drawn]


def test_a_death_of_vtk_becomes_a_sentence_and_the_curve_is_drawn(
    copied: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    dying = "import os, signal; os.kill(os.getpid(), signal.SIGSEGV)"
    monkeypatch.setattr(module, "DRAW", (sys.executable, "-c", dying))
    assert main(["show", str(copied)]) == NO_PICTURE
    said = capsys.readouterr()
    assert "libegl1 and libgl1-mesa-dri (or libosmesa6)" in said.err
    assert said.err.count("\n") == 1
    assert "curve.png" in said.out
    assert _colours(copied / "curve.png") > 2


def test_a_fault_of_the_drawing_says_which(copied: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "DRAW", (sys.executable, "-c", "raise RuntimeError('the pencil broke')"))
    assert show(copied).trouble == "the fields could not be drawn: RuntimeError: the pencil broke"


def test_a_folder_without_result(tmp_path: Path) -> None:
    with pytest.raises(CaseError, match="holds no result"):
        show(tmp_path)


def test_a_result_without_fields_has_its_curve(copied: Path) -> None:
    for file in copied.glob("fields*"):
        file.unlink()
    assert [picture.name for picture in show(copied).pictures] == ["curve.png"]
