"""A Taylor step of the aligned field, in the language of LLVM, for a vector of lanes.

It is `rigidpend.equations.aligned` as recurrences of Taylor coefficients (products become sums
over j of a_j b_(k-j)), written once for any order and either kind of numbers. A step's length
follows Jorba and Zou, Experimental Mathematics 14 (2005), sec. 3.2, as in heyoka. Lanes never
meet: an orbit comes out the same to the last bit whatever its neighbours, and on every
processor, for each sum and product is spelled out and nothing is left to a mathematical library.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from fractions import Fraction
from typing import Any, NamedTuple

from rigidpend.equations import AlignedCoefficients
from rigidpend.integrate.kernel.lane_numbers import KINDS, Value
from rigidpend.integrate.kernel.writer import Writer

LONGEST = 32.0
"""Longest step, t'; only an orbit that stands still comes to it."""
LOGARITHM = (-1025.4983531488, 4.0292113911, -2.0783351683, 0.6260321822, -0.0784406762)
"""log2 x - 1023 on [1, 2) within 1.2e-4, from its values at Chebyshev's points."""
POWER = (0.9999002882, 0.6963247711, 0.2246931558, 0.0789672570)
"""2^x on [0, 1) within 1e-4, likewise."""
COMPONENTS = ("Qp", "Qm", "M3", "gamma1", "gamma2", "gamma3")


class Products(NamedTuple):
    """The parameters of the recurrences, whose products are with omega rather than with Q and M."""

    half_sigma: Any
    """Divided by kappa, for the product with omega3 = kappa M3."""
    force_p: Any
    force_m: Any
    twist: Any
    """Divided by omega1 omega2."""
    mu_r1: Any
    mu_r2: Any
    omega1: Any
    omega2: Any
    kappa: Any

    @staticmethod
    def of(c: AlignedCoefficients) -> Products:
        """The parameters of a body."""
        values = c._asdict()
        values["half_sigma"] = c.half_sigma / c.kappa
        values["twist"] = c.twist / (c.omega1 * c.omega2)
        return Products(**values)


def order_of(tolerance: float) -> int:
    """Order of the series that is best for a local tolerance (Jorba and Zou, eq. 3.8)."""
    return max(4, math.ceil(1 - math.log(tolerance) / 2))


