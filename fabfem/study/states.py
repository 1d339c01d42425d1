"""States that the runs of a sweep pass, as their reports name them, and the exponential through some of them.

``states.csv`` has a row for each state of each run: the parameters, what the report says of the state, and, as
``start_psi`` and the like, what the history has of the same measures where the stage begins.
"""

import csv
import json
from collections.abc import Iterator, Sequence
from io import StringIO
from math import isfinite
from typing import Any, NamedTuple

import numpy as np

from fabfem.case.study import Sweep, SweptPicture
from fabfem.study.progress import text
from fabfem.study.store import Run

Rows = list[dict[str, Any]]


class Exponential(NamedTuple):
    """The exponential y = factor exp(rate x) nearest to some points, as a straight line in the logarithm of y."""

    factor: float
    """Value at x = 0."""
    rate: float
    """Exponent over x."""
    determination: float
    """Share of the variance of log y that it explains (R²)."""
    points: int
    """Points it goes through."""


def exponential(x: Sequence[float], y: Sequence[float]) -> Exponential | None:
    """Return the best exponential through some points with y > 0, ``None`` for fewer than three of them."""
    pairs = np.array([(a, np.log(b)) for a, b in zip(x, y, strict=True) if b > 0.0 and isfinite(a)])
    if len(pairs) < 3 or np.ptp(pairs[:, 0]) == 0.0:
        return None
    rate, start = np.polyfit(pairs[:, 0], pairs[:, 1], 1)
    gap = pairs[:, 1] - (start + rate * pairs[:, 0])
    spread = float(np.var(pairs[:, 1]))
    share = 1.0 - float(np.mean(gap**2)) / spread if spread > 0.0 else float("nan")
    return Exponential(float(np.exp(start)), float(rate), share, len(pairs))


def states(runs: Sequence[Run]) -> Rows:
    """Return a row for each state of each run that has a report."""
    return [row for run in runs for row in _of_run(run)]


def _of_run(run: Run) -> Iterator[dict[str, Any]]:
    file = run.folder / "report.json"
    history = run.history()
    if not history or not file.is_file():
        return
    parameters = {setting.name: text(setting.value) for setting in run.choice}
    for stage in json.loads(file.read_text(encoding="utf-8")).get("stages", ()):
        places = [row for row, name in enumerate(history.get("stage", ())) if name == stage["name"]]
        for state, said in stage.get("states", {}).items():
            numbers = {key: value for key, value in said.items() if isinstance(value, int | float)}
            start = {f"start_{key}": float(history[key][places[0]]) for key in numbers if places and key in history}
            yield {**parameters, "stage": stage["name"], "state": state, **numbers, **start}


def table(rows: Rows) -> str:
    """Return the text of a table of states."""
    lines = StringIO()
    writer = csv.DictWriter(lines, list(dict.fromkeys(key for row in rows for key in row)), lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    return lines.getvalue()


def fits(said: Sweep, rows: Rows) -> dict[str, list[Any]]:
    """Return the exponential of each panel of each picture of states, by the name of the picture."""
    return {picture.name: _fitted(picture, rows) for picture in said.picture if picture.states}


def _fitted(picture: SweptPicture, rows: Rows) -> list[Any]:
    found = []
    for x, y in zip(picture.x, picture.y, strict=True):
        pairs = [(row[x], row[y]) for row in rows if row["state"] in picture.states and x in row and y in row]
        best = exponential([a for a, _ in pairs], [b for _, b in pairs])
        found.append(best._asdict() if best else None)
    return found
