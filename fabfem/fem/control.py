"""The equation that says how far an increment goes whose load is found: a displacement, or the length of its path."""

from functools import singledispatch
from typing import NamedTuple, Protocol

import numpy as np

from fabfem.fem.space import Space
from fabfem.fem.stages import ArcLength, DisplacementControl


class Control(Protocol):
    """The equation that says how far an increment goes."""

    def row(self, step: np.ndarray) -> np.ndarray:
        """Derivative (ndof,) of what is controlled, at a displacement increment."""

    def misfit(self, step: np.ndarray, size: float) -> float:
        """What a displacement increment lacks of an increment of a part `size` of the stage."""

    def scale(self, size: float) -> float:
        """Size of what is controlled in an increment."""

    def first(self, along: np.ndarray, size: float, last: np.ndarray | None, sense: float) -> float:
        """Change of the load factor of an increment that goes `along` per unit of it, after the increment `last`.

        `sense` is 1 or -1 where it is to rise or fall, 0 where it is to go on.
        """


@singledispatch
def control(goal: object, space: Space) -> Control:
    """The equation that a goal asks for."""
    raise TypeError(f"{type(goal).__name__} does not control a stage.")


class _Displacement(NamedTuple):
    space: Space
    direction: np.ndarray
    change: float

    def row(self, step: np.ndarray) -> np.ndarray:
        return self.direction

    def misfit(self, step: np.ndarray, size: float) -> float:
        return size * self.change - self.space.dot(self.direction, step)

    def scale(self, size: float) -> float:
        return abs(size * self.change)

    def first(self, along: np.ndarray, size: float, last: np.ndarray | None, sense: float) -> float:
        slope = self.space.dot(self.direction, along)
        return size * self.change / slope if slope else np.inf


class _Arc(NamedTuple):
    space: Space
    nodes: int
    length: float

    def row(self, step: np.ndarray) -> np.ndarray:
        return 2.0 * step / self.nodes

    def misfit(self, step: np.ndarray, size: float) -> float:
        return (size * self.length) ** 2 - self.space.dot(step, step) / self.nodes

    def scale(self, size: float) -> float:
        return (size * self.length) ** 2

    def first(self, along: np.ndarray, size: float, last: np.ndarray | None, sense: float) -> float:
        length = self.space.norm(along) / np.sqrt(self.nodes)
        forward = sense or (1.0 if last is None or self.space.dot(last, along) >= 0.0 else -1.0)
        return forward * size * self.length / length if length else np.inf


@control.register
def _(goal: DisplacementControl, space: Space) -> Control:
    direction = np.zeros(space.ndof)
    for boundary, component, factor in goal.terms:
        dofs = space.dofs_on(boundary, component)
        direction[dofs] += factor / space.mesh.ranks.sum(len(space.once(dofs)))
    return _Displacement(space, direction, goal.change)


@control.register
def _(goal: ArcLength, space: Space) -> Control:
    nodes = np.arange(len(space.mesh.points))
    return _Arc(space, space.mesh.ranks.sum(len(nodes[space.mesh.ranks.owned(nodes)])), goal.length)
