"""What kinds of runs have cost on this machine, kept in the user's cache.

Times are those of a machine that does nothing else: the wall time, or the processor time where that is less, for then
other programs had the rest. What a run needs once, before its first step, is its start: interpreter, packages, what
the case describes, and the loading of compiled kernels. Compiling them, which only the first run of all does, is
never counted.
"""

import hashlib
import json
import os
import time
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, NamedTuple, TypeVar

from fabfem.output.atomic import write_atomic
from umat.cache import VARIABLE, user_cache

R = TypeVar("R")
"""Record of the rates of a kind of run."""


class Price(NamedTuple):
    """What a run will cost."""

    seconds: float
    """Wall time on a machine that does nothing else, from the command to its end [s]."""
    source: str
    """Where the rates come from."""
    evaluations: float | None = None
    """Evaluations of the material, where they are known."""

    def told(self) -> str:
        """Return it in words."""
        counted = "" if self.evaluations is None else f", {self.evaluations:.2g} evaluations"
        return f"about {duration(self.seconds)}{counted}, judged by {self.source}"


class Stopwatch:
    """Time since it was made."""

    def __init__(self) -> None:
        self._wall, self._processor, self._kernels = time.perf_counter(), time.process_time(), _kernels()

    @property
    def wall(self) -> float:
        """Wall time [s]."""
        return time.perf_counter() - self._wall

    @property
    def free(self) -> float:
        """What the wall time would have been on a machine that does nothing else [s]."""
        return min(self.wall, time.process_time() - self._processor)

    @property
    def compiled(self) -> bool:
        """Whether kernels were compiled meanwhile."""
        return _kernels() != self._kernels


def share_of(report: Mapping[str, Any]) -> float:
    """Return which part of its wall time a run would have taken on a free machine, from its report."""
    taken, spent = report.get("processor_time", {}).get("run"), report["wall_time"]["total"]
    return min(1.0, taken / spent) if taken and spent else 1.0


def start_of(report: Mapping[str, Any]) -> float:
    """Return the time that the program took before a run began, from its report [s]."""
    return float(report.get("processor_time", {}).get("start") or 0.0)


def stored(said: Any) -> dict[str, Any] | None:
    """Return the rates of a kind of run, which plain values tell from others, if they are known."""
    try:
        return dict(json.loads(_file(said).read_text(encoding="utf-8")))
    except (OSError, ValueError, TypeError):
        return None


def known(record: Callable[..., R], said: Any) -> R | None:
    """Return the rates of a kind of run as a record, if they are known and were stored from such a one."""
    try:
        return record(**(stored(said) or {}))
    except TypeError:
        return None


def source(whole: bool, pilot: str) -> str:
    """Return where rates come from: a whole run, or the `pilot` of the run in question."""
    return f"{'a run of this kind' if whole else pilot} on this machine"


def store(said: Any, rates: Mapping[str, Any]) -> None:
    """Keep the rates of a kind of run."""
    file = _file(said)
    try:
        file.parent.mkdir(parents=True, exist_ok=True)
        write_atomic(file, json.dumps(rates) + "\n")
    except OSError:
        return  # a cache that cannot be written costs no more than the next pilot


def duration(seconds: float) -> str:
    """Return a time with the unit that suits it."""
    if seconds < 120.0:
        return f"{seconds:.2g} s"
    return f"{seconds / 60.0:.0f} min" if seconds < 7200.0 else f"{seconds / 3600.0:.1f} h"


def _file(said: Any) -> Path:
    key = hashlib.sha256(json.dumps(said, sort_keys=True).encode()).hexdigest()[:16]
    return user_cache() / "fabfem-rates" / f"{key}.json"


def _kernels() -> int:
    """Return how many compiled kernels are kept."""
    folder = os.environ.get(VARIABLE)
    return sum(1 for _ in Path(folder).rglob("*.nbc")) if folder else 0
