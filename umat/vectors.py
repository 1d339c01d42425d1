"""The compiler's type of a row in use: as many numbers as one instruction handles, with their arithmetic.

numba knows numbers and arrays of them; this adds a fixed number of them side by side, an LLVM vector. A row is read
from and written to a flat array of float64; a number beside one stands for the same in every lane.
"""

import operator
from typing import Any, ClassVar

import numpy as np
from llvmlite import ir
from numba.core import cgutils, types
from numba.core.typing.templates import ConcreteTemplate, infer_global, signature
from numba.extending import intrinsic, lower_builtin, models, register_model

WIDTH = 8


class Vector(types.Type):
    """Type of a row in use."""


class Mask(types.Type):
    """Type of a comparison of rows."""


VECTOR, MASK = Vector(f"vector{WIDTH}"), Mask(f"mask{WIDTH}")
NUMBERS, TRUTHS = ir.VectorType(ir.DoubleType(), WIDTH), ir.VectorType(ir.IntType(1), WIDTH)


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
    zeros = ir.Constant(ir.VectorType(ir.IntType(32), WIDTH), None)
    return builder.shuffle_vector(one, ir.Constant(NUMBERS, ir.Undefined), zeros)


def _place(context: Any, builder: Any, array: Any, kind: Any, index: Any) -> Any:
    """Return the address of a row."""
    data = context.data_model_manager[kind].get(builder, array, "data")
    first = builder.mul(index, index.type(WIDTH))
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
        kind = types.containers.UniTuple(VECTOR, count)

        def build(context, builder, sig, args):
            places = [builder.add(args[1], args[1].type(i)) for i in range(count)]
            values = [builder.load(_place(context, builder, args[0], sig.args[0], place), align=8) for place in places]
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
        cases: ClassVar = [signature(result, *pair) for pair in pairs]

    for pair in pairs:

        @lower_builtin(function, *pair)
        def _lower(context, builder, sig, args):
            a, b = (_spread(builder, kind, value) for kind, value in zip(sig.args, args, strict=True))
            return build(builder, a, b)


def _function(function: Any, build: Any) -> None:
    """Teach the compiler a function of one row."""

    @infer_global(function)
    class _Function(ConcreteTemplate):
        cases: ClassVar = [signature(VECTOR, VECTOR)]

    @lower_builtin(function, VECTOR)
    def _lower(context, builder, sig, args):
        return build(builder, args[0])


def _call(name: str) -> Any:
    """Return what calls a vector function of the compiler's."""

    def build(builder, value):
        kind = ir.FunctionType(NUMBERS, [NUMBERS])
        return builder.call(cgutils.get_or_insert_function(builder.module, kind, f"llvm.{name}.v{WIDTH}f64"), [value])

    return build


def _by_lane(name: str) -> Any:
    """Return what calls a function of numbers for each lane in turn."""

    def build(builder, *values):
        number = ir.DoubleType()
        called = cgutils.get_or_insert_function(
            builder.module, ir.FunctionType(number, [number] * len(values)), f"llvm.{name}.f64"
        )
        out = ir.Constant(NUMBERS, ir.Undefined)
        for lane in range(WIDTH):
            here = ir.IntType(32)(lane)
            out = builder.insert_element(
                out, builder.call(called, [builder.extract_element(v, here) for v in values]), here
            )
        return out

    return build


for _name, _build in {"add": "fadd", "sub": "fsub", "mul": "fmul", "truediv": "fdiv"}.items():
    _operation(getattr(operator, _name), VECTOR, lambda builder, a, b, name=_build: getattr(builder, name)(a, b))
for _name, _sign in {"lt": "<", "le": "<=", "gt": ">", "ge": ">="}.items():
    _operation(getattr(operator, _name), MASK, lambda builder, a, b, sign=_sign: builder.fcmp_ordered(sign, a, b))
# what is not a number stays so where it is the first argument
_operation(np.maximum, VECTOR, lambda builder, a, b: builder.select(builder.fcmp_unordered(">", a, b), a, b))
_operation(np.minimum, VECTOR, lambda builder, a, b: builder.select(builder.fcmp_unordered("<", a, b), a, b))
_operation(operator.pow, VECTOR, _by_lane("pow"))
_function(operator.neg, lambda builder, a: builder.fneg(a))
_function(np.sqrt, _call("sqrt"))
_function(np.abs, _call("fabs"))
_function(np.exp, _by_lane("exp"))


@infer_global(operator.and_)
class _And(ConcreteTemplate):
    cases: ClassVar = [signature(MASK, MASK, MASK)]


@lower_builtin(operator.and_, MASK, MASK)
def _and(context, builder, sig, args):
    return builder.and_(*args)
