"""``report.json``: what a run did, rewritten whole after every increment.

Wall times are seconds, memory is MiB, residuals are relative to the forces in play; all else is in the units of the
case, which the report holds as resolved with all defaults.
"""

import json
import platform
import sys
from collections.abc import Iterable, Mapping
from importlib import metadata
from pathlib import Path
from typing import Any

import numpy as np

from fabfem import __version__
from fabfem.case import Case
from fabfem.output.atomic import write_atomic
from fabfem.timing import Timer

PACKAGES = ("numpy", "scipy", "numba", "scikit-fem", "meshio", "pydantic", "pypardiso", "mpi4py", "petsc4py")
FILE = "report.json"
WORST = 5
"""Number of worst points kept."""


class Report:
    """The report of a run, kept as plain values and written on demand; without a path it is not written."""

    def __init__(self, path: Path | None, **head: Any) -> None:
        self.path = path
        self.content: dict[str, Any] = {
            "status": "running",
            "reason": "",
            **head,
            "sign": "compression positive for stress and strain",
            "wall_time": {},
            "peak_memory": 0.0,
            "versions": versions(),
            "worst_points": [],
            "increments": [],
            "cutbacks": [],
        }

    def add(self, increment: Mapping[str, Any], cutbacks: Iterable[Mapping[str, Any]] = ()) -> None:
        """Append a converged increment and the cut-backs that led to it."""
        self.content["increments"].append(dict(increment))
        self.content["cutbacks"].extend(dict(cutback) for cutback in cutbacks)

    def worst(self, point: Mapping[str, Any]) -> None:
        """Keep a point if its local error is among the largest so far, each point once."""
        seen = {entry["point"]: entry for entry in (point, *self.content["worst_points"])}
        for entry in self.content["worst_points"]:
            if entry["error"] > seen[entry["point"]]["error"]:
                seen[entry["point"]] = entry
        self.content["worst_points"] = sorted(seen.values(), key=lambda entry: -entry["error"])[:WORST]

    def end(self, status: str, reason: str = "") -> None:
        """Set how the run ended: ``completed``, ``stopped`` or ``interrupted``, and why."""
        self.content.update(status=status, reason=reason)

    def write_timed(self, timer: Timer) -> None:
        """Write the file with the time that a timer tells, what belongs to no phase as ``other``."""
        total = timer.total()
        self.content["processor_time"] = timer.processor()
        self.write({**timer.spent, "other": total - sum(timer.spent.values()), "total": total})

    def write(self, wall_time: Mapping[str, float]) -> None:
        """Write the file with the wall time by phase [s] as it stands."""
        self.content["wall_time"] = {phase: round(seconds, 4) for phase, seconds in wall_time.items()}
        self.content["peak_memory"] = round(peak_memory(), 1)
        if self.path is not None:
            write_atomic(self.path, json.dumps(self.content, indent=1, default=_plain, allow_nan=False) + "\n")


def about(case: Case) -> dict[str, Any]:
    """Return what the report of any scene says first: file, title and units of its case."""
    units = case.unit_system
    return {
        "case": case.path.name,
        "title": case.title,
        "units": {**units._asdict(), "stress": units.label("stress")},
    }


def read_report(folder: Path) -> dict[str, Any]:
    """Return the report in the folder of a result."""
    return dict(json.loads((folder / FILE).read_text(encoding="utf-8")))


def versions() -> dict[str, str]:
    """Return the versions of the program, the interpreter and the packages that decide a result."""
    found = {"fabfem": __version__, "python": platform.python_version()}
    for package in PACKAGES:
        try:
            found[package] = metadata.version(package)
        except metadata.PackageNotFoundError:
            continue
    return found


def peak_memory() -> float:
    """Return the largest resident memory of this process so far [MiB], 0 where the system does not tell."""
    try:
        import resource
    except ImportError:
        return 0.0
    scale = 2**20 if sys.platform == "darwin" else 2**10
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / scale


def _plain(value: Any) -> Any:
    """Return a numpy number or array as plain values."""
    if isinstance(value, np.generic | np.ndarray):
        return value.tolist()
    raise TypeError(f"{type(value).__name__} cannot stand in a report")
