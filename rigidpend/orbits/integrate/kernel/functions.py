"""Sine, cosine and logarithm of numbers in lanes, in doubles or in pairs of doubles.

Arguments are reduced by the bits of the number itself, and power series with exact fractions as
coefficients do the rest: as many terms as the kind of number has bits for.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from fractions import Fraction

from rigidpend.numbers.exact import context, fraction
from rigidpend.orbits.integrate.kernel.lane_numbers import Doubles, Value, as_doubles

CONSTANT_BITS = 240
"""Bits of pi and ln 2: more than two pairs have."""
SIGN = -(1 << 63)
"""The sign of a double, as a whole number."""
ROOT_HALF = int.from_bytes(bytes.fromhex("3fe6a09e667f3bcd"), "big")
"""The bits of sqrt(1/2)."""

SQUARE = (math.pi / 4) ** 2
"""The largest square of a reduced angle."""
NEAR_1 = 0.0295
"""The largest ((m - 1)/(m + 1))^2 of a number m from sqrt(1/2) to sqrt(2)."""


class Functions:
    """Elementary functions of one kind of numbers, doubles or pairs of them."""

    def __init__(self, numbers: Doubles) -> None:
        self.numbers, self.code = numbers, numbers.code
        m = context(CONSTANT_BITS)
        self.half_pi, self.ln2 = (fraction(x, CONSTANT_BITS) for x in (m.pi / 2, m.ln2))

    def cos_sin(self, x: Value) -> tuple[Value, Value]:
        """Cosine and sine of an angle of some turns at most, radians."""
        code, n = self.code, self.numbers
        turns = self._nearest(x, 2 / math.pi)
        r = self._reduced(x, turns, self.half_pi)
        w = n.times(r, r)
        # 1, 1, -1/2!, -1/3!, 1/4!, 1/5!, ...: of cosine and sine in turn.
        count = 2 * self._until(SQUARE, lambda j: math.factorial(2 * j)) + 2
        ratios = [Fraction((-1) ** (k // 2), math.factorial(k)) for k in range(count)]
        sin = n.settled(n.with_product(r, n.times(r, w), self._series(ratios[3::2], w, SQUARE)))
        cos = n.settled(n.with_product(self._number(1), w, self._series(ratios[2::2], w, SQUARE)))
        quarter = code(f"fptosi {code.vector} {turns} to {code.whole}")
        odd = code(f"icmp ne {code.whole} {code.with_each('and', quarter, 1)}, zeroinitializer")
        next_ = code.with_each("add", quarter, 1)
        return (
            self._signed(self._chosen(odd, sin, cos), next_),
            self._signed(self._chosen(odd, cos, sin), quarter),
        )

    def reduced_angle(self, x: Value) -> Value:
        """The angle less whole turns, from -pi to pi."""
        return self._reduced(x, self._nearest(x, 1 / (2 * math.pi)), 4 * self.half_pi)

    def logarithm_of_size(self, x: Value) -> Value:
        """ln|x| of a normal number other than zero."""
        code, n = self.code, self.numbers
        bits = code.bits(x[0])
        sign = code.with_each("and", bits, SIGN)
        size = code(f"xor {code.whole} {bits}, {sign}")
        k = code.with_each("ashr", code.with_each("sub", size, ROOT_HALF), 52)
        factor = code(f"sub {code.whole} {code.everywhere('1023', 'i64')}, {k}")
        factor = code(f"or {code.whole} {code.with_each('shl', factor, 52)}, {sign}")
        factor = code.of_bits(factor)
        # From sqrt(1/2) to sqrt(2); the factor is a power of two.
        m = tuple(code.binary("fmul", part, factor) for part in x)
        one = self._number(1)
        z = n.quotient(n.minus(m, one), n.plus(m, one))
        w = n.times(z, z)
        twice = n.plus(z, z)
        shares = [Fraction(1, 2 * j + 1) for j in range(1, self._until(NEAR_1, lambda j: 2 * j))]
        near = n.settled(n.with_product(twice, n.times(twice, w), self._series(shares, w, NEAR_1)))
        exponent = code(f"sitofp {code.whole} {k} to {code.vector}")
        return n.settled(n.with_product(near, n.of_double(exponent), self._number(self.ln2)))

    def _reduced(self, x: Value, count: str, period: Fraction) -> Value:
        """x less `count` periods: the period in two numbers, so that nothing is lost."""
        n, code = self.numbers, self.code
        less = n.of_double(code(f"fneg {code.vector} {count}"))
        first = sum(map(Fraction, as_doubles(period, n.parts)), Fraction(0))
        for part in (first, period - first):
            x = n.settled(n.with_product(x, less, self._number(part)))
        return x

    def _series(self, coefficients: Sequence[Fraction], x: Value, most: float) -> Value:
        """A power series by Horner's rule, for |x| <= most.

        Terms that are a rounding of doubles below the first one, and more, are summed in doubles.
        """
        n, plain = self.numbers, Doubles(self.code)
        small = 2.0 ** (plain.bits - n.bits - 2) * abs(coefficients[0])
        few = next((j for j, c in enumerate(coefficients) if abs(c) * most**j < small), 0)
        total = self._number(coefficients[-1])
        for j in range(len(coefficients) - 2, -1, -1):
            c = self._number(coefficients[j])
            if 0 < few <= j:
                total = n.of_double(plain.with_product(c, total, x)[0])
            else:
                total = n.settled(n.with_product(c, total, x))
        return total

    def _until(self, ratio: float, divisor: Callable[[int], int]) -> int:
        """The number of terms ratio^j / divisor(j) until they are below rounding."""
        j = 1
        while ratio**j / divisor(j) > 2.0 ** -(self.numbers.bits + 2):
            j += 1
        return j

    def _number(self, value: Fraction | int) -> Value:
        return tuple(map(self.code.everywhere, self.numbers.constant(Fraction(value))))

    def _nearest(self, x: Value, factor: float) -> str:
        """The whole number nearest to a multiple of a number, as a double."""
        code = self.code
        turns = code.binary("fmul", x[0], code.number(factor))
        turns = code.binary("fadd", turns, code.number(0.5))
        return code(f"call {code.vector} @llvm.floor.{code.suffix}({code.vector} {turns})")

    def _chosen(self, mask: str, a: Value, b: Value) -> Value:
        return tuple(self.code.chosen(mask, x, y) for x, y in zip(a, b, strict=True))

    def _signed(self, x: Value, quarter: str) -> Value:
        """The opposite in the lanes where the second bit of a whole number is 1."""
        code = self.code
        sign = code.with_each("shl", code.with_each("and", quarter, 2), 62)
        return tuple(code.of_bits(code(f"xor {code.whole} {code.bits(y)}, {sign}")) for y in x)
