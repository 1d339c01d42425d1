"""Which products of a direction's displacement and its normal are summed, and the moments of the normals.

With mirror symmetry about the plane normal to z every component with an odd number of z indices vanishes; those
sums are simply not in the list and stay zero, which is all that the symmetry needs.

Storage: a pair (i, k) is row 3 i + k, a symmetric pair row `PAIR`, a symmetric triple row `TRIPLE`.
"""

from functools import lru_cache
from itertools import product
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..directions import Directions
from .contact import GROUP
from .rows import (
    AXES,
    BARE,
    BARE_SLIPPED,
    BY_DILATANCY,
    BY_FRICTION,
    BY_NORMAL,
    BY_TANGENT,
    D_DILATANCY,
    D_FRICTION,
    D_LATE,
    D_SLIPPED,
    DISPLACEMENT,
    ELASTIC,
    H_SLIPPED,
    LATE,
    PAIR,
    SLIPPED,
    STIFFNESS_SLIPPED,
    T_SLIPPED,
    TANGENTIAL,
    TRIPLE,
    WASTE,
    D,
    T,
)  # fmt: skip


class Terms(NamedTuple):
    """Terms (buffer row, three out rows, three moment columns), and the Mandel components that do not vanish."""

    always: NDArray[np.int64]
    final: NDArray[np.int64]  #: for the error, in the last evaluation
    density: NDArray[np.int64]  #: for the derivative by an evolving fabric, in the last evaluation
    components: NDArray[np.int64]


class Rule(NamedTuple):
    """Contact directions, padded with weightless ones to whole groups, and the moments of their normals."""

    normals: NDArray[np.float64]
    weights: NDArray[np.float64]
    table: NDArray[np.float64]  #: zero where there is no weight
    used: int  #: without the padding


@lru_cache(maxsize=2)
def terms(mirrored: bool) -> Terms:
    """Return the terms of a half sphere, or of a quarter mirrored about the plane z = 0."""

    def kept(*index: int) -> bool:
        return not mirrored or index.count(2) % 2 == 0

    def pairs(out: Any, row: Any) -> list[tuple[Any, Any, Any]]:
        return [(out + 3 * i + j, row + i, j) for i, j in product(AXES, AXES) if kept(i, j)]

    def triples(out: Any, row: Any) -> list[tuple[Any, Any, Any]]:
        return [(out + 10 * i + s, row + i, 9 + s) for i in AXES for s, triple in enumerate(TRIPLE) if kept(i, *triple)]

    always = pairs(D, DISPLACEMENT) + pairs(D_SLIPPED, SLIPPED) + pairs(D_FRICTION, BY_FRICTION)
    for out, row in ((D_DILATANCY, BY_DILATANCY), (TANGENTIAL, BY_TANGENT)):
        always += [(out + s, row, 3 + s) for s, pair in enumerate(PAIR) if kept(*pair)]
    always += [(H_SLIPPED + 6 * (3 * i + k) + s, STIFFNESS_SLIPPED + 3 * i + k, 3 + s)
               for i, k in product(AXES, AXES) for s, pair in enumerate(PAIR) if kept(i, k, *pair)]  # fmt: skip
    always += triples(ELASTIC, BY_NORMAL)
    density = triples(T, BARE) + triples(T_SLIPPED, BARE_SLIPPED)
    components = np.array([0, 1, 2, 5] if mirrored else range(6))
    return Terms(_in_threes(always), _in_threes(pairs(D_LATE, LATE)), _in_threes(density), components)


def _in_threes(terms: list[tuple[Any, Any, Any]]) -> NDArray[np.int64]:
    """Return the terms (out row, buffer row, column) three in a row that share a buffer row, filled up with waste."""
    table = []
    for row in sorted({term[1] for term in terms}):
        of_row = [(out, column) for out, buffer, column in terms if buffer == row]
        for k in range(0, len(of_row), 3):
            three = of_row[k : k + 3]
            three += [(WASTE + j, 0) for j in range(len(three), 3)]
            table.append([row, *(out for out, _ in three), *(column for _, column in three)])
    return np.array(table)


def moments(normals: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return n_i, n_i n_j and n_i n_j n_k of every direction, shape (directions, 3 + 6 + 10)."""
    columns = [normals[:, i] for i in AXES]
    columns += [normals[:, list(index)].prod(axis=1) for index in (*PAIR, *TRIPLE)]
    return np.ascontiguousarray(np.array(columns).T)


def padded(directions: Directions) -> Rule:
    """Return the directions, padded with weightless copies of the first."""
    if directions.mirror_axis not in (None, "z"):
        raise ValueError(f"the mirror plane of the directions must be normal to z, not {directions.mirror_axis}")
    missing = -len(directions.weights) % GROUP
    normals = np.vstack([directions.normals, np.repeat(directions.normals[:1], missing, axis=0)])
    weights = np.concatenate([directions.weights, np.zeros(missing)])
    table = moments(normals) * (weights > 0.0)[:, None]
    return Rule(np.ascontiguousarray(normals), weights, table, len(directions.weights))
