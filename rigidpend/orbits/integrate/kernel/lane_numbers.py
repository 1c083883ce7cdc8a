"""Numbers in vectors of lanes, as the kernel computes with them: doubles, or pairs of doubles.

A pair is a sum of two doubles of which the second is the rounding error of the first: some 106
bits. Its operations are those of Dekker (1971) and Knuth with fused multiplication: Joldes,
Muller and Popescu, ACM Trans. Math. Softw. 44 (2017), bound their errors by some 2^-104. A sum
of terms that cancel errs by as much relative to the terms, as it would with exact terms rounded.
"""

from __future__ import annotations

from fractions import Fraction
from typing import TypeAlias

from rigidpend.orbits.integrate.kernel.writer import Writer, hexadecimal

Value: TypeAlias = tuple[str, ...]
"""Registers that make up a number in each lane, the largest part first."""


def as_doubles(value: Fraction, parts: int) -> list[float]:
    """The doubles that make up a number, the largest first."""
    found, numerator, denominator = [], value.numerator, value.denominator
    for _ in range(parts):
        # Python rounds a quotient of whole numbers correctly; nothing here needs lowest terms.
        found.append(numerator / denominator)
        p, q = found[-1].as_integer_ratio()
        numerator, denominator = numerator * q - p * denominator, denominator * q
    return found


class Doubles:
    """Numbers of 53 bits, one vector each."""

    bits, parts = 53, 1

    def __init__(self, code: Writer) -> None:
        self.code = code

    def rows(self, count: int | str) -> str:
        """Kind of memory for so many numbers."""
        return f"[{count} x {self.code.vector}]"

    def load(self, base: str, index: str | int) -> Value:
        """The number at an index of an array of `rows`."""
        place = self.code.at(base, index, self.rows(self.parts))
        return tuple(self.code.element(place, i) for i in range(self.parts))

    def store(self, value: Value, base: str, index: str | int) -> None:
        place = self.code.at(base, index, self.rows(self.parts))
        for i, part in enumerate(value):
            self.code.store(part, self.code.at(place, i))

    def constant(self, value: Fraction) -> list[str]:
        """A number's parts as LLVM reads them."""
        return [hexadecimal(part) for part in self.rounded(value)]

    def rounded(self, value: Fraction) -> list[float]:
        """The doubles that make up a number, the largest first."""
        return as_doubles(value, self.parts)

    def of_double(self, x: str) -> Value:
        """The number with the value of a double."""
        return (x, *("zeroinitializer",) * (self.parts - 1))

    def times(self, a: Value, b: Value) -> Value:
        return (self.code.binary("fmul", a[0], b[0]),)

    def plus(self, a: Value, b: Value) -> Value:
        return (self.code.binary("fadd", a[0], b[0]),)

    def minus(self, a: Value, b: Value) -> Value:
        return (self.code.binary("fsub", a[0], b[0]),)

    def with_product(self, total: Value, a: Value, b: Value) -> Value:
        """total + a b, to be `settled` when all products are in."""
        return (self.code.fma(a[0], b[0], total[0]),)

    def settled(self, total: Value) -> Value:
        return total

    def divided(self, a: Value, share: Value, whole: str) -> Value:
        """a / whole, correctly rounded, from share = 1/whole.

        The error of a rounded 1/3 is the same on every step: drifts would grow with the time.
        """
        code = self.code
        quotient = code.binary("fmul", a[0], share[0])
        opposite = code(f"fneg {code.vector} {quotient}")
        return (code.fma(code.fma(opposite, whole, a[0]), share[0], quotient),)

    def quotient(self, a: Value, b: Value) -> Value:
        """a / b."""
        return (self.code.binary("fdiv", a[0], b[0]),)

    def horner(self, total: Value, x: str, c: Value) -> Value:
        """total x + c, of a double x."""
        return (self.code.fma(total[0], x, c[0]),)

    def horner_at(self, total: Value, x: Value, c: Value) -> Value:
        """total x + c, of a number x."""
        return self.horner(total, x[0], c)


class Pairs(Doubles):
    """Numbers of some 106 bits, two vectors each."""

    bits, parts = 106, 2

    def times(self, a: Value, b: Value) -> Value:
        product, error = self._product(a[0], b[0])
        error = self.code.fma(a[0], b[1], error)
        return self._joined(product, self.code.fma(a[1], b[0], error))

    def plus(self, a: Value, b: Value) -> Value:
        total, error = self._sum(a[0], b[0])
        rest = self.code.binary("fadd", a[1], b[1])
        return self._joined(total, self.code.binary("fadd", error, rest))

    def minus(self, a: Value, b: Value) -> Value:
        opposite = tuple(self.code(f"fneg {self.code.vector} {part}") for part in b)
        return self.plus(a, opposite)

    def with_product(self, total: Value, a: Value, b: Value) -> Value:
        product, error = self._product(a[0], b[0])
        head, lost = self._sum(total[0], product)
        rest = self.code.binary("fadd", total[1], lost)
        rest = self.code.binary("fadd", rest, error)
        rest = self.code.fma(a[0], b[1], rest)
        return head, self.code.fma(a[1], b[0], rest)

    def settled(self, total: Value) -> Value:
        return self._joined(*total)

    def divided(self, a: Value, share: Value, whole: str) -> Value:
        return self.times(a, share)

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

    def horner_at(self, total: Value, x: Value, c: Value) -> Value:
        return self.plus(self.times(total, x), c)

    def _product(self, a: str, b: str) -> tuple[str, str]:
        """a b and its rounding error, exactly."""
        product = self.code.binary("fmul", a, b)
        return product, self.code.fma(a, b, self.code(f"fneg {self.code.vector} {product}"))

    def _sum(self, a: str, b: str) -> tuple[str, str]:
        """a + b and its rounding error, exactly (Knuth)."""
        code = self.code
        total = code.binary("fadd", a, b)
        part = code.binary("fsub", total, a)
        first = code.binary("fsub", a, code.binary("fsub", total, part))
        return total, code.binary("fadd", first, code.binary("fsub", b, part))

    def _joined(self, head: str, rest: str) -> Value:
        """The pair of a sum whose second term is small (Dekker)."""
        code = self.code
        total = code.binary("fadd", head, rest)
        return total, code.binary("fsub", rest, code.binary("fsub", total, head))


KINDS: dict[int, type[Doubles]] = {kind.bits: kind for kind in (Doubles, Pairs)}
"""Kinds of numbers by their bits."""


def kernel_bits(bits: int) -> int:
    """The bits of the kernel's numbers that serve so many, 106 at most."""
    return min(kind for kind in KINDS if kind >= bits)
