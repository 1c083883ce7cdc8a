"""Approximate orbits in any precision as Chebyshev series, step by step, by Newton's iteration.

Nothing here is proven, and nothing needs to be: :mod:`rigidpend.routes.certified.orbit` decides.

A step starts from a solution in doubles. Each iteration then computes the residual of the integral
equation on x in [-1, 1],

    R(x) = y + tau (integral of f(P) from -1 to x) - P(x),

in integers; y is the state at the beginning, tau half of the step's length in time, and f the
field, `rigidpend.mechanics.equations.aligned` itself. The equation linearised about the solution in
doubles gives the correction, also in doubles: each iteration gains about `GAIN` bits.
"""

import functools
import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from flint import arb

from rigidpend.machine.workers import check_stop
from rigidpend.mechanics.equations import AlignedCoefficients, aligned, aligned_along
from rigidpend.numbers import Array
from rigidpend.orbits.integrate.states import states_at
from rigidpend.routes.certified.models import Path
from rigidpend.routes.certified.proof_data import ORBIT_CLOCK, Step

GAIN = 35
"""Bits that an iteration gains: those to which doubles solve the linear equation."""
DOUBLE = 35
"""Bits of the solution in doubles that are taken as right at the beginning."""
COEFFICIENT_BITS = 46
"""Bits down to which doubles give coefficients; their decay tells how many a series needs."""
FASTER = 0.9
"""Coefficients kept, as a share of those for a geometric decay; measured, the decay is faster."""
NOISE = 2.0**-42
"""Size of a coefficient, over the largest one of a correction, below which it is round-off."""
FIRST_NODES = 64
"""Nodes of the first solution of a step."""
RESIDUAL_BITS = 8
"""Bits of a residual beyond those that its correction can use."""
GRAIN = 4
"""Numbers of coefficients are multiples of this, so that few rules are computed."""
LONGEST = 5.0
"""Length of a step times the faster one of the rates of rotation and saddle.

Measured: the time of a proof hardly depends on it from 4 to 6."""
CLEAR = 0.15
"""Least |M3|/|M| at the end of a step."""
SHORTER, SHORTEST = 0.8, 0.3
"""Factor by which a step that would end near M3 = 0 is shortened, and its least share of a step."""


class Rule(NamedTuple):
    """Chebyshev nodes and the matrices of what is linear in a polynomial's values at them."""

    nodes: Array
    """(n,), x = -cos(pi k/(n - 1)), rising from -1 to 1."""
    integral: Array
    """(n, n), from values to those of the integral from -1."""
    series: Array
    """(n, n), from values to coefficients w of w_0/2 + sum_j w_j T_j."""
    values: Array
    """(n, n), from coefficients w to values."""
    middles: Array
    """(n - 1, n), from values to those halfway, in the angle, between neighbouring nodes."""


@functools.lru_cache(maxsize=64)
def rule(n: int) -> Rule:
    """The rule of n nodes."""
    angle = np.pi * np.arange(n) / (n - 1)
    values = np.cos(np.outer(angle[::-1], np.arange(n)))
    # Series are w_0/2 + sum_j w_j T_j throughout, as in the certificates.
    values[:, 0] = 0.5
    # The inverse of `values` is known, a discrete cosine transform: values at both ends count
    # half, and so does the last coefficient.
    ends = np.where((np.arange(n) == 0) | (np.arange(n) == n - 1), 0.5, 1.0)
    series = 2 / (n - 1) * (np.cos(np.outer(np.arange(n), angle[::-1])) * ends)
    series[-1] /= 2
    middles = np.cos(np.outer((angle[::-1][:-1] + angle[::-1][1:]) / 2, np.arange(n)))
    middles[:, 0] = 0.5
    # Coefficients of the integral are (w_{j-1} - w_{j+1})/(2 j) for j > 0.
    antiderivative = np.zeros((n, n))
    for j in range(1, n):
        antiderivative[j, j - 1] = 1 / (2 * j)
        if j + 1 < n:
            antiderivative[j, j + 1] = -1 / (2 * j)
    integral = values @ antiderivative @ series
    # The constant that the series leaves open is fixed by an integral of zero at x = -1.
    return Rule(-np.cos(angle), integral - integral[:1], series, values, middles @ series)


