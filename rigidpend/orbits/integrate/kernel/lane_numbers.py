"""Numbers in vectors of lanes, as the kernels compute with them: doubles, or sums of doubles.

A pair is a sum of two doubles, the second of which is the rounding error of the first: some 106
bits. Its operations are those of Dekker (1971) and Knuth with fused multiplication. Joldes, Muller
and Popescu, ACM Trans. Math. Softw. 44 (2017), bound their errors by some 2^-104. Sums of up to
eight doubles follow Hida, Li and Bailey (15th IEEE Symposium on Computer Arithmetic, 2001), but
without branches, which lanes cannot take one by one. Where terms cancel, the error is relative to
the terms and not to their sum.
"""

from collections.abc import Callable
from fractions import Fraction
from typing import Any, TypeAlias

import numpy as np

from rigidpend.numbers import Array
from rigidpend.orbits.integrate.kernel.machine_code import Writer

LONG = 5
"""Number of parts from which on an operation becomes a function of its own, being so long."""
Value: TypeAlias = tuple[str, ...]
"""Registers that hold the parts of a number in each lane, the largest part first."""


def as_doubles(value: Fraction, parts: int) -> list[float]:
    """Successive doubles that add up to a number but for the last one's rounding."""
    found, numerator, denominator = [], value.numerator, value.denominator
    for _ in range(parts):
        # Python rounds a quotient of integers correctly. Each double is the one nearest to the
        # rest; the fraction of the rest stays unreduced, since a gcd would take longer.
        found.append(numerator / denominator)
        p, q = found[-1].as_integer_ratio()
        numerator, denominator = numerator * q - p * denominator, denominator * q
    return found


class Doubles:
    """Numbers of 53 bits, one vector each."""

    bits, parts = 53, 1

    def __init__(self, code: Writer, room: int = 0) -> None:
        self.code, self.room = code, room or self.parts
        """`room` is the number of parts that memory holds for a number; further parts are zero."""

    def rows(self, count: int | str) -> str:
        """LLVM type of an array of so many vectors; a number takes `room` of them."""
        return f"[{count} x {self.code.vector}]"

    def load(self, base: str, index: str | int) -> Value:
        """The number at an index of an array of `rows`."""
        place = self.code.at(base, index, self.rows(self.room))
        return tuple(self.code.element(place, i) for i in range(self.parts))

    def store(self, value: Value, base: str, index: str | int) -> None:
        place = self.code.at(base, index, self.rows(self.room))
        for i, part in enumerate((*value, *("zeroinitializer",) * (self.room - self.parts))):
            self.code.store(part, self.code.at(place, i))

    def of_double(self, x: str) -> Value:
        """The number with the value of a double."""
        return (x, *("zeroinitializer",) * (self.parts - 1))

    def times(self, a: Value, b: Value) -> Value:
        return (self.code.binary("fmul", a[0], b[0]),)

    def plus(self, a: Value, b: Value) -> Value:
        return (self.code.binary("fadd", a[0], b[0]),)

    def minus(self, a: Value, b: Value) -> Value:
        return (self.code.binary("fsub", a[0], b[0]),)

    def opposite(self, x: Value) -> Value:
        return tuple(self.code(f"fneg {self.code.vector} {part}") for part in x)

    def with_product(self, total: Value, a: Value, b: Value) -> Value:
        """total + a b, to be `settled` when all products are in."""
        return (self.code.fma(a[0], b[0], total[0]),)

    def settled(self, total: Value) -> Value:
        return total

    def raised(self, x: str, base: str) -> Value:
        """A double x upon a base, to which `with_raised` and `with_raised_product` may add.

        The base, a double, is at least 3 times as large as the total, with any number of the terms,
        can become. Only pairs make use of it.
        """
        return self.of_double(x)

    def with_raised(self, total: Value, a: Value) -> Value:
        """A raised total + a."""
        return self.plus(total, a)

    def with_raised_product(self, total: Value, a: Value, b: Value) -> Value:
        """A raised total + a b."""
        return self.with_product(total, a, b)

    def lowered(self, total: Value, base: str) -> Value:
        """A raised total without its base; it errs by roundings of the base's last bit."""
        return self.settled(total)

    def divided(self, a: Value, share: Value, whole: str) -> Value:
        """a / whole, correctly rounded, from share = 1/whole.

        The error of a rounded 1/3 would be the same on every step, and integrals of the motion
        would drift in proportion to the time.
        """
        # The fused product gives the remainder a - whole * quotient exactly, and a second one
        # corrects the quotient by it.
        code = self.code
        quotient = code.binary("fmul", a[0], share[0])
        opposite = code(f"fneg {code.vector} {quotient}")
        return (code.fma(code.fma(opposite, whole, a[0]), share[0], quotient),)

    def quotient(self, a: Value, b: Value) -> Value:
        """a / b."""
        return (self.code.binary("fdiv", a[0], b[0]),)

    def horner(self, total: Value, x: str, c: Value) -> Value:
        """total x + c, with x a double."""
        return (self.code.fma(total[0], x, c[0]),)

    def horner_at(self, total: Value, x: Value, c: Value) -> Value:
        """total x + c, with x a number of this kind."""
        return self.horner(total, x[0], c)

    def sum_and_error(self, a: str, b: str) -> tuple[str, str]:
        """a + b of doubles and its rounding error, exactly (Knuth)."""
        code = self.code
        total = code.binary("fadd", a, b)
        part = code.binary("fsub", total, a)
        first = code.binary("fsub", a, code.binary("fsub", total, part))
        return total, code.binary("fadd", first, code.binary("fsub", b, part))


