"""Where a march can be taken up again: everything that its next increment depends on, as one value.

The matrices, the solver and its analysis are made anew from the model; only what came out of the increments is kept:
the last equilibrium, and what the stage had come to (the size to try next, the displacement that carries the last
increment on, the load factor, the bracket of a search).
"""

from typing import Any, NamedTuple

import numpy as np

from fabfem.fem.model import Model
from fabfem.fem.trial import Equilibrium


class Start(NamedTuple):
    """The end of an increment."""

    stage: str
    stage_index: int
    number: int
    """Increments so far."""
    time: float
    """Time when the stage began."""
    now: Equilibrium
    origin: np.ndarray
    """(ndof,) internal force of the skeleton when the stage began."""
    progress: Any
    """What the course of the stage had come to; a record of the module that goes through it."""


def misfit(model: Model, start: Start) -> str:
    """Return why a march of a model cannot be taken up at a start, in a sentence; nothing where it can."""
    names = [stage.name for stage in model.stages]
    if start.stage not in names[start.stage_index : start.stage_index + 1]:
        return f"it lies in stage {start.stage_index + 1}, '{start.stage}', and the stages are {', '.join(names)}"
    if len(start.now.displacement) != model.space.ndof:
        return f"it has {len(start.now.displacement)} unknowns and the mesh has {model.space.ndof}"
    if set(start.now.states) != set(model.zones):
        return f"it has the zones {', '.join(start.now.states)} and the mesh has {', '.join(model.zones)}"
    changed = {name for stage in model.stages for name in stage.changes}
    for name, zone in model.zones.items():
        if len(start.now.states[name].stress) != len(zone.state.stress):
            return f"zone '{name}' has other points in it"
        if name not in changed and _shapes(start.now.states[name]) != _shapes(zone.state):
            return f"the material of zone '{name}' keeps another state"
    return ""


def _shapes(state: Any) -> tuple[Any, ...]:
    return (type(state), *(part.shape for part in state))
