"""Rate at which the distance of two orbits can grow: the logarithmic norm of the aligned field.

The distance of two states with difference (p, q, s, g1, g2, g3) is measured by

    p^2 + q^2 + (sin(alpha0) s)^2/2 + (|g|/w)^2,    w > 0 any number.

For this norm the terms of Qp, Qm and M3 among themselves cancel but for the saddle of the
periodic orbits: what remains is sin(alpha0)/2 |M3|, the true exponent beside them.
"""

from __future__ import annotations

from typing import NamedTuple

from flint import arb

from rigidpend.mechanics.equations import AlignedCoefficients

HEAVIEST = 2**16
"""Weight w of gamma at most, which a free body would leave without a bound."""


class LogarithmicNorm(NamedTuple):
    """Constants of the norm and of its rate, balls."""

    saddle: arb
    """sin(alpha0)/2, the exponent per unit of M3."""
    upright: arb
    """sin(alpha0)/sqrt(2), the weight of M3."""
    weight: arb
    """w, exact."""
    torque: arb
    """Bound on the torque of a unit gamma, in the norm of M."""
    turning: arb
    """Bound on |omega| of a unit M of that norm."""

    @classmethod
    def of(cls, c: AlignedCoefficients) -> LogarithmicNorm:
        """Constants from the coefficients of the aligned equations, balls."""
        saddle = arb(c.half_sigma)
        # With sigma^2 = 2 lambda^2 the free body's own terms cancel in the lemma,
        # but for its saddle. The two that follow are its F and Omega, by which
        # momentum and gamma drive each other.
        upright = saddle * arb(2).sqrt()
        torque = _larger(_hypotenuse(c.force_p, c.force_m), upright * _hypotenuse(c.mu_r1, c.mu_r2))
        turning = _larger(
            arb(2).sqrt() * _larger(abs(c.omega1), abs(c.omega2)), abs(c.kappa) / upright
        )
        # The weight at which both are equal; any number will do, so the midpoint is taken as exact.
        best = (turning / torque).sqrt() if torque > arb(HEAVIEST) ** -2 * turning else HEAVIEST
        return cls(saddle, upright, arb(best).mid(), torque, turning)

    def rate(self, M3: arb, radius: arb) -> arb:
        """Bound on the logarithmic rate of growth of the distance of two orbits.

        Parameters
        ----------
        M3 : arb
            Bound on |M3| halfway between the orbits.
        radius : arb
            Bound on their distance; one of them has |gamma| = 1.
        """
        # The larger eigenvalue of the lemma's quadratic form.
        steep = self.saddle * M3
        coupling = self.weight * self.torque + (1 + self.weight * radius / 2) * (
            self.turning / self.weight
        )
        return (steep + _hypotenuse(steep, coupling)) / 2

    @property
    def bending(self) -> arb:
        """Bound on the second derivative of the field, for two states of norm 1."""
        return (1 + self.turning * self.turning).sqrt()

    def steepness(self, size: arb) -> arb:
        """Bound on the derivative of the field, for a state of norm 1, at states of such a size."""
        return self.bending * size + self.weight * self.torque

    def norm(self, state: tuple[arb, ...]) -> arb:
        """Norm of a difference of states."""
        p, q, s, *g = state
        squares = [p, q, self.upright * s, *(x / self.weight for x in g)]
        return sum((x * x for x in squares), arb(0)).sqrt()


def _larger(a: arb, b: arb) -> arb:
    return a.max(b)


def _hypotenuse(a: arb, b: arb) -> arb:
    return (a * a + b * b).sqrt()
