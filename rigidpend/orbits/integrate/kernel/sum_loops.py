"""Arithmetic of arrays of sums of doubles, in machine code.

NumPy has no such numbers: its `long double` has 64, 113 or 53 bits, depending on the machine. Sums
are the same everywhere. An array lies in memory as all of the largest parts, followed by all of the
smaller ones. Each loop goes over it in vectors of lanes. The last vector ends with the array and
may overlap the one before, so that the length need not be a multiple of the number of lanes.
"""

import ctypes
import functools
import importlib
from collections.abc import Callable
from typing import Any

import numpy as np

from rigidpend.orbits.integrate.kernel import machine_code
from rigidpend.orbits.integrate.kernel.lane_functions import Functions
from rigidpend.orbits.integrate.kernel.lane_numbers import KINDS, Doubles, Value
from rigidpend.orbits.integrate.kernel.machine_code import LANES, Writer

WIDE_LANES = 2 * LANES
"""Lanes of sums of products: two vectors fill the time in which a sum waits for its last term."""
OPERATIONS: dict[str, Callable[[Doubles, Value, Value], Value]] = {
    "add": lambda n, a, b: n.plus(a, b),
    "subtract": lambda n, a, b: n.minus(a, b),
    "multiply": lambda n, a, b: n.times(a, b),
    "divide": lambda n, a, b: n.quotient(a, b),
    "cos": lambda n, a, _: Functions(n).cos_sin(a)[0],
    "sin": lambda n, a, _: Functions(n).cos_sin(a)[1],
    "log": lambda n, a, _: Functions(n).logarithm_of_size(a),
}
"""Operations on the elements of two arrays by NumPy's names; the last three ignore the second."""


@functools.cache
def elementwise(name: str, bits: int) -> Any:
    """One of the `OPERATIONS` on sums of doubles, as a NumPy ufunc of all their parts.

    It takes the parts of both arguments and gives those of the result. NumPy handles shapes and
    strides, and releases the interpreter where an array is long enough.
    """
    code = Writer()
    n = KINDS[bits](code)
    parts = n.parts
    # A ufunc's inner loop is called with (args, dims, steps, data): addresses of the operands,
    # number of elements, and bytes from one element to the next. Arrays shorter than a vector take
    # one group of lanes, of which `within` have an element.
    count = code.load("%dims", "i64", 8)
    many = code(f"icmp sge i64 {count}, {LANES}")
    within = code(f"select i1 {many}, i64 {LANES}, i64 {count}")
    operands = [_Operand(code, k, many, within) for k in range(3 * parts)]
    with code.loop(code(f"udiv i64 {code.add(count, LANES - 1)}, {LANES}")) as group:
        first = code(f"select i1 {many}, i64 {_first(code, group, count)}, i64 0")
        given = tuple(x.loaded(first) for x in operands[: 2 * parts])
        value = OPERATIONS[name](n, given[:parts], given[parts:])
        for part, operand in zip(value, operands[2 * parts :], strict=True):
            operand.keep(part, first)
    text = code.function("define i64 @apply(ptr %args, ptr %dims, ptr %steps, ptr %data) {", "0")
    return _ufunc(name, machine_code.function(text), parts)


class _Operand:
    """An argument or a result in the loop of a ufunc, with `step` bytes between its numbers.

    Numbers that lie side by side (`dense`), or are one number for all (`alone`), are read as a
    vector. All others are copied one by one, for LLVM takes long to compile instructions that
    gather a vector. `within` is the number of lanes that have a number.
    """

    def __init__(self, code: Writer, k: int, many: str, within: str) -> None:
        self.code, self.within = code, within
        self.base, self.step = code.scalar("%args", k, "ptr"), code.scalar("%steps", k, "i64")
        dense, alone = (code(f"icmp eq i64 {self.step}, {size}") for size in (8, 0))
        self.dense, self.alone = code(f"and i1 {many}, {dense}"), code(f"and i1 {many}, {alone}")
        either = code(f"or i1 {self.dense}, {self.alone}")
        self.other, self.room = code(f"xor i1 {either}, true"), code.variable(code.vector)
        # Kept apart from `room`, which LLVM can hold in a register only if no code addresses its
        # single lanes.
        self.lanes = code.variable(code.vector)

    def loaded(self, first: str) -> str:
        """A vector of elements from index `first` on, with 1 in lanes that have no element."""
        # 1 is harmless in every operation: no division by zero, no logarithm of zero.
        code = self.code
        with code.when(self.dense):
            code.store(code.load(code.at(self.base, first, "double"), align=8), self.room)
        with code.when(self.alone):
            code.store(code.everywhere(code.load(self.base, "double", 8)), self.room)
        with code.when(self.other):
            code.store(code.number(1.0), self.lanes)
            with code.loop(self.within) as lane:
                code.keep(code.load(self._place(first, lane), "double", 8), self.lanes, lane)
            code.store(code.load(self.lanes), self.room)
        return code.load(self.room)

    def keep(self, value: str, first: str) -> None:
        """Write a vector's lanes to the elements from `first` on; lanes without one are dropped."""
        code = self.code
        with code.when(self.dense):
            code.store(value, code.at(self.base, first, "double"), align=8)
        with code.when(code(f"xor i1 {self.dense}, true")):
            code.store(value, self.lanes)
            with code.loop(self.within) as lane:
                code.store(code.scalar(self.lanes, lane), self._place(first, lane), "double", 8)

    def _place(self, first: str, lane: str) -> str:
        """Address of a lane's element, by its distance in bytes."""
        far = self.code.mul(self.code.add(first, lane), self.step)
        return self.code.at(self.base, far, "i8")


