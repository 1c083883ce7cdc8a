"""A traced field as recurrences of Taylor coefficients, in any kind of lanes' numbers.

With a_k the coefficients of an operand, b_k those of the other and c_k those of the result,

    c = a b         c_k = sum a_j b_(k-j)
    c = a / b       c_k = (a_k - sum' b_j c_(k-j)) / b_0
    c = sqrt(a)     c_k = (a_k - sum'' c_j c_(k-j)) / (2 c_0)
    c = exp(a)      c_k = sum' (j a_j) c_(k-j) / k
    c = sin(a)      c_k = sum' (j a_j) d_(k-j) / k, d = cos(a), and d_k with -c,

where j goes from 0 to k, from 1 in sum', and from 1 to k - 1 in sum''. The terms between 1 and
k - 1 wait for nothing of the order k: those of all sums share a loop. Where all sums are products
of what no other sum leads to, as in the aligned field, longer numbers than doubles share one from
0 to k. Functions
are in doubles only, for their first coefficients come from the system's mathematical library.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from rigidpend.orbits.integrate.kernel.lane_numbers import KINDS, Value
from rigidpend.orbits.integrate.kernel.tape import FUNCTIONS, Operation, TracedField

if TYPE_CHECKING:
    from rigidpend.orbits.integrate.kernel.taylor_step import Kernel

ZERO = "zeroinitializer"
BITS, SPARE = 53, 12
"""Bits of a part, and those that a coefficient has more than its size on a step asks for.

