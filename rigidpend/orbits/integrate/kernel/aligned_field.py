"""The aligned field as recurrences of Taylor coefficients, in either kind of lanes' numbers.

They are `rigidpend.mechanics.equations.aligned` term by term: products become sums over j of a_j
b_(k-j).
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

from rigidpend.mechanics.equations import AlignedCoefficients
from rigidpend.orbits.integrate.kernel.lane_numbers import KINDS

if TYPE_CHECKING:
    from rigidpend.orbits.integrate.kernel.lane_numbers import Value
    from rigidpend.orbits.integrate.kernel.taylor_step import Kernel

BITS, SPARE = 53, 24
"""Bits of a part, and those that a coefficient has more than its size on a step asks for."""
COMPONENTS = ("Qp", "Qm", "M3", "gamma1", "gamma2", "gamma3")


class Products(AlignedCoefficients):
    """The parameters of the recurrences, whose products are with omega rather than with Q and M.

    `half_sigma` is divided by kappa, for the product with omega3 = kappa M3, and `twist` by
    omega1 omega2.
    """

    __slots__ = ()

    @classmethod
    def of(cls, c: AlignedCoefficients) -> Products:
        """The parameters of a body."""
        twist = c.twist / (c.omega1 * c.omega2)
        return cls(*c._replace(half_sigma=c.half_sigma / c.kappa, twist=twist))


class AlignedField(NamedTuple):
    """The field of every body, which enters through `Products`."""

    components: tuple[str, ...] = COMPONENTS
    functions: tuple[str, ...] = ()

    def recurrences(self, kernel: Kernel) -> AlignedRecurrences:
        return AlignedRecurrences(kernel)


ALIGNED = AlignedField()


class AlignedRecurrences:
    """Lines that find the series of the six components."""

    def __init__(self, kernel: Kernel) -> None:
        self.kernel, self.code, self.numbers = kernel, kernel.code, kernel.numbers
        self.component, self.parts = kernel.component, kernel.parts
        rows = self.numbers.rows((kernel.order + 1) * self.parts)
        self.turning = [self.code.variable(rows) for _ in range(3)]
        count = len(Products._fields)
        self.c = Products(*(kernel.scalar("%parameters", i, count) for i in range(count)))

    def expand(self) -> None:
        """Find all coefficients from those of order 0."""
        first = 0
        for parts, last in parts_by_order(self.kernel.order, self.parts):
            self.numbers = KINDS[BITS * parts](self.code, self.parts)
            with self.code.loop(last, first) as k:
                self._next_coefficients(k)
            first = last

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
        self.kernel.integrated(zip(COMPONENTS, rates, strict=True), k, n)

    def _products(self, k: str) -> dict[str, Value]:
        """Coefficients of order k of nine products: of omega_i with Qp, Qm, gamma (a, b, c)."""
        code, n = self.code, self.numbers
        pairs = ("3p", "3m", "12", "3b", "2c", "1c", "3a", "2a", "1b")
        sums = {pair: code.variable(n.rows(n.parts)) for pair in pairs}
        own = type(n)(code)
        for place in sums.values():
            own.store(own.of_double("zeroinitializer"), place, 0)
        with code.loop(code(f"add i64 {k}, 1")) as j:
            other = code(f"sub i64 {k}, {j}")
            left = {i: n.load(x, j) for i, x in zip("123", self.turning, strict=True)}
            names = zip("pmabc", (x for x in COMPONENTS if x != "M3"), strict=True)
            right = {letter: n.load(self.component[x], other) for letter, x in names}
            right["2"] = n.load(self.turning[1], other)
            for pair, place in sums.items():
                total = own.load(place, 0)
                own.store(own.with_product(total, left[pair[0]], right[pair[1]]), place, 0)
        return {pair: own.settled(own.load(place, 0)) for pair, place in sums.items()}


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
