"""Machine code of the kernels: written in LLVM's language, compiled for this processor, and cached.

A file of the cache holds the object code of one kernel, together with the kernel's text, the
processor and LLVM's version. A file that does not match, or is damaged, brings a warning and is
never run; the kernel is compiled anew. A flipped bit in machine code could end the process, or give
wrong numbers silently.
"""

import ctypes
import functools
import re
import struct
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from rigidpend.machine import cache

LANES = 8
"""Doubles in a vector, which takes one register of AVX-512, two of AVX2, four of NEON."""
FEW_LANES = 4
"""Doubles in a vector for at most as many orbits: with 8 these take up to twice as long."""


def lanes_for(orbits: int) -> int:
    """The number of doubles in a vector for so many orbits."""
    return FEW_LANES if orbits <= FEW_LANES else LANES


class Writer:
    """Writer of lines in LLVM's language, each of whose values has a register of its own.

    A value that changes in a loop is a variable in memory, which LLVM itself moves to a register:
    so no phi nodes are written.
    """

    def __init__(self, lanes: int = LANES) -> None:
        self.vector = f"<{lanes} x double>"
        self.mask, self.whole = f"<{lanes} x i1>", f"<{lanes} x i64>"
        self.suffix, self.lanes, self.bytes = f"v{lanes}f64", lanes, 8 * lanes
        self.variables: list[str] = []
        self.functions: dict[str, list[str]] = {}
        """Texts of the functions that the lines call, by name."""
        self.lines: list[str] = []
        self.made = 0

    def __call__(self, line: str) -> str:
        """Write a line that makes a value, and return the value's register."""
        self.made += 1
        self.lines.append(f"  %r{self.made} = {line}")
        return f"%r{self.made}"

    def do(self, line: str) -> None:
        self.lines.append(f"  {line}")

    def variable(self, kind: str) -> str:
        # Written apart, to stand at the function's beginning: an alloca within a loop would take
        # new memory on each pass.
        self.made += 1
        self.variables.append(f"  %v{self.made} = alloca {kind}, align 64")
        return f"%v{self.made}"

    def at(self, base: str, index: str | int, kind: str = "") -> str:
        """Address of an element of an array, of vectors by default."""
        return self(f"getelementptr {kind or self.vector}, ptr {base}, i64 {index}")

    def load(self, place: str, kind: str = "", align: int = 0) -> str:
        return self(f"load {kind or self.vector}, ptr {place}, align {align or self.bytes}")

    def store(self, value: str, place: str, kind: str = "", align: int = 0) -> None:
        aligned = align or self.bytes
        self.do(f"store {kind or self.vector} {value}, ptr {place}, align {aligned}")

    def element(self, base: str, index: str | int) -> str:
        return self.load(self.at(base, index))

    def scalar(self, base: str, index: str | int, kind: str = "double") -> str:
        """A single number of an array."""
        return self.load(self.at(base, index, kind), kind, 8)

    def keep(self, value: str, base: str, index: str | int, kind: str = "double") -> None:
        """Put a single number into an array."""
        self.store(value, self.at(base, index, kind), kind, 8)

    def add(self, a: str, b: str | int) -> str:
        """The sum of two whole numbers."""
        return self(f"add i64 {a}, {b}")

    def mul(self, a: str, b: str | int) -> str:
        """The product of two whole numbers."""
        return self(f"mul i64 {a}, {b}")

    def binary(self, operation: str, a: str, b: str) -> str:
        return self(f"{operation} {self.vector} {a}, {b}")

    def fma(self, a: str, b: str, c: str) -> str:
        """a b + c, rounded once."""
        v = self.vector
        return self(f"call {v} @llvm.fma.{self.suffix}({v} {a}, {v} {b}, {v} {c})")

    def size(self, a: str) -> str:
        return self(f"call {self.vector} @llvm.fabs.{self.suffix}({self.vector} {a})")

    def compare(self, relation: str, a: str, b: str) -> str:
        return self(f"fcmp {relation} {self.vector} {a}, {b}")

    # Both of these give b where a comparison with NaN fails.
    def larger(self, a: str, b: str) -> str:
        return self.chosen(self.compare("ogt", a, b), a, b)

    def smaller(self, a: str, b: str) -> str:
        return self.chosen(self.compare("olt", a, b), a, b)

    def chosen(self, mask: str, a: str, b: str) -> str:
        return self(f"select {self.mask} {mask}, {self.vector} {a}, {self.vector} {b}")

    def logic(self, operation: str, a: str, b: str) -> str:
        return self(f"{operation} {self.mask} {a}, {b}")

    def bits(self, x: str) -> str:
        """The bits of doubles, as whole numbers."""
        return self(f"bitcast {self.vector} {x} to {self.whole}")

    def of_bits(self, bits: str) -> str:
        """The doubles of which these are the bits."""
        return self(f"bitcast {self.whole} {bits} to {self.vector}")

    def with_each(self, operation: str, a: str, value: str | int) -> str:
        """An operation on vectors of integers, whose second operand is the same in each lane."""
        return self(f"{operation} {self.whole} {a}, {self.everywhere(str(value), 'i64')}")

    def number(self, value: float) -> str:
        """The same number in each lane."""
        return self.everywhere(hexadecimal(value))

    def everywhere(self, value: str, kind: str = "double") -> str:
        """A vector with a scalar in each lane."""
        # The idiom that LLVM knows as a broadcast: shuffle lane 0 into all.
        several = f"<{self.lanes} x {kind}>"
        first = self(f"insertelement {several} poison, {kind} {value}, i32 0")
        return self(
            f"shufflevector {several} {first}, {several} poison, "
            f"<{self.lanes} x i32> zeroinitializer"
        )

    @contextmanager
    def loop(self, end: str | int, start: str | int = 0) -> Iterator[str]:
        """Lines that run for each integer from `start` to below `end`; yields the integer."""
        counter, name = self.variable("i64"), f"loop{self.made}"
        self.store(str(start), counter, "i64", 8)
        self._jump(f"{name}.head")
        self._label(f"{name}.head")
        index = self.load(counter, "i64", 8)
        goes_on = self(f"icmp slt i64 {index}, {end}")
        self.do(f"br i1 {goes_on}, label %{name}.body, label %{name}.end")
        self._label(f"{name}.body")
        yield index
        self.store(self(f"add i64 {index}, 1"), counter, "i64", 8)
        self._jump(f"{name}.head")
        self._label(f"{name}.end")

    @contextmanager
    def repeated(self) -> Iterator[list[str]]:
        """Lines that run once, and again as long as a condition holds.

        The lines put the condition's register into the list that this yields.
        """
        self.made += 1
        name = f"again{self.made}"
        self._jump(f"{name}.head")
        self._label(f"{name}.head")
        condition: list[str] = []
        yield condition
        self.do(f"br i1 {condition[0]}, label %{name}.head, label %{name}.end")
        self._label(f"{name}.end")

    @contextmanager
    def when(self, condition: str) -> Iterator[None]:
        """Lines that run if a condition holds."""
        self.made += 1
        name = f"when{self.made}"
        self.do(f"br i1 {condition}, label %{name}.yes, label %{name}.end")
        self._label(f"{name}.yes")
        yield
        self._jump(f"{name}.end")
        self._label(f"{name}.end")

    def function(self, head: str, result: str) -> str:
        """The whole text of a function with the given first line, these lines and an i64 result."""
        v = self.vector
        declared = (
            f"declare {v} @llvm.fma.{self.suffix}({v}, {v}, {v})",
            *(f"declare {v} @llvm.{x}.{self.suffix}({v})" for x in ("fabs", "floor")),
        )
        called = [line for lines in self.functions.values() for line in lines]
        body = [*declared, *called, head, "entry:", *self.variables, *self.lines]
        return "\n".join([*body, f"  ret i64 {result}", "}"]) + "\n"

    def _jump(self, label: str) -> None:
        self.do(f"br label %{label}")

    def _label(self, name: str) -> None:
        self.lines.append(f"{name}:")


