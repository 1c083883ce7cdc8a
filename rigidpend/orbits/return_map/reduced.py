"""Reduced equations beside the upper periodic orbit (J1 = J2), with an angle as time.

With J3 = 0 and the energy h given, a state is (Qp, Qm, psi). The angle psi tells how far the
vertical has turned about M: gamma = cos(psi) R e1 - sin(psi) R e2, where R is the smallest rotation
that takes e3 to M/J2. It equals theta1 + theta2 - pi/2 - beta0/2. Then r . gamma is
cos(psi + beta0/2) less a term of second order in Qp and Qm. The angle psi grows steadily; with psi
as time the system has two dimensions, no neutral direction and exactly the given energy.

The equations use S = J2 + M3, and with it J2 - M3 = (M1^2 + M2^2)/S without cancellation.
"""

from typing import Any, NamedTuple

from rigidpend.mechanics.body import Angles
from rigidpend.mechanics.equations import AlignedCoefficients, aligned_coefficients
from rigidpend.numbers import Scalar
from rigidpend.numbers.exact import GUARD_BITS, context
from rigidpend.orbits.precision import Precision


class Coefficients(NamedTuple):
    """The numbers in the reduced equations, in one precision."""

    aligned: AlignedCoefficients
    to_M1: Any
    """1/(2 cos(alpha0/2)), the factor from Qp + Qm to M1."""
    to_M2: Any
    """1/(2 sin(alpha0/2)), the factor from Qp - Qm to M2."""

    def momenta(self, Qp: Any, Qm: Any) -> tuple[Any, Any]:
        """M1 and M2 of components Qp and Qm: numbers, arrays or power series."""
        return (Qp + Qm) * self.to_M1, (Qp - Qm) * self.to_M2


def coefficients(p: Angles, unit: str, a: Precision) -> Coefficients:
    """The coefficients of a body, with M in units of 1/`unit` (so mu of 1/unit^2).

    `p` holds numbers with guard bits, so that each coefficient is rounded only once.
    """
    m = context(a.bits + GUARD_BITS)
    scaled = p._replace(mu=p.mu * m.mpf(unit) ** 2)
    found = AlignedCoefficients(*map(a.number, aligned_coefficients(scaled, m)))
    half = p.alpha0 / 2
    return Coefficients(found, a.number(1 / (2 * m.cos(half))), a.number(1 / (2 * m.sin(half))))


class ReducedRates(NamedTuple):
    """Rates of change in t', with three functions that the energy and M3 need."""

    Qp: Any
    Qm: Any
    psi: Any
    theta3: Any
    drop: Any
    """mu (cos(psi + beta0/2) - r . gamma)."""
    across: Any
    """M1^2 + M2^2."""
    product: Any
    """Qp Qm."""


def reduced(Q: Scalar, turn: Scalar, size: Any, c: Coefficients) -> ReducedRates:
    """Right-hand side of the reduced equations, from eq. eq and th3, dimensionless time t'.

    Parameters
    ----------
    Q : 2 numbers or power series
        Qp and Qm.
    turn : 2 numbers
        cos(psi), sin(psi).
    size : 4 numbers or power series
        J2, M3, 1/J2 and 1/S.
    c : Coefficients

    Notes
    -----
    gamma3 = -(M1 cos(psi) - M2 sin(psi))/J2. Power series have no division: hence the reciprocals.
    Their products take long: of Qp and Qm there are three, of which all else is made up.
    """
    (Qp, Qm), (cos, sin), (J2, M3, per_J2, per_S), k = Q, turn, size, c.aligned
    pp, pm, mm = Qp * Qp, Qp * Qm, Qm * Qm
    # M1 cos(psi) - M2 sin(psi) and mu r . M are linear in Qp and Qm.
    lean_p, lean_m = c.to_M1 * cos - c.to_M2 * sin, c.to_M1 * cos + c.to_M2 * sin
    by_p, by_m = _weights(c)
    gamma3 = (Qp * -lean_p + Qm * -lean_m) * per_J2
    # From gamma by the rotation R: mu r . gamma = mu cos(psi + beta0/2) - drop, with
    # drop = -gamma3 mu r . M/S.
    both = pp * (by_p * lean_p) + pm * (by_p * lean_m + by_m * lean_p) + mm * (by_m * lean_m)
    drop = both * per_J2 * per_S
    spin, square = M3 * k.half_sigma, (c.to_M1 * c.to_M1, c.to_M2 * c.to_M2)
    # The rates of Qp and Qm are those of the aligned equations, with this gamma3.
    return ReducedRates(
        Qp=gamma3 * k.force_p - spin * Qp,
        Qm=spin * Qm - gamma3 * k.force_m,
        psi=J2 * k.kappa - pm * per_S + drop * per_J2,
        theta3=(Qp * by_p + Qm * by_m) * per_J2 * per_J2,
        drop=drop,
        across=(pp + mm) * (square[0] + square[1]) + pm * (2 * (square[0] - square[1])),
        product=pm,
    )


def lift(turn: Scalar, c: Coefficients) -> Any:
    """The weight's energy on the periodic orbit, mu cos(psi + beta0/2); `turn` as in `reduced`."""
    return c.aligned.mu_r1 * turn[0] - c.aligned.mu_r2 * turn[1]


def theta3_rate(M: Any, c: Coefficients) -> Any:
    """Rate of the precession angle theta3 (eq. th3) from Qp, Qm and M3, radians per t'.

    It is mu (r1 M1 + r2 M2)/J2^2.
    """
    Qp, Qm, M3 = M
    M1, M2 = c.momenta(Qp, Qm)
    by_p, by_m = _weights(c)
    return (Qp * by_p + Qm * by_m) / (M1 * M1 + M2 * M2 + M3 * M3)


def _weights(c: Coefficients) -> tuple[Any, Any]:
    """The factors of Qp and Qm in the product mu r . M = mu (r1 M1 + r2 M2), where r3 = 0."""
    along, across = c.to_M1 * c.aligned.mu_r1, c.to_M2 * c.aligned.mu_r2
    return along + across, along - across
