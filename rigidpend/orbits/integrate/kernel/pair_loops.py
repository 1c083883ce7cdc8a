"""Arithmetic of arrays of pairs of doubles, in machine code.

NumPy has no such numbers, and its `long double` has as many bits as a machine likes: 64, 113, or
those of a double. These are the same everywhere. An array lies in memory as all of the larger
parts and then all of the smaller ones; each function goes over it in vectors of lanes, of which
the last one overlaps the one before, so that arrays need not fill them.
"""

from __future__ import annotations

import ctypes
import functools
from collections.abc import Callable
from typing import Any

from rigidpend.orbits.integrate.kernel import machine_code
from rigidpend.orbits.integrate.kernel.functions import Functions
from rigidpend.orbits.integrate.kernel.lane_numbers import Pairs, Value
from rigidpend.orbits.integrate.kernel.machine_code import LANES, Writer

OPERATIONS: dict[str, Callable[[Pairs, Value, Value], Value]] = {
    "add": lambda n, a, b: n.plus(a, b),
    "subtract": lambda n, a, b: n.minus(a, b),
    "multiply": lambda n, a, b: n.times(a, b),
    "divide": lambda n, a, b: n.quotient(a, b),
    "cos": lambda n, a, _: Functions(n).cos_sin(a)[0],
    "sin": lambda n, a, _: Functions(n).cos_sin(a)[1],
    "log": lambda n, a, _: Functions(n).logarithm_of_size(a),
}
"""Operations on the elements of one or two arrays."""


@functools.cache
def elementwise(name: str) -> Any:
    """The function ``f(out, a, a_step, b, b_step, n)`` of one of the `OPERATIONS`.

    The arguments are addresses of arrays of n numbers, n at least `LANES`, and 1; or of `LANES`
    equal numbers, and 0.
    """
    code = Writer()
    n = Pairs(code)
    with code.loop(code(f"udiv i64 {code(f'add i64 %n, {LANES - 1}')}, {LANES}")) as group:
        first = _first(code, group, "%n")
        a, b = (
            _loaded(code, f"%{x}", code(f"mul i64 {first}, %{x}_step"), _apart(code, x))
            for x in ("a", "b")
        )
        _keep(code, OPERATIONS[name](n, a, b), "%out", first, "%n")
    head = "define i64 @apply(ptr noalias %out, ptr %a, i64 %a_step, ptr %b, i64 %b_step, i64 %n) {"
    address, count = ctypes.c_void_p, ctypes.c_int64
    kinds = address, address, count, address, count, count
    return machine_code.function(code.function(head, "0"), "apply", *kinds)


@functools.cache
def products() -> Any:
    """The function ``f(out, a, b, rows, terms, width, sets, a_own, b_own)``, a matrix product.

    For each of the sets out[i, c] is the sum of a[i, k] b[k, c] over all of the terms k; `a_own`
    and `b_own` are 1 where each set has its own, 0 where all share one. `width`, the columns of
    b, is at least `LANES`.
    """
    code = Writer()
    n = Pairs(code)
    total = code.variable(n.rows(2))
    a_one, b_one = code("mul i64 %rows, %terms"), code("mul i64 %terms, %width")
    # How many of each there are, from where on the smaller parts lie.
    a_all, b_all = (
        code(f"mul i64 {one}, {code(f'select i1 {own}, i64 %sets, i64 1')}")
        for one, own in (
            (a_one, code("icmp ne i64 %a_own, 0")),
            (b_one, code("icmp ne i64 %b_own, 0")),
        )
    )
    all_ = code(f"mul i64 {code('mul i64 %rows, %width')}, %sets")
    groups = code(f"udiv i64 {code(f'add i64 %width, {LANES - 1}')}, {LANES}")
    with code.loop("%sets") as one, code.loop("%rows") as i, code.loop(groups) as group:
        column = _first(code, group, "%width")
        n.store(_zero(code), total, 0)
        with code.loop("%terms") as k:
            row = code(f"mul i64 {code(f'mul i64 {one}, %a_own')}, {a_one}")
            row = code(f"add i64 {row}, {code(f'mul i64 {i}, %terms')}")
            row = code(f"add i64 {row}, {k}")
            factor = tuple(
                code.everywhere(code.load(code.at("%a", place, "double"), "double", 8))
                for place in (row, code(f"add i64 {row}, {a_all}"))
            )
            place = code(f"mul i64 {code(f'mul i64 {one}, %b_own')}, {b_one}")
            place = code(f"add i64 {place}, {code(f'mul i64 {k}, %width')}")
            place = code(f"add i64 {place}, {column}")
            b = _loaded(code, "%b", place, b_all)
            n.store(n.with_product(n.load(total, 0), factor, b), total, 0)
        place = code(f"add i64 {code(f'mul i64 {one}, %rows')}, {i}")
        place = code(f"add i64 {code(f'mul i64 {place}, %width')}, {column}")
        _keep(code, n.settled(n.load(total, 0)), "%out", place, all_)
    head = (
        "define i64 @products(ptr noalias %out, ptr %a, ptr %b, i64 %rows, i64 %terms, i64 %width,"
        " i64 %sets, i64 %a_own, i64 %b_own) {"
    )
    kinds = (*(ctypes.c_void_p,) * 3, *(ctypes.c_int64,) * 6)
    return machine_code.function(code.function(head, "0"), "products", *kinds)


