"""The problem behind Fig. 4: its checked numbers, and its scales of time and distance."""

import functools
import math
from dataclasses import dataclass
from typing import Any

from rigidpend.machine import files
from rigidpend.mechanics import pendulum
from rigidpend.mechanics.body import Body, check_units
from rigidpend.mechanics.free_body import fastest_rate
from rigidpend.numbers import checked
from rigidpend.numbers.checked import ParameterError
from rigidpend.numbers.exact import Exact, ExactError, context, function

MOST_SYMBOLS = 100_000
"""Largest number of symbols on an orbit."""
LEAST_MU = 1e-100
"""Least mu relative to h0: doubles lose a smaller one."""
OF_SYMBOL = 11
"""Bytes of a result for each symbol: symbol, certainty, separatrix and crossing time."""
SMALLEST_RATIO = "1e-500"
"""Least J1_0/J2_0: the components, of the order of its square root, are then normal doubles."""


def check_energy(name: str, h: Exact, mu: Exact) -> None:
    """Raise ParameterError for an energy not above mu, or one that calls for other units."""
    if not h.at(113) > mu.at(113):
        raise ParameterError(name, f"{name} > mu is broken: {name} = {h}, mu = {mu}")
    check_units(name, h)


@dataclass(frozen=True)
class RouteProblem:
    """Orbits that start at theta1_0 = alpha0 + beta0, J1_0 and J2_0 = sqrt(2 h0/kappa).

    J1_0 and J2_0 are dimensionless, h0 is in physical units, as mu; all are taken exactly.
    ParameterError says which condition is broken: h0 > mu, and 0 < J1_0 < J2_0 but not on the
    section J1 = J2/2.
    """

    body: Body
    h0: Exact
    J1_0: Exact
    n_symbols: int
    """Number of symbols to find on each orbit."""

    def __post_init__(self) -> None:
        checked.of_kind("body", self.body, Body)
        n = checked.whole("n_symbols", self.n_symbols, 1, MOST_SYMBOLS)
        object.__setattr__(self, "n_symbols", n)
        for name in ("h0", "J1_0"):
            object.__setattr__(self, name, checked.number(name, getattr(self, name)))
        m = context(113)
        h0, mu = self.h0.at(113), self.body.mu.at(113)
        check_energy("h0", self.h0, self.body.mu)
        if 0 < mu < LEAST_MU * h0:
            message = f"mu = {self.body.mu} is below {LEAST_MU} h0, too small for doubles; mu = 0?"
            raise ParameterError("mu", message)
        J1, J2 = self.J1_0.at(113), self.J2_0(113)
        shown = f"J1_0 = {self.J1_0}, J2_0 = {float(J2):.17g}"
        if not (J1 > 0 and self.J2mJ1_0(113) > 0):
            raise ParameterError("J1_0", f"0 < J1_0 < J2_0 is broken: {shown}")
        # Closer to the section rounding errors would decide whether the start counts as a crossing.
        if abs(2 * J1 - J2) < m.mpf(2) ** -48 * J2:
            message = f"the start lies on the section J1 = J2/2 that counts crossings: {shown}"
            raise ParameterError("J1_0", message)
        if m.mpf(SMALLEST_RATIO) > J1 / J2:
            raise ParameterError("J1_0", f"J1_0 = {self.J1_0} is below {SMALLEST_RATIO} J2_0")

    def afford(self, columns: int, field: str = "theta2_0") -> None:
        """Raise ParameterError, naming `field`, for more columns than a result can hold."""
        what = f"{columns} columns of {self.n_symbols} symbols"
        files.afford(field, columns * (self.n_symbols + 1), OF_SYMBOL, what)

    @property
    def energies(self) -> tuple[Exact, Exact]:
        """The least and the largest energy of the orbits, over all phases."""
        # The energy is h0 + mu times the height of the centre of gravity, which is -1 to 1.
        return self.h0 - self.body.mu, self.h0 + self.body.mu

    def J2_0(self, bits: int) -> Any:
        """J2_0 = sqrt(2 h0/kappa), dimensionless (after eq. sol_3), in `bits` bits."""
        return _rounded_J2_0(self.body.A, self.h0, bits)

    def J2mJ1_0(self, bits: int) -> Any:
        """J2_0 - J1_0, dimensionless, correctly rounded to `bits` bits however small it is."""
        try:
            return (_J2_0(self.body.A, self.h0) - self.J1_0).at(bits)
        # The difference cannot be told from zero, as where J1_0 is given as the expression of J2_0.
        # Zero makes the check of the conditions refuse it.
        except ExactError:
            return context(bits).mpf(0)


@functools.lru_cache(maxsize=256)
def _J2_0(A: tuple[Exact, Exact, Exact], h0: Exact) -> Exact:
    """J2_0 as an exact expression, which gives as many bits as a difference from it needs."""
    A1, A2, A3 = A
    return function("sqrt", 2 * h0 * A3 * (A1 - A2) / (A1 * A2))


@functools.lru_cache(maxsize=256)
def _rounded_J2_0(A: tuple[Exact, Exact, Exact], h0: Exact, bits: int) -> Any:
    return _J2_0(A, h0).at(bits)