_made: list[Any] = []
"""Data to which ufuncs keep pointers, and which therefore must not be freed."""


def _ufunc(name: str, loop: Any, parts: int) -> Any:
    """A ufunc of two numbers with one result, all in parts, whose innermost loop is machine code.

    It is made by PyUFunc_FromFuncAndData, as an extension in C would make it.
    """
    # NumPy's C functions stand in a table, whose address is in a capsule; entry 1 is that function.
    take = ctypes.pythonapi.PyCapsule_GetPointer
    take.restype, take.argtypes = ctypes.c_void_p, (ctypes.py_object, ctypes.c_char_p)
    umath = importlib.import_module("numpy._core._multiarray_umath")
    functions = ctypes.cast(take(umath._UFUNC_API, None), ctypes.POINTER(ctypes.c_void_p))
    text, number = ctypes.c_char_p, ctypes.c_int
    kinds = (ctypes.c_void_p, ctypes.c_void_p, text, *(number,) * 4, text, text, number)
    create = ctypes.PYFUNCTYPE(ctypes.py_object, *kinds)(functions[1])
    loops = (ctypes.c_void_p * 1)(ctypes.cast(loop, ctypes.c_void_p).value)
    kinds_of = bytes([np.dtype(float).num] * 3 * parts)
    rest = (ctypes.c_void_p * 1)(), kinds_of, name.encode()
    _made.append((loop, loops, *rest))
    no_identity = -1
    return create(loops, *rest[:2], 1, 2 * parts, parts, no_identity, rest[2], b"", 0)


@functools.cache
def products(bits: int) -> Any:
    """The function ``f(out, a, b, rows, terms, width, sets, a_own, b_own)``: matrix products.

    For each of the `sets` out[i, c] is the sum of a[i, k] b[k, c] over all terms k. `a_own` and
    `b_own` are 1 if each set has its own matrix, 0 if all share one. `width`, the number of columns
    of b, is at least `LANES`.
    """
    code = Writer()
    n = KINDS[bits](code)
    total = code.variable(n.rows(n.parts))
    a_one, b_one = code.mul("%rows", "%terms"), code.mul("%terms", "%width")
    # The numbers of elements of a and of b: so far behind the larger parts lie the smaller ones.
    a_all, b_all = (
        code.mul(one, code(f"select i1 {own}, i64 %sets, i64 1"))
        for one, own in (
            (a_one, code("icmp ne i64 %a_own, 0")),
            (b_one, code("icmp ne i64 %b_own, 0")),
        )
    )
    all_ = code.mul(code.mul("%rows", "%width"), "%sets")
    groups = code(f"udiv i64 {code.add('%width', LANES - 1)}, {LANES}")
    with code.loop("%sets") as one, code.loop(groups) as group, code.loop("%rows") as i:
        column = _first(code, group, "%width")
        # Lanes are columns of b and of the result; an element of a is the same in all of them.
        n.store(n.of_double(code.number(0.0)), total, 0)
        with code.loop("%terms") as k:
            row = code.mul(code.mul(one, "%a_own"), a_one)
            row = code.add(code.add(row, code.mul(i, "%terms")), k)
            places = _places(code, row, a_all, n.parts)
            factor = tuple(code.everywhere(code.scalar("%a", place)) for place in places)
            place = code.mul(code.mul(one, "%b_own"), b_one)
            place = code.add(code.add(place, code.mul(k, "%width")), column)
            b = _loaded(code, "%b", place, b_all, n.parts)
            n.store(n.with_product(n.load(total, 0), factor, b), total, 0)
        place = code.add(code.mul(one, "%rows"), i)
        place = code.add(code.mul(place, "%width"), column)
        _keep(code, n.settled(n.load(total, 0)), "%out", place, all_)
    head = (
        "define i64 @products(ptr noalias %out, ptr %a, ptr %b, i64 %rows, i64 %terms, i64 %width,"
        " i64 %sets, i64 %a_own, i64 %b_own) {"
    )
    return machine_code.function(code.function(head, "0"))


