"""Nested tuples of arrays and numbers laid into one block of memory, and compiled code that finds them there.

The machine code must not allocate: numba's run-time, which counts references, is not in the library. So every array
that the kernels work on lies at a fixed place of a block that the library holds, and a tuple of arrays is made of the
block's address alone. Numbers are constants of the code.
"""

from collections.abc import Iterator
from typing import Any

import numba
import numpy as np
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic
from numba.np.arrayobj import make_array, populate_array

ALIGNMENT = 64


def block(record: Any) -> bytearray:
    """Return the contents of the arrays of a nested tuple, each at its place."""
    contents = bytearray()
    for array in _arrays(record):
        contents += np.ascontiguousarray(array).tobytes()
        contents += bytes(-len(contents) % ALIGNMENT)
    return contents


def viewer(record: Any) -> Any:
    """Return a function for kernels, from the address of a block to a nested tuple of arrays like `record`."""
    kind = numba.typeof(record)

    @intrinsic
    def view(_typing, memory):
        def generate(context, builder, signature, values):
            places = _places(record)
            return _made(context, builder, values[0], record, kind, places)

        return kind(memory), generate

    return view


def _arrays(record: Any) -> Iterator[Any]:
    if isinstance(record, tuple):
        for part in record:
            yield from _arrays(part)
    elif isinstance(record, np.ndarray):
        yield record


def _places(record: Any) -> Iterator[int]:
    place = 0
    for array in _arrays(record):
        yield place
        place += array.nbytes + -array.nbytes % ALIGNMENT


def _made(context: Any, builder: Any, memory: Any, record: Any, kind: Any, places: Iterator[int]) -> Any:
    """Return the value of a nested tuple whose arrays' data begin at places of the memory."""
    if isinstance(record, tuple):
        parts = [_made(context, builder, memory, *each, places) for each in zip(record, kind, strict=True)]
        return context.make_tuple(builder, kind, parts)
    if not isinstance(record, np.ndarray):
        return context.get_constant(kind, record)
    array = make_array(kind)(context, builder)
    data = builder.bitcast(
        cgutils.pointer_add(builder, memory, next(places)), context.get_data_type(kind.dtype).as_pointer()
    )
    shape, strides = (
        [context.get_constant(types.intp, number) for number in numbers] for numbers in (record.shape, record.strides)
    )
    populate_array(array, data, shape, strides, context.get_constant(types.intp, record.itemsize), None)
    return array._getvalue()
