"""Lie-Poisson splittings of the Euler-Poisson equations: geometry exact at any step.

The Hamiltonian is a sum of M1^2/(2 A1), M2^2/(2 A2), M3^2/(2 A3) and mu r . gamma. Each of the
four alone is solved exactly: the first three turn M and gamma about an axis, the last moves M
by mu gamma x r. Every step is thus a Poisson map: \\|gamma\\| and M . gamma stay as they are, to
rounding, and the energy keeps within a bound for as long as orbits are followed.

The symmetric step of order 2 is composed to higher orders,
S(w1 h) S(w2 h) ... S(w2 h) S(w1 h), with the weights of `SCHEMES`.

References
----------
.. [1] Strang, G. (1968). SIAM J. Numer. Anal. 5, 506-517.
.. [2] Suzuki, M. (1990). Phys. Lett. A 146, 319-323: the five-fold fractal.
.. [3] Kahan, W., Li, R.-C. (1997). Math. Comp. 66, 1089-1099: schemes s9odr6a and s17odr8a.
.. [4] McLachlan, R. I. (1993). Phys. Rev. Lett. 71, 3043-3046: splitting of Lie-Poisson systems.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from rigidpend.mechanics.equations import cross
from rigidpend.numbers.generic import Elementary, Numbers, Scalar

KICK = 3
"""The fourth part, the potential; 0, 1 and 2 are the turns about the axes."""
SCHEMES: dict[int, tuple[str, ...]] = {
    2: (),
    # 1/(4 - 4^(1/3)), twice [2]_.
    4: ("0.41449077179437573714235406286076385",) * 2,
    # s9odr6a, then s17odr8a [3]_.
    6: (
        "0.39216144400731413927925056",
        "0.33259913678935943859974864",
        "-0.70624617255763935980996482",
        "0.082213596293550800230149045",
    ),
    8: (
        "0.13020248308889008087881763",
        "0.56116298177510838456196441",
        "-0.38947496264484728640807860",
        "0.15884190655515560089621075",
        "-0.39590389413323757733623154",
        "0.18453964097831570709183254",
        "0.25837438768632204729397911",
        "0.29501172360931029887096624",
    ),
}
"""Weights of each order up to the middle one, decimal: the sum of all is 1."""


class Splitting(NamedTuple):
    """A body as the splitting sees it, physical units, with the substeps of a step."""

    A: Numbers
    mu_r: Numbers
    """mu r, 3 numbers."""
    substeps: tuple[tuple[int, Any], ...]
    """Substeps: the part, and its share of the step; the first and the last are kicks."""

    def advance(self, vectors: Numbers, h: Scalar, steps: int = 1, m: Elementary = np) -> list[Any]:
        """Take some steps of length `h`, physical time; an array gives every orbit its own.

        Vectors are 3 arrays (k, ...), the components of k vectors in principal axes: M first, then
        gamma and any others that are fixed in space. `m` has sin and cos.
        """
        (_, first), *inner, (_, last) = self.substeps
        found = self._kicked(list(vectors), first * h)
        for count in range(steps, 0, -1):
            for part, share in inner:
                found = self._turned(found, part, share * h, m)
            # The last kick of a step and the first of the next are one.
            found = self._kicked(found, (last if count == 1 else last + first) * h)
        return found

    def _turned(self, v: list[Any], part: int, h: Scalar, m: Elementary) -> list[Any]:
        """The exact flow of M_i^2/(2 A_i), or of the potential."""
        if part == KICK:
            return self._kicked(v, h)
        j, k = (part + 1) % 3, (part + 2) % 3
        angle = v[part][0] * (h / self.A[part])
        cos, sin = m.cos(angle), m.sin(angle)
        v[j], v[k] = v[j] * cos + v[k] * sin, v[k] * cos - v[j] * sin
        return v

    def _kicked(self, v: list[Any], h: Scalar) -> list[Any]:
        """The exact flow of mu r . gamma: gamma stays, M grows evenly."""
        torque = cross([x[1] for x in v], self.mu_r)
        moved = [np.array(x) for x in v]
        for x, push in zip(moved, torque, strict=True):
            x[0] += push * h
        return moved


def splitting(A: Numbers, r: Numbers, mu: Scalar, order: int, number: Any = float) -> Splitting:
    """The splitting of a body, of order 2, 4, 6 or 8.

    `number` makes a number of a text: `float`, or that of an mpmath context.
    """
    substeps: list[tuple[int, Any]] = [(KICK, 0 * number("1"))]
    outer = [number(w) for w in SCHEMES[order]]
    for weight in (*outer, 1 - 2 * sum(outer), *reversed(outer)):
        half = weight / 2
        parts = [(KICK, half), (0, half), (1, half), (2, weight), (1, half), (0, half)]
        # Neighbours of one kind are one substep.
        substeps[-1] = (KICK, substeps[-1][1] + half)
        substeps += [*parts[1:], (KICK, half)]
    return Splitting(tuple(A), tuple(mu * x for x in r), tuple(substeps))


def stages(order: int) -> int:
    """Number of steps of order 2 in a step."""
    return 2 * len(SCHEMES[order]) + 1