def hexadecimal(value: float) -> str:
    """A double in hexadecimal, which LLVM reads exactly."""
    return "0x" + struct.pack(">d", value).hex().upper()


MOST_BYTES = 50_000_000
"""Bytes of all cached kernels at most; one has 0.1 to 0.6 MB, most of it the text."""
OPTIMISATION = 3
"""LLVM's level of optimisation; at 2 the steps take as long."""


_loaded: list[Any] = []
"""Compiled code in memory, which has to live as long as the functions that call it."""
_locks: dict[str, threading.Lock] = {}
"""A lock for each text: of several threads that need it one compiles, and the others wait."""


class Pointer(ctypes.c_void_p):
    """Type of an argument that is an array, or the address of a number in one."""

    @classmethod
    def from_param(cls, array: Any) -> Any:
        return ctypes.c_void_p(array if isinstance(array, int) else array.ctypes.data)


HEAD = re.compile(r"^define i64 @(\w+)\((.*)\) \{$", re.MULTILINE)
"""First line of the function of a text: its name, and its arguments, each behind its type."""
ARGUMENT_TYPES = {"ptr": Pointer, "i64": ctypes.c_int64, "double": ctypes.c_double}
"""Types of the arguments by LLVM's names, for a call from Python."""


def function(text: str) -> Any:
    """The function of a text in LLVM's language that returns an int64, ready to be called.

    Other threads can use the interpreter while it runs, and while it is compiled.
    """
    # `functools.cache` alone would let several threads compile the same text. `setdefault` is
    # atomic, so all of them have one lock.
    with _locks.setdefault(text, threading.Lock()):
        return ready(text)