class Kernel:
    """Parts of a function that takes Taylor steps; what is done with each is up to the heirs."""

    def __init__(self, order: int, bits: int) -> None:
        self.order, self.code = order, Writer()
        self.numbers = KINDS[bits](self.code)
        self.parts, rows = self.numbers.parts, (order + 1) * self.numbers.parts
        self.series = self.code.variable(self.numbers.rows(len(COMPONENTS) * rows))
        self.component: dict[str, str] = {}
        self.turning = [self.code.variable(self.numbers.rows(rows)) for _ in range(3)]

    def function(self, head: str, result: str) -> str:
        """The whole text of a function of which the lines have been written."""
        code, v = self.code, self.code.vector
        declared = (
            f"declare {v} @llvm.fma.{code.suffix}({v}, {v}, {v})",
            f"declare {v} @llvm.fabs.{code.suffix}({v})",
            f"declare {v} @llvm.floor.{code.suffix}({v})",
        )
        body = [*declared, head, "entry:", *code.variables, *code.lines]
        return "\n".join([*body, f"  ret i64 {result}", "}"]) + "\n"

    def begin(self) -> None:
        """Set up the constants of all steps: places of the series, parameters, and 1/k."""
        code, count = self.code, len(Products._fields)
        for i, name in enumerate(COMPONENTS):
            self.component[name] = code.at(self.series, i * (self.order + 1) * self.parts)
        self.c = Products(*(self._scalar("%parameters", i, count) for i in range(count)))
        self.one = code.number(1.0)
        self.shares = code.variable(f"[{self.parts * (self.order + 1)} x double]")
        for k in range(1, self.order + 1):
            for i, part in enumerate(self.numbers.constant(Fraction(1, k))):
                place = code.at(self.shares, i * (self.order + 1) + k, "double")
                code.store(part, place, "double", 8)

    def _scalar(self, base: str, index: str | int, apart: int) -> Value:
        """A number in each lane, from its parts in an array."""
        code, places = self.code, []
        for i in range(self.parts):
            at = code(f"add i64 {index}, {i * apart}")
            places.append(code.load(code.at(base, at, "double"), "double", 8))
        return tuple(code.everywhere(x) for x in places)

    def places(self, first: str) -> list[list[str]]:
        """Places of a vector of lanes, from lane `first` on: the components', then the time's."""
        state = [
            [self._place("%state", i + 6 * part, first) for part in range(self.parts)]
            for i in range(len(COMPONENTS))
        ]
        return [*state, [self._place("%time", i, first) for i in range(2)]]

    def load_lanes(self, places: list[list[str]]) -> None:
        """Take the lanes' states and times into the kernel."""
        code = self.code
        *rows, times = places
        self.time = [code.variable(code.vector) for _ in times]
        for name, row in zip(COMPONENTS, rows, strict=True):
            value = tuple(code.load(x, align=8) for x in row)
            self.numbers.store(value, self.component[name], 0)
        for variable, place in zip(self.time, times, strict=True):
            code.store(code.load(place, align=8), variable)

    def store_lanes(self, places: list[list[str]]) -> None:
        """Put them back, carried on."""
        code = self.code
        *rows, times = places
        for name, row in zip(COMPONENTS, rows, strict=True):
            value = self.numbers.load(self.component[name], 0)
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
        with self.code.loop(self.order) as k:
            self._next_coefficients(k)

    def go_on(self, h: str, ends: list[Value]) -> None:
        """Step to the ends of the series."""
        for name, end in zip(COMPONENTS, ends, strict=True):
            self.numbers.store(end, self.component[name], 0)
        self._let_time_pass(h)

    def _next_coefficients(self, k: str) -> None:
        """Coefficients of order k + 1 from those up to k: ``aligned``, term by term."""
        n, c = self.numbers, self.c
        Qp, Qm, M3 = (n.load(self.component[x], k) for x in COMPONENTS[:3])
        omega = (
            n.times(c.omega1, n.plus(Qp, Qm)),
            n.times(c.omega2, n.minus(Qp, Qm)),
            n.times(c.kappa, M3),
        )
        for place, value in zip(self.turning, omega, strict=True):
            n.store(value, place, k)
        total = self._products(k)
        gamma1, gamma2, gamma3 = (n.load(self.component[x], k) for x in COMPONENTS[3:])
        weight = n.minus(n.times(c.mu_r2, gamma1), n.times(c.mu_r1, gamma2))
        rates = (
            n.minus(n.times(c.force_p, gamma3), n.times(c.half_sigma, total["3p"])),
            n.minus(n.times(c.half_sigma, total["3m"]), n.times(c.force_m, gamma3)),
            n.plus(n.times(c.twist, total["12"]), weight),
            n.minus(total["3b"], total["2c"]),
            n.minus(total["1c"], total["3a"]),
            n.minus(total["2a"], total["1b"]),
        )
        following = self.code(f"add i64 {k}, 1")
        share = self._scalar(self.shares, following, self.order + 1)
        whole = self.code.everywhere(self.code(f"sitofp i64 {following} to double"))
        for name, rate in zip(COMPONENTS, rates, strict=True):
            n.store(n.divided(rate, share, whole), self.component[name], following)

    def _products(self, k: str) -> dict[str, Value]:
        """Coefficients of order k of nine products: of omega_i with Qp, Qm, gamma (a, b, c)."""
        code, n = self.code, self.numbers
        pairs = ("3p", "3m", "12", "3b", "2c", "1c", "3a", "2a", "1b")
        sums = {pair: code.variable(n.rows(self.parts)) for pair in pairs}
        for place in sums.values():
            n.store(("zeroinitializer",) * self.parts, place, 0)
        with code.loop(code(f"add i64 {k}, 1")) as j:
            other = code(f"sub i64 {k}, {j}")
            left = {i: n.load(x, j) for i, x in zip("123", self.turning, strict=True)}
            names = zip("pmabc", (x for x in COMPONENTS if x != "M3"), strict=True)
            right = {letter: n.load(self.component[x], other) for letter, x in names}
            right["2"] = n.load(self.turning[1], other)
            for pair, place in sums.items():
                n.store(n.with_product(n.load(place, 0), left[pair[0]], right[pair[1]]), place, 0)
        return {pair: n.settled(n.load(place, 0)) for pair, place in sums.items()}

    def head(self, name: str, k: int) -> str:
        """The first part of a coefficient: as a double."""
        return self.code.element(self.component[name], k * self.parts)

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
        return self._power_of_two(code.smaller(exponent, code.number(math.log2(LONGEST))))

    def _norm(self, m: int) -> str:
        """Largest coefficient of an order."""
        code = self.code
        norm, *sizes = [code.size(self.head(x, m)) for x in COMPONENTS]
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

    def at(self, name: str, h: str) -> Value:
        """A component's series at a time from the beginning of the step, by Horner's rule."""
        n, place = self.numbers, self.component[name]
        total = n.load(place, self.order)
        for k in range(self.order - 1, -1, -1):
            total = n.horner(total, h, n.load(place, k))
        return total

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
