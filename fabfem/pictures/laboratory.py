"""Pictures of an element test: the curves of its history, rose diagrams, and response envelopes of probes."""

import csv
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from numpy.typing import NDArray

from fabfem.laboratory.plans import basis
from fabfem.output.history import name_and_unit, read_history
from fabfem.output.report import read_report
from umat.mandel import FACTOR

Array = NDArray[np.float64]

COLOURS = ("#1f5a8a", "#c2571a", "#3d8a4f", "#7b4fa3", "#8a6d1f", "#555555")
LABELS = {
    "p": "mean effective stress p",
    "q": "deviatoric stress q",
    "eps_q": "deviatoric strain ε_q",
    "eps_v": "volumetric strain ε_v",
    "e": "void ratio e",
    "F_norm": "norm of fabric anisotropy ‖F‖",
    "A": "fabric anisotropy variable A",
    "eta": "stress ratio η",
    "q_axial": "axial less radial stress",
    "eps_axial": "axial strain ε_zz",
    "tau_xz": "shear stress τ_xz",
    "gamma_xz": "shear strain γ_xz",
}
PANELS = (
    ("eps_axial", "q_axial"),
    ("gamma_xz", "tau_xz"),
    ("eps_q", "q"),
    ("p", "q_axial"),
    ("p", "tau_xz"),
    ("p", "q"),
    ("p", "e"),
    ("eps_q", "eps_v"),
    ("eps_q", "F_norm"),
    ("eps_q", "A"),
    ("eps_q", "eta"),
)
"""Curves in order of choice; a history without a column has no panel for it."""
MOST = 6
CONSTANT = 1e-9
"""Range of a curve that is constant but for rounding."""
MARKS = {"instability": "o", "phase_transformation": "s", "characteristic": "D", "peak": "^", "critical": "*"}


class Curves(NamedTuple):
    """The columns of a history."""

    stage: list[str]
    """Stage of each row."""
    columns: dict[str, Array]
    """Columns by name."""
    units: dict[str, str]
    """Units of the columns."""


def draw(folder: Path) -> list[Path]:
    """Draw the pictures of an element test into its folder and return their files."""
    report = read_report(folder)
    pictures = [_curves(folder, report)]
    pictures += [_roses(folder, report)] if (folder / "roses.csv").is_file() else []
    pictures += [_envelopes(folder, report)] if (folder / "probes.csv").is_file() else []
    return [picture for picture in pictures if picture is not None]


def read(folder: Path) -> Curves:
    """Return the columns of a history."""
    headers, rows = read_history(folder / "history.csv")
    named = [name_and_unit(header) for header in headers]
    table = {name: np.array([float(row[k]) for row in rows]) for k, (name, _) in enumerate(named) if k}
    return Curves([row[0] for row in rows], table, dict(named))


def _curves(folder: Path, report: dict[str, Any]) -> Path | None:
    """Draw up to six panels of what the history has."""
    curves = read(folder)
    panels = [pair for pair in PANELS if all(name in curves.columns for name in pair)][:MOST]
    if not panels or not curves.stage:
        return None
    figure, axes = _figure(len(panels), str(report.get("title") or folder.name))
    for (across, up), panel in zip(panels, axes, strict=False):
        _panel(panel, curves, report, across, up)
    handles, labels = axes[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=4, frameon=False)
    return _saved(figure, folder / "curves.png")


def _panel(panel: Axes, curves: Curves, report: dict[str, Any], across: str, up: str) -> None:
    """Draw a curve for each stage and the states that the report names."""
    stages = list(dict.fromkeys(curves.stage))
    for k, stage in enumerate(stages):
        rows = np.array([name == stage for name in curves.stage])
        x, y = curves.columns[across][rows], curves.columns[up][rows]
        panel.plot(x, y, color=COLOURS[k % len(COLOURS)], linewidth=1.6, label=stage)
        for name, place in _states(report, stage):
            at = [float(np.interp(place, np.arange(len(x)), values)) for values in (x, y)]
            colour = COLOURS[k % len(COLOURS)]
            panel.plot(*at, MARKS[name], color=colour, markeredgecolor="white", markersize=9, label=_words(name))
    panel.set(xlabel=_label(curves, across), ylabel=_label(curves, up))
    if np.ptp(curves.columns[up]) < CONSTANT:
        middle = float(np.mean(curves.columns[up]))
        panel.set_ylim(middle - 0.01, middle + 0.01)
    _plain(panel)


def _states(report: dict[str, Any], stage: str) -> Iterator[tuple[str, float]]:
    for entry in report.get("stages", []):
        if entry["name"] == stage:
            yield from ((name, state["increment"]) for name, state in entry.get("states", {}).items() if name in MARKS)


