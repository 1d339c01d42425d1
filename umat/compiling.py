"""How kernels that only other kernels call are compiled: to the compiler's intermediate code and no further.

By itself numba optimises every function, links into it all that it calls and makes machine code of it, although only
the entry runs, which has all of them within it. `InnerLibrary` leaves that to the entry. numba's passes also prepare
for what no kernel has (`SPARED`), examine a function anew after each, and look up every operation by itself
(`lookups`): `InnerCompiler` does without. It steps in as numba's guide to customised compilers shows, and into methods
of the library of code.

A kernel that had a closure, a comprehension, a `with` or an expression of whole arrays would not compile.

While anything is compiled Python's garbage collector rests: what the compiler makes stays alive until it has done, and
looking through it again and again was a seventh of the time. The first run of a material takes some 150 MB more for it.
"""

import gc
from typing import Any

from numba._dynfunc import make_function
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import CompilerBase, DefaultPassBuilder
from numba.core.compiler_machinery import PassManager, register_pass
from numba.core.event import Event, Listener, register
from numba.core.typed_passes import NativeLowering, NopythonTypeInference

from .lookups import InnerInference, InnerLower

#: passes by their names, which not every version of numba has
SPARED = {
    "AnnotateTypes", "DumpParforDiagnostics", "FindLiterallyCalls", "InlineClosureLikes", "InlineInlinables",
    "InlineOverloads", "LiteralPropagationSubPipelinePass", "LiteralUnroll", "MakeFunctionToJitFunction",
    "NoPythonSupportedFeatureValidation", "NopythonRewrites", "RewriteDynamicRaises", "WithLifting",
}  # fmt: skip


class InnerLibrary(JITCodeLibrary):
    """Code that is linked into other code and never run by itself."""

    _shared_module: Any

    def _optimize_functions(self, ll_module: Any) -> None:
        """Leave it to the entry."""

    def finalize(self) -> None:
        """Link nothing and make no machine code."""
        self._raise_if_finalized()
        for library in self._linking_libraries:
            getattr(self, "_reload_init", set()).update(getattr(library, "_reload_init", ()))  # not before numba 0.62
        for function in self._final_module.functions:
            if not function.is_declaration:
                function.linkage = "linkonce_odr"
        self._finalize_dynamic_globals()
        self._finalized = True

    def _get_module_for_linking(self) -> Any:
        """Return this code and all that it calls; only code that numba itself compiles asks for it."""
        if self._shared_module is None:
            self._ensure_finalized()
            self._shared_module = self._final_module.clone()
            for library in _called(self):
                module = library._final_module if _inner(library) else library._get_module_for_linking()
                self._shared_module.link_in(module, preserve=True)
        return self._shared_module


def _inner(library: Any) -> bool:
    return isinstance(library, InnerLibrary)


def _called(library: Any) -> list[Any]:
    """Return the libraries that one calls, and through inner ones; one of numba's has all that it calls within it."""
    found = [library]
    for caller in found:
        if _inner(caller):
            found += [other for other in dict.fromkeys(caller._linking_libraries) if other not in found]
    return found[1:]


@register_pass(mutates_CFG=True, analysis_only=False)
class InnerLowering(NativeLowering):
    """The last pass, for a function that others will have within them."""

    _name = "inner_lowering"

    @property
    def lowering_class(self) -> type[InnerLower]:
        """What makes intermediate code of a function."""
        return InnerLower

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


class InnerPasses(PassManager):
    """Passes after which nothing is examined: those that need it see to it themselves."""

    _ENFORCING = False


class InnerCompiler(CompilerBase):
    """The compiler with fewer passes, and two of its own."""

    def define_pipelines(self) -> list[Any]:
        """Return the passes."""
        usual = DefaultPassBuilder.define_nopython_pipeline(self.state)
        own = {NativeLowering: InnerLowering, NopythonTypeInference: InnerInference}
        passes = InnerPasses(usual.pipeline_name)
        for step, why in usual.passes:
            if step.__name__ not in SPARED:
                passes.add_pass(own.get(step, step), why)
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
