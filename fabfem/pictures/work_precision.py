"""The work-precision picture of a study: error over run time, both logarithmic, a line for each knob."""

import json
import math
from collections.abc import Sequence
from pathlib import Path
from textwrap import fill
from typing import Any

COLOURS = ("#1f5a8a", "#c1662f", "#3c7d4f", "#8a3f7a", "#6b6b2a", "#4a4a9a", "#a0303a", "#2a8a8a")
FLOOR = 1e-15
"""Error below which rounding is all there is."""


def draw(folder: Path) -> Path:
    """Draw ``study.png`` from the ``study.json`` of a folder and return its file."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    study = json.loads((folder / "study.json").read_text(encoding="utf-8"))
    rows = [row for row in study["rows"] if row["time"] is not None and row["error"] is not None]
    figure = Figure(figsize=(9, 6), layout="constrained")
    axes = figure.add_subplot()
    for number, knob in enumerate(dict.fromkeys(row["knob"] for row in rows if row["knob"])):
        _line(axes, [row for row in rows if row["knob"] == knob], knob, COLOURS[number % len(COLOURS)])
    _scatter(axes, [row for row in rows if not row["knob"]])
    _front(axes, [row for row in rows if row["pareto"]])
    _doubt(axes, study["truth"]["doubt"])
    clock = "wall" if study["clock"] == "wall" else "processor"
    quantity = study["quantity"]["column"].replace("_", " ")
    axes.set(xscale="log", yscale="log", xlabel=f"{clock} time [s]", ylabel=f"relative error of {quantity}")
    axes.set_title(fill(study["title"] or study["case"], 90), fontsize=11)
    axes.grid(alpha=0.25, which="both")
    axes.spines[["top", "right"]].set_visible(False)
    axes.legend(fontsize=9)
    FigureCanvasAgg(figure)
    figure.savefig(folder / "study.png", dpi=130)
    return folder / "study.png"


def _line(axes: Any, rows: Sequence[dict[str, Any]], knob: str, colour: str) -> None:
    """Draw the runs along a knob, in the order of its values, each with its value beside it."""
    times, errors = [row["time"] for row in rows], [_seen(row["error"]) for row in rows]
    axes.plot(times, errors, color=colour, marker="o", markersize=5, linewidth=1.5, label=knob)
    for row, time, error in zip(rows, times, errors, strict=True):
        axes.annotate(row["value"], (time, error), xytext=(5, 5), textcoords="offset points", fontsize=8, color=colour)


def _scatter(axes: Any, rows: Sequence[dict[str, Any]]) -> None:
    """Draw the case as it stands, and combinations of knobs."""
    alone = [row for row in rows if row["label"] == "as the case stands"]
    mixed = [row for row in rows if row not in alone]
    if mixed:
        places = [row["time"] for row in mixed], [_seen(row["error"]) for row in mixed]
        axes.plot(*places, "o", color="#999999", markersize=4, label="combinations", zorder=1)
    for row in alone:
        axes.plot(row["time"], _seen(row["error"]), "*", color="black", markersize=14, label=row["label"], zorder=4)


def _front(axes: Any, rows: Sequence[dict[str, Any]]) -> None:
    """Draw the runs that none beats in both time and error."""
    front = sorted((row["time"], _seen(row["error"])) for row in rows)
    if front:
        axes.step(*zip(*front, strict=True), where="post", color="#888888", linestyle="--", linewidth=1.0, zorder=0)
        axes.plot(
            *zip(*front, strict=True), "o", markersize=12, markerfacecolor="none", color="#888888", label="Pareto front"
        )


def _doubt(axes: Any, doubt: float | None) -> None:
    """Draw the error that the truth may have itself."""
    if doubt and math.isfinite(doubt):
        axes.axhline(doubt, color="#bbbbbb", linestyle=":", label="how sure the truth is")


def _seen(error: float) -> float:
    return max(error, FLOOR)
