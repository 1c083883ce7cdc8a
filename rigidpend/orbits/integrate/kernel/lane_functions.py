"""Cosine, sine and logarithm of numbers in vectors of lanes, doubles or sums of them.

The argument is reduced, by multiples of pi/2 or by its exponent, and a power series does the rest.
Its coefficients are exact fractions, rounded once, and it has as many terms as the bits of the kind
of number ask for.
"""

import math
from collections.abc import Callable, Sequence
from fractions import Fraction

from rigidpend.numbers.exact import context, fraction
from rigidpend.orbits.integrate.kernel.lane_numbers import Doubles, Value, as_doubles

CONSTANT_BITS = 360
"""Bits of pi and ln 2: more than two triples have, for a period is subtracted in two numbers."""
SIGN = -(1 << 63)
"""The sign bit of a double, as an integer."""
ROOT_HALF = int.from_bytes(bytes.fromhex("3fe6a09e667f3bcd"), "big")
"""The bits of sqrt(1/2), a double, as an integer."""
SQUARE = (math.pi / 4) ** 2
"""Largest square of a reduced angle, radians squared."""
NEAR_1 = 0.0295
"""Largest ((m - 1)/(m + 1))^2 for m from sqrt(1/2) to sqrt(2)."""


class Functions:
    """Elementary functions of one kind of numbers: doubles, or sums of them."""

    def __init__(self, numbers: Doubles) -> None:
        self.numbers, self.code = numbers, numbers.code
        m = context(CONSTANT_BITS)
        self.half_pi, self.ln2 = (fraction(x, CONSTANT_BITS) for x in (m.pi / 2, m.ln2))

    def cos_sin(self, x: Value) -> tuple[Value, Value]:
        """Cosine and sine of an angle of some turns at most, radians."""
        code, n = self.code, self.numbers
        # x = turns pi/2 + r with |r| <= pi/4, and w = r^2.
        turns = self._nearest(x, 2 / math.pi)
        r = self._reduced(x, turns, self.half_pi)
        w = n.times(r, r)
        # 1, 1, -1/2!, -1/3!, 1/4!, 1/5!, ...: of cosine and sine in turn.
        count = 2 * self._until(SQUARE, lambda j: math.factorial(2 * j)) + 2
        ratios = [Fraction((-1) ** (k // 2), math.factorial(k)) for k in range(count)]
        # The leading terms r and 1 are added last, so that rounding is relative to the result.
        sin = self._plus(r, n.times(r, w), self._series(ratios[3::2], w, SQUARE))
        cos = self._plus(self._number(1), w, self._series(ratios[2::2], w, SQUARE))
        quarter = code(f"fptosi {code.vector} {turns} to {code.whole}")
        # Odd quarters of a turn exchange sine and cosine. The sine's sign is the second bit of
        # `quarter`, the cosine's that of the next quarter, as cos x = sin(x + pi/2).
        odd = code(f"icmp ne {code.whole} {code.with_each('and', quarter, 1)}, zeroinitializer")
        next_ = code.with_each("add", quarter, 1)
        return (
            self._signed(self._chosen(odd, sin, cos), next_),
            self._signed(self._chosen(odd, cos, sin), quarter),
        )

    def reduced_angle(self, x: Value) -> Value:
        """The angle without its whole turns, radians from -pi to pi."""
        return self._reduced(x, self._nearest(x, 1 / (2 * math.pi)), 4 * self.half_pi)

    def logarithm_of_size(self, x: Value) -> Value:
        """ln|x| of a number whose first part is a normal double."""
        code, n = self.code, self.numbers
        # |x| = 2^k m with m from sqrt(1/2) to sqrt(2). Read as integers, the bits of positive
        # doubles ascend with their values by 2^52 for each factor of two: from those of sqrt(1/2)
        # k is counted.
        bits = code.bits(x[0])
        sign = code.with_each("and", bits, SIGN)
        size = code(f"xor {code.whole} {bits}, {sign}")
        k = code.with_each("ashr", code.with_each("sub", size, ROOT_HALF), 52)
        factor = code(f"sub {code.whole} {code.everywhere('1023', 'i64')}, {k}")
        factor = code(f"or {code.whole} {code.with_each('shl', factor, 52)}, {sign}")
        factor = code.of_bits(factor)
        # The factor is 2^-k with the sign of x: the product is m, and exact.
        m = tuple(code.binary("fmul", part, factor) for part in x)
        one = self._number(1)
        # ln m = 2 artanh z = 2 z (1 + z^2/3 + z^4/5 + ...), where z = (m - 1)/(m + 1).
        z = n.quotient(n.minus(m, one), n.plus(m, one))
        w = n.times(z, z)
        twice = n.plus(z, z)
        shares = [Fraction(1, 2 * j + 1) for j in range(1, self._until(NEAR_1, lambda j: 2 * j))]
        near = self._plus(twice, n.times(twice, w), self._series(shares, w, NEAR_1))
        exponent = code(f"sitofp {code.whole} {k} to {code.vector}")
        return n.settled(n.with_product(near, n.of_double(exponent), self._number(self.ln2)))

    def _reduced(self, x: Value, count: str, period: Fraction) -> Value:
        """x less `count` periods.

        The period is a sum of two numbers: the second restores the digits that cancel.
        """
        n, code = self.numbers, self.code
        less = n.of_double(code(f"fneg {code.vector} {count}"))
        first = sum(map(Fraction, as_doubles(period, n.parts)), Fraction(0))
        for part in (first, period - first):
            x = n.settled(n.with_product(x, less, self._number(part)))
        return x

    def _series(self, coefficients: Sequence[Fraction], x: Value, most: float) -> Value:
        """A power series by Horner's rule, for |x| <= most.

        The last terms, which are so small that a double's rounding of them is below the sum's, are
        summed in doubles.
        """
        n, plain = self.numbers, Doubles(self.code)
        small = 2.0 ** (plain.bits - n.bits - 2) * abs(coefficients[0])
        few = next((j for j, c in enumerate(coefficients) if abs(c) * most**j < small), 0)
        # 0 stands for none. For doubles themselves both branches do the same.
        total = self._number(coefficients[-1])
        for j in range(len(coefficients) - 2, -1, -1):
            c = self._number(coefficients[j])
            if 0 < few <= j:
                total = n.of_double(plain.with_product(c, total, x)[0])
            else:
                total = self._plus(c, total, x)
        return total

    def _plus(self, c: Value, total: Value, x: Value) -> Value:
        """c + total x, a step of a series in which each term is at most half of the one before."""
        # So c is its own base.
        return self.numbers.settled(self.numbers.with_raised_product(c, total, x))

    def _until(self, ratio: float, divisor: Callable[[int], int]) -> int:
        """The number of terms ratio^j / divisor(j) until they are below round-off."""
        j = 1
        while ratio**j / divisor(j) > 2.0 ** -(self.numbers.bits + 2):
            j += 1
        return j

    def _number(self, value: Fraction | int) -> Value:
        return tuple(map(self.code.number, as_doubles(Fraction(value), self.numbers.parts)))

    def _nearest(self, x: Value, factor: float) -> str:
        """The integer nearest to a number times a factor, as a double; a half is rounded up."""
        code = self.code
        turns = code.binary("fmul", x[0], code.number(factor))
        turns = code.binary("fadd", turns, code.number(0.5))
        return code(f"call {code.vector} @llvm.floor.{code.suffix}({code.vector} {turns})")

    def _chosen(self, mask: str, a: Value, b: Value) -> Value:
        return tuple(self.code.chosen(mask, x, y) for x, y in zip(a, b, strict=True))

    def _signed(self, x: Value, quarter: str) -> Value:
        """The opposite of x in the lanes where the second bit of an integer is 1."""
        code = self.code
        # The bit moves to the place of a double's sign, 62 bits further, which it then flips.
        sign = code.with_each("shl", code.with_each("and", quarter, 2), 62)
        return tuple(code.of_bits(code(f"xor {code.whole} {code.bits(y)}, {sign}")) for y in x)
