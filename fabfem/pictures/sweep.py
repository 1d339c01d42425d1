"""Pictures of a sweep: the curves of all its runs in one row of axes, or the states that they pass as points.

The values of one parameter have colours, those of another may have styles of line. Measured curves that the case
compares with have a picture of their own, ``measured.png``. A sweep that asks for no picture has ``sweep.png``: its
columns over the first of them, or, of runs of which only the end is kept, over the first parameter.
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
from fabfem.pictures import calibration
from fabfem.pictures.curves import KEY, STYLES
from fabfem.pictures.laboratory import LABELS
from fabfem.pictures.work_precision import COLOURS
from fabfem.study.sweep import ABOUT

ROUNDING = 1e-9
MARKERS = "osD^vP"
ACROSS = 4
"""Most panels side by side."""
MOST = 8
"""Most panels of a picture that nobody asked for; the last columns are what a case derives."""
COUNTS = ("stage", "increment", "time", "iterations", "load_factor")
"""Columns of every history."""
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
        pictures.append(_saved(figure, folder, about, picture["name"]))
    if (folder / "measured_curves.csv").is_file():
        pictures.append(calibration.draw(folder, "measured", about["title"]))
    usual = None if pictures else _usual(folder, about)
    if usual:
        pictures.append(_saved(usual, folder, about, "sweep"))
    return tuple(pictures)


def _saved(figure: Figure, folder: Path, about: Any, name: str) -> Path:
    figure.suptitle(fill(about["title"], int(12 * figure.get_figwidth())), fontsize=10)
    FigureCanvasAgg(figure)
    figure.savefig(folder / f"{name}.png", dpi=100)
    return folder / f"{name}.png"


def _usual(folder: Path, about: Any) -> Figure | None:
    """Return the figure of a sweep that asks for none, if its table has columns to draw."""
    lines, units = _read(folder / "sweep.csv")
    names = list(units)
    columns = [name for name in names[len(about["parameters"]) + len(ABOUT) :] if name not in COUNTS]
    columns = [name for name in columns if any(np.isfinite(_number(line[name])) for line in lines)]
    if not columns or not lines:
        return None
    if len({tuple(line[name] for name in about["parameters"]) for line in lines}) == len(lines):
        return _ends(lines, units, about["parameters"], columns[-MOST:])
    across, *up = columns if len(columns) > 1 else [next(name for name in ("time", *names) if name in names), *columns]
    picture = {"name": "sweep", "x": [across] * len(up[-MOST:]), "y": up[-MOST:], "colour": None, "until": None}
    return _curves(folder, about, picture | {"style": about["parameters"][1] if len(about["parameters"]) > 1 else None})


def _ends(
    lines: Sequence[dict[str, str]], units: dict[str, str], parameters: Sequence[str], columns: Sequence[str]
) -> Figure:
    """Draw the ends of all runs over the first parameter, with a line for each choice of the others."""
    across, *others = parameters
    groups: dict[str, list[dict[str, str]]] = {}
    for line in lines:
        groups.setdefault(", ".join(f"{name} = {_short(line[name])}" for name in others), []).append(line)
    words = not all(np.isfinite(_number(line[across])) for line in lines)
    figure, axes = _figure(len(columns))
    for ax, column in zip(axes, columns, strict=False):
        for (label, rows), shade in zip(groups.items(), _shades(len(groups)), strict=True):
            at = [_short(row[across]) if words else _number(row[across]) for row in rows]
            ax.plot(at, [_number(row[column]) for row in rows], "o-", color=shade, markersize=4, label=label)
        _plain(ax, across, column, units, numbers=not words)
    if others:
        handles, labels = axes[0].get_legend_handles_labels()
        figure.legend(handles, labels, fontsize=8, frameon=False, loc="outside lower center", ncols=_beside(figure))
    return figure


def _curves(folder: Path, about: Any, picture: Any) -> Figure:
    """Draw a panel for each pair of columns, with a line for each run."""
    lines, units = _read(folder / "sweep.csv")
    runs = list(_runs(lines, about["parameters"], picture))
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
    ncols = min(len(key), _beside(figure))
    figure.legend(list(key.values()), list(key), fontsize=8, frameon=False, loc="outside lower center", ncols=ncols)
    return figure


def _states(folder: Path, about: Any, picture: Any) -> Figure:
    """Draw the states as points, the best exponential through them and the curves of the source."""
    file = folder / "states.csv"
    lines, units = _read(file) if file.is_file() else ([], {})
    figure, axes = _figure(len(picture["x"]))
    fits = about["fits"].get(picture["name"]) or []
    for ax, x, y, fit in zip(axes, picture["x"], picture["y"], fits, strict=False):
        points = []
        for state, marker, colour in zip(picture["states"], cycle(MARKERS), cycle(COLOURS), strict=False):
            rows = [line for line in lines if line["state"] == state]
            for name in (x, y) if rows else ():
                _known(name, units, folder, picture)
            at = [(_number(row[x]), _number(row[y])) for row in rows]
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


def _runs(lines: Sequence[dict[str, str]], parameters: Sequence[str], picture: Any) -> list[Run]:
    """Return the runs of a table with a row for each row of each history, up to where the picture ends."""
    groups: dict[tuple[str, ...], list[dict[str, str]]] = {}
    for line in lines:
        groups.setdefault(tuple(line[name] for name in parameters), []).append(line)
    runs = []
    for values, rows in groups.items():
        columns = {name: np.array([_number(row[name]) for row in rows]) for name in rows[0]}
        past = np.zeros(len(rows), bool)
        if picture["until"]:
            past = np.asarray(columns[picture["until"]["column"]]) > picture["until"]["value"] * (1.0 + ROUNDING)
        end = int(np.argmax(past)) if past.any() else len(rows)
        runs.append(dict(zip(parameters, values, strict=True)) | {"columns": {k: v[:end] for k, v in columns.items()}})
    return runs


def _read(path: Path) -> tuple[list[dict[str, str]], dict[str, str]]:
    """Return the rows of a table by column, and the unit of each column."""
    with path.open(encoding="utf-8", newline="") as file:
        header, *rows = list(csv.reader(file))
    named = [name.rstrip("]").partition(" [") for name in header]
    return [dict(zip([name for name, _, _ in named], row, strict=True)) for row in rows], {
        name: unit for name, _, unit in named
    }


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


def _beside(figure: Figure) -> int:
    """Return how many entries of a key fit side by side."""
    return max(1, int(figure.get_figwidth() / KEY))


def _plain(ax: Axes, x: str, y: str, units: dict[str, str], numbers: bool = True) -> None:
    ax.set(xlabel=_label(x, units), ylabel=_label(y, units))
    ax.xaxis.label.set_fontsize(9)
    ax.yaxis.label.set_fontsize(9)
    ax.tick_params(labelsize=8)
    if numbers:
        ax.locator_params(axis="x", nbins=6)
    ax.grid(alpha=0.3)
    ax.spines[["top", "right"]].set_visible(False)


def _label(name: str, units: dict[str, str]) -> str:
    unit = units.get(name, "")
    return WORDS.get(name, name.replace("_", " ").replace("gamma", "γ")) + (
        f" [{unit}]" if unit not in ("-", "") else ""
    )


def _number(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        return float("nan")


def _short(value: str) -> str:
    return value.replace("_", " ")
