"""Periodic orbits of (eq1) at J1 = 0 and J1 = J2 to round-off, with their Floquet multipliers.

In (M, gamma) they are the pendulum motions; theta1 on them is the direction in which orbits leave
or approach. A hyperbolic motion has two such directions, each a periodic solution of the Riccati
equation. Near mu = 0 all pendulum motions are hyperbolic, but not at every mu: with the body of
Fig. 5 the motion is elliptic, without such directions, for mu between 0.59 h0 and 0.87 h0, and
above that the directions come back turned by half a turn.

theta1 itself may turn fast, and then has complex singularities close to real times. Therefore the
linear system behind the Riccati equation is solved, in the aligned components and in time. There
only the pendulum motion limits the step, and its singularities approach real times no faster than
1/ln(1/(h0 - mu)). Each step is a Gauss collocation of order 2 `STAGES`; all steps of a period are
computed side by side.
"""

import functools
import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rigidpend.mechanics import jacobi, pendulum
from rigidpend.mechanics.body import Angles
from rigidpend.mechanics.coordinates import cos_sin_half
from rigidpend.mechanics.equations import AlignedCoefficients, aligned, rounded_coefficients
from rigidpend.numbers import Array

STAGES = 10
"""Number of Gauss points in a step: the method is of order 20."""
FEWEST_STEPS, MOST_STEPS = 32, 1 << 9
"""Number of steps of a period, at first and at most."""
SETTLED = 1e-11
"""Change of theta1 under halved steps, radians, below which the finer steps are taken.

Of the change 2^-(2 `STAGES`) is left as their error, which is below round-off."""


class NotHyperbolic(ArithmeticError):
    """Error: the pendulum motion is not hyperbolic; it has no stable and no unstable direction."""


class PeriodicOrbit(NamedTuple):
    """A periodic orbit at J1 = 0 or J1 = J2, dimensionless."""

    family: int
    """Family: 1 at J1 = 0, 2 at J1 = J2."""
    epsilon: int
    """Sign: 1 beside separatrices 2 and 4, -1 beside 1 and 3."""
    tau: Array
    """Phase theta2 (family 1) or theta1 + theta2 (family 2), radians, (n,).

    It runs from -pi/2, the lowest point, over a turn, at equal steps of t'."""
    theta1: Array
    """Angle theta1, radians, (n,); its first value is within pi of beta0 + epsilon alpha0."""
    period: float
    """Period, t'."""
    exponent: float
    """Floquet exponent along the direction theta1, per t'.

    With u = J2_0 sin(alpha0) it is u/2 + O(mu) where orbits leave, -u/2 + O(mu) where they
    approach. The small action J1 or J2 - J1 is quadratic in the components of M, and grows at twice
    this rate."""
    turns: int
    """Number of turns by which theta1 grows in a period; 0 near mu = 0."""

    @property
    def exponent_per_period(self) -> float:
        return self.exponent * self.period

    @property
    def multiplier(self) -> float:
        """Floquet multiplier of (M, gamma), negative where the direction comes back reversed."""
        return (-1) ** self.turns * math.exp(self.exponent_per_period)


