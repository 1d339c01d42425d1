"""How kernels that only other kernels call are compiled: to the compiler's intermediate code and no further.

By itself numba optimises every function and makes machine code of it, although only the entry runs, which has all of
them within it. `InnerCompiler` leaves both to the entry. It steps into the pass that numba's guide to customised
compilers shows, and into two methods of the library of code that this pass fills.

While anything is compiled Python's garbage collector rests: what the compiler makes stays alive until it has done, and
looking through it again and again was a seventh of the time. The first run of a material takes some 150 MB more for it.
"""

import gc
import operator
from typing import Any

from numba._dynfunc import make_function
from numba.core.codegen import JITCodeLibrary
from numba.core import errors, types
from numba.core.compiler import CompilerBase, DefaultPassBuilder
from numba.core.compiler_machinery import PassManager, register_pass
from numba.core.event import Event, Listener, register
from numba.core.ir import UNDEFINED
from numba.core.lowering import Lower
from numba.core.typed_passes import NativeLowering, NopythonTypeInference
from numba.core.typeinfer import TypeInferer


class InnerLibrary(JITCodeLibrary):
    """Code that is linked into other code and never run by itself."""

    def _optimize_functions(self, module: Any) -> None:
        """Leave it to the entry."""

    def finalize(self) -> None:
        """Link nothing and make no machine code."""
        self._raise_if_finalized()
        for library in self._linking_libraries:
            self._reload_init.update(library._reload_init)
        for function in self._final_module.functions:
            if not function.is_declaration:
                function.linkage = "linkonce_odr"
        self._finalize_dynamic_globals()
        self._finalized = True

    def _get_module_for_linking(self) -> Any:
        """Return this code with all that it calls, for an entry: what other inner code calls is not looked into."""
        if self._shared_module is None:
            self._ensure_finalized()
            self._shared_module = self._final_module.clone()
            for library in _called({self: None}):
                inner = isinstance(library, InnerLibrary)
                module = library._final_module if inner else library._get_module_for_linking()
                self._shared_module.link_in(module, preserve=True)
        return self._shared_module


def _called(found: dict[Any, None]) -> list[Any]:
    """Return the libraries that those found call, through inner ones; they are added to them."""
    for library in (whole := list(found)):
        if isinstance(library, InnerLibrary):
            new = dict.fromkeys(other for other in library._linking_libraries if other not in found)
            found |= new
            whole += new
    return whole[1:]


_made: dict[Any, Any] = {}


class Lowering(Lower):
    """Lowering that looks up once how a function is built for its arguments' types."""

    def _made_for(self, function: Any, args: Any) -> Any:
        """Return what builds a function."""
        key = (id(function), *map(id, args))
        if key not in _made:
            typing = self.context.typing_context
            kind = typing.resolve_value_type(function)
            found = kind.get_call_type(typing, args, {})
            _made[key] = self.context.get_function(kind, found), function, args
        return _made[key][0]

    def lower_binop(self, kind: Any, expression: Any, function: Any) -> Any:
        """Return the value of an operation on two values."""
        if expression.static_lhs is not UNDEFINED or expression.static_rhs is not UNDEFINED:
            return super().lower_binop(kind, expression, function)
        signature = self.fndesc.calltypes[expression]
        values = [
            self._cast_var(variable, wanted)
            for variable, wanted in zip((expression.lhs, expression.rhs), signature.args, strict=True)
        ]
        value = self._made_for(function, signature.args)(self.builder, values)
        return self.context.cast(self.builder, value, signature.return_type, kind)

    def lower_getitem(self, kind: Any, expression: Any, value: Any, index: Any, signature: Any) -> Any:
        """Return an element."""
        values = [self._cast_var(*pair) for pair in zip((value, index), signature.args, strict=True)]
        value = self._made_for(operator.getitem, signature.args)(self.builder, values)
        return self.context.cast(self.builder, value, signature.return_type, kind)


