"""Lanes: points laid side by side, so that one instruction serves several of them.

A quantity of the kernel is a *row* of `LANES` numbers, one for each point in flight; rows lie one after
another in flat arrays. Kernels are written once: compiled, ``for l in lanes(width)`` is a loop that the
compiler vectorises; with the compiler switched off (``NUMBA_DISABLE_JIT=1``) it is a single pass with slices,
and the same source is a plain numpy program. Arithmetic inside such a loop therefore has no branches on data:
`select`, `np.maximum` and `np.minimum` only.
"""

import numba
import numpy as np
from numba import njit

COMPILED = not numba.config.DISABLE_JIT
#: Points in flight in one kernel. 64 fills the vector units and still lives in the caches.
LANES = 64 if COMPILED else 256

_OPTIONS = {"nogil": True, "error_model": "numpy", "fastmath": {"contract"}}
#: Decorator of what Python calls: kept on disk from one session to the next.
entry = njit(cache=True, **_OPTIONS)
#: Decorator of what only kernels call: no global lock, C arithmetic, multiply–add fused (the same on every run), and
#: no wrappers for Python, which would take longer to compile than the functions.
kernel = njit(no_cpython_wrapper=True, no_cfunc_wrapper=True, **_OPTIONS)

if COMPILED:

    @kernel
    def lanes(width):
        """Indices of the first lanes."""
        return range(width)

    @kernel
    def select(condition, yes, no):
        """Choose between two numbers."""
        return yes if condition else no

    @kernel
    def at(row, lane):
        """Place of a row's entry in a flat array (unsigned: no test for a negative index in the inner loop)."""
        return np.uint64(row) * np.uint64(LANES) + np.uint64(lane)

else:

    def lanes(width):
        """Return one slice that stands for the first lanes."""
        return (slice(0, width),)

    select = np.where

    def at(row, lane):
        """Place of a row's entries in a flat array."""
        return slice(row * LANES + lane.start, row * LANES + lane.stop)


@kernel
def spot(row, lane):
    """Place of one number, for loops over single lanes."""
    return row * LANES + lane


def rows(count: int) -> np.ndarray:
    """Return zeroed storage for `count` rows, flat."""
    return np.zeros(count * LANES)
