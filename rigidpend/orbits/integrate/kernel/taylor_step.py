"""A Taylor step of a field, written in LLVM's language for a vector of lanes.

A traced field becomes recurrences of Taylor coefficients, for any order and kind of numbers.
With a_k and b_k the coefficients of the operands and c_k those of the result,

    c = a b         c_k = sum a_j b_(k-j)
    c = a / b       c_k = (a_k - sum' b_j c_(k-j)) / b_0,

where j goes from 0 to k, in sum' from 1 to k. The terms with j from 1 to k - 1 need no coefficient
of order k, so one loop adds up those terms of all sums.

The length of a step follows Jorba and Zou, Experimental Mathematics 14 (2005), sec. 3.2, as in
heyoka. Lanes never interact: an orbit is the same to the last bit whatever its neighbours are. It
is also the same on every processor, because the text states each sum, product and fused product.
"""

import functools
import math
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from fractions import Fraction
from typing import NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from rigidpend.numbers import Array
from rigidpend.orbits.integrate.kernel.lane_numbers import KINDS, Doubles, Value, as_doubles
from rigidpend.orbits.integrate.kernel.machine_code import LANES, Writer, hexadecimal
from rigidpend.orbits.integrate.kernel.tape import TracedField

LONGEST = 32.0
"""Longest step, t'; only an orbit at rest takes it."""
FEW_BITS = -(1 << 32)
"""Mask that keeps the sign, the exponent and the first 20 bits of the fraction of a double."""
LOGARITHM = (-1025.4983531488, 4.0292113911, -2.0783351683, 0.6260321822, -0.0784406762)
"""Polynomial for log2 x - 1023 on [1, 2), within 1.2e-4, interpolated at Chebyshev points."""
POWER = (0.9999002882, 0.6963247711, 0.2246931558, 0.0789672570)
"""Polynomial for 2^x on [0, 1), within 1e-4 of its value, interpolated likewise."""
ZERO = "zeroinitializer"
ROOM = 32
"""Orders from a multiple of this number up to the next multiple share a kernel."""
BITS, SPARE = 53, 12
"""Bits of a part, and bits that a coefficient has beyond those that its size on a step asks for.

With 8 and with 24 spare bits crossing times in pairs err alike, on orbits of three bodies."""


def order_of(tolerance: float) -> int:
    """Order of the series that is cheapest for a local tolerance (Jorba and Zou, eq. 3.8)."""
    # Steps are the radius of convergence over e^2, so an order gains two nats.
    return max(4, math.ceil(1 - math.log(tolerance) / 2))


Further: TypeAlias = Callable[[Doubles, Value, Value], Value]
"""A step of Horner's rule, ``further(n, total, c)``, in numbers of a kind."""


class Room(NamedTuple):
    """Sizes for which a kernel is written; one kernel serves several orders."""

    coefficients: int
    """Number of coefficients of each series."""
    parts: int
    """Number of doubles that the rates of the lowest orders need."""


