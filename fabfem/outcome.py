"""How a run of any scene ended, and what a scene says about itself before it runs."""

from pathlib import Path
from typing import Any, NamedTuple

from fabfem.case import CaseError
from fabfem.output.progress import summary


class Outcome(NamedTuple):
    """How a run ended."""

    status: str
    """``completed``, ``stopped`` or ``interrupted``."""
    reason: str
    """Why it ended before its end, in a sentence; empty when completed."""
    folder: Path
    """Where the results are."""
    increments: int
    """Converged increments."""
    last: tuple[tuple[str, str], ...]
    """Header and value of the last row of the history."""
    seconds: float
    """Wall time [s]."""

    def summary(self, error: str = "") -> str:
        """Return what the terminal shows when a run is over: how it ended, how wrong it is if known, where to look."""
        head = f"{self.status} after {self.increments} increments in {self.seconds:.1f} s"
        files = {"history": "history.csv", "fields": "fields.pvd", "report": "report.json"}
        places = [(name, str(self.folder / file)) for name, file in files.items() if (self.folder / file).is_file()]
        known = [("error", error)] if error else []
        below = [*known, *places, ("pictures", f"fabfem show {self.folder}")]
        return "\n".join([head, summary(self.last), "", summary(below)])


class Description(NamedTuple):
    """What a scene says about itself before it runs."""

    omitted: tuple[str, ...]
    """Sentences on what it leaves out."""
    remains: tuple[tuple[str, str], ...]
    """Name and size of what is left."""
    memory: float = 0.0
    """Memory that a run needs [MiB]; 0 where the scene cannot tell."""


def make_folder(folder: Path) -> None:
    """Make the folder of the results; `CaseError` if nothing can be written there."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
        (folder / "report.json").touch()
    except OSError as error:
        raise CaseError(f"{folder}: results cannot be written there ({error.strerror or error})") from None


def short(value: Any) -> str:
    """Return a value of the history as the terminal shows it."""
    return f"{value:.5g}" if isinstance(value, float) else str(value)