@functools.cache
def convolution(bits: int) -> Any:
    """The function ``f(out, a, b, a_rows, work, count, rows, width)``: products of polynomials.

    Numbers are doubles (53 bits) or sums of them (106, 159). `a` and `b` hold the addresses of
    `count` arrays each, `a_rows` the number of rows of each array of a; the array of b beside it
    has `rows` + 1 minus that. out[r, c] is the sum of a[k, c] b[r - k, c] over all arrays and
    over k. `width` is at least `WIDE_LANES`. `work` has room for 3 `rows` numbers in each of
    these lanes.
    """
    # Rows of some columns lie far apart in memory. They are brought together in `work`: the sums,
    # and the rows of a and of b, the parts of a number behind one another.
    code = Writer(WIDE_LANES)
    n = KINDS[bits](code)
    parts = n.parts
    total = code.variable(n.rows(parts))
    all_, zero = code.mul("%rows", "%width"), n.of_double(code.number(0.0))
    sums, left, right = (code.at("%work", code.mul("%rows", parts * k)) for k in range(3))
    groups = code(f"udiv i64 {code.add('%width', WIDE_LANES - 1)}, {WIDE_LANES}")

    def row(base: str, place: str) -> Value:
        return _loaded(code, base, code.mul(place, parts * WIDE_LANES), str(WIDE_LANES), parts)

    def keep(value: Value, base: str, place: str) -> None:
        _keep(code, value, base, code.mul(place, parts * WIDE_LANES), str(WIDE_LANES))

    def gather(base: str, rows: str, to: str, column: str) -> None:
        apart = code.mul(rows, "%width")
        with code.loop(rows) as k:
            place = code.add(code.mul(k, "%width"), column)
            keep(_loaded(code, base, place, apart, parts), to, k)

    with code.loop(groups) as group:
        column = _first(code, group, "%width")
        with code.loop("%rows") as r:
            keep(zero, sums, r)
        with code.loop("%count") as one:
            a, b, a_rows = (
                code.scalar(base, one, kind)
                for base, kind in (("%a", "ptr"), ("%b", "ptr"), ("%a_rows", "i64"))
            )
            b_last = code(f"sub i64 %rows, {a_rows}")
            gather(a, a_rows, left, column)
            gather(b, code.add(b_last, 1), right, column)
            with code.loop("%rows") as r:
                n.store(row(sums, r), total, 0)
                # k from max(0, r - b_last) to min(r, a_rows - 1): both rows exist.
                least = code(f"sub i64 {r}, {b_last}")
                least = code(f"select i1 {code(f'icmp sgt i64 {least}, 0')}, i64 {least}, i64 0")
                end = code.add(r, 1)
                fewer = code(f"icmp slt i64 {end}, {a_rows}")
                end = code(f"select i1 {fewer}, i64 {end}, i64 {a_rows}")
                with code.loop(end, least) as k:
                    x, y = row(left, k), row(right, code(f"sub i64 {r}, {k}"))
                    n.store(n.with_product(n.load(total, 0), x, y), total, 0)
                keep(n.load(total, 0), sums, r)
        # Normalised once, when the products of all arrays are in.
        with code.loop("%rows") as r:
            place = code.add(code.mul(r, "%width"), column)
            _keep(code, n.settled(row(sums, r)), "%out", place, all_)
    head = (
        "define i64 @convolution(ptr noalias %out, ptr %a, ptr %b, ptr %a_rows, ptr noalias %work,"
        " i64 %count, i64 %rows, i64 %width) {"
    )
    return machine_code.function(code.function(head, "0"))


@functools.cache
def held(loop: Callable[..., Any], *of: int) -> Any:
    """A loop that holds the interpreter's lock, for short arrays: to get it back takes longer."""
    # ctypes calls a PYFUNCTYPE without releasing the lock, a CFUNCTYPE with.
    free = loop(*of)
    return ctypes.cast(free, ctypes.PYFUNCTYPE(ctypes.c_int64, *free.argtypes))


def _first(code: Writer, group: str, count: str) -> str:
    """Index of the first element of a group of lanes; the last group ends with the elements."""
    first, last = code.mul(group, code.lanes), code(f"sub i64 {count}, {code.lanes}")
    return code(f"select i1 {code(f'icmp slt i64 {first}, {last}')}, i64 {first}, i64 {last}")


def _places(code: Writer, place: str, apart: str, parts: int) -> list[str]:
    """The places of a number's parts, each `apart` from the one before."""
    found = [place]
    while len(found) < parts:
        found.append(code.add(found[-1], apart))
    return found


def _loaded(code: Writer, base: str, place: str, apart: str, parts: int) -> Value:
    places = _places(code, place, apart, parts)
    return tuple(code.load(code.at(base, x, "double"), align=8) for x in places)


def _keep(code: Writer, value: Value, base: str, place: str, apart: str) -> None:
    for part, at in zip(value, _places(code, place, apart, len(value)), strict=True):
        code.store(part, code.at(base, at, "double"), align=8)
