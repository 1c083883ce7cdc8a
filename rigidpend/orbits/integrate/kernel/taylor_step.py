"""A Taylor step of a field, in the language of LLVM, for a vector of lanes.

`recurrences` find the series; here they are set up, and followed for a step, for any order and
either kind of numbers. A step's length follows Jorba and Zou, Experimental Mathematics 14 (2005),
sec. 3.2, as in heyoka. Lanes never meet: an orbit comes out the same to the last bit whatever its
neighbours. It does on every processor too, for each sum and product is spelled out; only a field
with sines or exponentials takes these from the system's mathematical library.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from fractions import Fraction

from rigidpend.orbits.integrate.kernel.lane_numbers import KINDS, Doubles, Value
from rigidpend.orbits.integrate.kernel.machine_code import LANES, Writer
from rigidpend.orbits.integrate.kernel.recurrences import Recurrences
from rigidpend.orbits.integrate.kernel.tape import TracedField

LONGEST = 32.0
"""Longest step, t'; only an orbit that stands still comes to it."""
FEW_BITS = -(1 << 32)
"""The sign, the exponent and the first 20 bits of a double."""
LOGARITHM = (-1025.4983531488, 4.0292113911, -2.0783351683, 0.6260321822, -0.0784406762)
"""log2 x - 1023 on [1, 2) within 1.2e-4, from its values at Chebyshev's points."""
POWER = (0.9999002882, 0.6963247711, 0.2246931558, 0.0789672570)
"""2^x on [0, 1) within 1e-4, likewise."""


def order_of(tolerance: float) -> int:
    """Order of the series that is best for a local tolerance (Jorba and Zou, eq. 3.8)."""
    return max(4, math.ceil(1 - math.log(tolerance) / 2))