@functools.cache
def convolution() -> Any:
    """The function ``f(out, a, b, a_rows, b_rows, width)``, the product of two polynomials.

    out[r, c] is the sum of a[k, c] b[r - k, c]; `width` is at least `LANES`.
    """
    code = Writer()
    n = Pairs(code)
    total = code.variable(n.rows(2))
    rows = code(f"sub i64 {code('add i64 %a_rows, %b_rows')}, 1")
    a_all, b_all, all_ = (code(f"mul i64 {x}, %width") for x in ("%a_rows", "%b_rows", rows))
    last_b = code("sub i64 %b_rows, 1")
    groups = code(f"udiv i64 {code(f'add i64 %width, {LANES - 1}')}, {LANES}")
    with code.loop(rows) as r, code.loop(groups) as group:
        column = _first(code, group, "%width")
        n.store(_zero(code), total, 0)
        least = code(f"sub i64 {r}, {last_b}")
        least = code(f"select i1 {code(f'icmp sgt i64 {least}, 0')}, i64 {least}, i64 0")
        end = code(f"add i64 {r}, 1")
        end = code(f"select i1 {code(f'icmp slt i64 {end}, %a_rows')}, i64 {end}, i64 %a_rows")
        with code.loop(end, least) as k:
            a, b = (
                _loaded(code, base, code(f"add i64 {code(f'mul i64 {row}, %width')}, {column}"), x)
                for base, row, x in (
                    ("%a", k, a_all),
                    ("%b", code(f"sub i64 {r}, {k}"), b_all),
                )
            )
            n.store(n.with_product(n.load(total, 0), a, b), total, 0)
        place = code(f"add i64 {code(f'mul i64 {r}, %width')}, {column}")
        _keep(code, n.settled(n.load(total, 0)), "%out", place, all_)
    head = (
        "define i64 @convolution(ptr noalias %out, ptr %a, ptr %b, i64 %a_rows, i64 %b_rows,"
        " i64 %width) {"
    )
    kinds = (*(ctypes.c_void_p,) * 3, *(ctypes.c_int64,) * 3)
    return machine_code.function(code.function(head, "0"), "convolution", *kinds)


def _first(code: Writer, group: str, count: str) -> str:
    """The first element of a group of lanes, of which the last one ends with the elements."""
    first, last = code(f"mul i64 {group}, {LANES}"), code(f"sub i64 {count}, {LANES}")
    return code(f"select i1 {code(f'icmp slt i64 {first}, {last}')}, i64 {first}, i64 {last}")


def _apart(code: Writer, which: str) -> str:
    """From the larger parts to the smaller ones, in doubles."""
    several = code(f"mul i64 %{which}_step, %n")
    return code(f"select i1 {code(f'icmp eq i64 {several}, 0')}, i64 {LANES}, i64 {several}")


def _loaded(code: Writer, base: str, place: str, apart: str) -> Value:
    places = place, code(f"add i64 {place}, {apart}")
    return tuple(code.load(code.at(base, x, "double"), align=8) for x in places)


def _keep(code: Writer, value: Value, base: str, place: str, apart: str) -> None:
    for part, at in zip(value, (place, code(f"add i64 {place}, {apart}")), strict=True):
        code.store(part, code.at(base, at, "double"), align=8)


def _zero(code: Writer) -> Value:
    return code.number(0.0), code.number(0.0)
