"""The checker of one orbit: it decides if given polynomials prove the orbit's crossings.

It knows nothing of how they were found. `docs/certified.md` states the theorem, whose hypotheses
are called H1 to H5 here as well. A hypothesis that is not shown ends in :class:`Undecided`, never
in a symbol. All times are dimensionless; those of a step count in the unit of
:class:`rigidpend.routes.certified.balls.Enclosed`.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from flint import arb, ctx

from rigidpend.machine.workers import check_stop
from rigidpend.mechanics.equations import AlignedCoefficients, aligned
from rigidpend.mechanics.free_body import separatrix_beside
from rigidpend.routes.certified.balls import (
    ARB_BITS,
    Enclosed,
    LogarithmicNorm,
    double_above,
    upper,
)
from rigidpend.routes.certified.models import PART_COUNTS, VALUE_BITS, Model, Values, above
from rigidpend.routes.certified.pieces import ORBIT_CLOCK, Step

NEWTON = 3
"""Newton iterations, rounded to doubles, to the place of a crossing."""
RADIUS_TRIALS, FIRST_RADIUS = 4, 4
"""Trials of a tube's radius, and the first radius over the distance that it has to hold."""
WIDEST = 2.0**-6
"""Radius of a tube at most: nothing is decided where the distance may be larger."""


class Undecided(ArithmeticError):
    """Error: the polynomials do not prove what comes next; the text says why."""


class Outgrown(Undecided):
    """Error: the bound on the distance has grown too large; more bits would help."""


class ProvenCrossing(NamedTuple):
    """A proven crossing of M3 = 0."""

    time: float
    """t', within `radius` of the exact time."""
    radius: float
    """t'."""
    separatrix: int
    """1 to 4, the one beside which the orbit crosses."""
    bound: float
    """Bound on the distance of the polynomial from the exact orbit over its step, in the norm."""