class Expansions(Doubles):
    """Numbers that are sums of several doubles, each below an ulp of the one before.

    Terms of one size are added up together; their rounding errors are terms of the next smaller
    size, down to the last part, whose errors are lost.
    """

    def times(self, a: Value, b: Value) -> Value:
        return self.settled(self.with_product(self.of_double("zeroinitializer"), a, b))

    def plus(self, a: Value, b: Value) -> Value:
        return self._called(Expansions._plus, a, b)

    def with_product(self, total: Value, a: Value, b: Value) -> Value:
        return self._called(Expansions._with_product, total, a, b)

    def settled(self, total: Value) -> Value:
        return self._called(Expansions._settled, total)

    def _called(self, lines: Callable[..., Value], *given: Value) -> Value:
        """The result of an operation, which is a function of its own where numbers are long.

        Compiling the lines once, and not wherever they are used, takes a tenth of the time.
        """
        code, parts = self.code, range(self.parts)
        if self.parts < LONG:
            return lines(self, *given)
        name = f"@{lines.__name__}_{self.parts}"
        kind = "{" + ", ".join(code.vector for _ in parts) + "}"
        if name not in code.functions:
            inner = Writer(code.lanes)
            taken = [tuple(f"%x{i}.{part}" for part in parts) for i in range(len(given))]
            # LLVM returns several values as a structure, which is put together part by part.
            made = "poison"
            for part, value in enumerate(lines(type(self)(inner), *taken)):
                made = inner(f"insertvalue {kind} {made}, {code.vector} {value}, {part}")
            listed = ", ".join(f"{code.vector} {x}" for value in taken for x in value)
            head = f"define internal {kind} {name}({listed}) noinline {{"
            code.functions[name] = [head, *inner.lines, f"  ret {kind} {made}", "}"]
        listed = ", ".join(f"{code.vector} {x}" for value in given for x in value[: self.parts])
        made = code(f"call {kind} {name}({listed})")
        return tuple(code(f"extractvalue {kind} {made}, {part}") for part in parts)

    def _plus(self, a: Value, b: Value) -> Value:
        # `lost` holds the rounding errors of one size, which are terms of the next.
        found, lost = list[str](), list[str]()
        for x, y in zip(a, b, strict=True):
            last = len(found) == self.parts - 1
            total, lost = self._added(x, [y, *lost], last)
            found.append(total)
        return self._settled(tuple(found))

    def minus(self, a: Value, b: Value) -> Value:
        return self.plus(a, self.opposite(b))

    def _with_product(self, total: Value, a: Value, b: Value) -> Value:
        # a_i b_j is of the size i + j, its error of the next one. Of the smallest size errors no
        # longer count, and what would be smaller still is left out.
        found, lost = list[str](), list[str]()
        for order, part in enumerate(total):
            last = order == self.parts - 1
            part, lost = self._added(part, lost, last)
            for i in range(order + 1):
                if last:
                    part = self.code.fma(a[i], b[order - i], part)
                    continue
                product, error = self._product(a[i], b[order - i])
                part, rest = self.sum_and_error(part, product)
                lost += [rest, error]
            found.append(part)
        return tuple(found)

    def _settled(self, total: Value) -> Value:
        # Leading parts may have cancelled, or overlap: each round carries the largest part that is
        # left to its place, as a bubble sort does, without a branch.
        parts = list(total)
        for first in range(self.parts - 1):
            for i in range(self.parts - 1, first, -1):
                parts[i - 1], parts[i] = self.sum_and_error(parts[i - 1], parts[i])
        return tuple(parts)

    def divided(self, a: Value, share: Value, whole: str) -> Value:
        return self.times(a, share)

    def quotient(self, a: Value, b: Value) -> Value:
        # Long division: each digit is a double, one more than there are parts, since each has an
        # error of some ulps.
        quotient, rest = self.of_double("zeroinitializer"), a
        for _ in range(self.parts + 1):
            digit = self.of_double(self.code.binary("fdiv", rest[0], b[0]))
            rest = self.minus(rest, self.times(digit, b))
            quotient = self.plus(quotient, digit)
        return quotient

    def horner(self, total: Value, x: str, c: Value) -> Value:
        return self.horner_at(total, self.of_double(x), c)

    def horner_at(self, total: Value, x: Value, c: Value) -> Value:
        return self.plus(self.times(total, x), c)

    def _added(self, total: str, terms: list[str], last: bool) -> tuple[str, list[str]]:
        """A sum of terms of one size, and its rounding errors; none of them for the last part."""
        lost = []
        for term in terms:
            if last:
                total = self.code.binary("fadd", total, term)
            else:
                total, rest = self.sum_and_error(total, term)
                lost.append(rest)
        return total, lost

    def _product(self, a: str, b: str) -> tuple[str, str]:
        """a b of doubles and its rounding error, exactly, by a fused product."""
        product = self.code.binary("fmul", a, b)
        return product, self.code.fma(a, b, self.code(f"fneg {self.code.vector} {product}"))


