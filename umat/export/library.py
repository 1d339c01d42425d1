"""From a compiled function to a shared library: machine code without numba's run-time, the entry point, the linker.

The entry point is written in LLVM's intermediate code. It hands the block of memory of the calling thread to the
function, and says what became of the point: PNEWDT is halved where the point was refused. Where the caller passes no
PNEWDT, and where the routine was called wrongly, STRESS(1) becomes NaN so that the caller cannot take the old stress
for an answer; the reason for the latter is printed once.
"""

import os
import shutil
import subprocess
import tempfile
from pathlib import Path
from typing import Any

import llvmlite.binding as binding
from llvmlite import ir
from numba import types
from numba.core import compiler
from numba.core.registry import cpu_target

from umat.abaqus import ARGUMENTS
from umat.export.layout import Layout
from umat.export.point import MESSAGES, EntryPoint
from umat.export.record import ALIGNMENT, block
from umat.lanes import COMPILED

SYMBOL = "umat_"
PASSED = ("STRESS", "STATEV", "DDSDDE", "DSTRAN", "NTENS", "NSTATV", "PROPS", "NPROPS")
INTEGERS = ("NTENS", "NSTATV", "NPROPS")
REDUCTION = 0.5
"""Factor on PNEWDT of a refused point."""
RELEASE = "NRT_MemInfo_call_dtor"
LEVELS = ("x86-64-v2", "x86-64-v3", "x86-64-v4")
"""Levels of x86-64 processors: up to SSE 4.2, up to AVX2, up to AVX-512."""
LINKERS = ("cc", "gcc", "clang")
BYTE, WORD, LONG, REAL = ir.IntType(8), ir.IntType(32), ir.IntType(64), ir.DoubleType()


def check_tools(cpu: str) -> None:
    """Raise ValueError where no library can be made."""
    _machine(cpu)
    if not COMPILED:
        raise ValueError("numba's compiler is switched off (NUMBA_DISABLE_JIT); a library needs it")
    _linker()


def write(entry: EntryPoint, layout: Layout, library: Path, cpu: str) -> None:
    """Write the shared library of an entry point; ValueError if the linker fails."""
    machine = _machine(cpu)
    compiled = _compiled(entry)
    module = binding.parse_assembly(compiled.library.get_llvm_str())
    module.link_in(binding.parse_assembly(_entry_code(compiled, entry, layout, module)))
    for part in (*module.functions, *module.global_variables):
        if part.name != SYMBOL and not part.is_declaration:
            part.linkage = "internal"
    _link(machine.emit_object(module), library)


def _compiled(entry: EntryPoint) -> Any:
    """Return numba's result for the function, compiled without reference counts and without Python."""
    flags = compiler.Flags()
    flags.nrt, flags.no_cpython_wrapper, flags.no_cfunc_wrapper, flags.error_model = False, True, True, "numpy"
    kinds = [types.CPointer(types.int32 if name in INTEGERS else types.float64) for name in PASSED]
    signature = (types.CPointer(types.uint8), *kinds)
    return compiler.compile_extra(
        cpu_target.typing_context, cpu_target.target_context, entry.function, signature, types.int64, flags, {}
    )


def _machine(cpu: str) -> Any:
    binding.initialize_all_targets()
    binding.initialize_all_asmprinters()
    target, host = binding.Target.from_default_triple(), cpu == "host"
    known = ("host", "generic", *(LEVELS if target.triple.startswith("x86_64") else ()))
    if cpu not in known:  # LLVM would end the process
        raise ValueError(f"there is no processor '{cpu}' to write code for; there are {', '.join(known)}")
    name = binding.get_host_cpu_name() if host else cpu
    features = binding.get_host_cpu_features().flatten() if host else ""
    return target.create_target_machine(cpu=name, features=features, opt=3, reloc="pic", codemodel="default")


