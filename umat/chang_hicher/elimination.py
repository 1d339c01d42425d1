"""Small linear systems, one in each lane, solved side by side without exchanging rows.

The unknown stresses come first: their block is the compliance at fixed fabric, whose pivots are positive where
the material is stable. A vanishing pivot gives a step that is not finite, or wild: the line search and the
step control see to those.
"""

from ..lanes import inlined, kernel, put, row


@kernel
def factorise(rows, matrix, n):
    """Replace n × n rows by their L U factors, the diagonal by its inverse."""
    for k in range(n):
        inverse = 1.0 / row(rows, matrix + k * n + k)
        put(rows, matrix + k * n + k, inverse)
        for i in range(k + 1, n):
            factor = row(rows, matrix + i * n + k) * inverse
            put(rows, matrix + i * n + k, factor)
            subtract(rows, factor, matrix + i * n + k + 1, matrix + k * n + k + 1, n - k - 1)


@kernel
def solve(rows, matrix, right, n, m):
    """Replace n × m rows by the solutions of the factorised systems."""
    for k in range(n):
        for i in range(k + 1, n):
            subtract(rows, row(rows, matrix + i * n + k), right + i * m, right + k * m, m)
    for k in range(n - 1, -1, -1):
        inverse = row(rows, matrix + k * n + k)
        for j in range(m):
            put(rows, right + k * m + j, row(rows, right + k * m + j) * inverse)
        for i in range(k):
            subtract(rows, row(rows, matrix + i * n + k), right + i * m, right + k * m, m)


@inlined
def subtract(rows, factor, target, source, m):
    """Subtract a factor times m rows from m rows."""
    for j in range(m):
        put(rows, target + j, row(rows, target + j) - factor * row(rows, source + j))