def phase_rate(problem: RouteProblem) -> float:
    """The faster of the problem's rates, radians per t': of rotation, kappa J2, or exponent u."""
    return fastest_rate(float(problem.J2_0(53)), problem.body.angles(), math)


def rotation_period(problem: RouteProblem) -> float:
    """The period in t' of the pendulum rotation that the orbits pass by."""
    return float(pendulum.period(problem.body.angles(113), problem.h0.at(113), context(113)))


@functools.lru_cache(maxsize=256)
def passage_rotations(problem: RouteProblem) -> float:
    """Number of pendulum rotations in a typical passage of a periodic orbit.

    J1/J2 falls and grows again, both by exp(2 pi^2/nu) in a rotation. Its least value is the
    largest of three: the splitting of the surfaces, about mu/h0 nu/sinh(nu) times the cosine of a
    random phase; the distance of the start from them; and rounding in doubles. Without weight
    (mu = 0) the orbit never returns: infinity.
    """
    p, m = problem.body.angles(), context(53)
    if not p.mu:
        return math.inf
    depth = float(m.log(2 * problem.h0.at(53) / problem.body.mu.at(53)))
    # ln(J2/J1) at the closest, over 2 pi^2/nu, is half of the rotations: in and out take the same.
    return max(1.0, (depth + min(closeness(problem), 53 * math.log(2))) * p.nu / math.pi**2)


def closeness(problem: RouteProblem) -> float:
    """ln(displacement of both surfaces / distance at which orbits pass them).

    Orbits pass at the distance by which the surfaces are split, or at that of the start where it is
    larger: a part J1_0/J2_0 of the displacement.
    """
    start = float(context(53).log(problem.J2_0(53) / problem.J1_0.at(53)))
    return min(narrowness(problem.body.angles().nu), start)


LAYER = 16.0
"""Largest |I| of orbits over nu times the splitting of the surfaces.

Of 200 orbits each of eleven bodies drawn by lot, through 100 passages, it was 8.6 to 15.6, the more
the larger nu = 6.6 to 21."""
MOST_NARROWER = 40
"""Largest number of bits by which tables of a layer are narrower than the displacement.

Midlines are found in doubles."""
FEWEST, FEWEST_HEAVY, HEAVY = 6, 3, 0.01
"""Least number of such bits that pays; and the same, where mu is above `HEAVY` h0.

Arcs that begin beside a midline take longer: with five bodies of 3 to 5 bits first calls took 1.2
to 1.7 times as long. Series over the whole displacement of a heavy body may not shrink."""


@functools.lru_cache(maxsize=256)
def narrower(problem: RouteProblem) -> int:
    """Bits by which the layer of orbits is narrower than the displacement of both surfaces.

    Return maps of these orbits count d from the midlines. 0 stands for bits so few that they do not
    pay.
    """
    p, m = problem.body.angles(), context(53)
    if not p.mu:
        return 0
    share = problem.J1_0.at(53) / problem.J2_0(53)
    weight = problem.body.mu.at(53) / problem.h0.at(53)
    # Starts have to lie in the layer, and within the range of its normal form: |I| of a start is
    # 4 J1/J2 times the displacement, its |v| at most as large as where arcs end.
    close = min(narrowness(p.nu), float(-m.log(4 * share)))
    nats = min(close - math.log(LAYER * p.nu), float(m.log(weight / (8 * share))))
    bits = math.floor(nats / math.log(2))
    return min(bits, MOST_NARROWER) if bits >= (FEWEST_HEAVY if weight > HEAVY else FEWEST) else 0


def narrowness(nu: float) -> float:
    """ln(sinh(nu)/nu) = ln(displacement of both surfaces / their splitting)."""
    # In this form sinh(nu) does not overflow.
    return nu + math.log(-math.expm1(-2 * nu) / (2 * nu))


def whisker_growth(nu: float) -> float:
    """Geometric mean of the growth of an error in a passage, where phases are as good as random.

    A passage at distance q lasts (2/u) ln(1/q) and turns the phase by (2 nu/pi) ln(1/q). The
    distance q of the next passage is proportional to Melnikov's sine of the phase, so that the new
    phase's derivative is 1 - (2 nu/pi) cot(phase). The logarithm of its size has the mean
    ln sqrt(1 + (2 nu/pi)^2) over all phases.
    """
    return math.hypot(1, 2 * nu / math.pi)


@functools.lru_cache(maxsize=32)
def passage_limit(problem: RouteProblem, bits: int) -> float:
    """Longest time t' that an orbit may take to its next crossing, in a computation of `bits` bits.

    In one rotation the distance from a periodic orbit grows by exp(pi^2/nu). The limit is twice the
    time to distance one from the smallest distance that `bits` bits resolve, relative to that of
    the start and to mu/h0, and four rotations.
    """
    m, p = context(53), problem.body.angles()
    smaller = min(problem.J1_0.at(53), problem.J2mJ1_0(53))
    # Distances are the square roots of actions, hence the half.
    depth = m.log(problem.J2_0(53) / smaller) / 2
    if p.mu:
        depth += m.log(problem.h0.at(53) / problem.body.mu.at(53))
    nats = float(depth) + (bits + 20) * math.log(2)
    return (2 * nats * p.nu / math.pi**2 + 4) * rotation_period(problem)