class OrbitChecker:
    """A proof in progress: the exact orbit is within `bound` of the last polynomial's end.

    Steps are taken one after the other; `crossings` grows with them.
    """

    def __init__(self, problem: Enclosed) -> None:
        with ctx.workprec(ARB_BITS):
            self.growth = LogarithmicNorm.of(problem.coefficients)
        self.coefficients, self.start, self.unit = problem
        self.time, self.bound = arb(0), arb(0)
        self.crossings: list[ProvenCrossing] = []
        self._end: list[arb] | None = None

    def take(self, step: Step) -> None:
        """Check H1 to H5 on a step and go to its end; Undecided where one is not shown."""
        check_stop()
        # Backward a bound would shrink.
        if step.half_length <= 0:
            raise Undecided("H2: the length of a step is not positive")
        models = [Model.of_series(w, step.bits) for w in step.series]
        duration = arb(step.half_length) / 2**ORBIT_CLOCK
        with ctx.workprec(ARB_BITS):
            begin = self._joined(models)
            _check_below("H1: the distance where two steps join", begin)
            leap = defect(models, duration, self.coefficients, self.growth)
            _check_below("H2: the distance with a step's defect", begin + 2 * leap)
            # Finer parts cost eight times as much: they are tried only where coarse ones leave a
            # sign in doubt. The tube is bounded anew with them, by smaller bounds on |M3|.
            for parts in PART_COUNTS:
                M3 = Values(models[2], parts)
                radius = self._tube(begin, leap, M3, duration, parts)
                doubt = self._doubt(models, M3, radius, duration, parts)
                if not doubt:
                    break
            else:
                raise Undecided(doubt)
            self.time += 2 * duration

    def _joined(self, models: Sequence[Model]) -> arb:
        """H1: bound on the distance at the beginning, from that at the end of the step before."""
        here = [_end(model, -1) for model in models]
        # In the polynomials' own bits, because the jump is a difference of nearly equal numbers:
        # 64 bits would lose it to cancellation.
        with ctx.workprec(models[0].bits + ARB_BITS):
            before = self.start if self._end is None else self._end
            gap = tuple(abs(a - b).upper() for a, b in zip(here, before, strict=True))
        self._end = [_end(model, 1) for model in models]
        return upper(self.bound + self.growth.norm(gap))

    def _tube(self, begin: arb, leap: arb, M3: Values, duration: arb, parts: int) -> arb:
        """H3: bound on the distance over the whole step, which `leap`, its defect (H2), adds to."""
        # D is bounded over x in [-1, 1], an interval of length 2: it adds at most 2 delta. The
        # last argument says that the growth lemma takes M3 halfway to the orbit.
        sizes, length = [_from_units(M3.upper(k)) for k in range(parts)], 2 * duration / parts
        grown, _, holds = growth_in_tube(sizes, length, begin + 2 * leap, self.growth, WIDEST, 0.5)
        _check_below("H3: the distance at the end of a step", grown)
        if not holds:
            raise Outgrown("H3: no tube is shown to hold the orbit; more bits would help")
        self.bound = grown
        return grown

    def _doubt(
        self, models: Sequence[Model], M3: Values, radius: arb, duration: arb, parts: int
    ) -> str:
        """H4 and H5: the reason for which M3's signs or crossings are not shown; empty if they are.

        Only if all of them are shown are the step's crossings recorded.
        """
        away = _in_units(radius / self.growth.upright)
        sides = [(M3.at[k] > 0) - (M3.at[k] < 0) if M3.lower(k) > away else 0 for k in range(parts)]
        # Both ends must be told. No crossing falls between two steps then: the exact M3 where they
        # join has the sign of either polynomial, for each is farther from zero than from it.
        if not (sides[0] and sides[-1]):
            return "H4: M3 is too near zero at an end of a step for its sign to be told"
        found = []
        for first, last in _gaps(sides):
            # The same side again: a touch of M3 = 0, or two crossings that these parts do not part.
            if sides[first - 1] == sides[last + 1]:
                return "H4: M3 comes too near zero without crossing it"
            crossing = self._crossing(models, range(first, last + 1), radius, duration, parts)
            if isinstance(crossing, str):
                return crossing
            found.append(crossing)
        self.crossings += found
        return ""

    def _crossing(
        self, models: Sequence[Model], where: range, radius: arb, duration: arb, parts: int
    ) -> ProvenCrossing | str:
        """H5: the one crossing on a run of parts, or the reason for which it is not shown."""
        slopes = models[2].derivative()
        rates = Values(slopes, parts)
        # Neighbouring parts share an end, so a positive bound on each gives one sign on all.
        least = min(map(rates.lower, where))
        if least <= _in_units(self._rate_apart(models, radius, duration)):
            return "H5: M3 crosses zero too slowly for it to be one crossing"
        # Where M3 rises, beside 2 and 4, Qp is large and its sign tells which; where it falls,
        # beside 1 and 3, it is Qm.
        rising = rates.at[where[0]] > 0
        large = Values(models[0 if rising else 1], parts)
        if min(map(large.lower, where)) <= _in_units(radius):
            return "H5: Q is too near zero at a crossing to tell its separatrix"
        Q = large.at[where[0]]
        x = self._zero(models[2], slopes, where, parts, upper(radius / self.growth.upright), least)
        # x = -1 is the beginning of the step, and times here are in units of 1/unit.
        time = (self.time + (1 + x) * duration) / self.unit
        return ProvenCrossing(
            *_contained(time), separatrix_beside(rising, Q, Q), double_above(radius)
        )

    def _rate_apart(self, models: Sequence[Model], radius: arb, duration: arb) -> arb:
        """The right side of H5, a bound on the distance of dM3/dx from that of the exact orbit."""
        # 1/(4 lambda) is `twist`, and mu the length of (mu r1, mu r2). The mean of polynomial and
        # orbit, at which the lemma takes the derivative, has |Qp| + |Qm| at most `widest`.
        c = self.coefficients
        widest = sum((arb(x.size) / arb(2) ** x.bits for x in models[:2]), radius)
        torque = (c.mu_r1**2 + c.mu_r2**2).sqrt() * self.growth.weight
        # |D_3| is at most |D|/sigma, and the radius includes the defect |D|.
        own = radius / self.growth.upright
        return upper(duration * (2 * abs(c.twist) * widest + torque) * radius + own)

    def _zero(
        self, M3: Model, slopes: Model, where: range, parts: int, away: arb, least: int
    ) -> arb:
        """An enclosure of the place x of a crossing, about the polynomial's zero in doubles.

        `away` bounds the distance of M3 from that of the orbit, `least` its slope from below.
        """
        low, high = ((2 * k - parts) / parts for k in (where[0], where[-1] + 1))
        x = (low + high) / 2
        for _ in range(NEWTON):
            x -= float((M3.at(arb(x)) / slopes.at(arb(x))).mid())
            # Newton's step may leave the run, beyond which no slope is bounded. Any x inside is
            # valid: |M3| there over the least slope is at least its distance from the zero.
            x = min(max(x, low), high)
        off = abs(M3.at(arb(x))) / arb(2) ** M3.bits + away
        return arb(x, (off / _from_units(least)).upper())


