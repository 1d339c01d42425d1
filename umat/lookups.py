"""Type inference and lowering that ask once what the compiler makes of an operation.

For every `a + b` numba goes through all versions of `+` that any library has taught it, some fifty times slower than
looking up what came of it for the same types before; and once more when it lowers the operation. The kernels have some
five thousand operations, but three hundred different ones. What is made of them is the same.
"""

import operator
from typing import Any

from numba.core import errors, types
from numba.core.compiler_machinery import register_pass
from numba.core.ir import UNDEFINED
from numba.core.lowering import Lower
from numba.core.typed_passes import NopythonTypeInference
from numba.core.typeinfer import TypeInferer

#: answers, and what was asked, whose identities would else be free for others
_signatures: dict[tuple[int, ...], tuple[Any, ...]] = {}
_builders: dict[tuple[int, ...], tuple[Any, ...]] = {}
#: what stands for more than itself: a method has an owner, a recursion its caller
_PARTICULAR = (types.BoundFunction, types.FunctionType, types.RecursiveCall)


class Inference(TypeInferer):
    """Type inference that remembers the signatures of calls."""

    #: whether the function will be inlined in any case, and with it what numba compiles for it
    inlined = False

    def resolve_call(self, fnty: Any, pos_args: Any, kw_args: Any) -> Any:
        """Return the signature of a call."""
        if kw_args or isinstance(fnty, _PARTICULAR):
            return super().resolve_call(fnty, pos_args, kw_args)
        key = (self.inlined, id(fnty), *map(id, pos_args))
        if key not in _signatures:
            found = super().resolve_call(fnty, pos_args, kw_args)
            if found is None:
                return None
            _signatures[key] = found, fnty, pos_args
        return _signatures[key][0]


@register_pass(mutates_CFG=True, analysis_only=False)
class InnerInference(NopythonTypeInference):
    """The pass of type inference."""

    _name = "inner_inference"

    def run_pass(self, state: Any) -> bool:
        """Infer the types of one function."""
        warnings = errors.WarningsFixer(errors.NumbaWarning)  # type: ignore[attr-defined]
        infer = Inference(state.typingctx, state.func_ir, warnings)
        infer.inlined = state.flags.forceinline
        callers, target = state.typingctx.callstack, state.targetctx.target
        with callers.register(target, infer, state.func_ir.func_id, state.args), warnings:
            for index, (name, kind) in enumerate(zip(state.func_ir.arg_names, state.args, strict=True)):
                infer.seed_argument(name, index, kind)
            infer.build_constraint()
            infer.propagate()
            state.typemap, state.return_type, state.calltypes = infer.unify()
        return True


class InnerLower(Lower):
    """Lowering that remembers what builds an operation."""

    def lower_binop(self, resty: Any, expr: Any, op: Any) -> Any:
        """Return the value of an operation on two values."""
        if expr.static_lhs is not UNDEFINED or expr.static_rhs is not UNDEFINED:
            return super().lower_binop(resty, expr, op)
        return self._build(op, (expr.lhs, expr.rhs), self.fndesc.calltypes[expr], resty)

    def lower_getitem(self, resty: Any, expr: Any, value: Any, index: Any, signature: Any) -> Any:
        """Return an element."""
        return self._build(operator.getitem, (value, index), signature, resty)

    def _build(self, function: Any, operands: Any, signature: Any, kind: Any) -> Any:
        values = [self._cast_var(*pair) for pair in zip(operands, signature.args, strict=True)]
        value = self._builder_of(function, signature.args)(self.builder, values)
        return self.context.cast(self.builder, value, signature.return_type, kind)

    def _builder_of(self, function: Any, args: Any) -> Any:
        key = (id(function), *map(id, args))
        if key not in _builders:
            typing = self.context.typing_context
            known = typing.resolve_value_type(function)
            builder = self.context.get_function(known, known.get_call_type(typing, args, {}))
            _builders[key] = builder, function, args
        return _builders[key][0]