def periodic_orbit(p: Angles, h0: float, family: int = 1, epsilon: int = 1) -> PeriodicOrbit:
    """Compute a hyperbolic periodic orbit to round-off, wherever mu < h0 and it is hyperbolic.

    The energy h0 is kappa J2_0^2/2, where J2_0 is J2 at r . gamma = 0. In family 1, at J1 = 0,
    orbits leave along epsilon = 1 and approach along -1; in family 2, at J1 = J2, conversely.

    The error of the multiplier's logarithm is below 2^-45 h0/((h0 - mu) sin(alpha0)), the relative
    error of the period below 2^-48 h0/(h0 - mu): mu and alpha0 are rounded, and near h0 the motion
    almost rests at its highest point. Random bodies, with h0 - mu from 0.9 h0 down to 1e-7 h0 and
    A2 down to 0.003 A1, reach half of each bound. If A1 - A3 is a part d < 0.01 of A1, the error of
    the logarithm may be 0.01/d times as large; the worst of 410 random bodies, with d from 1e-2
    down to 1e-6, reached a quarter of that. A logarithm near 0, as where A1 - A2 is a small part d
    of A1, keeps digits of its own: of 70 random bodies, with d from 0.09 down to 1e-10, it erred by
    less than a part of 1e-16 h0/((h0 - mu) d).

    Of a p in 113 bits alpha0 is not rounded: where mu is below sin(alpha0) h0, the first bound
    holds without sin(alpha0). Of 522 random bodies, with A2 down to 1e-8 A1, the worst reached 0.18
    of it.

    NotHyperbolic is raised if there is no such orbit. ArithmeticError is raised if rounding decides
    whether there is, or if `MOST_STEPS` don't settle it: then h0 - mu is so small, the motion so
    nearly parabolic, or the body so nearly symmetric, that rounding decides, or the multiplier is
    beyond doubles. ValueError is raised for an epsilon other than 1 or -1.
    """
    if epsilon not in (1, -1):
        raise ValueError(f"epsilon is 1 or -1, not {epsilon!r}")
    # The reversal that exchanges the families also exchanges leaving and approaching.
    leaving = pendulum.side_of(family) * epsilon == 1
    linear = _Rounded(rounded_coefficients(p), *map(cos_sin_half, (p.alpha0, p.beta0)))
    p = Angles(*map(float, p))
    n, coarse, said = FEWEST_STEPS, np.array([np.nan]), ""
    while n <= MOST_STEPS:
        tau, steps = _steps(p, linear, float(h0), family, n)
        try:
            with np.errstate(over="ignore", invalid="ignore"):
                theta1, growth = _direction(steps, leaving, p, linear, epsilon)
        except NotHyperbolic as error:
            # Of a thin body too few steps give any sum: twice as many have to give the same.
            if said == str(error):
                raise
            said, theta1 = str(error), np.array([np.nan])
        except np.linalg.LinAlgError:
            # A long step may grow so that its matrix is singular in doubles.
            theta1 = np.array([np.nan])
        # Every second start of the fine steps is a start of the coarse ones.
        if np.abs(theta1[::2] - coarse).max() < SETTLED:
            period = float(pendulum.period(p, h0, math))
            turns = round((theta1[-1] - theta1[0]) / (2 * np.pi))
            return PeriodicOrbit(family, epsilon, tau, theta1[:-1], period, growth / period, turns)
        n, coarse = 2 * n, theta1
    raise ArithmeticError(
        f"{MOST_STEPS} steps don't settle the periodic orbit at h0 = {h0}, mu = {p.mu}, "
        f"alpha0 = {p.alpha0}, beta0 = {p.beta0}, kappa = {p.kappa}: rounding decides, or its "
        "multiplier is too large"
    )


class _Rounded(NamedTuple):
    """Numbers of a body for the linear system, doubles, each correct to its last digit."""

    c: AlignedCoefficients
    half_alpha: tuple[float, float]
    """Cosine and sine of alpha0/2."""
    half_beta: tuple[float, float]


@functools.lru_cache(maxsize=16)
def _steps(p: Angles, linear: _Rounded, h0: float, family: int, n: int) -> tuple[Array, Array]:
    """Compute tau at the start of n equal steps of time, and the steps' matrices less 1 (n, 2, 2).

    The matrices act on (Qp, Qm), which are uncoupled without weight. In other components the small
    sin(alpha0) would be lost by cancellation where alpha0 is near 0 or pi.
    """
    nodes, weights, integrals = _gauss()
    turn, step = np.arange(n) / n, 1 / n
    # 2 sn^2 - 1 and 2 sn cn have half the period of sn: a rotation takes 2 K of its argument.
    half_turn = 2 * jacobi.K(pendulum.complement(h0, p.mu, math), math)
    up, ahead, _ = pendulum.swing(turn * half_turn, h0, p.mu, np)
    B = step * _linearised(turn[:, None] + step * nodes, p, linear, h0, family)
    # B_i is the system's matrix at node i, times the step. The fundamental matrix, 1 at a step's
    # beginning, has the values X_i = 1 + sum_j integrals_ij B_j X_j.
    size = 2 * STAGES
    system = np.eye(size) - np.einsum("ij,abnj->niajb", integrals, B).reshape(n, size, size)
    ones = np.broadcast_to(np.tile(np.eye(2), (STAGES, 1)), (n, size, 2))
    X = np.linalg.solve(system, ones).reshape(n, STAGES, 2, 2)
    tau = np.unwrap(np.atan2(up, ahead))
    return tau, np.einsum("j,abnj,njbc->nac", weights, B, X)


def _linearised(
    turn: NDArray[Any], p: Angles, linear: _Rounded, h0: float, family: int
) -> NDArray[Any]:
    """Matrix of the linear system of Qp and Qm, (2, 2, ...), at times `turn` in periods.

    The rates are per period.
    """
    period, r = pendulum.period(p, h0, math), (*linear.half_beta, 0)
    # The dimensionless equations are those of a body with A3 = 1/kappa.
    # M3 = -J2 in family 1 (J1 = 0), M3 = J2 in family 2.
    sign = -pendulum.side_of(family)
    motion = pendulum.body_motion(turn * period, sign, 1 / p.kappa, r, h0, p.mu, np)
    (*_, M3), (gamma1, gamma2, _) = motion
    # The rates of Qp and Qm are linear in Qp, Qm and gamma3: unit vectors give exact columns.
    (cos, sin), columns = linear.half_alpha, []
    for Qp, Qm in ((1.0, 0.0), (0.0, 1.0)):
        # gamma3 follows from M . gamma = 0.
        M1, M2 = (Qp + Qm) / (2 * cos), (Qp - Qm) / (2 * sin)
        gamma3 = -(M1 * gamma1 + M2 * gamma2) / M3
        columns.append(aligned((Qp, Qm, M3, gamma1, gamma2, gamma3), linear.c)[:2])
    return period * np.array(columns).swapaxes(0, 1)