def _roses(folder: Path, report: dict[str, Any]) -> Path | None:
    """Draw E(n), f_n and f_t/f_n around the plane of the diagrams, a curve for each stored increment."""
    _, rows = read_history(folder / "roses.csv")
    if not rows:
        return None
    plane = report["resolved_case"]["output"]["roses"]["plane"]
    figure = Figure(figsize=(13, 5), layout="constrained")
    titles = ("contact density 4πE(n)", "normal force f_n / mean", "mobilised friction f_t / f_n")
    for column, title in enumerate(titles, 4):
        panel = figure.add_subplot(1, 3, column - 3, projection="polar")
        for k, increment in enumerate(dict.fromkeys(row[1] for row in rows)):
            chosen = [row for row in rows if row[1] == increment]
            angles = np.radians([float(row[3]) for row in chosen] + [float(chosen[0][3])])
            values = [float(row[column]) for row in chosen] + [float(chosen[0][column])]
            label = f"ε_q = {100 * float(chosen[0][2]):.3g} %"
            panel.plot(angles, values, color=COLOURS[k % len(COLOURS)], linewidth=1.6, label=label)
        panel.set_theta_zero_location("N")  # type: ignore[attr-defined]
        panel.set_theta_direction(-1)  # type: ignore[attr-defined]
        panel.set_thetagrids((0, 90, 180, 270), (f"+{plane[0]}", f"+{plane[1]}", f"−{plane[0]}", f"−{plane[1]}"))  # type: ignore[attr-defined]
        panel.set_rlabel_position(45)  # type: ignore[attr-defined]
        panel.set_title(title)
        panel.grid(alpha=0.4)
    handles, labels = panel.get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=6, frameon=False)
    figure.suptitle(str(report.get("title") or folder.name))
    return _saved(figure, folder / "roses.png")


def _envelopes(folder: Path, report: dict[str, Any]) -> Path | None:
    """Draw the ends of the probes and the responses to them in the plane of the probes."""
    with (folder / "probes.csv").open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    stages = [stage for stage in report["resolved_case"]["stage"] if stage["kind"] == "probe"]
    if not rows:
        return None
    figure, axes = _figure(2, str(report.get("title") or folder.name))
    for k, stage in enumerate(stages):
        ends = [row for row in rows if row["stage"] == stage["name"] and float(row["fraction [-]"]) == 1.0]
        for panel, what in zip(axes, ("stress", "strain"), strict=False):
            points = np.array([_in_plane(row, what, stage["plane"]) for row in ends])
            closed = np.vstack([points, points[:1]])
            panel.plot(*closed.T, ".-", color=COLOURS[k % len(COLOURS)], linewidth=1.2, label=stage["name"])
    for panel, what in zip(axes, ("stress", "strain"), strict=False):
        first, second = AXES[stages[0]["plane"]] if isinstance(stages[0]["plane"], str) else SPANNING
        panel.set(xlabel=f"Δ{what} along {second}", ylabel=f"Δ{what} along {first}", aspect="equal")
        panel.set_title("stress" if what == "stress" else "strain", fontsize=10)
        _plain(panel)
    figure.legend(*axes[0].get_legend_handles_labels(), loc="outside lower center", ncols=4, frameon=False)
    return _saved(figure, folder / "envelopes.png")


AXES = {
    "triaxial": ("zz", "(xx + yy)/√2"),
    "biaxial": ("zz", "xx"),
    "deviatoric": ("(2 zz − xx − yy)/√6", "(xx − yy)/√2"),
    "torsion": ("(zz − xx)/√2", "√2 xz"),
}
"""Names of the two axes of each plane of probes."""


SPANNING = ("the first tensor", "the second, across it")
"""Names of the axes of a plane that two tensors span."""


def _in_plane(row: dict[str, str], what: str, plane: str | list[list[float]]) -> tuple[float, float]:
    """Return the coordinates of a change of stress or strain in the plane of its probes: across, up."""
    change = np.array([float(value) for key, value in row.items() if key.startswith(f"d_{what}_")]) * FACTOR
    up, across = basis(plane) @ change
    return float(across), float(up)


def _figure(panels: int, title: str) -> tuple[Figure, Sequence[Axes]]:
    """Return a figure of up to three panels in a row."""
    across = min(panels, 3)
    down = -(-panels // across)
    figure = Figure(figsize=(4.6 * across, 3.9 * down + 0.6), layout="constrained")
    figure.suptitle(title)
    return figure, [figure.add_subplot(down, across, k + 1) for k in range(panels)]


def _plain(panel: Axes) -> None:
    panel.locator_params(axis="x", nbins=6)
    panel.ticklabel_format(style="sci", scilimits=(-3, 4), useOffset=False)
    panel.grid(alpha=0.3)
    panel.spines[["top", "right"]].set_visible(False)


def _label(curves: Curves, name: str) -> str:
    unit = curves.units[name]
    return LABELS.get(name, name) + (f" [{unit}]" if unit != "-" else "")


def _words(name: str) -> str:
    return "peak stress ratio" if name == "peak" else name.replace("_", " ")


def _saved(figure: Figure, path: Path) -> Path:
    FigureCanvasAgg(figure)
    figure.savefig(path, dpi=110)
    return path
