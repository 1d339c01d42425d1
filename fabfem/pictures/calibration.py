"""What was measured beside what a case answers, a panel for each curve: of a calibration, or of a sweep."""

import csv
from pathlib import Path
from typing import Any

from fabfem.pictures.work_precision import COLOURS


def draw(folder: Path, name: str = "calibration", title: str = "") -> Path:
    """Draw ``NAME.png`` from the ``NAME_curves.csv`` of a folder and return its file."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure
    from matplotlib.lines import Line2D

    with (folder / f"{name}_curves.csv").open(encoding="utf-8") as file:
        header, *rows = list(csv.reader(file))
    curves = [column.removesuffix(" measured") for column in header[2::2]]
    figure = Figure(figsize=(4.2 * len(curves), 4.0), layout="constrained")
    for number, (axes, curve) in enumerate(zip(figure.subplots(1, len(curves), squeeze=False)[0], curves, strict=True)):
        _panel(axes, rows, 2 + 2 * number)
        axes.set(xlabel=header[1].replace("_", " "), ylabel=curve.replace("_", " "))
    tests = list(dict.fromkeys(row[0] for row in rows))
    key = {test: Line2D([], [], color=COLOURS[k % len(COLOURS)]) for k, test in enumerate(tests)}
    key |= {"measured": Line2D([], [], color="#444444", linestyle="", marker="o", markersize=4)}
    key |= {"case": Line2D([], [], color="#444444")}
    figure.legend(list(key.values()), list(key), loc="outside lower center", ncols=6, fontsize=8, frameon=False)
    if title:
        figure.suptitle(title)
    FigureCanvasAgg(figure)
    figure.savefig(folder / f"{name}.png", dpi=100)
    return folder / f"{name}.png"


def _panel(axes: Any, rows: list[list[str]], column: int) -> None:
    """Draw a curve of all tests, measured as points and answered as lines."""
    for number, test in enumerate(dict.fromkeys(row[0] for row in rows)):
        mine = [row for row in rows if row[0] == test]
        along, measured, answered = ([float(row[i]) for row in mine] for i in (1, column, column + 1))
        colour = COLOURS[number % len(COLOURS)]
        axes.plot(along, measured, "o", color=colour, markersize=4)
        axes.plot(along, answered, color=colour, linewidth=1.5)
    axes.grid(alpha=0.25)
    axes.spines[["top", "right"]].set_visible(False)
