"""Wall time by phase, and processor time."""

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from time import perf_counter, process_time


class Timer:
    """Wall time spent in each phase [s].

    Parameters
    ----------
    phases : sequence of str
        Names of the phases.
    """

    def __init__(self, phases: Sequence[str]) -> None:
        self._begun, self._start, self._resumed = perf_counter(), process_time(), False
        self.spent = dict.fromkeys(phases, 0.0)

    @contextmanager
    def phase(self, name: str) -> Iterator[None]:
        """Add the time of a block to a phase."""
        begun = perf_counter()
        try:
            yield
        finally:
            self.spent[name] += perf_counter() - begun

    def add(self, timings: Mapping[str, float]) -> None:
        """Add the times that somebody else took."""
        for name, seconds in timings.items():
            self.spent[name] += seconds

    def since(self, before: Mapping[str, float]) -> dict[str, float]:
        """Return the time spent in each phase after a copy of `spent` was made [s]."""
        return {name: seconds - before[name] for name, seconds in self.spent.items()}

    def resume(self, spent: Mapping[str, float], total: float) -> None:
        """Count the times of an earlier run too, `total` in all."""
        self.add({name: seconds for name, seconds in spent.items() if name in self.spent})
        self._begun -= total
        self._resumed = total > 0.0

    def total(self) -> float:
        """Return the time since the timer was made [s]."""
        return perf_counter() - self._begun

    def processor(self) -> dict[str, float]:
        """Return the processor time of the process before the timer was made and since [s]; nothing once resumed."""
        if self._resumed:
            return {}
        return {"start": round(self._start, 4), "run": round(process_time() - self._start, 4)}
