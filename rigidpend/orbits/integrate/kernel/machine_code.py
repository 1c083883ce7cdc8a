"""Machine code of the kernels: compiled by LLVM for this processor, kept on disk, loaded.

A file of the cache holds the object code of one kernel, with what it is of: the kernel's text,
the processor and LLVM's version. One that does not fit is told and compiled anew, never run: a
flipped bit in machine code would end the process, or be wrong without a word.
"""

from __future__ import annotations

import ctypes
import functools
import threading
from pathlib import Path
from typing import Any

from rigidpend.machine import cache

MOST = 50_000_000
"""Bytes of all kept kernels, of 0.1 to 0.6 MB each, most of it the text."""
LEVEL = 3
"""Effort of LLVM's optimisation; with 2 the steps take as long."""


_loaded: list[Any] = []
"""Code in memory, which has to live as long as the functions that call it."""
_locks: dict[str, threading.Lock] = {}
"""A lock for each text: threads ask for the same code, and one makes it while the others wait."""


class ArrayPointer(ctypes.c_void_p):
    """Kind of an argument that is an array: the address of its first number."""

    @classmethod
    def from_param(cls, array: Any) -> Any:
        return ctypes.c_void_p(array.ctypes.data)


def function(text: str, name: str, *arguments: Any) -> Any:
    """The function of a text in LLVM's language that returns an int64, ready to be called.

    While it runs, and while it is compiled, other threads have the interpreter.

    Parameters
    ----------
    text : str
    name : str
    arguments : ctypes types, or `ArrayPointer`
    """
    with _locks.setdefault(text, threading.Lock()):
        return ready(text, name, *arguments)


@functools.cache
def ready(text: str, name: str, *arguments: Any) -> Any:
    """The function, read or compiled: for one thread at a time."""
    import llvmlite.binding as llvm

    machine = _machine(llvm)
    of = repr((text, machine.triple, *processor(llvm), llvm.llvm_version_info)).encode()
    code = cache.load(folder(), of)
    if code is None:
        code = compiled(llvm, machine, text)
        cache.save(folder(), of, code, MOST)
    loaded = llvm.create_mcjit_compiler(llvm.parse_assembly(""), machine)
    loaded.add_object_file(llvm.ObjectFileRef.from_data(code))
    loaded.finalize_object()
    _loaded.append(loaded)
    return ctypes.CFUNCTYPE(ctypes.c_int64, *arguments)(loaded.get_function_address(name))


def folder() -> Path:
    """The folder where the machine code is kept."""
    return cache.folder() / "kernels"


def processor(llvm: Any) -> tuple[str, str]:
    """The processor's name and abilities."""
    return llvm.get_host_cpu_name(), llvm.get_host_cpu_features().flatten()


def _machine(llvm: Any) -> Any:
    llvm.initialize_native_target()
    llvm.initialize_native_asmprinter()
    cpu, features = processor(llvm)
    target = llvm.Target.from_default_triple()
    return target.create_target_machine(cpu=cpu, features=features, opt=LEVEL, jit=True)


def compiled(llvm: Any, machine: Any, text: str) -> bytes:
    """Object code of a text."""
    module = llvm.parse_assembly(text)
    module.verify()
    options = llvm.create_pipeline_tuning_options(speed_level=LEVEL)
    builder = llvm.create_pass_builder(machine, options)
    builder.getModulePassManager().run(module, builder)
    return bytes(machine.emit_object(module))
