"""Small linear systems, one in each lane, solved side by side without exchanging rows.

The unknown stresses come first: their block is the compliance at fixed fabric, whose pivots are positive where
the material is stable. The smallest pivot relative to its column is reported; where it is poor, the step is cut.
"""

import numpy as np

from ..lanes import kernel, lanes


@kernel
def factorise(a, pivot, n):
    """Replace the n × n rows of `a` by their L U factors; `pivot` becomes the least |pivot| / |diagonal before|."""
    pivot[:] = 1.0
    for k in range(n):
        diagonal = a[k * n + k]
        for l in lanes():
            pivot[l] = np.minimum(pivot[l], np.abs(diagonal[l]))
            diagonal[l] = 1.0 / diagonal[l]
        for i in range(k + 1, n):
            factor = a[i * n + k]
            for l in lanes():
                factor[l] *= diagonal[l]
            for j in range(k + 1, n):
                target, above = a[i * n + j], a[k * n + j]
                for l in lanes():
                    target[l] -= factor[l] * above[l]


@kernel
def equilibrate(a, b, n, m):
    """Divide every row by its diagonal entry of the start, so that pivots are compared with one."""
    for i in range(n):
        scale = a[i * n + i].copy()
        for l in lanes():
            scale[l] = 1.0 / scale[l]
        for j in range(n):
            target = a[i * n + j]
            for l in lanes():
                target[l] *= scale[l]
        for j in range(m):
            target = b[i * m + j]
            for l in lanes():
                target[l] *= scale[l]


@kernel
def solve(a, b, n, m):
    """Replace the n × m rows of `b` by the solutions of the factorised systems."""
    for k in range(n):
        for i in range(k + 1, n):
            factor = a[i * n + k]
            for j in range(m):
                target, above = b[i * m + j], b[k * m + j]
                for l in lanes():
                    target[l] -= factor[l] * above[l]
    for k in range(n - 1, -1, -1):
        diagonal = a[k * n + k]
        for j in range(m):
            target = b[k * m + j]
            for l in lanes():
                target[l] *= diagonal[l]
        for i in range(k):
            factor = a[i * n + k]
            for j in range(m):
                target, below = b[i * m + j], b[k * m + j]
                for l in lanes():
                    target[l] -= factor[l] * below[l]
