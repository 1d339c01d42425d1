"""Checkpoints of a run: ``checkpoint_000012.npz``, the last two kept, each all that the run needs to go on.

One is written after an increment when the case's number of increments or seconds has passed since the last, but never
so often that writing takes more than a twentieth of the time; and one when a run ends, however it ends.
"""

from collections.abc import Callable, Iterator
from pathlib import Path
from time import perf_counter
from typing import Any, NamedTuple

from fabfem.output.archive import ArchiveError, read_archive, write_archive

PATTERN, SHARES = "checkpoint_*.npz", "share_*.npz"
KEPT = 2
SHARE = 0.05
"""Share of the time that may go into checkpoints written by the clock."""


class Checkpoint(NamedTuple):
    """A moment of a run."""

    identity: dict[str, Any]
    """What the run is; `fabfem.identity`."""
    start: Any
    """Where its march can be taken up."""
    written: dict[str, Any]
    """What its files had come to, by writer."""
    share: Any = None
    """What of the mesh the process had that wrote it (`fabfem.fem.share`)."""
    shares: int = 1
    """Processes that shared the run; those of the others are ``share_000012_0001.npz`` and on beside it."""


class Checkpoints:
    """The checkpoints of a folder, written as a run goes on.

    Parameters
    ----------
    folder : Path
    seconds : float
        Time between two [s].
    increments : int or None
        Increments between two, whatever the time.
    rank : int
        Number of this process among those that share the run; the first writes last, so that its file means all.
    wait : callable
        Returns when all processes have called it.
    """

    def __init__(
        self,
        folder: Path,
        seconds: float,
        increments: int | None = None,
        rank: int = 0,
        wait: Callable[[], Any] = lambda: None,
    ) -> None:
        self._rank, self._wait = rank, wait
        self.folder, self.seconds, self.increments = folder, seconds, increments
        self._at, self._cost, self._count, self._number = perf_counter(), 0.0, 0, -1

    def due(self) -> bool:
        """Return whether one is due after one more increment."""
        self._count += 1
        if self.increments is not None:
            return self._count >= self.increments
        return perf_counter() - self._at >= max(self.seconds, self._cost / SHARE)

    def write(self, number: int, checkpoint: Checkpoint) -> None:
        """Write one, named by the increments so far, unless it is there; keep the last two."""
        if number == self._number:
            return
        begun = perf_counter()
        if self._rank:
            write_archive(_share(self.folder, number, self._rank), checkpoint)
        self._wait()
        if not self._rank:
            write_archive(self.folder / f"checkpoint_{number:06d}.npz", checkpoint)
            self._forget()
        self._at, self._count, self._number = perf_counter(), 0, number
        self._cost = self._at - begun

    def _forget(self) -> None:
        """Remove all checkpoints but the last two, with their shares."""
        for file in sorted(self.folder.glob(PATTERN))[:-KEPT]:
            file.unlink()
            for share in self.folder.glob(f"share_{_number(file):06d}_*.npz"):
                share.unlink()


def _share(folder: Path, number: int, rank: int) -> Path:
    return folder / f"share_{number:06d}_{rank:04d}.npz"


def _number(file: Path) -> int:
    return int(file.stem.removeprefix("checkpoint_"))


def pieces(folder: Path, first: Checkpoint) -> Iterator[Checkpoint]:
    """Yield the checkpoints of all processes that shared a run, `first` the one that stands for them.

    Raises
    ------
    ArchiveError
        If one is damaged or missing.
    """
    yield first
    for rank in range(1, first.shares):
        try:
            yield read_archive(_share(folder, first.start.number, rank))
        except OSError as error:
            raise ArchiveError(f"{error.filename} is missing") from None


def newest(folder: Path) -> Checkpoint | None:
    """Return the last checkpoint of a folder that is whole, None where there is none.

    Raises
    ------
    ArchiveError
        If there are checkpoints and none of them can be read.
    """
    trouble: ArchiveError | None = None
    for file in sorted(folder.glob(PATTERN), reverse=True):
        try:
            found = read_archive(file)
        except ArchiveError as error:
            trouble = error
            continue
        if isinstance(found, Checkpoint):
            return found
        trouble = ArchiveError(f"{file} is no checkpoint")
    if trouble:
        raise trouble
    return None


def clear(folder: Path) -> None:
    """Remove the checkpoints of an earlier run."""
    for pattern in (PATTERN, SHARES):
        for file in folder.glob(pattern):
            file.unlink()