class Approximation:
    """An approximate orbit, advanced step by step from the midpoints of six balls."""

    def __init__(self, coefficients: AlignedCoefficients, state: Sequence[arb]) -> None:
        self.coefficients = coefficients
        self.doubles = AlignedCoefficients(*(float(c.mid()) for c in coefficients))
        self.state = [_fixed(x) for x in state]
        size = math.hypot(*(float(x.mid()) for x in state[:3]))
        c = self.doubles
        # The pendulum motion rotates at the rate kappa |M|; beside it Qp^2 and Qm^2, which drive
        # M3, grow and decay at the rate sin(alpha0) |M|.
        self.longest = LONGEST / (size * max(c.kappa, 2 * c.half_sigma))
        self.size = size
        self._known: dict[int, AlignedCoefficients] = {}

    def step(self, bits: int) -> Step:
        """The next step, its coefficients in units of 2^-bits."""
        # The state has units of its own: the end of a step has one bit more than its coefficients,
        # and bits fall as the bound grows.
        begin = [
            x >> (here - bits) if here >= bits else x << (bits - here) for x, here in self.state
        ]
        half, states = self._in_doubles([x / 2**bits for x in begin])
        series, n = self._start(states, bits)
        # From here on the half-length is this integer, in the residual and in the certificate.
        whole = round(half * 2**ORBIT_CLOCK)
        linear = _Linear(series @ rule(n).values.T, self.doubles, half)
        known = DOUBLE
        P = [_whole(row, bits) for row in series]
        while True:
            # A step of thousands of bits takes half a minute.
            check_stop()
            # An early residual is not computed in more bits than its correction can use.
            work = min(bits, known + GAIN + RESIDUAL_BITS)
            residual = self._residual(P, begin, whole, bits, work)
            size = max(map(abs, (x for row in residual for x in row)))
            P = _corrected(P, residual, size.bit_length(), linear)
            won = bits - size.bit_length() + GAIN
            # Done, or stuck: then the checker finds a large defect, and says so.
            if won >= bits or won <= known:
                break
            known = won
        # T_j(1) = 1: the end is the sum of the series; w_0 counts half, so the sum is doubled and
        # has one bit more.
        self.state = [(w[0] + 2 * (sum(w[2::2]) + sum(w[1::2])), bits + 1) for w in P]
        return Step(whole, bits, P)

    def _in_doubles(self, begin: Sequence[float]) -> tuple[float, Array]:
        """The half-length of a step and the orbit's values at its nodes, (6, n), in doubles."""
        share = 1.0
        while True:
            half = share * self.longest / 2
            times = half * (1 + rule(FIRST_NODES).nodes[1:])
            ahead = states_at(self.doubles, np.array(begin), times)
            states = np.column_stack((begin, ahead))
            # No step may end near M3 = 0: the checker has to tell the sign at both ends (H4).
            clear = abs(states[2, -1]) > CLEAR * self.size or share < SHORTEST
            # A thin body turns far faster on its way over than beside the periodic orbits.
            if clear and _enough(states @ rule(FIRST_NODES).series.T) < FIRST_NODES:
                return half, states
            share *= SHORTER

    def _start(self, states: Array, bits: int) -> tuple[Array, int]:
        """Coefficients of the orbit in doubles, (6, n), and n, the number that `bits` ask for."""
        series = states @ rule(states.shape[1]).series.T
        enough = max(4, _enough(series))
        # If coefficients decay geometrically, their number grows in proportion to the bits.
        n = -(-(int(FASTER * enough * bits / COEFFICIENT_BITS) + 4) // GRAIN) * GRAIN
        kept = np.zeros((6, n))
        m = min(n, enough + 1)
        kept[:, :m] = series[:, :m]
        return kept, n

    def _numbers(self, bits: int) -> AlignedCoefficients:
        """The coefficients of the field in units of 2^-bits."""
        if bits not in self._known:
            paths = (Path.of_ball(arb(c), bits) for c in self.coefficients)
            self._known[bits] = AlignedCoefficients(*paths)
        return self._known[bits]

    def _residual(
        self, P: Sequence[Sequence[int]], begin: Sequence[int], whole: int, bits: int, work: int
    ) -> list[list[int]]:
        """Coefficients of R in units of 2^-bits, computed in `work` bits."""
        # Later coefficients are smaller than a unit of so few bits.
        shift, n = bits - work, min(len(P[0]), len(P[0]) * work // bits + GRAIN)
        rows = [[w >> shift for w in row[:n]] for row in P]
        rates = aligned([Path.of_series(row, work) for row in rows], self._numbers(work))
        found, rest = [], [0] * (len(P[0]) - n)
        for w, rate, x in zip(rows, rates, begin, strict=True):
            r = [whole * c >> ORBIT_CLOCK for c in rate.series[: n + 1]]
            integral = [(r[j - 1] - r[j + 1]) // (2 * j) for j in range(1, n)]
            # T_j(-1) = (-1)^j: this w_0 makes the integral, with y, equal to y at x = -1.
            first = 2 * ((x >> shift) - sum(integral[1::2]) + sum(integral[::2]))
            R = [(a - b) << shift for a, b in zip([first, *integral], w, strict=True)]
            found.append(R + rest)
        return found


class _Linear:
    """The integral equation linearised about an orbit, and its solution in doubles."""

    def __init__(self, states: Array, c: AlignedCoefficients, half: float) -> None:
        self.rule, self.half = rule(states.shape[1]), half
        self.J = jacobian(states, c)
        middle = jacobian(states @ self.rule.middles.T, c)
        Y = _fundamental(self.J, middle, half * np.diff(self.rule.nodes))
        self.Y, self.inverse = Y, np.linalg.inv(Y)
        integral = np.tensordot(self.rule.integral, half * (self.J @ Y), 1)
        # One correction of Y by its own integral equation, Y = 1 + half integral J Y: the few
        # digits of the Runge-Kutta rule become enough.
        self.Y = Y + self.solve(integral + np.eye(6) - Y)
        self.inverse = np.linalg.inv(self.Y)

    def solve(self, residual: Array) -> Array:
        """The solution d of d = residual + half integral J d at the nodes, (n, 6, k)."""
        # Variation of constants: d = R + Y (integral of Y^-1 half J R from -1).
        pulled = self.inverse @ (self.half * (self.J @ residual))
        return residual + self.Y @ np.tensordot(self.rule.integral, pulled, 1)


def jacobian(states: Array, c: AlignedCoefficients) -> Array:
    """Derivatives of the aligned field at states (6, n), as (n, 6, 6)."""
    along = aligned_along(states[:, None], np.eye(6)[:, :, None], c)
    return np.array(along).transpose(2, 0, 1)


def _fundamental(J: Array, middle: Array, lengths: Array) -> Array:
    """Fundamental matrix at the nodes by the classical Runge-Kutta rule, (n, 6, 6)."""
    h, one = lengths[:, None, None], np.eye(6)
    first = J[:-1]
    second = middle @ (one + h / 2 * first)
    third = middle @ (one + h / 2 * second)
    last = J[1:] @ (one + h * third)
    steps = one + h / 6 * (first + 2 * second + 2 * third + last)
    Y = np.empty_like(J)
    Y[0] = one
    for k, step in enumerate(steps):
        np.matmul(step, Y[k], out=Y[k + 1])
    return Y


def _enough(series: Array) -> int:
    """Number of the first coefficients, of (6, n), that are more than round-off."""
    # From each place on the largest coefficient: a single small one does not end a series.
    tail = np.maximum.accumulate(np.abs(series).max(axis=0)[::-1])[::-1]
    return int((tail > 2.0**-COEFFICIENT_BITS * tail[0]).sum())


def _corrected(
    P: Sequence[Sequence[int]], residual: Sequence[Sequence[int]], top: int, linear: _Linear
) -> list[list[int]]:
    """The series plus the solution of the linearised equation for a residual of `top` bits."""
    # The residual itself is added exactly; only the change that the equation makes of it is
    # computed in doubles. Larger integers are shifted to 60 bits, more than doubles hold.
    down = top - 60
    scaled = [[x >> down for x in row] if down > 0 else row for row in residual]
    R = np.array(scaled, dtype=float)
    d = linear.solve((R @ linear.rule.values.T).T[..., None])[..., 0].T
    change = d @ linear.rule.series.T - R
    # Coefficients beyond the last one that is more than round-off are cut: noise does not decay,
    # and the derivative in the defect multiplies it.
    size = np.abs(change).max(axis=0)
    last = int(np.flatnonzero(size > NOISE * size.max())[-1])
    change[:, last + 1 :] = 0
    correction = np.rint(change).tolist()
    lift = max(down, 0)
    return [
        [w + r + (int(x) << lift) for w, r, x in zip(*rows, strict=True)]
        for rows in zip(P, residual, correction, strict=True)
    ]


def _whole(row: Array, bits: int) -> list[int]:
    return [int(x) << (bits - 60) if bits >= 60 else int(x) >> (60 - bits) for x in row * 2.0**60]


def _fixed(x: arb) -> tuple[int, int]:
    """Midpoint of a ball as (mantissa, digits behind the binary point)."""
    mantissa, exponent = x.mid().man_exp()
    return int(mantissa), -int(exponent)
