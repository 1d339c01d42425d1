"""Peak and residual of every force of the history, by stage."""

from collections.abc import Sequence
from typing import Any

from fabfem.boundary_value.probes import Column
from fabfem.fem.increment import Increment

LOADS = ("reaction", "derived", "factor")
"""Kinds of column that have a peak."""


class Peaks:
    """The largest and the last value of the forces of a history, by stage."""

    def __init__(self, columns: Sequence[Column]) -> None:
        self._at = [(place, column) for place, column in enumerate(columns) if column.kind in LOADS]
        self._found: dict[tuple[int, str], dict[str, Any]] = {}

    def add(self, increment: Increment, row: Sequence[Any]) -> None:
        """Take an increment's row."""
        for place, column in self._at:
            value = float(row[place])
            here = {"stage": increment.stage, "column": column.header, "peak": value, "increment": increment.number}
            entry = self._found.setdefault((increment.stage_index, column.name), here | {"time": increment.time})
            if abs(value) > abs(entry["peak"]):
                entry.update(peak=value, increment=increment.number, time=increment.time)
            entry["last"] = value
            entry["last_over_peak"] = value / entry["peak"] if entry["peak"] else 1.0

    def memory(self) -> list[tuple[tuple[int, str], dict[str, Any]]]:
        """Return all entries with their keys."""
        return list(self._found.items())

    def recall(self, memory: list[tuple[tuple[int, str], dict[str, Any]]]) -> None:
        """Go on from the entries of an earlier run."""
        self._found = {key: dict(entry) for key, entry in memory}

    def content(self) -> list[dict[str, Any]]:
        """Return an entry for each stage and force."""
        return list(self._found.values())
