"""Lanes: points laid side by side, so that one instruction serves several of them.

A quantity of the kernel is a *row* of `LANES` numbers, one for each point in flight; rows lie one after another in flat
arrays. `row` reads one, `put` writes one; what is between them reads like arithmetic on numbers and acts on all lanes.
Compiled, a row in use is one value of the vector unit (`vectors`): the compiler gets no loops to vectorise and no
overlaps of arrays to check, which is faster to run and to compile. With the compiler switched off
(``NUMBA_DISABLE_JIT=1``) a row is a numpy array, and the same source is a plain numpy program. There are no branches on
such data: `select`, `np.maximum` and `np.minimum` only. `spot` is the place of one lane's number, for what each point
does by itself.
"""

from typing import Any

import numba
import numpy as np
from numba import njit

from .vectors import WIDTH

COMPILED = not numba.config.DISABLE_JIT
#: Points in flight in one kernel.
LANES = WIDTH if COMPILED else 64

#: Versions of numba, from one to before another, whose inside `compiling` is known to fit; others compile by themselves
#: what they are given, in twice the time.
KNOWN = (0, 61), (0, 69)


def _pipeline() -> dict[str, Any]:
    """Return the option that lets inner kernels be compiled by passes of their own, where numba is known."""
    version = tuple(int(number) for number in numba.__version__.split(".")[:2])
    if not KNOWN[0] <= version < KNOWN[1]:
        return {}
    from .compiling import InnerCompiler

    return {"pipeline_class": InnerCompiler}


# no kernel makes arrays, and counting who holds one would empty the vector registers at every turn
_OPTIONS: dict[str, Any] = {"nogil": True, "error_model": "numpy", "fastmath": {"contract"}, "_nrt": False}
#: Decorator of what Python calls: kept on disk from one session to the next.
entry = njit(cache=True, **_OPTIONS)
#: Decorator of what only kernels call: no global lock, C arithmetic, multiply–add fused (the same on every run), and
#: no wrappers for Python, which would take longer to compile than the functions.
_INNER: dict[str, Any] = {
    "no_cpython_wrapper": True,
    "no_cfunc_wrapper": True,
    **_pipeline(),
    **_OPTIONS,
}
kernel = njit(**_INNER)
#: Decorator of short kernels whose arguments are rows: they stay in registers only where there is no call.
inlined = njit(forceinline=True, **_INNER)

if COMPILED:
    from .vectors import nine, put, row, select, six, store

    @kernel
    def lanes():
        """Indices of the lanes, for what is done lane by lane."""
        return range(LANES)

    @kernel
    def at(row, lane):
        """Place of a row's entry in a flat array."""
        return row * LANES + lane

else:

    def row(array, index):
        """Return a row of a flat array."""
        return array[index * LANES : (index + 1) * LANES].copy()

    def put(array, index, value):
        """Write a row of a flat array."""
        array[index * LANES : (index + 1) * LANES] = value

    def six(array, first):
        """Return six consecutive rows."""
        return tuple(row(array, first + i) for i in range(6))

    def nine(array, first):
        """Return nine consecutive rows."""
        return tuple(row(array, first + i) for i in range(9))

    def store(array, first, values):
        """Write consecutive rows."""
        for i, value in enumerate(values):
            put(array, first + i, value)

    select = np.where

    def lanes():
        """Return one slice that stands for all lanes."""
        return (slice(0, LANES),)

    def at(row, lane):
        """Place of a row's entries in a flat array."""
        return slice(row * LANES, (row + 1) * LANES)


@kernel
def spot(row, lane):
    """Place of one number, for loops over single lanes."""
    return row * LANES + lane


def rows(count: int) -> np.ndarray:
    """Return zeroed storage for `count` rows, flat."""
    return np.zeros(count * LANES)
