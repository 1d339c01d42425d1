"""Who has which part of a mesh, and what has to be added up over all of them: here, one process has all of it.

A run that many processes share (`fabfem.parallel`) gives each an own `Mesh` of some elements and an object with the
interface of `Alone`. Space, assembly, batch update and Newton are those of one process on the elements of one rank;

* a nodal displacement (ndof,) is complete and the same on every rank that has the node;
* nodal forces made of a rank's own elements are partial until `summed` has added those of the others;
* lengths and products of nodal vectors count every node once, on the rank that owns it (`owned`), and are summed;
* what a decision hangs on (residuals, refusals, errors) is the same on all ranks, so all take the same way.

With one process all of this is the identity.
"""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np


class Around(NamedTuple):
    """A rank's elements with those of other ranks around them."""

    mesh: Any
    """The rank's elements first; without boundaries, and alone."""
    values: Callable[[np.ndarray], np.ndarray]
    """Values (n, ...) of the rank's elements -> those of all elements of `mesh`; called by all ranks together."""
    inner: int
    """Elements of `mesh` before those of the outermost layer."""


class Alone:
    """One process with the whole mesh; also the interface of a rank among many."""

    rank = 0
    size = 1
    spent: dict[str, float] = {}  # noqa: RUF012 nobody adds to it: one process has nothing to tell
    """What the solver and the exchange between ranks have come to."""
    patches: np.ndarray | None = None
    """(nel,) patch of each element, where it was found on a larger mesh."""

    def __reduce__(self) -> str:
        """Stay the one object, copied or sent."""
        return "ALONE"

    def sum(self, value: Any) -> Any:
        """A number or array, summed over all ranks."""
        return value

    def least(self, value: Any) -> Any:
        """A number or array, its least over all ranks."""
        return value

    def largest(self, value: Any) -> Any:
        """A number or array, its largest over all ranks."""
        return value

    def stacked(self, rows: np.ndarray) -> np.ndarray:
        """The rows of all ranks, in the order of the ranks."""
        return rows

    def agreed(self, answer: Any, nq: int, may_hold: float) -> Any:
        """The answer of the points, a refusal where any rank has one or more than a share `may_hold` are held."""
        return answer

    def summed(self, values: np.ndarray) -> np.ndarray:
        """(nnodes, k) values at nodes, summed over the ranks that have the node."""
        return values

    def extreme(self, values: np.ndarray) -> np.ndarray:
        """(nnodes,) values at nodes, the largest over the ranks that have the node."""
        return values

    def owned(self, nodes: np.ndarray) -> np.ndarray | slice:
        """Which of some nodes this rank counts."""
        return slice(None)

    def touching(self, boundary: str) -> np.ndarray:
        """Nodes of a boundary whose facets there are all on other ranks."""
        return np.zeros(0, int)

    def told(self) -> str:
        """The hash of the whole mesh, where this is a part; empty where it is not."""
        return ""

    def numbers(self, nel: int, nnodes: int) -> tuple[np.ndarray, np.ndarray]:
        """The numbers in the whole mesh of this rank's elements and nodes."""
        return np.arange(nel), np.arange(nnodes)

    def point(self, number: int, nq: int) -> int:
        """The number in the whole mesh of a point of this rank, `nq` points to an element."""
        return number

    def places(self, points: np.ndarray, numbers: np.ndarray | list[int], nq: int) -> np.ndarray:
        """The places (n, dim) of points of the whole mesh, of which `points` are this rank's."""
        return points[numbers]

    def one(self, found: list[Any]) -> Any:
        """The first of what the ranks have found, of lists that may be empty on some of them."""
        return found[0]

    def nearest(self, distance: np.ndarray) -> np.ndarray:
        """The node of the least distance, the first in the whole mesh; empty on a rank that does not have it."""
        return np.array([distance.argmin()])

    def around(self, mesh: Any, layers: int) -> Around:
        """A rank's mesh with some layers of the others' elements around it; one process has no others."""
        return Around(mesh, lambda values: values, len(mesh.cells))

    def solver(self, constraints: Any, space: Any) -> Any:
        """A linear solver for the unknowns of a stage; None for those of one process."""
        return None


ALONE = Alone()