@functools.cache
def ready(text: str) -> Any:
    """The function, from the cache of files or compiled; called by one thread at a time."""
    # Imported here, for most commands compile nothing.
    import llvmlite.binding as llvm

    machine = _machine(llvm)
    of = repr((text, machine.triple, *processor(llvm), llvm.llvm_version_info)).encode()
    code = cache.load(folder(), of)
    if code is None:
        code = compiled(llvm, machine, text)
        cache.save(folder(), of, code, MOST_BYTES)
    # An engine with an empty module, to which the object code is added: LLVM compiles nothing here.
    loaded = llvm.create_mcjit_compiler(llvm.parse_assembly(""), machine)
    loaded.add_object_file(llvm.ObjectFileRef.from_data(code))
    loaded.finalize_object()
    _loaded.append(loaded)
    [(name, arguments)] = HEAD.findall(text)
    kinds = (ARGUMENT_TYPES[argument.split()[0]] for argument in arguments.split(", "))
    return ctypes.CFUNCTYPE(ctypes.c_int64, *kinds)(loaded.get_function_address(name))


def folder() -> Path:
    """The folder of the cached machine code."""
    return cache.folder() / "kernels"


def processor(llvm: Any) -> tuple[str, str]:
    """Name of this machine's processor, and its features: both decide the code."""
    return llvm.get_host_cpu_name(), llvm.get_host_cpu_features().flatten()


def _machine(llvm: Any) -> Any:
    llvm.initialize_native_target()
    llvm.initialize_native_asmprinter()
    cpu, features = processor(llvm)
    target = llvm.Target.from_default_triple()
    return target.create_target_machine(cpu=cpu, features=features, opt=OPTIMISATION, jit=True)


def compiled(llvm: Any, machine: Any, text: str) -> bytes:
    """Object code of a text in LLVM's language."""
    module = llvm.parse_assembly(text)
    module.verify()
    options = llvm.create_pipeline_tuning_options(speed_level=OPTIMISATION)
    # SROA moves variables to registers, GVN computes once what is computed twice. The texts leave
    # LLVM nothing else to find: with all its passes this takes thrice as long, for code as fast.
    passes = llvm.create_new_module_pass_manager()
    passes.add_sroa_pass()
    passes.add_new_gvn_pass()
    passes.run(module, llvm.create_pass_builder(machine, options))
    return bytes(machine.emit_object(module))
