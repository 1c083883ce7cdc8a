"""A Taylor step of a field, in the language of LLVM, for a vector of lanes.

A traced field becomes recurrences of Taylor coefficients, for any order and kind of numbers.
With a_k the coefficients of an operand, b_k those of the other and c_k those of the result,

    c = a b         c_k = sum a_j b_(k-j)
    c = a / b       c_k = (a_k - sum' b_j c_(k-j)) / b_0,

where j goes from 0 to k, and from 1 in sum'. The terms between 1 and k - 1 wait for nothing of the
order k: those of all sums share a loop. All sums of the aligned field are products of what no other
sum leads to: numbers longer than doubles, which follow it alone, share one from 0 to k.

A step's length follows Jorba and Zou, Experimental Mathematics 14 (2005), sec. 3.2, as in heyoka.
Lanes never meet: an orbit comes out the same to the last bit whatever its neighbours. It does on
every processor too, for each sum and product is spelled out.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from fractions import Fraction
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rigidpend.numbers.generic import Array
from rigidpend.orbits.integrate.kernel.lane_numbers import KINDS, Value, as_doubles
from rigidpend.orbits.integrate.kernel.machine_code import LANES, Writer, hexadecimal
from rigidpend.orbits.integrate.kernel.tape import TracedField

LONGEST = 32.0
"""Longest step, t'; only an orbit that stands still comes to it."""
FEW_BITS = -(1 << 32)
"""The sign, the exponent and the first 20 bits of a double."""
LOGARITHM = (-1025.4983531488, 4.0292113911, -2.0783351683, 0.6260321822, -0.0784406762)
"""log2 x - 1023 on [1, 2) within 1.2e-4, from its values at Chebyshev's points."""
POWER = (0.9999002882, 0.6963247711, 0.2246931558, 0.0789672570)
"""2^x on [0, 1) within 1e-4, likewise."""
ZERO = "zeroinitializer"
ROOM = 32
"""Orders from a multiple of this up to the next one share a kernel."""
BITS, SPARE = 53, 12
"""Bits of a part, and those that a coefficient has more than its size on a step asks for.

With 8 and with 24 crossing times in pairs err alike, on orbits of three bodies."""


def order_of(tolerance: float) -> int:
    """Order of the series that is best for a local tolerance (Jorba and Zou, eq. 3.8)."""
    return max(4, math.ceil(1 - math.log(tolerance) / 2))


class Room(NamedTuple):
    """Sizes that a kernel has room for, of which one serves several orders."""

    coefficients: int
    """Coefficients of each series."""
    parts: int
    """Parts of the rates of the lowest orders."""