def growth_in_tube(
    sizes: Sequence[arb],
    length: arb,
    begin: arb,
    growth: LogarithmicNorm,
    widest: float,
    share: float,
) -> tuple[arb, arb, bool]:
    """A bound on the distance over a step, the factor of its growth, and True if a tube holds it.

    `sizes` bound |M3| of the polynomials on parts of equal `length` in time. `begin` is the
    distance at the beginning with what the step adds. `widest` is the largest radius of a tube,
    and the rate is taken within `share` of the radius from the polynomials: 1/2 for the growth of
    a distance, 1 for that of derivatives at the orbits.
    """
    # A radius is assumed, then verified: as long as the distance is below `assumed` it is at most
    # `grown`, and if that is less, it never reaches `assumed`. The rate depends on it but little.
    assumed = FIRST_RADIUS * begin
    for _ in range(RADIUS_TRIALS):
        # A wider tube decides nothing, and the rate would be larger in it.
        assumed = assumed.min(arb(widest))
        wide = share * assumed / growth.upright
        rates = (growth.rate(size + wide, 2 * share * assumed) for size in sizes)
        factor = (sum(rates, arb(0)) * length).exp()
        grown = upper(factor * begin)
        # Balls compare as true only where that is certain: what may be larger counts as larger.
        if grown < assumed:
            return grown, factor, True
        if not grown < widest:
            break
        assumed = 2 * grown
    return grown, factor, False


def defect(
    models: Sequence[Model],
    duration: arb,
    coefficients: AlignedCoefficients,
    growth: LogarithmicNorm,
) -> arb:
    """H2: bound on the norm of dP/dx - duration f(P) over a step, where f is the aligned field.

    `duration` is half of the step's length in time.
    """
    # f is quadratic with constants as enclosures: one product of polynomials for each of its terms.
    bits = models[0].bits
    half = Model.of_ball(duration, bits)
    numbers = AlignedCoefficients(*(Model.of_ball(arb(c), bits) for c in coefficients))
    rates = aligned(models, numbers)
    parts = [P.derivative() - half * rate for P, rate in zip(models, rates, strict=True)]
    return upper(growth.norm(tuple(arb(part.size) / arb(2) ** bits for part in parts)))


def _end(model: Model, x: int) -> arb:
    """The polynomial's value at x = -1 or 1, as a ball: an integer over 2^(bits + 1)."""
    w = model.series
    # T_j(x) = x^j: odd and even j apart, without w_0, which counts half.
    signs = w[1::2], w[2::2]
    twice = w[0] + 2 * (x * sum(signs[0]) + sum(signs[1]))
    with ctx.workprec(model.bits + ARB_BITS):
        return arb(twice) / arb(2) ** (model.bits + 1)


def _check_below(what: str, distance: arb) -> None:
    # Balls compare as true only where that is certain: what may be larger counts as larger.
    if not distance < WIDEST:
        said = f"{what} may be {float(distance.mid()):.3g}, more than {WIDEST}"
        raise Outgrown(f"{said}; more bits would help")


def _contained(ball: arb) -> tuple[float, float]:
    """A double, and a distance from it within which the whole ball lies."""
    middle = float(ball.mid())
    return middle, double_above(abs(ball - arb(middle)))


def _gaps(sides: Sequence[int]) -> list[tuple[int, int]]:
    """First and last index of each run of zeros."""
    # The first and the last side are known, so every run of zeros has a neighbour on either side.
    starts = [k for k, side in enumerate(sides) if not side and sides[k - 1]]
    ends = [k for k, side in enumerate(sides) if not side and sides[k + 1]]
    return list(zip(starts, ends, strict=True))


def _from_units(value: int) -> arb:
    return arb(value) / 2**VALUE_BITS


def _in_units(x: arb) -> int:
    """A bound in units of 2^-VALUE_BITS, rounded up."""
    return above(x * arb(2) ** VALUE_BITS)
