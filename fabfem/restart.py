"""Where a run begins: at its beginning, at the last checkpoint of its own folder, or at that of another run."""

from pathlib import Path
from typing import Any, NamedTuple

from fabfem.case import CaseError
from fabfem.identity import differences
from fabfem.output.archive import ArchiveError
from fabfem.output.checkpoints import Checkpoint, newest

SHOWN = 3
"""Differences that a refusal names."""


class Restart(NamedTuple):
    """What is asked of a run besides its case."""

    resume: bool = False
    """Go on from the last checkpoint in the folder of the results, if there is one."""
    branch: Path | None = None
    """Folder of another run, from whose last checkpoint a new result begins."""


FRESH = Restart()


def checkpoint_of(restart: Restart, folder: Path, now: dict[str, Any]) -> Checkpoint | None:
    """Return the checkpoint that a run of identity `now` goes on from; None where it begins at the beginning.

    Raises
    ------
    CaseError
        If the run of the checkpoint was another one, or there is none to branch from.
    """
    if restart.branch is not None:
        return _branched(restart.branch, folder)
    found = _newest(folder) if restart.resume else None
    differing = differences(found.identity, now) if found else []
    if differing:
        more = f" and {len(differing) - SHOWN} more" if len(differing) > SHOWN else ""
        raise CaseError(
            f"{folder}: this run cannot be resumed, since {', '.join(differing[:SHOWN])}{more}; "
            f"'--branch {folder} --out DIR' starts a new result from its last state"
        )
    return found


def _branched(source: Path, folder: Path) -> Checkpoint:
    if source.resolve() == folder.resolve():
        raise CaseError(f"{folder}: a branch needs a folder of its own; '--out DIR' names it")
    found = _newest(source)
    if found is None:
        raise CaseError(f"{source}: there is no checkpoint to branch from")
    return found


def _newest(folder: Path) -> Checkpoint | None:
    try:
        return newest(folder)
    except ArchiveError as error:
        raise CaseError(f"{folder}: no checkpoint can be read: {error}") from None
