"""Compiles the kernels into an object file; runs in a process of its own, with numba's settings.

numba gives each kernel in LLVM's language, not optimised. All of them together are optimised here
for the target, which need not be this machine. Whatever a kernel would call except mathematics and
memory copies belongs to numba's handling of errors: no kernel may fail, so those calls end the
process.
"""

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import llvmlite.binding as llvm
from numba import cfunc, types

from phy import kernels
from phy.engine import files
from phy.engine.entries import ENTRIES, Entry
from phy.engine.targets import Target
from phy.kernels.words import call_of

# LLVM's own, mathematics and memory copies: no name of numba's or Python's looks like these.
_OUTSIDE = re.compile(r"llvm\..*|[a-z][a-z0-9]*")
_COUNTING = re.compile(
    r"^(define [^\n]*@NRT_(?:in|de)cref\([^\n]*\{)$.*?^\}", re.MULTILINE | re.DOTALL
)
_TARGET = re.compile(r"^target (triple|datalayout) = .*$", re.MULTILINE)


class AllocationError(Exception):
    """A kernel makes an array that is not `local`: a library has no allocator."""


def write_object(target: Target, to: Path, progress: Callable[[int], None]) -> None:
    """Compile every kernel and write the object file; `progress` gets the number done."""
    llvm.initialize_all_targets()
    llvm.initialize_all_asmprinters()
    machine = llvm.Target.from_triple(target.triple).create_target_machine(
        cpu=target.cpu(), features=target.features(), opt=3, reloc="pic", codemodel="default"
    )
    library = llvm.parse_assembly("")
    for number, (name, entry) in enumerate(ENTRIES.items()):
        text, symbol = _compile(name, entry)
        module = llvm.parse_assembly(_retarget(text, target.triple, str(machine.target_data)))
        module.get_function(symbol).name = files.SYMBOL + name
        library.link_in(module)
        progress(number + 1)
    library.link_in(llvm.parse_assembly(_endings(library)))
    names = {files.SYMBOL + name for name in ENTRIES}
    for each in (*library.functions, *library.global_variables):
        if not each.is_declaration and each.name not in names:
            each.linkage = "internal"
    library.verify()
    options = llvm.create_pipeline_tuning_options(speed_level=3)
    options.loop_vectorization = options.slp_vectorization = True
    options.loop_interleaving = options.loop_unrolling = True
    passes = llvm.create_pass_builder(machine, options)
    passes.getModulePassManager().run(library, passes)
    to.write_bytes(machine.emit_object(library))


def _compile(name: str, entry: Entry) -> tuple[str, str]:
    """(a kernel in LLVM's language, the name of its function there)."""
    words: Any = types.CPointer(types.int64)  # type: ignore[no-untyped-call]
    compiled = cfunc(types.void(words, words))(call_of(getattr(kernels, name), entry))
    return compiled.inspect_llvm(), compiled.native_name


def _retarget(text: str, triple: str, layout: str) -> str:
    told = {"triple": triple, "datalayout": layout}
    text = _TARGET.sub(lambda line: f'target {line[1]} = "{told[line[1]]}"', text)
    # No array of a library has an owner in numba, so there is nothing to count.
    return _COUNTING.sub(r"\1\n  ret void\n}", text)


def _endings(library: Any) -> str:
    """A module that defines what no kernel may need: functions that end the process."""
    lines = ["declare void @llvm.trap()"]
    for each in library.functions:
        if each.is_declaration and not _OUTSIDE.fullmatch(each.name):
            if "alloc" in each.name.lower():
                raise AllocationError(f"a kernel calls {each.name}: see phy.kernels.local")
            lines.append(f'define void @"{each.name}"() {{ call void @llvm.trap() unreachable }}')
    lines += [
        f'@"{each.name}" = global ptr null'
        for each in library.global_variables
        if each.is_declaration
    ]
    return "\n".join(lines)
