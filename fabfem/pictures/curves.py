"""Pictures of the history of a case on fabric laws: the columns that its ``[[picture]]`` tables name.

A panel shows the curves of one law, or of several told apart by the style of their lines; paths have one colour in all
panels. What is undefined is not drawn.
"""

import csv
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
from fabfem.output.report import read_report

STYLES = ("-", "--", ":", "-.", (0, (6, 1, 1, 1, 1, 1)), (0, (1, 3)))
MANY = 3
"""Panels side by side."""
KEY = 1.4
"""Width of an entry of the key [inch]."""


def draw(folder: Path) -> tuple[Path, ...]:
    """Draw the pictures that the case of a result asks for, and return their files.

    Raises
    ------
    CaseError
        If a picture names a column that the history does not have.
    """
    report = read_report(folder)
    curves, headers = _read(folder / "history.csv")
    return tuple(
        _picture(folder, picture, curves, headers, str(report.get("title", "")))
        for picture in report["resolved_case"].get("picture", ())
    )


def _read(path: Path) -> tuple[dict[tuple[str, str], dict[str, Any]], dict[str, str]]:
    """Return columns (arrays, NaN where empty) by law and path, and the full header of each column."""
    with path.open(encoding="utf-8", newline="") as file:
        lines = list(csv.reader(file))
    names = [name_and_unit(header)[0] for header in lines[0]]
    groups: dict[tuple[str, str], list[list[str]]] = {}
    for line in lines[1:]:
        row = dict(zip(names, line, strict=False))
        groups.setdefault((row.get("law", ""), row.get("path", "")), []).append(line)
    curves = {
        key: {name: np.array([number_of(line[i]) for line in rows]) for i, name in enumerate(names)}
        for key, rows in groups.items()
    }
    return curves, dict(zip(names, lines[0], strict=True))


def _picture(folder: Path, picture: Any, curves: Any, headers: dict[str, str], title: str) -> Path:
    for name in (picture["x"], picture["y"]):
        if name not in headers:
            where = f"picture[{picture['name']}]"
            raise CaseError(f"{folder.name}: {where}: the history has no column '{name}'{suggest(name, headers)}")
    laws = list(dict.fromkeys(law for law, _ in curves))
    panels = [tuple(panel) for panel in picture.get("panels") or ()] or [(law,) for law in laws]
    across = min(len(panels), MANY) if len(panels) != MANY + 1 else 2
    down = -(-len(panels) // across)
    figure = Figure(figsize=(1.2 + 3.6 * across, 0.9 + 3.2 * down), layout="constrained")
    polar = {"projection": "polar"} if picture.get("polar") else {}
    axes = figure.subplots(down, across, sharex=not polar, sharey=not polar, squeeze=False, subplot_kw=polar)
    paths = list(dict.fromkeys(path for _, path in curves))
    colours = dict(zip(paths, colormaps["viridis"](np.linspace(0.0, 0.88, len(paths))), strict=True))
    for panel, ax in zip(panels, axes.flat, strict=False):
        _panel(ax, panel, picture, curves, colours, headers)
    for number, ax in enumerate(axes.flat):
        ax.tick_params(labelbottom=True)
        ax.set_visible(number < len(panels))
    _key(figure, paths, colours)
    figure.suptitle(fill(title, int(13 * figure.get_figwidth())), fontsize=9)
    FigureCanvasAgg(figure)
    file = folder / f"{picture['name']}.png"
    figure.savefig(file, dpi=110)
    return file


def _panel(ax: Axes, panel: tuple[str, ...], picture: Any, curves: Any, colours: Any, headers: dict[str, str]) -> None:
    """Draw the curves of some laws."""
    for law, style in zip(panel, cycle(STYLES), strict=False):
        for (name, path), columns in curves.items():
            if name != law:
                continue
            x, y = columns[picture["x"]], columns[picture["y"]]
            if picture.get("polar"):  # six times 60 degrees: the deviatoric plane, compression along 0, 120, 240
                x = np.radians(np.concatenate([k * 120.0 + part for k in range(3) for part in (-x[::-1], x)]))
                y = np.tile(np.concatenate([y[::-1], y]), 3)
            ax.plot(x, y, color=colours[path], linestyle=style, linewidth=1.4)
    ax.set_title(", ".join(panel), fontsize=9)
    ax.grid(alpha=0.3)
    if picture.get("polar"):
        ax.tick_params(labelsize=7)
    else:
        ax.set_xlabel(_label(headers[picture["x"]]))
        ax.set_ylabel(_label(headers[picture["y"]]))
        ax.spines[["top", "right"]].set_visible(False)
        ax.set_aspect("equal" if picture.get("equal") else "auto")
    if len(panel) > 1:
        lines = [
            Line2D([], [], color="#444444", linestyle=style) for _, style in zip(panel, cycle(STYLES), strict=False)
        ]
        ax.legend(lines, panel, fontsize=7, frameon=False, loc="best")


def _key(figure: Figure, paths: list[str], colours: Any) -> None:
    """Draw the key of the paths, if there are several."""
    if len(paths) > 1:
        lines = [Line2D([], [], color=colours[path]) for path in paths]
        columns = min(len(paths), max(2, int(figure.get_figwidth() / KEY)))
        figure.legend(lines, paths, fontsize=7, frameon=False, loc="outside lower center", ncols=columns)


def _label(header: str) -> str:
    return header.removesuffix(" [-]")
