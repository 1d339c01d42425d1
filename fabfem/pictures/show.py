"""Pictures of a result: the load curve with matplotlib, the fields with pyvista in a process of its own.

No run is ever lost for a picture: where VTK cannot draw, a sentence says what to install, and the curve is drawn all
the same.
"""

import json
import os
import subprocess
import sys
from collections.abc import Sequence
from importlib import import_module
from pathlib import Path
from typing import Any, NamedTuple

from fabfem.case import CaseError
from fabfem.output.history import read_history

DRAW = (sys.executable, "-m", "fabfem.pictures.draw")
"""Command that draws the fields of the folder it is given."""

DRAWERS = {"fabric": "fabfem.pictures.curves", "element": "fabfem.pictures.laboratory"}
"""Module that draws the pictures of a kind of scene which is no boundary-value problem; it has `draw(folder)`."""

TIME_LIMIT = 600.0
"""Longest time that drawing the fields may take [s]."""

NO_OPENGL = (
    "the fields could not be drawn, because VTK found no off-screen OpenGL on this machine; install the system "
    "packages libegl1 and libgl1-mesa-dri (or libosmesa6) and run fabfem show again"
)


class Shown(NamedTuple):
    """What was drawn."""

    pictures: tuple[Path, ...]
    """Pictures, in the folder of the result."""
    trouble: str
    """Sentence on what could not be drawn, or nothing."""


def show(folder: Path) -> Shown:
    """Draw the pictures of a result into its folder.

    Parameters
    ----------
    folder : Path
        Folder that ``fabfem solve`` or ``fabfem sweep`` wrote.

    Raises
    ------
    CaseError
        If the folder holds no result.
    """
    if (folder / "sweep.json").is_file():
        return Shown(tuple(import_module("fabfem.pictures.sweep").draw(folder)), "")
    if not (folder / "history.csv").is_file():
        raise CaseError(f"{folder}: holds no result (there is no history.csv)")
    drawer = DRAWERS.get(_kind(folder))
    if drawer:
        return Shown(tuple(import_module(drawer).draw(folder)), "")
    pictures = [*_curve(folder)]
    before = {picture.name: picture.stat().st_mtime_ns for picture in folder.glob("*.png")}
    trouble = _draw_fields(folder) if (folder / "fields_0000.vtu").is_file() else ""
    drawn = [
        picture for picture in sorted(folder.glob("*.png")) if before.get(picture.name) != picture.stat().st_mtime_ns
    ]
    return Shown((*pictures, *drawn), trouble)


def _draw_fields(folder: Path) -> str:
    """Return what went wrong, or nothing."""
    command = [*DRAW, str(folder)]
    for window in ({}, {"VTK_DEFAULT_OPENGL_WINDOW": "vtkOSOpenGLRenderWindow"}):
        try:
            done = subprocess.run(
                command, env=os.environ | window, capture_output=True, text=True, timeout=TIME_LIMIT, check=False
            )
        except subprocess.TimeoutExpired:
            return f"the fields could not be drawn within {TIME_LIMIT:g} s"
        if done.returncode == 0:
            return ""
        if "Traceback" in done.stderr:
            return f"the fields could not be drawn: {done.stderr.strip().splitlines()[-1]}"
    return NO_OPENGL


def _curve(folder: Path) -> Sequence[Path]:
    """Draw the first derived column, or reaction, over the first probe, if the case has them."""
    headers, rows = read_history(folder / "history.csv")
    asked = _columns(folder)
    across = next((name for name in asked["probe"] if name in headers), None)
    up = next((name for name in (*asked["derived"], *asked["reaction"]) if name in headers), None)
    if across is None or up is None or not rows:
        return ()
    at = headers.index(across), headers.index(up)
    return (_plot(folder, across, up, [(float(row[at[0]]), float(row[at[1]])) for row in rows]),)


def _plot(folder: Path, across: str, up: str, points: Sequence[tuple[float, float]]) -> Path:
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(8, 5), layout="constrained")
    axes = figure.add_subplot()
    axes.plot(*zip(*points, strict=True), color="#1f5a8a", linewidth=2, marker="o", markersize=3)
    axes.set(xlabel=_axis(across), ylabel=_axis(up), title=_title(folder))
    axes.grid(alpha=0.3)
    axes.spines[["top", "right"]].set_visible(False)
    FigureCanvasAgg(figure)
    figure.savefig(folder / "curve.png", dpi=160)
    return folder / "curve.png"


def _axis(header: str) -> str:
    return header.removesuffix(" [-]").replace("_", " ").replace("gamma", "γ")


def _report(folder: Path) -> dict[str, object]:
    path = folder / "report.json"
    return json.loads(path.read_text(encoding="utf-8")) if path.is_file() else {}


def _kind(folder: Path) -> str:
    """Return the kind of scene that a result is of."""
    case: Any = _report(folder).get("resolved_case", {})
    return str(case.get("scene", {}).get("kind", "boundary_value"))


def _columns(folder: Path) -> dict[str, list[str]]:
    """Return the headers of the history by what they are: probe, reaction, derived."""
    columns = _report(folder).get("columns", {})
    return {
        kind: columns.get(kind, []) if isinstance(columns, dict) else [] for kind in ("probe", "reaction", "derived")
    }


def _title(folder: Path) -> str:
    return str(_report(folder).get("title", folder.name))
