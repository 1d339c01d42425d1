"""What of a whole mesh a process has, and values carried from one division of the mesh to another.

What a march is taken up at (`fabfem.fem.start`) is made of arrays by dof, point, node, element or pressure; which of
these an array is, its name tells (`KINDS`), and below ``states`` the zone. A share says where in the whole mesh the
entries of each belong, so that the shares of n processes can be dealt out to m.
"""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import is_dataclass
from typing import Any, NamedTuple

import numpy as np

from fabfem.fem.porous_space import PorousSpace
from fabfem.fem.space import Space

KINDS = {
    **dict.fromkeys(("displacement", "force", "origin", "guess", "last", "start"), "dofs"),
    **{"tangent": "points", "rate": "pressures", "at_nodes": "nodes", "in_cells": "elements"},
}
"""What the first axis of an array counts, by the name of the array or of the table that it stands in."""


class Share(NamedTuple):
    """What a process has, by the numbers of the whole mesh."""

    elements: np.ndarray
    nodes: np.ndarray
    pressures: np.ndarray
    """Nodes that have a pore pressure as an unknown."""
    zones: Mapping[str, np.ndarray]
    """Elements of each zone, in the order of its states."""
    nq: int
    """Points of an element."""
    ncomp: int
    """Displacement components of a node."""

    def numbers(self, kind: str) -> np.ndarray:
        """Which entries of the whole mesh the entries of an array of a kind are, zones by ``zone:`` and their names."""
        if kind == "dofs":  # pressures count on from a number that no displacement has
            motion = (self.nodes[:, None] * self.ncomp + np.arange(self.ncomp)).ravel()
            return np.concatenate([motion, -1 - self.pressures])
        if kind in ("points", "elements") or kind.startswith("zone:"):
            elements = self.zones[kind[5:]] if kind.startswith("zone:") else self.elements
            return elements if kind == "elements" else (elements[:, None] * self.nq + np.arange(self.nq)).ravel()
        return self.nodes if kind == "nodes" else self.pressures


def share_of(space: Space) -> Share:
    """Return the share of the process that has a space."""
    mesh = space.mesh
    elements, nodes = mesh.ranks.numbers(len(mesh.cells), len(mesh.points))
    pressures = nodes[space.pressure_nodes] if isinstance(space, PorousSpace) else np.zeros(0, int)
    zones = {name: elements[ids] for name, ids in mesh.zones.items()}
    return Share(elements, nodes, pressures, zones, space.nq, len(space.components))


def carried(pieces: Iterable[tuple[Share, Any]], here: Share) -> Any:
    """Return the value that the pieces of several processes make, as far as `here` has it; read one after another."""
    whole: list[np.ndarray] = []
    template: Any = None
    for share, piece in pieces:
        found: list[tuple[str, np.ndarray]] = []
        mapped(piece, "", _noting(found))
        if template is None:
            template = piece
            whole = [np.zeros((len(here.numbers(kind)), *array.shape[1:]), array.dtype) for kind, array in found]
        for target, (kind, array) in zip(whole, found, strict=True):
            into, of = _matched(here.numbers(kind), share.numbers(kind))
            target[into] = array[of]
    rest = iter(whole)
    return mapped(template, "", lambda kind, array: next(rest))


def _noting(found: list[tuple[str, np.ndarray]]) -> Callable[[str, np.ndarray], None]:
    """Return what notes every array and its kind."""
    return lambda kind, array: found.append((kind, array))


def mapped(value: Any, kind: str, change: Callable[[str, np.ndarray], Any]) -> Any:
    """Return a value of records, tables and arrays with `change` applied to every array that has a kind."""
    if isinstance(value, np.ndarray):
        return change(kind, value) if kind and value.ndim else value
    if isinstance(value, Mapping):
        return {key: mapped(entry, kind, change) for key, entry in value.items()}
    names = getattr(value, "_fields", ())
    if is_dataclass(value) or not names:
        return type(value)(mapped(part, kind, change) for part in value) if isinstance(value, list | tuple) else value
    return type(value)(*(_field(name, getattr(value, name), kind, change) for name in names))


def _field(name: str, value: Any, kind: str, change: Callable[[str, np.ndarray], Any]) -> Any:
    if name == "states":
        return {zone: mapped(state, f"zone:{zone}", change) for zone, state in value.items()}
    return mapped(value, kind if kind.startswith("zone:") else KINDS.get(name, kind), change)


def _matched(here: np.ndarray, there: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the places of what both have, in each."""
    _, into, of = np.intersect1d(here, there, assume_unique=True, return_indices=True)
    return into, of
