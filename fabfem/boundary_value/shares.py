"""What a report says of the processes that shared a run."""

from typing import Any

import numpy as np

from fabfem.fem.space import Space
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
