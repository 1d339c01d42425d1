"""Pictures of a sweep: the curves of all its runs in one row of axes, or the states that they pass as points.

The values of one parameter have colours, those of another may have styles of line. Measured curves that the case
compares with have a picture of their own, ``measured.png``.
"""

import csv
import json
from collections.abc import Sequence
from itertools import cycle
from pathlib import Path
from textwrap import fill
from typing import Any

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from fabfem.case import CaseError, suggest
from fabfem.output.history import name_and_unit, number_of
from fabfem.pictures import calibration
from fabfem.pictures.curves import STYLES
from fabfem.pictures.laboratory import LABELS
from fabfem.pictures.work_precision import COLOURS

ROUNDING = 1e-9
MARKERS = "osD^vP"
ACROSS = 4
"""Most panels side by side."""
WORDS = LABELS | {"gamma": "shear strain ε1 − ε3", "psi": "state parameter ψ", "zeta": "dilatancy state ζ"}
WORDS |= {"eps_axial": "axial strain", "F_alpha": "angle of F from the vertical", "b": "b"}
WORDS |= {f"start_{name}": f"{WORDS[name]} at the start" for name in ("psi", "zeta")}
Run = dict[str, Any]
"""A run: its parameters as texts and its columns as arrays."""


def draw(folder: Path) -> tuple[Path, ...]:
    """Draw the pictures that the sweep in a folder asks for, and return their files.

    Raises
    ------
    CaseError
        If a picture names a column that the results do not have.
    """
    about = json.loads((folder / "sweep.json").read_text(encoding="utf-8"))
    pictures = []
    for picture in about["pictures"]:
        figure = _states(folder, about, picture) if picture["states"] else _curves(folder, about, picture)
        figure.suptitle(fill(about["title"], int(12 * figure.get_figwidth())), fontsize=10)
        FigureCanvasAgg(figure)
        figure.savefig(folder / f"{picture['name']}.png", dpi=100)
        pictures.append(folder / f"{picture['name']}.png")
    if (folder / "measured_curves.csv").is_file():
        pictures.append(calibration.draw(folder, "measured", about["title"]))
    return tuple(pictures)


def _curves(folder: Path, about: Any, picture: Any) -> Figure:
    """Draw a panel for each pair of columns, with a line for each run."""
    lines, units = read_rows(folder / "sweep.csv")
    runs = list(runs_of(lines, about["parameters"], picture))
    colour, style = picture["colour"] or about["parameters"][0], picture["style"]
    colours = _assigned(runs, colour, _shades)
    styles = _assigned(runs, style, lambda n: list(zip(range(n), cycle(STYLES), strict=False))) if style else {}
    figure, axes = _figure(len(picture["x"]))
    for ax, x, y in zip(axes, picture["x"], picture["y"], strict=False):
        for name in (x, y):
            _known(name, units, folder, picture)
        for run in runs:
            line = styles[run[style]][1] if style else "-"
            ax.plot(run["columns"][x], run["columns"][y], color=colours[run[colour]], linestyle=line, linewidth=1.4)
        _plain(ax, x, y, units)
    key = {f"{colour} = {_short(value)}": Line2D([], [], color=shade) for value, shade in colours.items()}
    key |= {value: Line2D([], [], color="#444444", linestyle=line) for value, (_, line) in styles.items()}
    figure.legend(list(key.values()), list(key), fontsize=8, frameon=False, loc="outside lower center", ncols=len(key))
    return figure


def _states(folder: Path, about: Any, picture: Any) -> Figure:
    """Draw the states as points, the best exponential through them and the curves of the source."""
    file = folder / "states.csv"
    lines, units = read_rows(file) if file.is_file() else ([], {})
    figure, axes = _figure(len(picture["x"]))
    fits = about["fits"].get(picture["name"]) or []
    for ax, x, y, fit in zip(axes, picture["x"], picture["y"], fits, strict=False):
        points = []
        for state, marker, colour in zip(picture["states"], cycle(MARKERS), cycle(COLOURS), strict=False):
            rows = [line for line in lines if line["state"] == state]
            for name in (x, y) if rows else ():
                _known(name, units, folder, picture)
            at = [(number_of(row[x]), number_of(row[y])) for row in rows]
            label = f"{state.replace('_', ' ')} ({len(at)})"
            ax.plot(*(np.array(at).reshape(-1, 2).T), marker, color=colour, markersize=5, label=label)
            points += at
        _exponentials(ax, points, fit, [curve for curve in picture["curves"] if curve["x"] in (None, x)])
        _plain(ax, x, y, units)
        ax.legend(fontsize=8, frameon=False)
    return figure


