"""A run that several processes share: what its report says of them, and how one goes on from what others wrote."""

import json
from pathlib import Path
from typing import Any

import numpy as np

from fabfem.case import CaseError
from fabfem.fem.share import carried, share_of
from fabfem.fem.space import Space
from fabfem.output.archive import ArchiveError
from fabfem.output.atomic import write_atomic
from fabfem.output.checkpoints import Checkpoint, pieces
from fabfem.output.report import peak_memory
from fabfem.timing import Timer


def shares(space: Space, timer: Timer) -> dict[str, Any]:
    """Return the report's entry ``ranks``: what each one had and spent, a list each; nothing for one process alone.

    The imbalance of a phase is the largest time of a rank over the mean; a rank that waits for others at the end of
    `material` or `assembly` does so in the next phase.
    """
    ranks = space.mesh.ranks
    if not ranks.spent:
        return {}
    own = {
        "elements": len(space.mesh.cells),
        "points": space.npoints,
        "unknowns": len(space.once(np.arange(space.ndof))),
        "ghosts": space.ndof - len(space.once(np.arange(space.ndof))),
        "peak_memory": round(peak_memory(), 1),
        **{name: round(seconds, 4) for name, seconds in timer.spent.items()},
        **ranks.spent,
    }
    table = ranks.stacked(np.array([list(own.values())], float))
    found = dict(zip(own, table.T.tolist(), strict=True))
    phases = ("elements", "material", "assembly")
    imbalance = {name: round(max(found[name]) / np.mean(found[name]), 3) for name in phases if any(found[name])}
    return {"ranks": {"number": ranks.size, "imbalance": imbalance, **found}}


def blame(folder: Path, rank: int, error: BaseException) -> None:
    """Write into the report that a rank has failed, and of what; the first rank may not come to it any more."""
    path = folder / "report.json"
    if path.is_file():
        content = json.loads(path.read_text(encoding="utf-8"))
        content |= {"status": "stopped", "reason": f"rank {rank} failed: {error or type(error).__name__}"}
        write_atomic(path, json.dumps(content, indent=1) + "\n")


def dealt(found: Checkpoint, folder: Path, space: Space, mesh: str) -> Checkpoint:
    """Return a checkpoint of `folder` as far as this process has the mesh, from the shares of those that wrote it.

    Parameters
    ----------
    found : Checkpoint
        What was found in the folder.
    folder : Path
        Where its shares are.
    space : Space
        What this process has.
    mesh : str
        Hash of the whole mesh.

    Raises
    ------
    CaseError
        If a share is missing or damaged, or several processes are to take up the state of another mesh.
    """
    if found.shares == 1 and space.mesh.ranks.size == 1:
        return found
    if found.identity["mesh"] != mesh:
        raise CaseError(f"{folder}: its state is that of another mesh, and cannot be dealt out to several processes")
    here = share_of(space)
    try:
        both = carried(
            ((piece.share, (piece.start, piece.written["pending"])) for piece in pieces(folder, found)), here
        )
    except ArchiveError as error:
        raise CaseError(f"{folder}: the checkpoint of {found.shares} processes cannot be read: {error}") from None
    return found._replace(start=both[0], written=found.written | {"pending": both[1]})