@register_pass(mutates_CFG=True, analysis_only=False)
class InnerLowering(NativeLowering):
    """The last pass, for a function that others will have within them."""

    _name = "inner_lowering"

    @property
    def lowering_class(self) -> Any:
        """What makes intermediate code of a function."""
        return Lowering

    def run_pass(self, state: Any) -> bool:
        """Lower one function."""
        state.library = InnerLibrary(state.targetctx.codegen(), state.func_id.func_qualname)
        state.library.enable_object_caching()
        state.flags.no_compile = True
        super().run_pass(state)
        lowered = state["cr"]
        # what numba makes of a function without wrapper: only its identity is used
        name, about = state.func_id.func_name, "called by other kernels only"
        inner = make_function(lowered.fndesc.lookup_module(), name, about, 0, lowered.env, (state.library,))
        state.targetctx.insert_user_function(inner, lowered.fndesc, [state.library])
        state["cr"] = lowered._replace(cfunc=inner)
        return True


_known: dict[Any, Any] = {}


class Inference(TypeInferer):
    """Type inference that asks once what a function makes of its arguments' types."""

    def resolve_call(self, function: Any, args: Any, keywords: Any) -> Any:
        """Return the signature of a call."""
        if keywords or isinstance(function, types.BoundFunction | types.RecursiveCall | types.FunctionType):
            return super().resolve_call(function, args, keywords)
        key = (self.kind, id(function), *map(id, args))
        if key not in _known:
            found = super().resolve_call(function, args, keywords)
            if found is None:
                return None
            _known[key] = found, function, args
        return _known[key][0]


@register_pass(mutates_CFG=True, analysis_only=False)
class InnerInference(NopythonTypeInference):
    _name = "inner_inference"

    def run_pass(self, state: Any) -> bool:
        """Infer the types."""
        warnings = errors.WarningsFixer(errors.NumbaWarning)
        infer = Inference(state.typingctx, state.func_ir, warnings)
        infer.kind = state.flags.forceinline
        callstack = state.typingctx.callstack
        with callstack.register(state.targetctx.target, infer, state.func_ir.func_id, state.args), warnings:
            for index, (name, kind) in enumerate(zip(state.func_ir.arg_names, state.args)):
                infer.seed_argument(name, index, kind)
            infer.build_constraint()
            infer.propagate()
            state.typemap, state.return_type, state.calltypes = infer.unify()
        return True


SPARED = {
    "WithLifting", "InlineClosureLikes", "RewriteDynamicRaises", "MakeFunctionToJitFunction", "InlineInlinables",
    "FindLiterallyCalls", "LiteralUnroll", "LiteralPropagationSubPipelinePass", "InlineOverloads", "NopythonRewrites",
    "NoPythonSupportedFeatureValidation", "AnnotateTypes", "DumpParforDiagnostics", "RewriteSemanticConstants",
}


class InnerPasses(PassManager):
    _ENFORCING = False


class InnerCompiler(CompilerBase):
    """The compiler with that last pass."""

    def define_pipelines(self) -> list[Any]:
        """Return the usual passes but one."""
        usual = DefaultPassBuilder.define_nopython_pipeline(self.state)
        other = {NativeLowering: InnerLowering, NopythonTypeInference: InnerInference}
        passes = InnerPasses(usual.pipeline_name)
        for step, why in usual.passes:
            if step.__name__ not in SPARED:
                passes.add_pass(other.get(step, step), why)
        passes.finalize()
        return [passes]


class Undisturbed(Listener):
    """Switches the garbage collector off while numba compiles; numba's lock admits one thread at a time."""

    def __init__(self) -> None:
        self.depth = 0
        self.collecting = False

    def on_start(self, event: Event) -> None:
        """Switch it off when the outermost function begins."""
        if self.depth == 0:
            self.collecting = gc.isenabled()
            gc.disable()
        self.depth += 1

    def on_end(self, event: Event) -> None:
        """Switch it on again, if it was, when that function is done or has failed."""
        self.depth -= 1
        if self.depth == 0 and self.collecting:
            gc.enable()


register("numba:compile", Undisturbed())