def room_for(order: int, bits: int) -> Room:
    """The least room that a kernel for series of an order has."""
    return Room(-(-(order + 1) // ROOM) * ROOM + 1, len(orders_by_parts(order, KINDS[bits].parts)))


def of_order(order: int, bits: int) -> tuple[int, NDArray[np.int64], Array]:
    """The arguments `%order`, `%bounds` and `%shares` of a kernel, which its text leaves open.

    The bounds are `orders_by_parts`; the shares are 1/k in parts, `coefficients` doubles apart.
    """
    parts = KINDS[bits].parts
    shares = np.zeros((parts, room_for(order, bits).coefficients))
    for k in range(1, order + 1):
        shares[:, k] = as_doubles(Fraction(1, k), parts)
    return order, np.array(orders_by_parts(order, parts), dtype=np.int64), shares


class Kernel:
    """Parts of a function that takes Taylor steps; what is done with each is up to the heirs.

    The order of the series is an argument: only the room for them is in the text.
    """

    HEAD = "i64 %order, ptr noalias %bounds, ptr noalias %shares"
    """The arguments of `of_order`."""

    def __init__(self, room: Room, bits: int, field: TracedField, lanes: int = LANES) -> None:
        self.room, self.code = room, Writer(lanes)
        self.field, self.size = field, len(field.rates)
        self.numbers = KINDS[bits](self.code)
        self.parts = self.numbers.parts
        self.series = self.code.variable(self.series_rows(self.size))
        self.component = [self.place_of(i) for i in range(self.size)]
        """Places of the components' series."""
        self.one, self.before = self.code.number(1.0), self.code.add("%order", -1)
        self.shrink = self._shrink()
        self.expand = Recurrences(field, self).expand
        """Finds the series about the lanes' states."""

    def series_rows(self, count: int = 1) -> str:
        """Kind of memory for so many series."""
        return self.numbers.rows(count * self.room.coefficients * self.parts)

    def place_of(self, component: str | int) -> str:
        """The place of a component's series."""
        return self.code.at(self.series, component, self.series_rows())

    def scalar(self, base: str, index: str | int, apart: int) -> Value:
        """A number in each lane, from its parts in an array."""
        code = self.code
        parts = [code.scalar(base, code.add(str(index), i * apart)) for i in range(self.parts)]
        return tuple(code.everywhere(x) for x in parts)

    @contextmanager
    def lanes_from(self, first: str) -> Iterator[None]:
        """Lines that carry on a vector of lanes, whose states and times are taken and put back."""
        code = self.code
        rows = [
            [self._place("%state", i + self.size * part, first) for part in range(self.parts)]
            for i in range(self.size)
        ]
        times = [self._place("%time", i, first) for i in range(2)]
        self.time = [code.variable(code.vector) for _ in times]
        for series, row in zip(self.component, rows, strict=True):
            self.numbers.store(tuple(code.load(x, align=8) for x in row), series, 0)
        for variable, place in zip(self.time, times, strict=True):
            code.store(code.load(place, align=8), variable)
        yield
        for series, row in zip(self.component, rows, strict=True):
            for part, place in zip(self.numbers.load(series, 0), row, strict=True):
                code.store(part, place, align=8)
        for variable, place in zip(self.time, times, strict=True):
            code.store(code.load(variable), place, align=8)

    def _place(self, base: str, row: int, first: str) -> str:
        """The place of a group of lanes in a row of an array."""
        return self.code.at(base, self.code.add(self.code.mul("%stride", row), first), "double")

    def go_on(self, h: str, ends: list[Value]) -> None:
        """Step to the ends of the series."""
        for series, end in zip(self.component, ends, strict=True):
            self.numbers.store(end, series, 0)
        # The time has what the sum's rounding leaves over.
        high, low = (self.code.load(x) for x in self.time)
        total, lost = self.numbers.sum_and_error(high, h)
        self.code.store(total, self.time[0])
        self.code.store(self.code.binary("fadd", low, lost), self.time[1])

    def any_lane(self, mask: str) -> tuple[str, str]:
        """The bits of a mask as a whole number, and whether one of them is set."""
        code, kind = self.code, f"i{self.code.lanes}"
        bits = code(f"bitcast {code.mask} {mask} to {kind}")
        return bits, code(f"icmp ne {kind} {bits}, 0")

    @contextmanager
    def each_lane(self, bits: str) -> Iterator[str]:
        """Lines for the number of each lane whose bit is set."""
        code, kind = self.code, f"i{self.code.lanes}"
        with code.loop(code.lanes) as lane:
            bit = code(f"lshr {kind} {bits}, {code(f'trunc i64 {lane} to {kind}')}")
            with code.when(code(f"trunc {kind} {bit} to i1")):
                yield lane

    def head(self, component: int, k: str | int) -> str:
        """The first part of a coefficient: as a double."""
        rows = self.numbers.rows(self.parts)
        return self.code.load(self.code.at(self.component[component], k, rows))

    def _times(self, a: str, b: str) -> str:
        return self.code.binary("fmul", a, b)

    def _minus(self, a: str, b: str) -> str:
        return self.code.binary("fsub", a, b)

    def length(self) -> str:
        """Length of the step: the last two coefficients tell the radius of convergence."""
        code = self.code
        size = self._binary_logarithm(code.larger(self._norm(0), self.one))
        exponents = [
            self._times(
                self._minus(size, self._binary_logarithm(self._norm(m))),
                code.everywhere(code.scalar("%shares", m)),
            )
            for m in (self.before, "%order")
        ]
        exponent = code.binary("fadd", code.smaller(*exponents), self.shrink)
        length = self._power_of_two(code.smaller(exponent, code.number(math.log2(LONGEST))))
        if self.parts <= 2:
            return length
        # Two doubles then hold every sum of steps, which is the time, without rounding.
        return code.of_bits(code.with_each("and", code.bits(length), FEW_BITS))

    def _shrink(self) -> str:
        """Share of the radius of convergence that a step takes, as a binary logarithm."""
        code = self.code
        share = code(
            f"fdiv double {hexadecimal(-0.7)}, {code(f'sitofp i64 {self.before} to double')}"
        )
        exponent = code(f"fsub double {share}, {hexadecimal(2.0)}")
        return code.everywhere(code(f"fdiv double {exponent}, {hexadecimal(math.log(2))}"))

    def _norm(self, m: str | int) -> str:
        """Largest coefficient of an order."""
        sizes = [self.code.size(self.head(i, m)) for i in range(self.size)]
        return functools.reduce(lambda norm, size: self.code.larger(size, norm), sizes)

    def _binary_logarithm(self, x: str) -> str:
        """log2 x from the exponent and a polynomial of the rest: good enough for a length."""
        code = self.code
        bits = code.bits(x)
        rest = code.with_each("or", code.with_each("and", bits, (1 << 52) - 1), 1023 << 52)
        rest = code.of_bits(rest)
        exponent = code.with_each("lshr", bits, 52)
        exponent = code(f"uitofp {code.whole} {exponent} to {code.vector}")
        return code.binary("fadd", exponent, self._polynomial(LOGARITHM, rest))

    def _power_of_two(self, x: str) -> str:
        """2^x from the whole part as an exponent and a polynomial of the rest."""
        code = self.code
        whole = code(f"call {code.vector} @llvm.floor.{code.suffix}({code.vector} {x})")
        rest = self._polynomial(POWER, self._minus(x, whole))
        bits = code(f"fptosi {code.vector} {whole} to {code.whole}")
        bits = code.with_each("shl", code.with_each("add", bits, 1023), 52)
        return self._times(rest, code.of_bits(bits))

    def _polynomial(self, coefficients: Sequence[float], x: str) -> str:
        total = self.code.number(coefficients[-1])
        for c in coefficients[-2::-1]:
            total = self.code.fma(total, x, self.code.number(c))
        return total

    def at(self, h: str, components: int) -> list[Value]:
        """Series of the first components at a time from the beginning of the step."""
        return self._summed(components, lambda total, c: self.numbers.horner(total, h, c))

    def at_number(self, x: Value) -> list[Value]:
        """All series at a time with all the parts of a number."""
        return self._summed(self.size, lambda total, c: self.numbers.horner_at(total, x, c))

    def _summed(self, components: int, further: Callable[[Value, Value], Value]) -> list[Value]:
        """Series summed by Horner's rule: side by side, of longer numbers one after the other."""
        code, n = self.code, self.numbers
        totals = code.variable(n.rows(components * self.parts))
        if self.parts <= 2:
            self._sum(range(components), totals, further)
        else:
            # Their lines would take long to compile for each component.
            with code.loop(components) as i:
                self._sum([i], totals, further)
        return [n.load(totals, i) for i in range(components)]

    def _sum(
        self,
        components: Sequence[str | int],
        totals: str,
        further: Callable[[Value, Value], Value],
    ) -> None:
        """Sum the series of some components side by side, and write the sums where they belong."""
        n, places = self.numbers, [self.place_of(i) for i in components]
        kept = [self.code.variable(n.rows(self.parts)) for _ in components]
        for place, total in zip(places, kept, strict=True):
            n.store(n.load(place, "%order"), total, 0)
        with self.descending() as k:
            for place, total in zip(places, kept, strict=True):
                n.store(further(n.load(total, 0), n.load(place, k)), total, 0)
        for i, total in zip(components, kept, strict=True):
            n.store(n.load(total, 0), totals, i)

    @contextmanager
    def descending(self, last: int = 0) -> Iterator[str]:
        """Lines that are repeated for each order below the highest, down to the last."""
        with self.code.loop(self.code.add("%order", -last)) as done:
            yield self.code(f"sub i64 {self.before}, {done}")


class Recurrences:
    """Lines that find the series of a traced field."""

    def __init__(self, field: TracedField, kernel: Kernel) -> None:
        self.field, self.kernel, self.code = field, kernel, kernel.code
        self.numbers, self.zero = kernel.numbers, kernel.numbers.of_double(ZERO)
        self.sums, size = field.sums, kernel.series_rows()
        # Doubles are quicker with the ends of the sums apart; of longer numbers their lines would
        # take long to compile.
        self.early = early_lines(field) if kernel.parts > 1 else ()
        self.series: dict[int, str] = {}
        for i in self.sums:
            operation, operands = field.lines[i]
            for operand in operands if operation == "times" else (i, *operands):
                self._keep(operand, size)
        count = 1 + max((x.operands[0] for x in field.lines if x.name == "parameter"), default=0)
        self.parameter = {
            line.operands[0]: kernel.scalar("%parameters", line.operands[0], count)
            for line in field.lines
            if line.name == "parameter"
        }

    def expand(self) -> None:
        """Find all coefficients from those of order 0."""
        values: dict[int, Value] = {}
        for i, line in enumerate(self.field.lines):
            if line.name == "parameter":
                values[i] = self.parameter[line.operands[0]]
            elif not self.early:
                values[i] = self._linear(i, "0", values, values)
                self._put(i, values[i], "0")
        if not self.early:
            self._integrate(values, "0")
        first = "0" if self.early else "1"
        for i, parts in enumerate(range(self.kernel.room.parts, 0, -1)):
            self.numbers = KINDS[BITS * parts](self.code, self.kernel.parts)
            last = self.code.scalar("%bounds", i, "i64")
            with self.code.loop(last, first) as k:
                self._coefficients(k, values)
            first = last
        self.numbers = self.kernel.numbers

    def _coefficients(self, k: str, values: dict[int, Value]) -> None:
        """Coefficients of order k of all lines, and of order k + 1 of the components."""
        found: dict[int, Value] = {}
        for i in self.early:
            found[i] = self._linear(i, k, found, values)
            self._put(i, found[i], k)
        sums = self._sums(k)
        for i, line in enumerate(self.field.lines):
            if line.name == "parameter" or i in self.early:
                continue
            if i in sums:
                found[i] = self._finished(i, sums[i], found, values)
            else:
                found[i] = self._linear(i, k, found, values)
            self._put(i, found[i], k)
        self._integrate(found, k)

    def _keep(self, i: int, size: str) -> None:
        """Make room for the series of an operand; a component has its own."""
        operation, operands = self.field.lines[i]
        if operation == "component":
            self.series[i] = self.kernel.component[operands[0]]
        elif operation != "parameter":
            self.series.setdefault(i, self.code.variable(size))

    def _put(self, i: int, value: Value, k: str) -> None:
        """Store a coefficient where sums will look for it."""
        if i in self.series and self.field.lines[i].name != "component":
            self.numbers.store(value, self.series[i], k)

    def _integrate(self, found: dict[int, Value], k: str) -> None:
        """Coefficients of order k + 1 of the components, those of a fixed rate zero from k = 1."""
        n, kernel, following = self.numbers, self.kernel, self.code.add(k, 1)
        share = kernel.scalar("%shares", following, kernel.room.coefficients)
        whole = self.code.everywhere(self.code(f"sitofp i64 {following} to double"))
        for series, i in zip(kernel.component, self.field.rates, strict=True):
            n.store(n.divided(found.get(i, self.zero), share, whole), series, following)

    def _linear(self, i: int, k: str, found: dict[int, Value], values: dict[int, Value]) -> Value:
        """A line's coefficient from those of the same order of its operands: all of order 0."""
        operation, operands = self.field.lines[i]
        if operation == "component":
            return self.numbers.load(self.kernel.component[operands[0]], k)
        if operation in ("times", "divided"):
            # The factor that is no series is a number; a sum has none of it from k = 1 on.
            return self._combined(operation, *({**values, **found}[j] for j in operands))
        return self._combined(operation, *(found.get(j, self.zero) for j in operands))

    def _sums(self, k: str) -> dict[int, Value]:
        """The terms of all sums for j from 1 to k - 1, or from 0 to k."""
        code, n = self.code, self.numbers
        own = type(n)(code)
        places = {i: code.variable(own.rows(own.parts)) for i in self.sums}
        for place in places.values():
            own.store(own.of_double(ZERO), place, 0)
        whole = (code.add(k, 1), 0) if self.early else (k, 1)
        with code.loop(*whole) as j:
            other = code(f"sub i64 {k}, {j}")
            loaded: dict[tuple[str, str], Value] = {}
            for i, place in places.items():
                for at in zip(self._factors(i), (j, other), strict=True):
                    if at not in loaded:
                        loaded[at] = n.load(*at)
                a, b = (loaded[at] for at in zip(self._factors(i), (j, other), strict=True))
                own.store(own.with_product(own.load(place, 0), a, b), place, 0)
        return {i: own.load(place, 0) for i, place in places.items()}

    def _factors(self, i: int) -> tuple[str, str]:
        """The series that a line's sum multiplies."""
        operation, operands = self.field.lines[i]
        a, b = operands if operation == "times" else (operands[1], i)
        return self.series[a], self.series[b]

    def _finished(
        self, i: int, total: Value, found: dict[int, Value], values: dict[int, Value]
    ) -> Value:
        """A line's coefficient from its sum, whose terms with j = k are still to come."""
        n, (operation, (a, b)) = self.numbers, self.field.lines[i]
        if self.early:
            return n.settled(total)
        if operation == "times":
            total = n.with_product(n.with_product(total, found[a], values[b]), values[a], found[b])
            return n.settled(total)
        total = n.settled(n.with_product(total, found[b], values[i]))
        return n.quotient(n.minus(found.get(a, self.zero), total), values[b])

    def _combined(self, operation: str, a: Value, b: Value) -> Value:
        n = self.numbers
        made = {"plus": n.plus, "minus": n.minus, "times": n.times, "divided": n.quotient}
        return made[operation](a, b)


def early_lines(field: TracedField) -> tuple[int, ...]:
    """Lines that no sum leads to, but for parameters."""
    late, early = set(field.sums), []
    for i, (operation, operands) in enumerate(field.lines):
        if operation not in ("component", "parameter") and late.intersection(operands):
            late.add(i)
        elif i not in late and operation != "parameter":
            early.append(i)
    return tuple(early)


def orders_by_parts(order: int, parts: int) -> list[int]:
    """First orders whose coefficients of rates need fewer doubles, from the most of them to one.

    On a step of the radius of convergence over e^2 each order is e^2 times smaller than the one
    before, down to the tolerance, and so are its digits that count.
    """
    needed = [(BITS * fewer - SPARE) * math.log(2) / 2 for fewer in range(parts - 1, 0, -1)]
    return [*(order - math.ceil(orders) for orders in needed if orders <= order - 1), order]