With 8 and with 24 crossing times in pairs err alike, on orbits of three bodies."""


class Recurrences:
    """Lines that find the series of a traced field."""

    def __init__(self, field: TracedField, kernel: Kernel) -> None:
        self.field, self.kernel, self.code = field, kernel, kernel.code
        self.numbers, self.zero = kernel.numbers, kernel.numbers.of_double(ZERO)
        self.sums, size = field.sums, self.numbers.rows((kernel.order + 1) * kernel.parts)
        # Doubles are quicker with the ends of the sums apart; of longer numbers their lines would
        # take long to compile.
        self.early = early_lines(field) if kernel.parts > 1 else ()
        self.series: dict[int, str] = {}
        self.weighted: dict[int, str] = {}
        """Series of k a_k of the operands of functions."""
        for i in self.sums:
            operation, operands = field.lines[i]
            for operand in operands if operation == "times" else (i, *operands):
                self._keep(operand, size)
            if operation in ("sin", "cos", "exp"):
                self.weighted.setdefault(operands[0], self.code.variable(size))
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
            if line.name == "parameter" or not self.early:
                values[i] = self._value(i, values)
                self._put(i, values[i], "0")
        if not self.early:
            self._integrate(values, "0")
        first = 0 if self.early else 1
        for parts, last in parts_by_order(self.kernel.order, self.kernel.parts):
            self.numbers = KINDS[BITS * parts](self.code, self.kernel.parts)
            if last > first:
                with self.code.loop(last, first) as k:
                    self._coefficients(k, values)
                first = last
        self.numbers = self.kernel.numbers

    def _coefficients(self, k: str, values: dict[int, Value]) -> None:
        """Coefficients of order k of all lines, and of order k + 1 of the components."""
        order = self.code.everywhere(self.code(f"sitofp i64 {k} to double"))
        found: dict[int, Value] = {}
        for i in self.early:
            found[i] = self._linear(i, k, found, values)
            self._put(i, found[i], k)
        sums = self._sums(k)
        for i, line in enumerate(self.field.lines):
            if line.name == "parameter" or i in self.early:
                continue
            if i in sums:
                found[i] = self._finished(i, sums[i], order, found, values)
            else:
                found[i] = self._linear(i, k, found, values)
            self._put(i, found[i], k, order)
        self._integrate(found, k)

    def _keep(self, i: int, size: str) -> None:
        """Make room for the series of an operand; a component has its own."""
        operation, operands = self.field.lines[i]
        if operation == "component":
            self.series[i] = self.kernel.component[operands[0]]
        elif operation != "parameter":
            self.series.setdefault(i, self.code.variable(size))

    def _put(self, i: int, value: Value, k: str, order: str = "") -> None:
        """Store a coefficient where sums will look for it."""
        n = self.numbers
        if i in self.series and self.field.lines[i].name != "component":
            n.store(value, self.series[i], k)
        if i in self.weighted:
            n.store(n.times(n.of_double(order or ZERO), value), self.weighted[i], k)

    def _integrate(self, found: dict[int, Value], k: str) -> None:
        """Coefficients of order k + 1 of the components, those of a fixed rate zero from k = 1."""
        rates = [found.get(i, self.zero) for i in self.field.rates]
        self.kernel.integrated(rates, k, self.numbers)

    def _value(self, i: int, values: dict[int, Value]) -> Value:
        """A line's result at the beginning of the step."""
        operation, operands = self.field.lines[i]
        if operation == "parameter":
            return self.parameter[operands[0]]
        if operation == "component":
            return self._component(operands[0], "0")
        if operation in FUNCTIONS:
            v = self.code.vector
            name = f"@llvm.{operation}.{self.code.suffix}"
            return (self.code(f"call {v} {name}({v} {values[operands[0]][0]})"),)
        return self._combined(operation, *(values[operand] for operand in operands))

    def _linear(self, i: int, k: str, found: dict[int, Value], values: dict[int, Value]) -> Value:
        """A line's coefficient from those of the same order of its operands."""
        operation, operands = self.field.lines[i]
        if operation == "component":
            return self._component(operands[0], k)
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
        whole = (code(f"add i64 {k}, 1"), 0) if self.early else (k, 1)
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
        if operation == "times":
            return self.series[operands[0]], self.series[operands[1]]
        if operation == "divided":
            return self.series[operands[1]], self.series[i]
        if operation == "sqrt":
            return self.series[i], self.series[i]
        return self.weighted[operands[0]], self.series[self._partner(i)]

    def _finished(
        self,
        i: int,
        total: Value,
        order: str,
        found: dict[int, Value],
        values: dict[int, Value],
    ) -> Value:
        """A line's coefficient from its sum, whose terms with j = k are still to come."""
        n, (operation, operands) = self.numbers, self.field.lines[i]
        a = operands[0]
        if self.early:
            return n.settled(total)
        if operation == "times":
            b = operands[1]
            total = n.with_product(n.with_product(total, found[a], values[b]), values[a], found[b])
            return n.settled(total)
        if operation == "sqrt":
            twice = n.plus(values[i], values[i])
            return n.quotient(n.minus(found[a], n.settled(total)), twice)
        if operation == "divided":
            b = operands[1]
            total = n.settled(n.with_product(total, found[b], values[i]))
            return n.quotient(n.minus(found.get(a, self.zero), total), values[b])
        rate = n.times(n.of_double(order), found[a])
        total = n.settled(n.with_product(total, rate, values[self._partner(i)]))
        share = n.quotient(total, n.of_double(order))
        return n.minus(self.zero, share) if operation == "cos" else share

    def _partner(self, i: int) -> int:
        """The line whose series the rate of a function's series has as a factor."""
        operation, operands = self.field.lines[i]
        partner = {"sin": "cos", "cos": "sin", "exp": "exp"}[operation]
        return self.field.lines.index(Operation(partner, operands))

    def _component(self, number: int, k: str) -> Value:
        return self.numbers.load(self.kernel.component[number], k)

    def _combined(self, operation: str, a: Value, b: Value) -> Value:
        n = self.numbers
        made = {"plus": n.plus, "minus": n.minus, "times": n.times, "divided": n.quotient}
        return made[operation](a, b)


def early_lines(field: TracedField) -> tuple[int, ...]:
    """Lines that no sum leads to, if all sums are products of such; else none.

    Nor may a plain number be added anywhere, for then order 0 is not like the others.
    """
    late = set(field.sums)
    for i, (operation, operands) in enumerate(field.lines):
        if operation in ("component", "parameter"):
            continue
        numbers = {j for j in operands if field.lines[j].name == "parameter"}
        if (i in field.sums or numbers) and operation != "times":
            return ()
        if late.intersection(operands):
            if i in field.sums:
                return ()
            late.add(i)
    if any(field.lines[i].name == "parameter" for i in field.rates):
        return ()
    lines = enumerate(field.lines)
    return tuple(i for i, line in lines if i not in late and line.name != "parameter")


def parts_by_order(order: int, parts: int) -> list[tuple[int, int]]:
    """Doubles that the coefficients of rates need: (parts, first order that needs fewer).

    On a step of the radius of convergence over e^2 each order is e^2 times smaller than the one
    before, down to the tolerance, and so are its digits that count.
    """
    found = []
    for fewer in range(parts - 1, 0, -1):
        last = order - math.ceil((BITS * fewer - SPARE) * math.log(2) / 2)
        if last > 0:
            found.append((fewer + 1, last))
    return [*found, (1, order)]
