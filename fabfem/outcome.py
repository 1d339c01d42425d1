"""How a run of any scene ended, and what a scene says about itself before it runs."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from enum import Enum
from pathlib import Path
from typing import Any, NamedTuple

from fabfem.case import CaseError
from fabfem.output.history import read_history
from fabfem.output.progress import summary

LOCK = ".lock"
"""File in the folder of a result that is locked while a run writes there."""
UNWRITTEN = "unwritten"
"""Status of a run whose results could not be written to their end."""

INTERRUPTED = "interrupted; all increments that converged are kept"
"""Reason of a run that was interrupted."""


class Outcome(NamedTuple):
    """How a run ended."""

    status: str
    """``completed``, ``stopped``, ``interrupted``, or ``unwritten`` where the results could not be written."""
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
    time: str = ""
    """What a run will cost in time, in words; empty where nobody asked, or it is not known without a pilot."""


class Pricing(Enum):
    """How much may be done to tell the time that a run will take."""

    NONE = "nobody asked"
    KNOWN = "say it where a run of the kind has been measured"
    PILOT = "else measure the beginning of one"

    def time(self, known: bool, told: Callable[[], str]) -> str:
        """Return what a run will cost in time, as `told` finds out; nothing where that may not be done.

        `known` says whether a run of the kind has been measured.
        """
        return told() if self is Pricing.PILOT or (self is Pricing.KNOWN and known) else ""


class FolderError(CaseError):
    """A folder that takes no results now, whatever the case says."""


@contextmanager
def claimed(folder: Path) -> Iterator[None]:
    """Make the folder of some results and keep other runs out of it while inside.

    The lock is the operating system's: it goes with the process that holds it, however that ends. A file system that
    knows no locks keeps nobody out.

    Raises
    ------
    FolderError
        If nothing can be written there, or another run is writing there.
    """
    from filelock import FileLock, Timeout

    lock = FileLock(folder / LOCK)
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with suppress(NotImplementedError):
            lock.acquire(timeout=0)
        (folder / "report.json").touch()
    except Timeout:
        raise FolderError(
            f"{folder}: another run is writing its results there; wait for its end, or name another folder by --out"
        ) from None
    except OSError as error:
        lock.release()
        raise FolderError(f"{folder}: results cannot be written there ({error.strerror or error})") from None
    try:
        yield
    finally:
        lock.release()


def unwritten(error: OSError, folder: Path, seconds: float) -> Outcome:
    """Return how a run ended whose results could not be written any more; what was begun and not done is removed."""
    for file in folder.glob(".*.part"):
        file.unlink(missing_ok=True)
    where = f"{Path(error.filename).name.removeprefix('.').removesuffix('.part')}: " if error.filename else ""
    reason = (
        f"the results in {folder} cannot be written: {where}{error.strerror or error}; what was written is kept, "
        "and --resume goes on from the last checkpoint once the cause is mended"
    )
    with suppress(OSError, ValueError):
        return Outcome(UNWRITTEN, reason, folder, len(read_history(folder / "history.csv")[1]), (), seconds)
    return Outcome(UNWRITTEN, reason, folder, 0, (), seconds)


def short(value: Any) -> str:
    """Return a value of the history as the terminal shows it."""
    return f"{value:.5g}" if isinstance(value, float) else str(value)