def _entry_code(compiled: Any, entry: EntryPoint, layout: Layout, beside: Any) -> str:
    """Return the intermediate code of the routine `umat_`."""
    module = ir.Module()
    module.triple, module.data_layout = beside.triple, beside.data_layout
    memory, told = _memory(module, block(entry.memory)), _constant(module, "told", ir.Constant(BYTE, 0), writable=True)
    pointer = BYTE.as_pointer()
    routine = ir.Function(module, ir.FunctionType(ir.VoidType(), [pointer] * len(ARGUMENTS)), SYMBOL)
    places = dict(zip(ARGUMENTS, routine.args, strict=True))
    builder = ir.IRBuilder(routine.append_basic_block())
    code = _call(builder, module, compiled, [memory, *(places[name] for name in PASSED)])
    with builder.if_then(builder.icmp_signed("!=", code, LONG(0)), likely=False):
        silent = builder.icmp_unsigned("==", places["PNEWDT"], pointer(None))
        with builder.if_else(silent) as (without, with_step):
            with without:
                _store_nan(builder, places["STRESS"])
            with with_step:
                step = builder.bitcast(places["PNEWDT"], REAL.as_pointer())
                builder.store(builder.fmul(builder.load(step), REAL(REDUCTION)), step)
        with builder.if_then(builder.icmp_signed("<", code, LONG(0))):
            _store_nan(builder, places["STRESS"])
            _complain(builder, module, code, told, layout)
    builder.ret_void()
    _without_counts(module, beside)
    return str(module)


def _call(builder: Any, module: Any, compiled: Any, arguments: list[Any]) -> Any:
    """Return the result of numba's function: by its convention the first two arguments are result and exception."""
    context, name = compiled.target_context, compiled.fndesc.llvm_func_name
    kind = context.call_conv.get_function_type(types.int64, compiled.signature.args)
    function = ir.Function(module, kind, name)
    result = builder.alloca(kind.args[0].pointee if hasattr(kind.args[0], "pointee") else LONG)
    trouble = builder.alloca(BYTE.as_pointer())
    places = [result, trouble, *arguments]
    builder.call(function, [builder.bitcast(place, to) for place, to in zip(places, kind.args, strict=True)])
    return builder.load(result)


def _without_counts(module: Any, beside: Any) -> None:
    """Define what numba calls when the last reference to an array goes: arrays in the block have no references."""
    foreign = {part.name for part in beside.functions if part.is_declaration and part.name.startswith("NRT_")}
    if foreign - {RELEASE}:
        raise ValueError(f"the kernels allocate memory, which a library cannot: {', '.join(sorted(foreign))}")
    if foreign:
        release = ir.Function(module, ir.FunctionType(ir.VoidType(), [BYTE.as_pointer()]), RELEASE)
        ir.IRBuilder(release.append_basic_block()).ret_void()


def _memory(module: Any, contents: bytearray) -> Any:
    """Return the address of the calling thread's block, which begins as `contents`."""
    memory = _constant(module, "memory", ir.Constant(ir.ArrayType(BYTE, len(contents)), contents), writable=True)
    memory.storage_class, memory.align = "thread_local", ALIGNMENT
    return memory


def _constant(module: Any, name: str, value: Any, writable: bool = False) -> Any:
    variable = ir.GlobalVariable(module, value.type, f"umat_export_{name}")
    variable.initializer, variable.global_constant, variable.linkage = value, not writable, "internal"
    return variable


def _store_nan(builder: Any, place: Any) -> None:
    builder.store(REAL(float("nan")), builder.bitcast(place, REAL.as_pointer()))


def _complain(builder: Any, module: Any, code: Any, told: Any, layout: Layout) -> None:
    """Print the sentence of a code, the first time that one is to be printed."""
    say = ir.Function(module, ir.FunctionType(WORD, [BYTE.as_pointer()]), "puts")
    with builder.if_then(builder.icmp_signed("==", builder.load(told), BYTE(0))):
        builder.store(BYTE(1), told)
        for known, sentence in MESSAGES.items():
            text = bytearray(f"umat (Chang-Hicher): {sentence.format(count=layout.state_variables)}.\0".encode())
            words = _constant(module, f"message{-known}", ir.Constant(ir.ArrayType(BYTE, len(text)), text))
            with builder.if_then(builder.icmp_signed("==", code, LONG(known))):
                builder.call(say, [builder.bitcast(words, BYTE.as_pointer())])


def _linker() -> str:
    for name in (os.environ.get("CC", ""), *LINKERS):
        if name and (found := shutil.which(name)):
            return found
    raise ValueError("no linker was found (cc, gcc, clang or what CC names): install a C compiler to export a library")


def _link(code: bytes, library: Path) -> None:
    with tempfile.TemporaryDirectory() as folder:
        part = Path(folder) / "umat.o"
        part.write_bytes(code)
        made = subprocess.run(
            [_linker(), "-shared", "-o", str(library), str(part), "-lm"], capture_output=True, text=True, check=False
        )
    if made.returncode:
        raise ValueError(f"the linker could not write '{library}': {made.stderr.strip()}")