class Kernel:
    """Parts of a function that takes Taylor steps; what is done with each is up to the heirs."""

    def __init__(self, order: int, bits: int, field: TracedField, lanes: int = LANES) -> None:
        self.order, self.code = order, Writer(lanes)
        self.field, self.size = field, len(field.rates)
        self.numbers = KINDS[bits](self.code)
        self.parts, rows = self.numbers.parts, (order + 1) * self.numbers.parts
        self.series = self.code.variable(self.numbers.rows(self.size * rows))
        self.component: list[str] = []
        """Places of the components' series."""

    def begin(self) -> None:
        """Set up the constants of all steps: places of the series, parameters, and 1/k."""
        code = self.code
        for i in range(self.size):
            self.component.append(code.at(self.series, i * (self.order + 1) * self.parts))
        self.one = code.number(1.0)
        self.shares = code.variable(f"[{self.parts * (self.order + 1)} x double]")
        for k in range(1, self.order + 1):
            for i, part in enumerate(self.numbers.constant(Fraction(1, k))):
                place = code.at(self.shares, i * (self.order + 1) + k, "double")
                code.store(part, place, "double", 8)
        self.recurrences = Recurrences(self.field, self)

    def scalar(self, base: str, index: str | int, apart: int) -> Value:
        """A number in each lane, from its parts in an array."""
        code, places = self.code, []
        for i in range(self.parts):
            at = code(f"add i64 {index}, {i * apart}")
            places.append(code.load(code.at(base, at, "double"), "double", 8))
        return tuple(code.everywhere(x) for x in places)

    def places(self, first: str) -> list[list[str]]:
        """Places of a vector of lanes, from lane `first` on: the components', then the time's."""
        state = [
            [self._place("%state", i + self.size * part, first) for part in range(self.parts)]
            for i in range(self.size)
        ]
        return [*state, [self._place("%time", i, first) for i in range(2)]]

    def load_lanes(self, places: list[list[str]]) -> None:
        """Take the lanes' states and times into the kernel."""
        code = self.code
        *rows, times = places
        self.time = [code.variable(code.vector) for _ in times]
        for series, row in zip(self.component, rows, strict=True):
            value = tuple(code.load(x, align=8) for x in row)
            self.numbers.store(value, series, 0)
        for variable, place in zip(self.time, times, strict=True):
            code.store(code.load(place, align=8), variable)

    def store_lanes(self, places: list[list[str]]) -> None:
        """Put them back, carried on."""
        code = self.code
        *rows, times = places
        for series, row in zip(self.component, rows, strict=True):
            value = self.numbers.load(series, 0)
            for part, place in zip(value, row, strict=True):
                code.store(part, place, align=8)
        for variable, place in zip(self.time, times, strict=True):
            code.store(code.load(variable), place, align=8)

    def _place(self, base: str, row: int, first: str) -> str:
        """The place of a group of lanes in a row of an array."""
        begin = self.code(f"mul i64 %stride, {row}")
        return self.code.at(base, self.code(f"add i64 {begin}, {first}"), "double")

    def expand(self) -> None:
        """Find the series about the lanes' states."""
        self.recurrences.expand()

    def integrated(self, rates: Sequence[Value], k: str, numbers: Doubles) -> None:
        """Store the coefficients of order k + 1 of components from those of order k of rates."""
        following = self.code(f"add i64 {k}, 1")
        share = self.scalar(self.shares, following, self.order + 1)
        whole = self.code.everywhere(self.code(f"sitofp i64 {following} to double"))
        for series, rate in zip(self.component, rates, strict=True):
            numbers.store(numbers.divided(rate, share, whole), series, following)

    def go_on(self, h: str, ends: list[Value]) -> None:
        """Step to the ends of the series."""
        for series, end in zip(self.component, ends, strict=True):
            self.numbers.store(end, series, 0)
        self._let_time_pass(h)

    def head(self, component: int, k: int) -> str:
        """The first part of a coefficient: as a double."""
        return self.code.element(self.component[component], k * self.parts)

    def _times(self, a: str, b: str) -> str:
        return self.code.binary("fmul", a, b)

    def _minus(self, a: str, b: str) -> str:
        return self.code.binary("fsub", a, b)

    def length(self) -> str:
        """Length of the step: the last two coefficients tell the radius of convergence."""
        code, p = self.code, self.order
        size = self._binary_logarithm(code.larger(self._norm(0), self.one))
        exponents = [
            self._times(
                self._minus(size, self._binary_logarithm(self._norm(m))), code.number(1 / m)
            )
            for m in (p - 1, p)
        ]
        shrink = code.number((-0.7 / (p - 1) - 2) / math.log(2))
        exponent = code.binary("fadd", code.smaller(*exponents), shrink)
        length = self._power_of_two(code.smaller(exponent, code.number(math.log2(LONGEST))))
        if self.parts <= 2:
            return length
        # Two doubles then hold every sum of steps, which is the time, without rounding.
        bits = code(f"bitcast {code.vector} {length} to {code.whole}")
        bits = code(f"and {code.whole} {bits}, {code.everywhere(str(FEW_BITS), 'i64')}")
        return code(f"bitcast {code.whole} {bits} to {code.vector}")

    def _norm(self, m: int) -> str:
        """Largest coefficient of an order."""
        code = self.code
        norm, *sizes = [code.size(self.head(i, m)) for i in range(self.size)]
        for size in sizes:
            norm = code.larger(size, norm)
        return norm

    def _binary_logarithm(self, x: str) -> str:
        """log2 x from the exponent and a polynomial of the rest: good enough for a length."""
        code = self.code
        bits = code(f"bitcast {code.vector} {x} to {code.whole}")
        rest = code(f"and {code.whole} {bits}, {code.everywhere(str((1 << 52) - 1), 'i64')}")
        rest = code(f"or {code.whole} {rest}, {code.everywhere(str(1023 << 52), 'i64')}")
        rest = code(f"bitcast {code.whole} {rest} to {code.vector}")
        exponent = code(f"lshr {code.whole} {bits}, {code.everywhere('52', 'i64')}")
        exponent = code(f"uitofp {code.whole} {exponent} to {code.vector}")
        return code.binary("fadd", exponent, self._polynomial(LOGARITHM, rest))

    def _power_of_two(self, x: str) -> str:
        """2^x from the whole part as an exponent and a polynomial of the rest."""
        code = self.code
        whole = code(f"call {code.vector} @llvm.floor.{code.suffix}({code.vector} {x})")
        rest = self._polynomial(POWER, self._minus(x, whole))
        bits = code(f"fptosi {code.vector} {whole} to {code.whole}")
        bits = code(f"add {code.whole} {bits}, {code.everywhere('1023', 'i64')}")
        bits = code(f"shl {code.whole} {bits}, {code.everywhere('52', 'i64')}")
        return self._times(rest, code(f"bitcast {code.whole} {bits} to {code.vector}"))

    def _polynomial(self, coefficients: Sequence[float], x: str) -> str:
        total = self.code.number(coefficients[-1])
        for c in coefficients[-2::-1]:
            total = self.code.fma(total, x, self.code.number(c))
        return total

    def at(self, component: int, h: str) -> Value:
        """A component's series at a time from the beginning of the step, by Horner's rule."""
        return self._summed(component, lambda total, c: self.numbers.horner(total, h, c))

    def at_number(self, component: int, x: Value) -> Value:
        """The same at a time with all the parts of a number."""
        return self._summed(component, lambda total, c: self.numbers.horner_at(total, x, c))

    def _summed(self, component: int, further: Callable[[Value, Value], Value]) -> Value:
        n, place = self.numbers, self.component[component]
        total = n.load(place, self.order)
        if self.parts <= 2:
            for k in range(self.order - 1, -1, -1):
                total = further(total, n.load(place, k))
            return total
        # Lines enough for a loop, which would take long to compile without one.
        kept = self.code.variable(n.rows(self.parts))
        n.store(total, kept, 0)
        with self.code.loop(self.order) as done:
            next_ = self.code(f"sub i64 {self.order - 1}, {done}")
            n.store(further(n.load(kept, 0), n.load(place, next_)), kept, 0)
        return n.load(kept, 0)

    def _let_time_pass(self, h: str) -> None:
        """Add the step to the time, with what the sum's rounding leaves over."""
        code = self.code
        high, low = (code.load(x) for x in self.time)
        total = code.binary("fadd", high, h)
        part = self._minus(total, high)
        lost = code.binary(
            "fadd", self._minus(high, self._minus(total, part)), self._minus(h, part)
        )
        code.store(total, self.time[0])
        code.store(code.binary("fadd", low, lost), self.time[1])
