"""Engine of any precision: Taylor series in fixed-point integers, in plain Python.

It has any precision, and shares no arithmetic with the kernel, so the two check each other. A
number x is the integer x 2^P. The field is :func:`rigidpend.mechanics.equations.aligned` itself,
run over series instead of numbers.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from fractions import Fraction
from itertools import pairwise
from operator import mul
from typing import TypeAlias

from rigidpend.machine.workers import check_stop
from rigidpend.mechanics.equations import AlignedCoefficients, aligned
from rigidpend.mechanics.separatrices import separatrix_beside
from rigidpend.numbers.exact import GUARD_BITS
from rigidpend.orbits.integrate.bounds import touch
from rigidpend.orbits.integrate.records import (
    Crossings,
    Orbits,
    Outcome,
    no_crossings,
    silent_outcome,
)
from rigidpend.orbits.integrate.roots import UndecidedTouch

MAX_STEPS = 100_000
SHRINK = math.exp(-2)
"""Step over radius of convergence; each order then gains two nats, the cheapest choice."""
LONGEST = 2.0
"""The logarithm of the largest radius that is believed: a series may end in zeros."""
FINEST = 2.0**-20
"""Share of a step below which M3 is looked at in integers, not in doubles."""

WEIGHTS = ("force_p", "force_m", "mu_r1", "mu_r2")
"""The coefficients that are proportional to mu."""

Path: TypeAlias = tuple[list[tuple[float, int]], Outcome]


def crossings(orbits: Orbits, bits: int) -> Crossings:
    """Crossings of orbits in `bits` bits or more, one by one.

    Parameters
    ----------
    orbits : Orbits
        With states as lists of Fractions.
    bits : int
        Relative precision of the smallest initial component.
    """
    found = no_crossings(orbits.n_crossings, len(orbits.states))
    for column, state in enumerate(orbits.states):
        path, found.outcome[column] = follow(orbits, state, bits)
        for k, (time, separatrix) in enumerate(path):
            found.time[k, column], found.separatrix[k, column] = time, separatrix
    return found


def follow(orbits: Orbits, state: Sequence[Fraction], bits: int) -> Path:
    """One orbit: its crossings as (time, separatrix), and how it ended."""
    path: list[tuple[float, int]] = []
    try:
        return path, _followed(orbits, state, bits, path)
    except UndecidedTouch:
        return path, Outcome.FAILED


def _followed(
    orbits: Orbits, state: Sequence[Fraction], bits: int, path: list[tuple[float, int]]
) -> Outcome:
    """Append the crossings of an orbit to a path; return how it ended."""
    unit = unit_of(state)
    coefficients, state = in_units(orbits.coefficients, state, unit)
    P = fractional_bits((*state, *coefficients), bits)
    flow = Flow([fixed(x, P) for x in coefficients], P)
    here, depth = [fixed(x, P) for x in state], depth_of_touch(state, bits, P)
    time = last = 0
    limit = fixed(Fraction(orbits.passage_limit) * unit, P)
    for _ in range(MAX_STEPS):
        series, step = flow.expand(here)
        for at in crossings_within(series[2], step, P, depth):
            last = time + at
            Qp, Qm, speed = (value_at(s, at, P) for s in (*series[:2], _derivative(series[2])))
            path.append(
                (float(Fraction(last, 1 << P) / unit), separatrix_beside(speed > 0, Qp, Qm))
            )
            if len(path) == orbits.n_crossings:
                return Outcome.COMPLETE
        here = [value_at(s, step, P) for s in series]
        time += step
        if time - last > limit:
            return silent_outcome(*here[:2])
    return Outcome.FAILED


def advance(
    coefficients: AlignedCoefficients, state: Sequence[Fraction], count: int, bits: int
) -> list[tuple[Fraction, tuple[Fraction, ...]]]:
    """Carry an orbit some steps of natural length: times since the start, and states.

    All numbers are Fractions; `bits` is as for :func:`crossings`.
    """
    unit = unit_of(state)
    c, scaled = in_units(coefficients, state, unit)
    P = fractional_bits((*scaled, *c), bits)
    flow = Flow([fixed(x, P) for x in c], P)
    here, time, found = [fixed(x, P) for x in scaled], 0, []
    for _ in range(count):
        series, step = flow.expand(here)
        here, time = [value_at(s, step, P) for s in series], time + step
        there = [Fraction(x, 1 << P) for x in here]
        found.append((Fraction(time, 1 << P) / unit, (*(x * unit for x in there[:3]), *there[3:])))
    return found


def unit_of(state: Sequence[Fraction]) -> Fraction:
    """The power of two next to |M|, so that fixed-point numbers are of order one."""
    largest = max(abs(x) for x in state[:3])
    return Fraction(2) ** (largest.numerator.bit_length() - largest.denominator.bit_length())


def in_units(
    coefficients: AlignedCoefficients, state: Sequence[Fraction], unit: Fraction
) -> tuple[AlignedCoefficients, list[Fraction]]:
    """The same orbit with M in units of `unit` and t' in units of its inverse."""
    c = coefficients
    weights = {name: getattr(c, name) / unit**2 for name in WEIGHTS}
    return c._replace(**weights), [*(x / unit for x in state[:3]), *state[3:]]


