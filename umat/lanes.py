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

if COMPILED:

    @njit(nogil=True, error_model="numpy")
    def lanes(width):
        """Indices of the first lanes."""
        return range(width)

    @njit(nogil=True, error_model="numpy")
    def select(condition, yes, no):
        """Choose between two numbers."""
        return yes if condition else no

    @njit(nogil=True, error_model="numpy")
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


@njit(nogil=True, error_model="numpy")
def spot(row, lane):
    """Place of one number, for loops over single lanes."""
    return row * LANES + lane


def rows(count: int) -> np.ndarray:
    """Return zeroed storage for `count` rows, flat."""
    return np.zeros(count * LANES)


#: Decorator of the lane kernels: no global lock, C arithmetic, multiply–add fused (the same on every run).
kernel = njit(nogil=True, error_model="numpy", cache=True, fastmath={"contract"})
