"""Lanes: points laid side by side, so that one instruction serves several of them.

A quantity of the kernel is a *row* of `LANES` numbers, one for each point in flight; rows lie one after another in flat
arrays. `row` reads one, `put` writes one; what is between them reads like arithmetic on numbers and acts on all lanes.
Compiled, a row in use is one value of the vector unit: the compiler gets no loops to vectorise and no overlaps of
arrays to check, which is faster to run and to compile. With the compiler switched off (``NUMBA_DISABLE_JIT=1``) a row is
a numpy array, and the same source is a plain numpy program. There are no branches on such data: `select`, `np.maximum`
and `np.minimum` only. `spot` is the place of one lane's number, for what each point does by itself.
"""

import operator
from typing import Any

import numba
import numpy as np
from numba import njit

from .compiling import InnerCompiler

COMPILED = not numba.config.DISABLE_JIT
#: Points in flight in one kernel: as many numbers as one instruction handles at most.
LANES = 8 if COMPILED else 64

# no kernel makes arrays, and counting who holds one would empty the vector registers at every turn
_OPTIONS: dict[str, Any] = {"nogil": True, "error_model": "numpy", "fastmath": {"contract"}, "_nrt": False}
#: Decorator of what Python calls: kept on disk from one session to the next.
entry = njit(cache=True, **_OPTIONS)
#: Decorator of what only kernels call: no global lock, C arithmetic, multiply–add fused (the same on every run), and
#: no wrappers for Python, which would take longer to compile than the functions.
_INNER: dict[str, Any] = {"no_cpython_wrapper": True, "no_cfunc_wrapper": True, "pipeline_class": InnerCompiler, **_OPTIONS}
kernel = njit(**_INNER)
#: Decorator of short kernels whose arguments are rows: they stay in registers only where there is no call.
inlined = njit(forceinline=True, **_INNER)