class _Series:
    """A power series whose coefficients are found one order at a time."""

    def __init__(self, tape: list[_Series], P: int) -> None:
        self.tape, self.P = tape, P
        self.terms: list[int] = []
        tape.append(self)

    def extend(self) -> None:
        """Find the next coefficient from those of the operands. Variables wait to be told."""

    def __add__(self, other: _Series) -> _Series:
        return _Sum(self, other, 1)

    def __sub__(self, other: _Series) -> _Series:
        return _Sum(self, other, -1)

    def __mul__(self, other: _Series) -> _Series:
        return _Product(self, other)


class _Sum(_Series):
    def __init__(self, a: _Series, b: _Series, sign: int) -> None:
        super().__init__(a.tape, a.P)
        self.a, self.b, self.sign = a, b, sign

    def extend(self) -> None:
        k = len(self.terms)
        self.terms.append(self.a.terms[k] + self.sign * self.b.terms[k])


class _Product(_Series):
    def __init__(self, a: _Series, b: _Series) -> None:
        super().__init__(a.tape, a.P)
        self.a, self.b = a, b

    def extend(self) -> None:
        self.terms.append(sum(map(mul, self.a.terms, reversed(self.b.terms))) >> self.P)


class _Scaled(_Series):
    def __init__(self, factor: int, a: _Series) -> None:
        super().__init__(a.tape, a.P)
        self.factor, self.a = factor, a

    def extend(self) -> None:
        self.terms.append(self.factor * self.a.terms[len(self.terms)] >> self.P)


class _Number:
    """A fixed-point constant, which multiplies series."""

    def __init__(self, value: int) -> None:
        self.value = value

    def __neg__(self) -> _Number:
        return _Number(-self.value)

    def __mul__(self, other: _Series) -> _Series:
        return _Scaled(self.value, other)


