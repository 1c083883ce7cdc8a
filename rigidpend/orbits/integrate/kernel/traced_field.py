"""Any field as recurrences of Taylor coefficients, from the lines of its `tape`; in doubles.

With a_k the coefficients of an operand, b_k those of the other and c_k those of the result,

    c = a b         c_k = sum a_j b_(k-j)
    c = a / b       c_k = (a_k - sum' b_j c_(k-j)) / b_0
    c = sqrt(a)     c_k = (a_k - sum'' c_j c_(k-j)) / (2 c_0)
    c = exp(a)      c_k = sum' (j a_j) c_(k-j) / k
    c = sin(a)      c_k = sum' (j a_j) d_(k-j) / k, d = cos(a), and d_k with -c,

where j goes from 0 to k, from 1 in sum', and from 1 to k - 1 in sum''. The terms between 1 and
k - 1 wait for nothing of the order k: those of all sums share a loop.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

from rigidpend.orbits.integrate.kernel.tape import FUNCTIONS, Operation

if TYPE_CHECKING:
    from rigidpend.orbits.integrate.kernel.taylor_step import Kernel

ZERO = "zeroinitializer"
SUMMED = ("times", "divided", *FUNCTIONS)
"""Operations on series that take a sum over j."""


class TracedField(NamedTuple):
    """A field whose numbers are the kernel's parameters."""

    lines: tuple[Operation, ...]
    rates: tuple[int, ...]
    """Lines of the derivatives of the components."""

    @property
    def components(self) -> tuple[str, ...]:
        return tuple(f"x{i}" for i in range(len(self.rates)))

    @property
    def functions(self) -> tuple[str, ...]:
        used = {line.name for line in self.lines}
        return tuple(name for name in FUNCTIONS if name in used)

    def recurrences(self, kernel: Kernel) -> TracedRecurrences:
        return TracedRecurrences(self, kernel)