if COMPILED:
    from llvmlite import ir
    from numba.core import cgutils, types
    from numba.core.typing.templates import ConcreteTemplate, infer_global, signature
    from numba.extending import intrinsic, lower_builtin, models, register_model

    class Vector(types.Type):
        """Type of a row in use."""

    class Mask(types.Type):
        """Type of a comparison of rows."""

    VECTOR, MASK = Vector(f"vector{LANES}"), Mask(f"mask{LANES}")
    NUMBERS, TRUTHS = ir.VectorType(ir.DoubleType(), LANES), ir.VectorType(ir.IntType(1), LANES)

    @register_model(Vector)
    class _VectorModel(models.PrimitiveModel):
        def __init__(self, manager: Any, kind: Any) -> None:
            super().__init__(manager, kind, NUMBERS)

    @register_model(Mask)
    class _MaskModel(models.PrimitiveModel):
        def __init__(self, manager: Any, kind: Any) -> None:
            super().__init__(manager, kind, TRUTHS)

    def _spread(builder: Any, kind: Any, value: Any) -> Any:
        """Return a number in every lane, or a row as it is."""
        if kind == VECTOR:
            return value
        one = builder.insert_element(ir.Constant(NUMBERS, ir.Undefined), value, ir.IntType(32)(0))
        zeros = ir.Constant(ir.VectorType(ir.IntType(32), LANES), None)
        return builder.shuffle_vector(one, ir.Constant(NUMBERS, ir.Undefined), zeros)

    def _place(context: Any, builder: Any, array: Any, kind: Any, index: Any) -> Any:
        """Return the address of a row."""
        data = context.make_array(kind)(context, builder, array).data
        first = builder.mul(index, index.type(LANES))
        return builder.bitcast(builder.gep(data, [first]), NUMBERS.as_pointer())

    @intrinsic
    def row(typing, array, index):
        """Return a row of a flat array."""

        def build(context, builder, sig, args):
            return builder.load(_place(context, builder, args[0], sig.args[0], args[1]), align=8)

        return VECTOR(array, types.intp), build

    @intrinsic
    def put(typing, array, index, value):
        """Write a row of a flat array."""

        def build(context, builder, sig, args):
            place = _place(context, builder, args[0], sig.args[0], args[1])
            builder.store(_spread(builder, sig.args[2], args[2]), place, align=8)
            return context.get_dummy_value()

        return types.none(array, types.intp, VECTOR if value == VECTOR else types.float64), build

    def _several(count: int) -> Any:
        """Return the function that reads consecutive rows."""

        def several(typing, array, first):
            kind = types.UniTuple(VECTOR, count)

            def build(context, builder, sig, args):
                places = [builder.add(args[1], args[1].type(i)) for i in range(count)]
                values = [
                    builder.load(_place(context, builder, args[0], sig.args[0], place), align=8) for place in places
                ]
                return context.make_tuple(builder, kind, values)

            return kind(array, types.intp), build

        return several

    six, nine = intrinsic(_several(6)), intrinsic(_several(9))

    @intrinsic
    def store(typing, array, first, values):
        """Write consecutive rows."""
        kinds = [VECTOR if value == VECTOR else types.float64 for value in values]

        def build(context, builder, sig, args):
            for i, kind in enumerate(kinds):
                index = builder.add(args[1], args[1].type(i))
                value = _spread(builder, kind, builder.extract_value(args[2], i))
                builder.store(value, _place(context, builder, args[0], sig.args[0], index), align=8)
            return context.get_dummy_value()

        return types.none(array, types.intp, values), build

    @intrinsic
    def select(typing, condition, yes, no):
        """Choose between two rows or numbers, lane by lane."""
        kinds = [VECTOR if value == VECTOR else types.float64 for value in (yes, no)]

        def build(context, builder, sig, args):
            return builder.select(args[0], *(_spread(builder, k, v) for k, v in zip(kinds, args[1:], strict=True)))

        return VECTOR(MASK, *kinds), build

    def _operation(function: Any, result: Any, build: Any) -> None:
        """Teach the compiler a function of two rows, or of a row and a number."""
        pairs = ((VECTOR, VECTOR), (VECTOR, types.float64), (types.float64, VECTOR))

        @infer_global(function)
        class _Operation(ConcreteTemplate):
            cases = [signature(result, *pair) for pair in pairs]

        for pair in pairs:

            @lower_builtin(function, *pair)
            def _lower(context, builder, sig, args):
                a, b = (_spread(builder, kind, value) for kind, value in zip(sig.args, args, strict=True))
                return build(builder, a, b)

    def _function(function: Any, build: Any) -> None:
        """Teach the compiler a function of one row."""

        @infer_global(function)
        class _Function(ConcreteTemplate):
            cases = [signature(VECTOR, VECTOR)]

        @lower_builtin(function, VECTOR)
        def _lower(context, builder, sig, args):
            return build(builder, args[0])

    def _call(name: str) -> Any:
        """Return what calls a vector function of the compiler's."""

        def build(builder, value):
            kind = ir.FunctionType(NUMBERS, [NUMBERS])
            return builder.call(
                cgutils.get_or_insert_function(builder.module, kind, f"llvm.{name}.v{LANES}f64"), [value]
            )

        return build

    def _by_lane(name: str) -> Any:
        """Return what calls a function of numbers for each lane in turn."""

        def build(builder, *values):
            number = ir.DoubleType()
            called = cgutils.get_or_insert_function(
                builder.module, ir.FunctionType(number, [number] * len(values)), f"llvm.{name}.f64"
            )
            out = ir.Constant(NUMBERS, ir.Undefined)
            for lane in range(LANES):
                here = ir.IntType(32)(lane)
                out = builder.insert_element(
                    out, builder.call(called, [builder.extract_element(v, here) for v in values]), here
                )
            return out

        return build

    for _name, _build in {"add": "fadd", "sub": "fsub", "mul": "fmul", "truediv": "fdiv"}.items():
        _operation(getattr(operator, _name), VECTOR, lambda builder, a, b, name=_build: getattr(builder, name)(a, b))
    for _name, _sign in {"lt": "<", "le": "<=", "gt": ">", "ge": ">="}.items():
        _operation(
            getattr(operator, _name), MASK, lambda builder, a, b, sign=_sign: builder.fcmp_ordered(sign, a, b)
        )
    # what is not a number stays so where it is the first argument
    _operation(np.maximum, VECTOR, lambda builder, a, b: builder.select(builder.fcmp_unordered(">", a, b), a, b))
    _operation(np.minimum, VECTOR, lambda builder, a, b: builder.select(builder.fcmp_unordered("<", a, b), a, b))
    _operation(operator.pow, VECTOR, _by_lane("pow"))
    _function(operator.neg, lambda builder, a: builder.fneg(a))
    _function(np.sqrt, _call("sqrt"))
    _function(np.abs, _call("fabs"))
    _function(np.exp, _by_lane("exp"))

    @kernel
    def lanes():
        """Indices of the lanes, for what is done lane by lane."""
        return range(LANES)

    @kernel
    def at(row, lane):
        """Place of a row's entry in a flat array."""
        return row * LANES + lane

    @infer_global(operator.and_)
    class _And(ConcreteTemplate):
        cases = [signature(MASK, MASK, MASK)]

    @lower_builtin(operator.and_, MASK, MASK)
    def _and(context, builder, sig, args):
        return builder.and_(*args)

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