def room_for(order: int, bits: int) -> Room:
    """Room of the kernel that serves series of an order."""
    return Room(-(-(order + 1) // ROOM) * ROOM + 1, len(orders_by_parts(order, KINDS[bits].parts)))


def of_order(order: int, bits: int) -> tuple[int, NDArray[np.int64], Array]:
    """Arguments `%order`, `%bounds` and `%shares` of a kernel, which depend on the order.

    The bounds are `orders_by_parts`. The shares are the numbers 1/k, (parts, `coefficients`).
    """
    parts = KINDS[bits].parts
    shares = np.zeros((parts, room_for(order, bits).coefficients))
    for k in range(1, order + 1):
        shares[:, k] = as_doubles(Fraction(1, k), parts)
    return order, np.array(orders_by_parts(order, parts), dtype=np.int64), shares


class Kernel:
    """Building blocks of a compiled function that takes Taylor steps.

    Subclasses say what is done with each step. The order of the series is an argument of the
    function; its text fixes only the room for the coefficients.
    """

    HEAD = "i64 %order, ptr noalias %bounds, ptr noalias %shares"
    """The arguments that :func:`of_order` gives."""

    def __init__(self, room: Room, bits: int, field: TracedField, lanes: int = LANES) -> None:
        self.room, self.code = room, Writer(lanes)
        self.field, self.size = field, len(field.rates)
        self.numbers = KINDS[bits](self.code)
        self.parts = self.numbers.parts
        self.series = self.code.variable(self.series_rows(self.size))
        self.component = [self.place_of(i) for i in range(self.size)]
        """Addresses of the components' series."""
        self.one, self.before = self.code.number(1.0), self.code.add("%order", -1)
        self.shrink = self._shrink()
        self.expand = Recurrences(field, self).expand
        """Writes the lines that find the series about the lanes' states."""

    def series_rows(self, count: int = 1) -> str:
        """LLVM type of an array of `count` series."""
        return self.numbers.rows(count * self.room.coefficients * self.parts)

    def place_of(self, component: str | int) -> str:
        """Address of a component's series."""
        return self.code.at(self.series, component, self.series_rows())

    def scalar(self, base: str, index: str | int, apart: int) -> Value:
        """The same number in each lane, its parts read `apart` doubles from one another."""
        code = self.code
        parts = [code.scalar(base, code.add(str(index), i * apart)) for i in range(self.parts)]
        return tuple(code.everywhere(x) for x in parts)

    @contextmanager
    def lanes_from(self, first: str) -> Iterator[None]:
        """Lines that work on a vector of lanes: states and times are read before, written after."""
        code = self.code
        # Row i + size * part of %state holds that part of component i, and lane `first` is its
        # first column here. Callers' rows start anywhere, so the loads are aligned to 8 bytes.
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
        """Address of a group of lanes in a row of an array."""
        return self.code.at(base, self.code.add(self.code.mul("%stride", row), first), "double")

    def go_on(self, h: str, ends: list[Value]) -> None:
        """Make the ends of the series the state, and add the length h to the time."""
        for series, end in zip(self.component, ends, strict=True):
            self.numbers.store(end, series, 0)
        # Compensated sum: the second double of the time collects the rounding errors of the first,
        # which would grow with the number of steps.
        high, low = (self.code.load(x) for x in self.time)
        total, lost = self.numbers.sum_and_error(high, h)
        self.code.store(total, self.time[0])
        self.code.store(self.code.binary("fadd", low, lost), self.time[1])

    def any_lane(self, mask: str) -> tuple[str, str]:
        """A mask as an integer with a bit for each lane, and a flag that is set if any bit is."""
        code, kind = self.code, f"i{self.code.lanes}"
        bits = code(f"bitcast {code.mask} {mask} to {kind}")
        return bits, code(f"icmp ne {kind} {bits}, 0")

    @contextmanager
    def each_lane(self, bits: str) -> Iterator[str]:
        """Lines that run for each lane whose bit is set, one lane after the other."""
        code, kind = self.code, f"i{self.code.lanes}"
        with code.loop(code.lanes) as lane:
            bit = code(f"lshr {kind} {bits}, {code(f'trunc i64 {lane} to {kind}')}")
            with code.when(code(f"trunc {kind} {bit} to i1")):
                yield lane

    def head(self, component: int, k: str | int) -> str:
        """The first part of a coefficient, which is the coefficient as a double."""
        rows = self.numbers.rows(self.parts)
        return self.code.load(self.code.at(self.component[component], k, rows))

    def _times(self, a: str, b: str) -> str:
        return self.code.binary("fmul", a, b)

    def _minus(self, a: str, b: str) -> str:
        return self.code.binary("fsub", a, b)

    def length(self) -> str:
        """Length of the step, positive, from the last two coefficients.

        With n_m the largest coefficient of order m, the radius of convergence is estimated by the
        smaller of (max(n_0, 1)/n_m)^(1/m) at the last two orders m.
        """
        code = self.code
        # The tolerance is relative to the state where that is above 1, else absolute. Two orders
        # are asked, for in a series of even or odd terms one of them vanishes.
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
        # With so few bits two doubles hold every sum of steps, which is the time, exactly.
        return code.of_bits(code.with_each("and", code.bits(length), FEW_BITS))

    def _shrink(self) -> str:
        """Binary logarithm of a step's share of the radius of convergence."""
        code = self.code
        # The share is exp(-2 - 0.7/(order - 1)), with the safety factor of Jorba and Zou.
        share = code(
            f"fdiv double {hexadecimal(-0.7)}, {code(f'sitofp i64 {self.before} to double')}"
        )
        exponent = code(f"fsub double {share}, {hexadecimal(2.0)}")
        return code.everywhere(code(f"fdiv double {exponent}, {hexadecimal(math.log(2))}"))

    def _norm(self, m: str | int) -> str:
        """Largest size of the components' coefficients of an order."""
        sizes = [self.code.size(self.head(i, m)) for i in range(self.size)]
        return functools.reduce(lambda norm, size: self.code.larger(size, norm), sizes)

    def _binary_logarithm(self, x: str) -> str:
        """log2 x of a double x >= 0 within 1.2e-4, which suffices for a step's length."""
        code = self.code
        bits = code.bits(x)
        # x is 2^(exponent - 1023) times a rest in [1, 2), whose own exponent field is 1023. A
        # coefficient that vanishes counts as 2^-1023, and so asks for no shorter step.
        rest = code.with_each("or", code.with_each("and", bits, (1 << 52) - 1), 1023 << 52)
        rest = code.of_bits(rest)
        exponent = code.with_each("lshr", bits, 52)
        exponent = code(f"uitofp {code.whole} {exponent} to {code.vector}")
        return code.binary("fadd", exponent, self._polynomial(LOGARITHM, rest))

    def _power_of_two(self, x: str) -> str:
        """2^x within 1e-4 of its value, from the exponent of the integer part of x."""
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
        """Values of the first components at a time h, a double, after the beginning of the step."""
        return self._summed(components, lambda n, total, c: n.horner(total, h, c))

    def at_number(self, x: Value) -> list[Value]:
        """Values of all components at a time x that has all parts of a number."""
        return self._summed(self.size, lambda n, total, c: n.horner_at(total, x, c))

    def _summed(self, components: int, further: Further) -> list[Value]:
        """Series summed by Horner's rule, where `further` takes in one coefficient."""
        code, n = self.code, self.numbers
        totals = code.variable(n.rows(components * self.parts))
        if self.parts <= 2:
            # Each Horner step waits for the one before; side by side the components fill the gaps.
            self._sum(range(components), totals, further)
        else:
            # One copy of the lines in a loop: six copies would take long to compile.
            with code.loop(components) as i:
                self._sum([i], totals, further)
        return [n.load(totals, i) for i in range(components)]

    def _sum(self, components: Sequence[str | int], totals: str, further: Further) -> None:
        """Sum the series of some components side by side into `totals`, a number each."""
        code, places = self.code, [self.place_of(i) for i in components]
        kept = [code.variable(self.numbers.rows(self.parts)) for _ in components]
        for place, total in zip(places, kept, strict=True):
            self.numbers.store(self.numbers.load(place, "%order"), total, 0)
        # Partial sums need no more parts than the coefficients that they begin with.
        last = self.before
        for n, first in reversed(self.by_parts()):
            with code.loop(code.add(code(f"sub i64 {last}, {first}"), 1)) as done:
                k = code(f"sub i64 {last}, {done}")
                for place, total in zip(places, kept, strict=True):
                    n.store(further(n, n.load(total, 0), n.load(place, k)), total, 0)
            last = code.add(first, -1)
        for i, total in zip(components, kept, strict=True):
            self.numbers.store(self.numbers.load(total, 0), totals, i)

    def by_parts(self) -> list[tuple[Doubles, str]]:
        """Kinds of numbers of the components' coefficients, and the first order of each.

        Higher orders are smaller on the step and need fewer bits: they have ever fewer parts, down
        to one double. Numbers keep their places in memory, with zeros for the parts that they lack.
        """
        code, found = self.code, [(self.numbers, "0")]
        for i, parts in enumerate(range(self.room.parts - 1, 0, -1)):
            # A component's coefficient is that of its rate, one order below, divided by its order.
            first = code.add(code.scalar("%bounds", i, "i64"), 1)
            found.append((KINDS[BITS * parts](code, self.parts), first))
        return found

    @contextmanager
    def descending(self, last: int = 0) -> Iterator[str]:
        """Lines that run for each order below the highest, descending to the order `last`."""
        with self.code.loop(self.code.add("%order", -last)) as done:
            yield self.code(f"sub i64 {self.before}, {done}")


class Recurrences:
    """Writer of the lines that find the series of a traced field."""

    def __init__(self, field: TracedField, kernel: Kernel) -> None:
        self.field, self.kernel, self.code = field, kernel, kernel.code
        self.numbers = kernel.numbers
        self.sums, size = field.sums, kernel.series_rows()
        self.series: dict[int, str] = {}
        # Only factors of sums need their earlier coefficients. A quotient is a factor of its own
        # sum, with its divisor.
        for i in self.sums:
            operation, operands = field.lines[i]
            for operand in operands if operation == "times" else (i, operands[1]):
                name, of = field.lines[operand]
                if name == "component":
                    self.series[operand] = kernel.component[of[0]]
                elif operand not in self.series:
                    self.series[operand] = self.code.variable(size)
        given = [
            (i, *line.operands) for i, line in enumerate(field.lines) if line.name == "parameter"
        ]
        self.parameters = {i: kernel.scalar("%parameters", k, len(given)) for i, k in given}

    def expand(self) -> None:
        """Find all coefficients from those of order 0."""
        values, first = dict(self.parameters), "1"
        for i in range(len(self.field.lines)):
            if i not in values:
                values[i] = self._linear(i, "0", values, values)
                self._put(i, values[i], "0")
        self._integrate(values, "0")
        for i, (numbers, _) in enumerate(self.kernel.by_parts()):
            self.numbers = numbers
            last = self.code.scalar("%bounds", i, "i64")
            with self.code.loop(last, first) as k:
                self._coefficients(k, values)
            first = last
        self.numbers = self.kernel.numbers

    def _coefficients(self, k: str, values: dict[int, Value]) -> None:
        """Find the coefficients of order k of all lines, and of order k + 1 of the components."""
        found: dict[int, Value] = {}
        sums = self._sums(k)
        for i in range(len(self.field.lines)):
            if i in self.parameters:
                continue
            if i in sums:
                found[i] = self._finished(i, sums[i], found, values)
            else:
                found[i] = self._linear(i, k, found, values)
            self._put(i, found[i], k)
        self._integrate(found, k)

    @property
    def zero(self) -> Value:
        """Zero in the numbers of the orders that are being written."""
        return self.numbers.of_double(ZERO)

    def _put(self, i: int, value: Value, k: str) -> None:
        """Store a coefficient if a sum will need it."""
        if i in self.series and self.field.lines[i].name != "component":
            self.numbers.store(value, self.series[i], k)

    def _integrate(self, found: dict[int, Value], k: str) -> None:
        """Find x_(k+1) = x'_k/(k + 1) of the components x; a constant rate has only x'_0."""
        n, kernel, following = self.numbers, self.kernel, self.code.add(k, 1)
        # 1/(k + 1) is a product with a kept number: a division would cost several times as much.
        share = kernel.scalar("%shares", following, kernel.room.coefficients)
        whole = self.code.everywhere(self.code(f"sitofp i64 {following} to double"))
        for series, i in zip(kernel.component, self.field.rates, strict=True):
            n.store(n.divided(found.get(i, self.zero), share, whole), series, following)

    def _linear(self, i: int, k: str, found: dict[int, Value], values: dict[int, Value]) -> Value:
        """A line's coefficient of order k from those of the same order of its operands.

        This is right for sums of lines, for products with a parameter, and for all lines at k = 0.
        """
        n, (operation, operands) = self.numbers, self.field.lines[i]
        if operation == "component":
            return n.load(self.kernel.component[operands[0]], k)
        # A parameter as a factor enters with its value at every order. As a term it is in `found`
        # at k = 0 only: its higher coefficients are zero.
        known = {**values, **found} if operation == "times" else found
        made = {"plus": n.plus, "minus": n.minus, "times": n.times, "divided": n.quotient}
        return made[operation](*(known.get(j, self.zero) for j in operands))

    def _sums(self, k: str) -> dict[int, Value]:
        """The sums' terms with j from 1 to k - 1."""
        code, n = self.code, self.numbers
        # Totals have memory of their own, without the zeros that series are filled up with.
        own = type(n)(code)
        places = {i: code.variable(own.rows(own.parts)) for i in self.sums}
        for place in places.values():
            own.store(own.of_double(ZERO), place, 0)
        with code.loop(k, 1) as j:
            other = code(f"sub i64 {k}, {j}")
            # A series is often a factor of several products: its coefficient is read once.
            read = functools.cache(n.load)
            for i, place in places.items():
                a, b = map(read, self._factors(i), (j, other))
                own.store(own.with_product(own.load(place, 0), a, b), place, 0)
        return {i: own.load(place, 0) for i, place in places.items()}

    def _factors(self, i: int) -> tuple[str, str]:
        """Addresses of the two series whose product a line's sum is; of a quotient b and c."""
        operation, operands = self.field.lines[i]
        a, b = operands if operation == "times" else (operands[1], i)
        return self.series[a], self.series[b]

    def _finished(
        self, i: int, total: Value, found: dict[int, Value], values: dict[int, Value]
    ) -> Value:
        """A line's coefficient from its sum, to which the terms with j = 0 and j = k are added."""
        n, (operation, (a, b)) = self.numbers, self.field.lines[i]
        # `values` has the coefficients of order 0, `found` those of order k.
        if operation == "times":
            total = n.with_product(n.with_product(total, found[a], values[b]), values[a], found[b])
            return n.settled(total)
        total = n.settled(n.with_product(total, found[b], values[i]))
        return n.quotient(n.minus(found.get(a, self.zero), total), values[b])


def orders_by_parts(order: int, parts: int) -> list[int]:
    """Orders at which the rates' coefficients begin to need fewer doubles; the last is `order`.

    On a step of the radius of convergence over e^2 each order contributes e^2 times less than the
    one before, down to the tolerance, so that fewer of its digits count.
    """
    # Of f doubles 53 f - SPARE bits count, which are lost over (53 f - SPARE) ln(2)/2 orders: so
    # many orders below the last one f doubles begin to suffice.
    needed = [(BITS * fewer - SPARE) * math.log(2) / 2 for fewer in range(parts - 1, 0, -1)]
    return [*(order - math.ceil(orders) for orders in needed if orders <= order - 1), order]