class TracedRecurrences:
    """Lines that find the series of a traced field, in doubles."""

    def __init__(self, field: TracedField, kernel: Kernel) -> None:
        self.field, self.kernel, self.code = field, kernel, kernel.code
        self.sums = {i for i, line in enumerate(field.lines) if _is_sum(line, field.lines)}
        size = f"[{kernel.order + 1} x {self.code.vector}]"
        self.series: dict[int, str] = {}
        self.weighted: dict[int, str] = {}
        """Series of k a_k of the operands of functions."""
        for i in sorted(self.sums):
            operation, operands = field.lines[i]
            self.series[i] = self.code.variable(size)
            for operand in operands:
                self._keep(operand, size)
            if operation in ("sin", "cos", "exp"):
                self.weighted.setdefault(operands[0], self.code.variable(size))
        self.parameter = {
            line.operands[0]: kernel.scalar("%parameters", line.operands[0], 0)[0]
            for line in field.lines
            if line.name == "parameter"
        }

    def expand(self) -> None:
        """Find all coefficients from those of order 0."""
        values: dict[int, str] = {}
        for i in range(len(self.field.lines)):
            values[i] = self._value(i, values)
            self._put(i, values[i], "0")
        self._integrate(values, "0")
        with self.code.loop(self.kernel.order, 1) as k:
            self._coefficients(k, values)

    def _coefficients(self, k: str, values: dict[int, str]) -> None:
        """Coefficients of order k of all lines, and of order k + 1 of the components."""
        order = self.code.everywhere(self.code(f"sitofp i64 {k} to double"))
        sums, found = self._sums(k), dict[int, str]()
        for i, line in enumerate(self.field.lines):
            if line.name == "parameter":
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
            self.series[i] = self.kernel.component[self.kernel.components[operands[0]]]
        elif operation != "parameter":
            self.series.setdefault(i, self.code.variable(size))

    def _put(self, i: int, value: str, k: str, order: str = "") -> None:
        """Store a coefficient where sums will look for it."""
        if i in self.series and self.field.lines[i].name != "component":
            self.code.store(value, self.code.at(self.series[i], k))
        if i in self.weighted:
            weighted = self._times(order, value) if order else ZERO
            self.code.store(weighted, self.code.at(self.weighted[i], k))

    def _integrate(self, found: dict[int, str], k: str) -> None:
        """Coefficients of order k + 1 of the components, those of a fixed rate zero from k = 1."""
        rates = ((found.get(i, ZERO),) for i in self.field.rates)
        self.kernel.integrated(zip(self.kernel.components, rates, strict=True), k)

    def _value(self, i: int, values: dict[int, str]) -> str:
        """A line's result at the beginning of the step."""
        operation, operands = self.field.lines[i]
        if operation == "parameter":
            return self.parameter[operands[0]]
        if operation == "component":
            return self._component(operands[0], "0")
        if operation in FUNCTIONS:
            v = self.code.vector
            name = f"@llvm.{operation}.{self.code.suffix}"
            return self.code(f"call {v} {name}({v} {values[operands[0]]})")
        return self._combined(operation, *(values[operand] for operand in operands))

    def _linear(self, i: int, k: str, found: dict[int, str], values: dict[int, str]) -> str:
        """A line's coefficient from those of the same order of its operands."""
        operation, operands = self.field.lines[i]
        if operation == "component":
            return self._component(operands[0], k)
        if operation in ("times", "divided"):
            # The factor that is no series is a number; a sum has none of it from k = 1 on.
            return self._combined(operation, *(found.get(j, values[j]) for j in operands))
        return self._combined(operation, *(found.get(j, ZERO) for j in operands))

    def _sums(self, k: str) -> dict[int, str]:
        """The terms of all sums for j from 1 to k - 1."""
        code = self.code
        places = {i: code.variable(code.vector) for i in sorted(self.sums)}
        for place in places.values():
            code.store(ZERO, place)
        with code.loop(k, 1) as j:
            other = code(f"sub i64 {k}, {j}")
            for i, place in places.items():
                left, right = self._factors(i)
                a, b = code.element(left, j), code.element(right, other)
                code.store(code.fma(a, b, code.load(place)), place)
        return {i: code.load(place) for i, place in places.items()}

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
        self, i: int, total: str, order: str, found: dict[int, str], values: dict[int, str]
    ) -> str:
        """A line's coefficient from its sum, whose terms with j = k are still to come."""
        code, (operation, operands) = self.code, self.field.lines[i]
        a = operands[0]
        if operation == "times":
            b = operands[1]
            return code.fma(values[a], found[b], code.fma(found[a], values[b], total))
        if operation == "sqrt":
            twice = code.binary("fadd", values[i], values[i])
            return self._rest_over(found[a], total, twice)
        if operation == "divided":
            b = operands[1]
            total = code.fma(found[b], values[i], total)
            return self._rest_over(found.get(a, ZERO), total, values[b])
        total = code.fma(self._times(order, found[a]), values[self._partner(i)], total)
        share = code.binary("fdiv", total, order)
        return code(f"fneg {code.vector} {share}") if operation == "cos" else share

    def _rest_over(self, a: str, total: str, denominator: str) -> str:
        return self.code.binary("fdiv", self.code.binary("fsub", a, total), denominator)

    def _partner(self, i: int) -> int:
        """The line whose series the rate of a function's series has as a factor."""
        operation, operands = self.field.lines[i]
        partner = {"sin": "cos", "cos": "sin", "exp": "exp"}[operation]
        return self.field.lines.index(Operation(partner, operands))

    def _component(self, number: int, k: str) -> str:
        return self.code.element(self.kernel.component[self.kernel.components[number]], k)

    def _combined(self, operation: str, a: str, b: str) -> str:
        names = {"plus": "fadd", "minus": "fsub", "times": "fmul", "divided": "fdiv"}
        return self.code.binary(names[operation], a, b)

    def _times(self, a: str, b: str) -> str:
        return self.code.binary("fmul", a, b)


def _is_sum(line: Operation, lines: Sequence[Operation]) -> bool:
    """True if a line's coefficients are sums: not where one factor is a plain number."""
    operation, operands = line
    if operation not in SUMMED:
        return False
    factors = operands[1:] if operation == "divided" else operands
    return all(lines[i].name != "parameter" for i in factors)
