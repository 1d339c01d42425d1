"""Compiled routines with the Abaqus UMAT argument list: loading one, and calling it for many points.

What a routine may change (STRESS, STATEV, DDSDDE, the energies, PNEWDT) every point has for itself; what it may only
read and is the same everywhere is one block. Temperature, fields, coordinates and finite rotation do not exist here:
the routine gets zeros and identities.
"""

import ctypes
from functools import lru_cache
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from llvmlite import ir as llvm
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic
from numba.np.arrayobj import make_array
from numpy.typing import NDArray

from umat.abaqus import ARGUMENTS, SHAPES
from umat.lanes import COMPILED, entry
from umat.mandel import Array

SYMBOLS = ("umat_", "umat", "umat__", "UMAT")
"""Names under which compilers leave the routine, in the order of search."""
NAME = b"UMAT".ljust(80)
"""CMNAME, blank padded as Fortran wants it."""
PER_POINT = {"NOEL": np.int32, "KINC": np.int32, "SSE": np.float64, "SPD": np.float64, "SCD": np.float64}
COUNTS = ("NDI", "NSHR", "NTENS", "NSTATV", "NPROPS", "NPT", "LAYER", "KSPT", "KSTEP")
NUMBERS = {"RPL": 1, "DDSDDT": 6, "DRPLDE": 6, "DRPLDT": 1, "DTIME": 1, "TEMP": 1, "DTEMP": 1, "PREDEF": 1, "DPRED": 1,
           "COORDS": 3, "DROT": 9, "CELENT": 1, "DFGRD0": 9, "DFGRD1": 9}  # fmt: skip
"""Sizes of the real arguments that are the same for every point."""


class Call(NamedTuple):
    """What n points pass to a routine, in its own conventions; see `umat.abaqus`."""

    stress: Array
    """(n, NTENS) STRESS, in and out."""
    variables: Array
    """(n, NSTATV) STATEV, in and out; one column at least, so that there is an address."""
    tangent: Array
    """(n, NTENS, NTENS) DDSDDE, out; [point, j, i] is DDSDDE(i, j)."""
    strain: Array
    """(n, NTENS) STRAN."""
    strain_increment: Array
    """(n, NTENS) DSTRAN."""
    time: Array
    """(n, 2) TIME, of the step and total."""
    step: Array
    """(n,) PNEWDT, in and out."""
    shared: dict[str, NDArray[Any]]
    """Arguments that all points read; see `shared_arguments`."""


@lru_cache(maxsize=32)
def load(library: str) -> Any:
    """Return the routine of a shared library, found by ctypes.

    Raises
    ------
    ValueError
        If the file is not there, cannot be loaded, or has no such routine.
    """
    path = Path(library).resolve()
    if not path.is_file():
        raise ValueError(f"there is no library '{library}'")
    try:
        shared = ctypes.CDLL(str(path))
    except OSError as error:
        raise ValueError(f"the library '{library}' cannot be loaded ({error})") from error
    for symbol in SYMBOLS:
        if hasattr(shared, symbol):
            return getattr(shared, symbol)
    raise ValueError(f"the library '{library}' has no routine {', '.join(SYMBOLS[:-1])} or {SYMBOLS[-1]}")


def shared_arguments(components: int, variables: int, properties: Any, time_step: float) -> dict[str, NDArray[Any]]:
    """Return the arguments that all points read, by name."""
    counts = (*SHAPES[components], components, variables, len(properties), 1, 1, 1, 1)
    shared: dict[str, NDArray[Any]] = {
        name: np.array([count], np.int32) for name, count in zip(COUNTS, counts, strict=True)
    }
    shared |= {name: np.zeros(size) for name, size in NUMBERS.items()}
    for name in ("DROT", "DFGRD0", "DFGRD1"):
        shared[name][::4] = 1.0
    shared["CELENT"][0], shared["DTIME"][0] = 1.0, time_step
    shared["PROPS"] = np.array([*properties, 0.0], float)  # one number more, so that there is an address
    shared["CMNAME"] = np.frombuffer(bytearray(NAME), np.uint8)
    return shared


def run(routine: Any, call: Call, start: int, stop: int) -> None:
    """Call a routine for the points `start` … `stop`, one after another."""
    step_size = call.shared["DTIME"][0]
    own = {name: np.zeros(len(call.stress), kind) for name, kind in PER_POINT.items()}
    own["NOEL"][:] = np.arange(1, len(call.stress) + 1)
    own["KINC"][:] = np.rint(call.time[:, 1] / step_size) + 1.0
    own |= dict(zip(("STRESS", "STATEV", "DDSDDE", "STRAN", "DSTRAN", "TIME", "PNEWDT"), call[:7], strict=True))
    together = own | call.shared
    places = np.array([together[name].ctypes.data for name in ARGUMENTS])
    strides = np.array([own[name].strides[0] if name in own else 0 for name in ARGUMENTS])
    _visit(ctypes.cast(routine, ctypes.c_void_p).value, places + start * strides, strides, len(NAME), stop - start)


@entry
def _visit(routine, places, strides, length, count):
    """Call the routine at an address `count` times, its arguments further on by `strides` each time."""
    for _ in range(count):
        _invoke(routine, places, length)
        places += strides


if COMPILED:

    @intrinsic
    def _invoke(_typing, routine, places, length):
        """Compile the call of a routine at an address, with the addresses in `places` and a length at the end."""

        def generate(context, builder, signature, values):
            pointer = llvm.PointerType(llvm.IntType(8))
            table = make_array(signature.args[1])(context, builder, values[1]).data
            places = [builder.load(builder.gep(table, [cgutils.intp_t(k)])) for k in range(len(ARGUMENTS))]
            kind = llvm.FunctionType(llvm.VoidType(), [pointer] * len(ARGUMENTS) + [cgutils.intp_t])
            function = builder.inttoptr(values[0], kind.as_pointer())
            builder.call(function, [*(builder.inttoptr(place, pointer) for place in places), values[2]])
            return context.get_dummy_value()

        return types.void(routine, places, length), generate

else:

    def _invoke(routine, places, length):
        """Call a routine at an address, with the addresses in `places` and a length at the end."""
        ctypes.CFUNCTYPE(None, *[ctypes.c_void_p] * len(ARGUMENTS), ctypes.c_size_t)(routine)(*places.tolist(), length)
