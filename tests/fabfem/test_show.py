"""Pictures of a result, with and without off-screen OpenGL."""

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
    draw = pytest.importorskip("fabfem.pictures.draw")
    found = draw.span(low, high)
    assert found == pytest.approx((first, last))
    labels = [f"{value:.4g}" for value in np.linspace(*found, draw.LABELS + 1)]
    assert len(set(labels)) == draw.LABELS + 1


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