@functools.cache
def _gauss() -> tuple[Array, Array, Array]:
    """Gauss points in [0, 1], their weights, and the weights of the integrals from 0 to each point.

    The last are (i, j): factor of the value at point j in the integral from 0 to point i.
    """
    # Integrals of Legendre polynomials up to each node, times the inverse of their values there.
    legendre = np.polynomial.legendre
    nodes, weights = legendre.leggauss(STAGES)
    values = legendre.legvander(nodes, STAGES)
    degree = np.arange(1, STAGES)
    integrals = np.empty((STAGES, STAGES))
    integrals[:, 0] = 1 + nodes
    # The integral of P_n from -1 is (P_{n+1} - P_{n-1})/(2 n + 1).
    integrals[:, 1:] = (values[:, 2:] - values[:, :-2]) / (2 * degree + 1)
    return (1 + nodes) / 2, weights / 2, integrals @ np.linalg.inv(values[:, :-1]) / 2


def _direction(
    steps: Array, leaving: bool, p: Angles, linear: _Rounded, epsilon: int
) -> tuple[Array, float]:
    """Find theta1 at the ends of the steps, (n + 1,), and the logarithm of M's growth in a period.

    Solutions are carried in the sense of time in which they grow, so that errors shrink beside
    them.
    """
    whole = functools.reduce(lambda done, step: done + step + step @ done, steps)
    # Steps are added one to another, and each has the rounding of its largest number.
    vector, growth = _eigenvector(whole, leaving, 2.0**-50 * float(np.abs(steps).sum()))
    ordered = steps if leaving else np.linalg.solve(np.eye(2) + steps, -steps)[::-1]
    found, summed = [vector], 0.0
    for step in ordered:
        vector = vector + step @ vector
        # Scaled to length 1 after each step, since the length may overflow over a period.
        length = math.hypot(*vector)
        vector, summed = vector / length, summed + math.log(length)
        found.append(vector)
    Qp, Qm = np.array(found if leaving else found[::-1]).T
    # theta1 - beta0 = 2 l, l = atan2(M1, M2); both are multiplied by 2 sin cos of alpha0/2 > 0.
    cos, sin = linear.half_alpha
    theta1 = p.beta0 + 2 * np.unwrap(np.atan2(sin * (Qp + Qm), cos * (Qp - Qm)))
    # The sign of an eigenvector is free, and changes theta1 by a turn: the value next to the
    # separatrix is taken.
    centre = p.beta0 + epsilon * p.alpha0
    theta1 += 2 * np.pi * np.round((centre - theta1[0]) / (2 * np.pi))
    growth = growth or summed
    return theta1, growth if leaving else -growth


def _eigenvector(whole: Array, leaving: bool, rounding: float) -> tuple[Array, float]:
    """Eigenvector, of length 1, of 1 + `whole`, a period's matrix, which leaves or approaches.

    With it comes the logarithm of the larger eigenvalue where that is near 1, or else 0.
    """
    # The product of the eigenvalues is the determinant, 1, so that the trace of `whole` is its
    # determinant's negative. Of a nearly symmetric body `whole` is small, and this keeps digits.
    size = float(np.abs(whole).max())
    beyond = float(np.trace(whole)) if not size < 1 else -float(np.linalg.det(whole))
    unknown = rounding * min(size, 1.0)
    if abs(beyond) <= unknown:
        raise ArithmeticError(
            "the pendulum motion is nearly parabolic: the sum of its multipliers is closer to 2"
            f" than {unknown:.1g}, and rounding decides whether it is more"
        )
    # A matrix that overflows, with a trace that is no number, gives a vector that never settles.
    if -4 <= beyond <= 0:
        told = f"{2 + beyond:.6g}" if beyond < -1e-3 else f"2 - {-beyond:.2g}"
        raise NotHyperbolic(
            f"the pendulum motion is not hyperbolic: its multipliers have the sum {told}, "
            "between -2 and 2"
        )
    # The root of trace^2 - 4 is that of a product, which does not cancel near a parabolic motion.
    turned = beyond < 0
    more = -4 - beyond if turned else beyond
    half = (more + math.sqrt(more * (more + 4))) / 2
    # The eigenvalues less 1. Only the larger of them is formed as a sum.
    other = -half / (1 + half)
    if turned:
        half, other = -2 - half, -2 - other
    # By the theorem of Cayley and Hamilton the columns of the matrix less the other eigenvalue are
    # eigenvectors.
    columns = whole - np.eye(2) * (other if leaving else half)
    lengths = np.hypot(*columns)
    # Both columns are eigenvectors, but one may be zero or nearly so: the longer one is taken.
    best = int(np.argmax(lengths))
    return np.asarray(columns[:, best] / lengths[best]), math.log1p(half) if 0 < half < 1 else 0.0
