"""Sine, cosine and logarithm in lanes, against mpmath."""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from rigidpend.numbers.exact import context
from rigidpend.orbits.integrate.kernel import machine_code
from rigidpend.orbits.integrate.kernel.functions import Functions
from rigidpend.orbits.integrate.kernel.lane_numbers import KINDS, Value
from rigidpend.orbits.integrate.kernel.machine_code import LANES, Writer

ROUNDINGS = {53: 2.0, 106: 3.0}
"""Errors allowed, in units of 2^-bits of an angle above 1 and of any other result."""
M = context(300)
BITS = pytest.mark.parametrize("bits", [53, 106])


def values(bits: int, lines: Callable[[Functions, Value], Value], x: Any) -> Any:
    """A function of LANES numbers, each as mpmath's."""
    code = Writer()
    numbers = KINDS[bits](code)
    number = tuple(code.element("%x", i) for i in range(numbers.parts))
    for i, part in enumerate(lines(Functions(numbers), number)):
        code.store(part, code.at("%y", i))
    text = code.function("define i64 @one(ptr noalias %x, ptr noalias %y) {", "0")
    function = machine_code.function(text, "one", ctypes.c_void_p, ctypes.c_void_p)
    room = np.zeros((2, numbers.parts * LANES + 8))
    ends = [row.ctypes.data + -row.ctypes.data % 64 for row in room]
    given, found = (
        np.ctypeslib.as_array((ctypes.c_double * (numbers.parts * LANES)).from_address(end))
        for end in ends
    )
    given[:] = np.concatenate([np.asarray(part, dtype=float) for part in x[: numbers.parts]])
    function(*ends)
    return [sum((M.mpf(z) for z in found[k::LANES]), M.mpf(0)) for k in range(LANES)]


def numbers_between(low: float, high: float, seed: int, bits: int) -> tuple[Any, list[Any]]:
    """LANES numbers with a second part, and the same for mpmath."""
    random = np.random.default_rng(seed)
    head = random.uniform(low, high, LANES)
    rest = random.uniform(-0.5, 0.5, LANES) * np.spacing(head) * (bits > 53)
    return (head, rest), [M.mpf(a) + M.mpf(b) for a, b in zip(head, rest, strict=True)]


@BITS
@pytest.mark.parametrize(
    "ends", [(-40, 40), (-1e-8, 1e-8), (0.78, 0.7854), (1.57, 1.5708), (-3.15, -3.14)]
)
def test_agrees_cosine_and_sine_with_mpmath(bits: int, ends: tuple[float, float]) -> None:
    x, true = numbers_between(*ends, 5, bits)
    for which, function in enumerate((M.cos, M.sin)):
        found = values(bits, lambda f, z, which=which: f.cos_sin(z)[which], x)  # type: ignore[misc]
        for one, z in zip(found, true, strict=True):
            assert abs(one - function(z)) < ROUNDINGS[bits] * 2.0**-bits * max(1, abs(z)), z


@BITS
@pytest.mark.parametrize(
    "ends", [(0.5, 2), (1.41, 1.414), (1 - 1e-9, 1 + 1e-9), (-1e-30, -1e-31), (1e9, 1e10)]
)
def test_agrees_the_logarithm_with_mpmath(bits: int, ends: tuple[float, float]) -> None:
    x, true = numbers_between(*ends, 6, bits)
    found = values(bits, Functions.logarithm_of_size, x)
    for one, z in zip(found, true, strict=True):
        size = abs(M.log(abs(z)))
        assert abs(one - M.log(abs(z))) < ROUNDINGS[bits] * 2.0**-bits * size, z


@BITS
def test_agrees_a_reduced_angle_with_the_angle(bits: int) -> None:
    x, true = numbers_between(-60, 60, 7, bits)
    for one, z in zip(values(bits, Functions.reduced_angle, x), true, strict=True):
        assert abs(one) < M.pi + 1e-9
        turns = (z - one) / (2 * M.pi)
        assert abs(turns - M.nint(turns)) < ROUNDINGS[bits] * 2.0**-bits
