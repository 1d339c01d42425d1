"""Pictures of a result: the load curve with matplotlib, the fields with pyvista in a process of its own.

No run is ever lost for a picture: where VTK cannot draw, a sentence says what to install, and the curve is drawn all
the same.
"""

import json
import os
import subprocess
import sys
from collections.abc import Iterator, Sequence
from importlib import import_module
from pathlib import Path
from textwrap import fill
from typing import Any, NamedTuple

from fabfem.case import CaseError
from fabfem.output.history import read_history

DRAW = (sys.executable, "-m", "fabfem.pictures.draw")
"""Command that draws the fields of the folder it is given."""

DRAWERS = {"fabric": "fabfem.pictures.curves", "element": "fabfem.pictures.laboratory"}
"""Module that draws the pictures of a kind of scene which is no boundary-value problem; it has `draw(folder)`."""

HOLLOW_CYLINDER = (("mean_gamma [-]", "mean_tau"), ("mean_eps_z [-]", "mean_sigma_z"))
"""Strain and stress of a hollow cylinder, twisted or pressed."""

GREEK = {"gamma": "γ", "tau": "τ", "eps": "ε", "sigma": "σ", "theta": "θ"}
FACTOR = "strength_factor [-]"
"""What the strength of a slope is divided by."""

MANY_RUNS = {
    "sweep.json": "fabfem.pictures.sweep",
    "study.json": "fabfem.pictures.work_precision",
    "calibration.json": "fabfem.pictures.calibration",
}
"""Module that draws the pictures of many runs of a case, by the file that tells them; it has `draw(folder)`."""

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
        Folder that ``fabfem solve``, ``sweep``, ``study`` or ``calibrate`` wrote.

    Raises
    ------
    CaseError
        If the folder holds no result.
    """
    for file, module in MANY_RUNS.items():
        if (folder / file).is_file():
            found = import_module(module).draw(folder)
            return Shown((found,) if isinstance(found, Path) else tuple(found), "")
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
    """Draw what the test is about, if the history has it."""
    headers, rows = read_history(folder / "history.csv")
    for across, up in _pairs(headers, rows, _columns(folder)):
        if {across, up} <= set(headers):
            rows = [row for row in rows if up != FACTOR or row[0] == rows[-1][0]]  # the stage that searches is the last
            at = headers.index(across), headers.index(up)
            points = [(float(row[at[0]]), float(row[at[1]])) for row in rows if row[at[0]] and row[at[1]]]
            return (_plot(folder, across, up, points),) if points else ()
    return ()


def _pairs(
    headers: Sequence[str], rows: Sequence[Sequence[str]], asked: dict[str, list[str]]
) -> Iterator[tuple[str, str]]:
    """Yield what could be drawn over what, the best first.

    The first derived column, or reaction, over the first probe; of a hollow cylinder the stress whose strain has gone
    farthest; of a slope the factor of its strength.
    """
    probes = [name for name in asked["probe"] if name in headers]
    for force in (*asked["derived"], *asked["reaction"]):
        yield from ((probe, force) for probe in probes)
    found = [(strain, _named(headers, stress)) for strain, stress in HOLLOW_CYLINDER if strain in headers]
    yield from sorted(found, key=lambda pair: -_farthest(rows, headers.index(pair[0])))
    yield from ((probe, FACTOR) for probe in probes)


def _named(headers: Sequence[str], name: str) -> str:
    """Return the header of a column with its unit."""
    return next((header for header in headers if header.startswith(f"{name} [")), "")


def _farthest(rows: Sequence[Sequence[str]], column: int) -> float:
    return max((abs(float(row[column])) for row in rows if row[column]), default=0.0)


def _plot(folder: Path, across: str, up: str, points: Sequence[tuple[float, float]]) -> Path:
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(8, 5), layout="constrained")
    axes = figure.add_subplot()
    axes.plot(*zip(*points, strict=True), color="#1f5a8a", linewidth=2, marker="o", markersize=3)
    axes.set(xlabel=_axis(across), ylabel=_axis(up), title=fill(_title(folder), 80))
    axes.grid(alpha=0.3)
    axes.spines[["top", "right"]].set_visible(False)
    FigureCanvasAgg(figure)
    figure.savefig(folder / "curve.png", dpi=160)
    return folder / "curve.png"


def _axis(header: str) -> str:
    words = header.removesuffix(" [-]").replace("_", " ")
    return " ".join(GREEK.get(word, word).replace("(gamma", "(γ") for word in words.split(" "))


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
