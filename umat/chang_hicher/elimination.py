"""Small linear systems, one in each lane, solved side by side without exchanging rows.

The unknown stresses come first: their block is the compliance at fixed fabric, whose pivots are positive where
the material is stable. A vanishing pivot gives a step that is not finite, or wild: the line search and the
step control see to those.
"""

from ..lanes import at, kernel, lanes


@kernel
def factorise(rows, matrix, n, width):
    """Replace n × n rows by their L U factors, the diagonal by its inverse."""
    for k in range(n):
        diagonal = matrix + k * n + k
        for l in lanes(width):
            rows[at(diagonal, l)] = 1.0 / rows[at(diagonal, l)]
        for i in range(k + 1, n):
            factor = matrix + i * n + k
            for l in lanes(width):
                rows[at(factor, l)] *= rows[at(diagonal, l)]
            for j in range(k + 1, n):
                target, above = matrix + i * n + j, matrix + k * n + j
                for l in lanes(width):
                    rows[at(target, l)] -= rows[at(factor, l)] * rows[at(above, l)]


@kernel
def solve(rows, matrix, right, n, m, width):
    """Replace n × m rows by the solutions of the factorised systems."""
    for k in range(n):
        for i in range(k + 1, n):
            subtract(rows, matrix + i * n + k, right + i * m, right + k * m, m, width)
    for k in range(n - 1, -1, -1):
        diagonal = matrix + k * n + k
        for j in range(m):
            target = right + k * m + j
            for l in lanes(width):
                rows[at(target, l)] *= rows[at(diagonal, l)]
        for i in range(k):
            subtract(rows, matrix + i * n + k, right + i * m, right + k * m, m, width)


@kernel
def subtract(rows, factor, target, source, m, width):
    """Subtract factor times m rows from m rows."""
    for j in range(m):
        for l in lanes(width):
            rows[at(target + j, l)] -= rows[at(factor, l)] * rows[at(source + j, l)]