class Flow:
    """The aligned field as a tape of series, reused at every step."""

    def __init__(self, coefficients: Sequence[int], P: int) -> None:
        self.tape: list[_Series] = []
        self.order = math.ceil(P * math.log(2) / 2) + 1
        self.variables = [_Series(self.tape, P) for _ in range(6)]
        self.P = P
        numbers = AlignedCoefficients(*map(_Number, coefficients))
        self.rates = aligned(self.variables, numbers)

    def expand(self, state: Sequence[int]) -> tuple[list[list[int]], int]:
        """The Taylor series of the orbit from `state`, and the step that they carry."""
        for node in self.tape:
            node.terms = []
        for variable, value in zip(self.variables, state, strict=True):
            variable.terms.append(value)
        for k in range(1, self.order + 1):
            check_stop()
            for node in self.tape:
                node.extend()
            for variable, rate in zip(self.variables, self.rates, strict=True):
                variable.terms.append(rate.terms[-1] // k)
        series = [variable.terms for variable in self.variables]
        return series, self._step(series)

    def _step(self, series: list[list[int]]) -> int:
        """A step inside the radius of convergence, which the last two orders tell."""
        radius = min(
            math.exp(min(LONGEST, -_log(max(abs(s[k]) for s in series), self.P) / k))
            for k in (self.order - 1, self.order)
        )
        return int(radius * SHRINK * 2**40) << (self.P - 40)


def fractional_bits(numbers: Sequence[Fraction], bits: int) -> int:
    smallest = min(abs(x) for x in numbers if x)
    leading_zeros = smallest.denominator.bit_length() - smallest.numerator.bit_length()
    return bits + GUARD_BITS + max(0, leading_zeros)


def fixed(x: Fraction, P: int) -> int:
    return (x.numerator << P) // x.denominator


def _log(x: int, P: int) -> float:
    """ln(x 2^-P), very small for 0."""
    return math.log(x) - P * math.log(2) if x else -math.inf


def value_at(series: Sequence[int], at: int, P: int) -> int:
    total = 0
    for term in reversed(series):
        total = (total * at >> P) + term
    return total


def _derivative(series: Sequence[int]) -> list[int]:
    return [k * term for k, term in enumerate(series)][1:]


def depth_of_touch(state: Sequence[Fraction], bits: int, P: int) -> int:
    """The depth of a touch of M3 = 0 that is not decided, of an orbit through a state."""
    size = Fraction(math.hypot(*map(float, state[:3])))
    return fixed(Fraction(touch(bits)) * size, P)


def crossings_within(series: Sequence[int], step: int, P: int, depth: int) -> Iterator[int]:
    """The zeros of a series in (0, step], in order, to full precision.

    Parameters
    ----------
    series : sequence of int
    step : int
    P : int
        Fractional bits of all these numbers.
    depth : int
        A turning point that is no farther from zero is not decided.

    Raises
    ------
    UndecidedTouch
        When the iteration comes to such a turning point.
    """
    size = step / (1 << P)
    scaled = [term / (1 << P) * size**k for k, term in enumerate(series)]
    slopes = _derivative(series)
    for a, b in _pieces(scaled, depth / (1 << P), 0.0, 1.0):
        low, high = (int(share * 2**53) * step >> 53 for share in (a, b))
        turns = _zero_between(slopes, low, high, P)
        if any(abs(value_at(series, turn, P)) <= depth for turn in turns):
            raise UndecidedTouch((a + b) / 2)
        for left, right in pairwise((low, *turns, high)):
            yield from _zero_between(series, left, right, P)


def _pieces(c: Sequence[float], depth: float, a: float, b: float) -> Iterator[tuple[float, float]]:
    """The parts of (a, b] where sum c_k x^k may come near zero, with one turning point at most.

    By exclusion and bisection: a derivative's bound over (0, 1) is the sum of its coefficients'
    sizes.
    """
    middle, half = (a + b) / 2, (b - a) / 2
    steepest = sum(k * abs(x) for k, x in enumerate(c))
    if abs(_horner(c, middle)) > steepest * half + depth:
        return
    slopes = [k * x for k, x in enumerate(c)][1:]
    bend = sum(k * abs(x) for k, x in enumerate(slopes))
    if abs(_horner(slopes, middle)) > bend * half or half < FINEST:
        yield a, b
        return
    yield from _pieces(c, depth, a, middle)
    yield from _pieces(c, depth, middle, b)


def _zero_between(series: Sequence[int], low: int, high: int, P: int) -> list[int]:
    """The zero of a monotone series in (low, high], by bisection; empty where it has none."""
    left, right = value_at(series, low, P), value_at(series, high, P)
    if left * right > 0 or left == 0:
        return []
    while high - low > 1:
        middle = (low + high) // 2
        if value_at(series, middle, P) * left > 0:
            low = middle
        else:
            high = middle
    return [high]


def _horner(c: Sequence[float], x: float) -> float:
    total = 0.0
    for term in reversed(c):
        total = total * x + term
    return total
