"""Index lists of the tensor contractions, made once for a set of directions.

A contraction such as ``B_ikml = H_ikjl G_jm`` is stored as a list of terms ``out += coefficient * a * b``, each naming
the rows it reads and writes. With mirror symmetry about the plane normal to z every component with an odd
number of z indices vanishes; those terms are simply not in the list, which is all that the symmetry needs.

Storage of a symmetric pair: xx, yy, zz, yz, xz, xy (`PAIR`), of a symmetric triple: `TRIPLE`; a general pair
(i, k) is row 3 i + k.
"""

from functools import lru_cache
from itertools import product
from typing import NamedTuple

import numpy as np

AXES = range(3)
PAIR = {(i, j): k for k, (i, j) in enumerate([(0, 0), (1, 1), (2, 2), (1, 2), (0, 2), (0, 1)])}
PAIR |= {(j, i): k for (i, j), k in PAIR.items()}
_TRIPLES = [(i, j, k) for i in AXES for j in AXES for k in AXES if i <= j <= k]
TRIPLE = {t: _TRIPLES.index(tuple(sorted(t))) for t in product(AXES, repeat=3)}
_HALF = 0.5**0.5

# rows of one direction's buffer: (quantity times its weight)
DISPLACEMENT, PLASTIC, FIRST_ORDER, BY_FRICTION, BY_DILATANCY = 0, 3, 6, 9, 12
STIFFNESS, STIFFNESS_PLASTIC, BARE, BARE_PLASTIC, BUFFER_ROWS = 13, 22, 31, 34, 37

# rows of the sums over directions
D, D_PLASTIC, D_FIRST, D_FRICTION, D_DILATANCY = 0, 9, 18, 27, 36
H, H_PLASTIC, T, T_PLASTIC, SUM_ROWS = 42, 96, 150, 180, 210

# columns of the Jacobian of the strain: six stresses, six fabric components, the void ratio
COLUMNS = 13


class Programs(NamedTuple):
    """Lists of terms: rows (out, a, b) as int32 arrays (n, 3), coefficients (n,) where they are not 1."""

    components: np.ndarray  #: Mandel components that do not vanish, (4,) or (6,)
    moments: np.ndarray  #: (out, buffer row, moment column) of the sums that a fixed fabric needs
    moments_fabric: np.ndarray  #: further sums that an evolving fabric needs
    strain: np.ndarray
    strain_coefficient: np.ndarray
    product: np.ndarray
    left: np.ndarray
    right: np.ndarray
    by_stress: np.ndarray
    by_stress_coefficient: np.ndarray
    by_force: np.ndarray
    by_force_coefficient: np.ndarray
    by_density: np.ndarray
    by_density_coefficient: np.ndarray
    by_inverse: np.ndarray
    by_inverse_coefficient: np.ndarray
    by_rate: np.ndarray


def _terms(rows):
    table = np.array([r[:3] for r in rows], np.int32).reshape(-1, 3)
    return table, np.array([r[3] if len(r) > 3 else 1.0 for r in rows])


def _mandel(i, j):
    """Weight with which entry (i, j) of a tensor feeds its symmetric Mandel component."""
    return 1.0 if i == j else _HALF


