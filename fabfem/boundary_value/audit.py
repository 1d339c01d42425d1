"""The null-step audit: how much the first equilibrium moves, and why.

A geostatic stage begins with a stress that is guessed (K0), a gravity stage with none or a little. The audit of the
first says how far out of balance the guess was before anything moved and where most, that of the second what is left
after gravity was turned on; both how far the ground moved and how many points yielded.
"""

from typing import Any

import numpy as np

import umat
from fabfem.boundary_value.problem import Problem
from fabfem.case.stages import Geostatic, Gravity
from fabfem.fem.constraints import constrain
from fabfem.fem.increment import Increment
from fabfem.fem.points import stress_of

BALANCED = 1e-6
"""Relative out-of-balance force below which a guess is in balance."""


def audited(problem: Problem, increment: Increment) -> bool:
    """Return whether an increment ends a stage that makes the state before anything is built."""
    return isinstance(problem.case.stage[increment.stage_index], Geostatic | Gravity) and increment.fraction >= 1.0


def audit(problem: Problem, increment: Increment) -> dict[str, Any]:
    """Return the audit of the stage that an increment ends."""
    geostatic = isinstance(problem.case.stage[increment.stage_index], Geostatic)
    found: dict[str, Any] = {
        "stage": increment.stage,
        "out_of_balance": increment.out_of_balance if geostatic else increment.residuals[-1],
        "moved": problem.model.space.farthest(increment.displacement),
        "yielded": yielded(problem, increment),
    }
    if geostatic and found["out_of_balance"] > BALANCED:
        found |= _worst(problem, increment)
    return found | {"why": _why(found, geostatic)}


def yielded(problem: Problem, increment: Increment) -> float | None:
    """Return the share of the volume that has yielded since the run began, None where no material knows."""
    space, known = problem.model.space, 0.0
    total = 0.0
    for name, zone in increment.zones.items():
        volume = space.weights[zone.points]
        strain = umat.state_fields(zone.material, increment.states[name]).get("plastic_strain")
        if strain is not None:
            known, total = known + volume[strain > 0.0].sum(), total + volume.sum()
    known, total = space.mesh.ranks.sum(known), space.mesh.ranks.sum(total)
    return float(known / total) if total else None


def _worst(problem: Problem, increment: Increment) -> dict[str, Any]:
    """Return where the guess was most out of balance, and on which boundaries that is."""
    model, stage = problem.model, problem.model.stages[increment.stage_index]
    space = model.space
    force = increment.external_force - space.internal_force(stress_of(space, increment.zones, increment.before))
    kept = constrain(space, stage.supports, stage.bodies).keep_unknown(force)
    size = np.abs(kept[: len(space.mesh.points) * len(space.components)]).reshape(len(space.mesh.points), -1)
    nodes = space.mesh.ranks.nearest(-size.max(axis=1))  # one, on the ranks that have it
    on = [name for name in space.mesh.boundaries if np.isin(nodes, space.mesh.nodes_on(name)).any()]
    mine = [(space.mesh.points[node].tolist(), int(size[node].argmax()), on) for node in nodes]
    at, component, on = space.mesh.ranks.one(mine)
    return {"at": at, "component": space.components[component], "boundaries": on}


def _why(found: dict[str, Any], geostatic: bool) -> str:
    if not geostatic:
        return "gravity was turned on, so the ground moved into its first equilibrium; displacements count from there"
    if found["out_of_balance"] <= BALANCED:
        return "the guessed stress is in balance"
    place = f"on {' and '.join(found['boundaries'])}" if found["boundaries"] else "inside the ground"
    at = ", ".join(f"{value:.4g}" for value in found["at"])
    causes = "a surface that is not level, a load that the surcharge does not include, or zones that differ sideways"
    strength = f"; {100 * found['yielded']:.3g} % of the ground yielded under it" if found["yielded"] else ""
    return f"the guessed stress is out of balance most {place} at ({at}) along {found['component']}: {causes}{strength}"
