"""What a scene leaves out, in sentences, and what remains of it: unknowns, points and memory."""

from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from fabfem.case import BoundaryValueCase
from fabfem.fem.model import Model
from fabfem.fem.multigrid import MANY
from fabfem.fem.space import Space
from fabfem.substance import Substance
from umat import symmetric_tangent

PROGRAM = 210.0
"""Memory of the interpreter with all packages and compiled kernels [MiB]."""


def left_out(
    case: BoundaryValueCase, space: Space, fields: Sequence[str], substances: Mapping[str, Substance]
) -> Iterator[str]:
    """Yield a sentence for each thing that a scene does without."""
    nodes = _nodes(space)
    if case.water is None:
        yield f"no pore pressure: the scene is dry ({_corners(space)} unknowns fewer)"
    elif not case.water.excess:
        yield f"no excess pore pressure: it is given ({_corners(space)} unknowns fewer)"
    missing = 3 - len(space.components)
    if missing:
        reason = (
            "the scene is flat" if case.scene.kinematics == "plane_strain" else "the scene has an axis and no torsion"
        )
        yield f"no third displacement: {reason} ({missing * nodes} unknowns fewer)"
    for substance in substances.values():
        yield from substance.omitted
    idle = sorted(set(fields) - set(case.output.fields if case.output else ()))
    if idle:
        yield f"not gathered, because not asked for: {', '.join(idle)}"


def _corners(space: Space) -> int:
    corners = np.unique(space.mesh.cells[:, : len(space.mesh.element.corners)])
    return space.mesh.ranks.sum(len(corners[space.mesh.ranks.owned(corners)]))


def _nodes(space: Space) -> int:
    """Return the nodes of the whole mesh."""
    nodes = np.arange(len(space.mesh.points))
    return space.mesh.ranks.sum(len(nodes[space.mesh.ranks.owned(nodes)]))


def remaining(model: Model) -> Iterator[tuple[str, str]]:
    """Yield (what, how much) of what is left to compute."""
    space = model.space
    total = space.mesh.ranks.sum
    yield "elements", f"{total(len(space.mesh.cells))} ({space.mesh.cell_type}), {_nodes(space)} nodes"
    yield "points", str(total(space.npoints))
    yield "unknowns", str(total(len(space.once(np.arange(space.ndof)))))
    for name, zone in model.zones.items():
        if zone.directions is not None:
            yield f"directions in {name}", str(len(zone.directions))
    most = f"about {space.mesh.ranks.largest(memory(model)):.0f} MiB{_each(space)}"
    yield "memory", f"{most}, of which {PROGRAM:.0f} MiB for the program itself"


def _each(space: Space) -> str:
    return "" if space.mesh.ranks.size == 1 else " on the rank that needs most"


def memory(model: Model) -> float:
    """Return an estimate of the memory that a run needs [MiB]: program, points, stiffness and what solves with it."""
    space = model.space
    states = sum(np.asarray(part).nbytes for zone in model.zones.values() for part in zone.state)
    points = 3 * states + space.npoints * (2 * len(space.kinematics.active) ** 2 + 8 * 6) * 8 + space.terms.nbytes
    places = (1.0 if space.mesh.dim == 2 else 2.0) * space.dofs.shape[1] ** 2 * len(space.dofs)
    whole = 12.0 * _entries(space)
    half = 0.5 if all(symmetric_tangent(zone.material) for zone in model.zones.values()) else 1.0
    iterative = model.solver in ("auto", "multigrid") and space.mesh.dim == 3 and space.ndof >= MANY
    solving = whole + 2.0 * whole if iterative else half * (whole + _factors(space))
    return PROGRAM + (points + places + solving) / 2**20


def _entries(space: Space) -> float:
    """Return about how many entries the stiffness has."""
    return space.ndof * len(space.components) * (12.0 if space.mesh.dim == 2 else 28.0)


def _factors(space: Space) -> float:
    """Return about how many bytes the factors of the stiffness take, after nested dissection [George 1973]."""
    nodes = len(space.mesh.points)
    fill = 8.0 * nodes * np.log2(nodes + 1.0) if space.mesh.dim == 2 else 8.0 * nodes ** (4.0 / 3.0)
    return fill * len(space.components) ** 2 * 8.0