@lru_cache(maxsize=2)
def programs(mirrored: bool) -> Programs:
    """Return the lists of terms for a half sphere, or for a quarter (`mirrored` about the plane z = 0)."""

    def kept(*index):
        return not mirrored or index.count(2) % 2 == 0

    def every(rank):
        return [x for x in product(AXES, repeat=rank) if kept(*x)]

    pairs = [(i, j) for (i, j) in _symmetric() if kept(i, j)]
    moments = [
        (first + 3 * i + j, row + i, j)
        for first, row in ((D, DISPLACEMENT), (D_PLASTIC, PLASTIC), (D_FIRST, FIRST_ORDER), (D_FRICTION, BY_FRICTION))
        for i, j in every(2)
    ]
    moments += [(D_DILATANCY + PAIR[p], BY_DILATANCY, 3 + PAIR[p]) for p in pairs]
    stiffness = [(9 * 0 + 6 * (3 * i + k) + PAIR[p], 3 * i + k, 3 + PAIR[p]) for i, k in product(AXES, AXES)
                 for p in _symmetric() if kept(i, k, *p)]
    density = [(10 * i + TRIPLE[t], i, 9 + TRIPLE[t]) for i in AXES for t in _TRIPLES if kept(i, *t)]
    moments += [(H + o, STIFFNESS + b, c) for o, b, c in stiffness]
    fabric = [(H_PLASTIC + o, STIFFNESS_PLASTIC + b, c) for o, b, c in stiffness]
    fabric += [(T + o, BARE + b, c) for o, b, c in density]
    fabric += [(T_PLASTIC + o, BARE_PLASTIC + b, c) for o, b, c in density]

    strain = _terms([(PAIR[i, j], 3 * i + k, PAIR[k, j], _mandel(i, j)) for i, j, k in product(AXES, repeat=3)
                     if kept(i, j) and kept(i, k)])
    plain = _terms([(3 * i + j, 3 * i + k, PAIR[k, j]) for i, j, k in product(AXES, repeat=3)
                    if kept(i, j) and kept(i, k)])[0]
    left = _terms([(9 * (3 * i + k) + 3 * m + n, 6 * (3 * i + k) + PAIR[j, n], PAIR[j, m])
                   for i, k, m, n, j in product(AXES, repeat=5) if kept(i, k, j, n) and kept(j, m)])[0]
    right = _terms([(9 * (3 * i + k) + 3 * m + n, 9 * (3 * i + k) + 3 * m + j, PAIR[j, n])
                    for i, k, m, n, j in product(AXES, repeat=5) if kept(i, k, m, j) and kept(j, n)])[0]
    by_stress = _terms([(COLUMNS * PAIR[i, m] + PAIR[k, n], 9 * (3 * i + k) + 3 * m + n, 0, _mandel(i, m) * _mandel(k, n))
                        for i, k, m, n in every(4)])
    by_force = _terms([(COLUMNS * PAIR[i, m] + 6 + PAIR[a, n], 9 * (3 * i + k) + 3 * m + n, 3 * k + a,
                        -2 / 15 * _mandel(i, m) * _mandel(a, n))
                       for i, k, m, n, a in product(AXES, repeat=5) if kept(i, k, m, n) and kept(k, a)])
    by_density = _terms([(COLUMNS * PAIR[i, m] + 6 + PAIR[a, b], 10 * i + TRIPLE[j, a, b], PAIR[j, m],
                          0.5 * _mandel(i, m) * _mandel(a, b))
                         for i, m, j, a, b in product(AXES, repeat=5) if kept(i, j, a, b) and kept(j, m)])
    by_inverse = _terms([(COLUMNS * PAIR[i, m] + 6 + PAIR[a, b], 3 * i + a, PAIR[b, m],
                          -1 / 15 * _mandel(i, m) * _mandel(a, b))
                         for i, m, a, b in product(AXES, repeat=4) if kept(i, a) and kept(b, m)])
    by_rate = _terms([(3 * i + j, 6 * (3 * i + k) + PAIR[j, n], 3 * k + n)
                      for i, j, k, n in every(4) if kept(k, n)])[0]
    components = np.array([0, 1, 2, 5] if mirrored else range(6), np.int64)
    return Programs(components, _terms(moments)[0], _terms(fabric)[0], *strain, plain, left, right, *by_stress,
                    *by_force, *by_density, *by_inverse, by_rate)


def _symmetric():
    return [(0, 0), (1, 1), (2, 2), (1, 2), (0, 2), (0, 1)]


def moment_table(normals: np.ndarray) -> np.ndarray:
    """Return n_i, n_i n_j and n_i n_j n_k of every direction, shape (directions, 3 + 6 + 10)."""
    n = normals
    columns = [n[:, i] for i in AXES]
    columns += [n[:, i] * n[:, j] for i, j in _symmetric()]
    columns += [n[:, i] * n[:, j] * n[:, k] for i, j, k in _TRIPLES]
    return np.ascontiguousarray(np.array(columns).T)