class Pairs(Expansions):
    """Numbers of some 106 bits, two vectors each, by algorithms of fewer operations."""

    bits, parts = 106, 2

    def times(self, a: Value, b: Value) -> Value:
        # a[1] b[1] is below the last bit, and left out.
        product, error = self._product(a[0], b[0])
        error = self.code.fma(a[0], b[1], error)
        return self._joined(product, self.code.fma(a[1], b[0], error))

    def _settled(self, total: Value) -> Value:
        return self._joined(*total)

    # A raised total stays within a third of its base. So two of them differ by less than a factor
    # of 2, and their difference is exact (Sterbenz): a sum's rounding error takes two operations to
    # find, not five. That of a product is in it, for the product is fused with the sum.

    def raised(self, x: str, base: str) -> Value:
        return self._joined(base, x)

    def with_raised(self, total: Value, a: Value) -> Value:
        code = self.code
        high = code.binary("fadd", total[0], a[0])
        lost = code.binary("fadd", a[0], code.binary("fsub", total[0], high))
        return high, code.binary("fadd", total[1], code.binary("fadd", lost, a[1]))

    def with_raised_product(self, total: Value, a: Value, b: Value) -> Value:
        code = self.code
        high = code.fma(a[0], b[0], total[0])
        lost = code.fma(a[0], b[0], code.binary("fsub", total[0], high))
        lost = code.fma(a[1], b[0], code.fma(a[0], b[1], lost))
        return high, code.binary("fadd", total[1], lost)

    def lowered(self, total: Value, base: str) -> Value:
        return self._joined(self.code.binary("fsub", total[0], base), total[1])

    def quotient(self, a: Value, b: Value) -> Value:
        quotients, rest = [], a
        for _ in range(3):
            quotients.append(self.code.binary("fdiv", rest[0], b[0]))
            rest = self.minus(rest, self.times(self.of_double(quotients[-1]), b))
        first, second, third = quotients
        return self._joined(first, self.code.binary("fadd", second, third))

    def horner(self, total: Value, x: str, c: Value) -> Value:
        product, error = self._product(total[0], x)
        error = self.code.fma(total[1], x, error)
        return self.plus((product, error), c)

    def _joined(self, head: str, rest: str) -> Value:
        """The pair of a sum of doubles, of which the second is the smaller one (Dekker)."""
        code = self.code
        total = code.binary("fadd", head, rest)
        return total, code.binary("fsub", rest, code.binary("fsub", total, head))


KINDS: dict[int, type[Doubles]] = {53: Doubles, 106: Pairs}
for _n in range(3, 9):
    KINDS[53 * _n] = type(f"Sums{_n}", (Expansions,), {"bits": 53 * _n, "parts": _n})
"""Kinds of numbers by their bits, which are 53 for each part."""


def in_parts(values: Any, bits: int) -> Array:
    """Fractions, or doubles at 53 bits, as sums of doubles, shape (parts, ...)."""
    parts = KINDS[bits].parts
    if parts == 1:
        return np.array([values], dtype=float)
    exact = np.asarray(values, dtype=object)
    columns = list(zip(*(as_doubles(x, parts) for x in exact.flat), strict=True))
    return np.array(columns, dtype=float).reshape(parts, *exact.shape)


def exactly(parts: Any) -> Any:
    """The exact sums of parts, shape (parts, ...), as Fractions, shape (...)."""
    given = np.asarray(parts, dtype=float)
    found = np.empty(given[0].size, dtype=object)
    found[:] = [_sum(each) for each in given.reshape(len(given), -1).T.tolist()]
    return found.reshape(given.shape[1:])[()]


def _sum(doubles: list[float]) -> Fraction:
    """The exact sum of doubles, whose denominators are powers of two: the largest is common."""
    ratios = [x.as_integer_ratio() for x in doubles]
    common = max(q for _, q in ratios)
    return Fraction(sum(p * (common // q) for p, q in ratios), common)