def _exponentials(ax: Axes, points: Sequence[tuple[float, float]], fit: Any, curves: Any) -> None:
    """Draw the best exponential, and those of the source, over the points."""
    if not points:
        ax.text(0.5, 0.5, "no such state on the way", transform=ax.transAxes, ha="center", fontsize=9)
        return
    found = np.array(points)
    x = np.linspace(np.nanmin(found[:, 0]), np.nanmax(found[:, 0]), 100)
    top = 1.3 * float(np.nanmax(found[:, 1]))
    said = [{"name": f"best, R² = {fit['determination']:.2f}", **fit, "style": "-"}] if fit else []
    said += [{**curve, "style": "--"} for curve in curves]
    for curve in said:
        y = curve["factor"] * np.exp(curve["rate"] * x)
        label = f"{curve['name']}: {curve['factor']:.3g} exp({curve['rate']:.3g} x)"
        ax.plot(x, np.where(y < top, y, np.nan), curve["style"], color="#333333", linewidth=1.2, label=label)
    ax.set_ylim(0.0, top)


def runs_of(lines: Sequence[dict[str, str]], parameters: Sequence[str], picture: Any) -> list[Run]:
    """Return the runs of a table with a row for each row of each history, up to where the picture ends."""
    groups: dict[tuple[str, ...], list[dict[str, str]]] = {}
    for line in lines:
        groups.setdefault(tuple(line[name] for name in parameters), []).append(line)
    runs = []
    for values, rows in groups.items():
        columns = {name: np.array([number_of(row[name]) for row in rows]) for name in rows[0]}
        past = np.zeros(len(rows), bool)
        if picture["until"]:
            past = np.asarray(columns[picture["until"]["column"]]) > picture["until"]["value"] * (1.0 + ROUNDING)
        end = int(np.argmax(past)) if past.any() else len(rows)
        runs.append(dict(zip(parameters, values, strict=True)) | {"columns": {k: v[:end] for k, v in columns.items()}})
    return runs


def read_rows(path: Path) -> tuple[list[dict[str, str]], dict[str, str]]:
    """Return the rows of a table by column, and the unit of each column."""
    with path.open(encoding="utf-8", newline="") as file:
        header, *rows = list(csv.reader(file))
    named = [name_and_unit(column) for column in header]
    return [dict(zip([name for name, _ in named], row, strict=True)) for row in rows], dict(named)


def _assigned(runs: Sequence[Run], name: str, choose: Any) -> dict[str, Any]:
    """Return what each value of a parameter is drawn with."""
    values = list(dict.fromkeys(run[name] for run in runs))
    return dict(zip(values, choose(len(values)), strict=True))


def _shades(count: int) -> list[Any]:
    return list(colormaps["viridis"](np.linspace(0.0, 0.85, count)))


def _known(name: str, units: dict[str, str], folder: Path, picture: Any) -> None:
    if name not in units:
        where = f"sweep.picture[{picture['name']}]"
        raise CaseError(f"{folder.name}: {where}: the results have no column '{name}'{suggest(name, units)}")


def _figure(panels: int) -> tuple[Figure, list[Axes]]:
    across = min(panels, ACROSS)
    down = -(-panels // across)
    figure = Figure(figsize=(0.6 + 3.4 * across, 0.9 + 3.0 * down), layout="constrained")
    return figure, [figure.add_subplot(down, across, k + 1) for k in range(panels)]


def _plain(ax: Axes, x: str, y: str, units: dict[str, str]) -> None:
    ax.set(xlabel=_label(x, units), ylabel=_label(y, units))
    ax.xaxis.label.set_fontsize(9)
    ax.yaxis.label.set_fontsize(9)
    ax.tick_params(labelsize=8)
    ax.locator_params(axis="x", nbins=6)
    ax.grid(alpha=0.3)
    ax.spines[["top", "right"]].set_visible(False)


def _label(name: str, units: dict[str, str]) -> str:
    unit = units.get(name, "")
    return WORDS.get(name, name) + (f" [{unit}]" if unit not in ("-", "") else "")


def _short(value: str) -> str:
    return value.replace("_", " ")
