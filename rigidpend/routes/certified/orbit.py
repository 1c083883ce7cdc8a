"""The checker of one orbit: it decides if given polynomials prove the orbit's crossings.

It knows nothing of how they were found. `docs/certified.md` states the theorem, whose hypotheses
are called H1 to H5 here as well. A hypothesis that is not shown ends in
:class:`rigidpend.routes.certified.proof_data.Undecided`. All times are dimensionless; those of a
step count in the unit of :class:`Enclosed`.
"""

from collections.abc import Sequence
from itertools import groupby, pairwise
from typing import NamedTuple

from flint import arb, ctx

from rigidpend.machine.workers import check_stop
from rigidpend.mechanics.free_body import separatrix_beside
from rigidpend.numbers.exact import Exact
from rigidpend.routes.certified.balls import (
    ARB_BITS,
    ball_of,
    double_above,
    momentum_unit,
    start_of,
    upper,
)
from rigidpend.routes.certified.models import Path, at_ends, on_parts
from rigidpend.routes.certified.passages import defects, joined, tube
from rigidpend.routes.certified.proof_data import ORBIT_BITS, ORBIT_CLOCK, Step, Undecided
from rigidpend.routes.certified.sections import Numbers
from rigidpend.routes.problem import RouteProblem

PART_COUNTS = (32, 256)
"""Numbers of equal parts of a step: the second is tried where the first leaves a sign in doubt."""
NEWTON = 3
"""Newton iterations, rounded to doubles, to the place of a crossing."""
AT_START = 64
"""Bits of the exact problem's enclosure beyond those of the first step."""


class Enclosed(NamedTuple):
    """The aligned problem of one orbit in balls: M in units of `unit`, t' in units of 1/unit."""

    numbers: Numbers
    state: tuple[arb, ...]
    """Qp, Qm, M3, gamma1, gamma2, gamma3 at t' = 0."""
    unit: arb
    """A power of two next to |M|, exact."""


def enclosed(problem: RouteProblem, theta2_0: Exact, bits: int) -> Enclosed:
    """Enclose the exact problem of an orbit that starts at theta1_0 = alpha0 + beta0.

    `theta2_0` is in radians. Round-off of the working precision widens the balls: it has `bits`, or
    as many more as J2_0 - J1_0 needs to be told from zero. Undecided where it takes too many.
    """
    with ctx.workprec(bits):
        given = problem.body, ball_of(problem.J1_0), problem.h0, ball_of(theta2_0)
        start, J2 = start_of(*given)
        # The root of what may be negative is no number.
        if not all(x.is_finite() for x in (*start, ball_of(problem.body.mu))):
            if bits > ORBIT_BITS:
                raise Undecided(f"H1: the start cannot be told in {bits} bits")
            return enclosed(problem, theta2_0, 2 * bits)
        # Coefficients in fixed point want |M| to be about one.
        unit = momentum_unit(J2)
        numbers = Numbers.of(problem.body, problem.h0, bits=bits, unit=unit)
        return Enclosed(numbers.of_symbols, start_of(*given, unit)[0], unit)


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


class Proof(NamedTuple):
    """The proof of an orbit, as far as it goes."""

    crossings: list[ProvenCrossing]
    steps: list[Step]
    reason: str
    """The reason for which it ends early; empty if it is whole."""
    unshown: bool = False
    """True if it ends with a step that is not shown: with more bits, and a lower bound, it may be.
    """

    @property
    def bits(self) -> int:
        """Bits of the first step, 0 without steps."""
        return self.steps[0].bits if self.steps else 0


class OrbitChecker:
    """A proof in progress: the exact orbit is within `bound` of the last polynomial's end.

    Steps are taken one after the other; `crossings` grows with them.
    """

    def __init__(self, problem: Enclosed) -> None:
        self.numbers, self.start, self.unit = problem
        self.growth, self.time, self.bound = self.numbers.growth, arb(0), arb(0)
        self.crossings: list[ProvenCrossing] = []
        self._end: list[Path] = []

    def take(self, step: Step) -> None:
        """Check H1 to H5 on a step and go to its end; Undecided where one is not shown."""
        check_stop()
        # Backward a bound would shrink.
        if step.half_length <= 0:
            raise Undecided("H2: the length of a step is not positive")
        states = [Path.of_series(w, step.bits) for w in step.series]
        # A coefficient of T_0 is twice what it stands for.
        half = Path.of_series([2 * step.half_length], ORBIT_CLOCK)
        end = self._end or [Path.of_ball(x, step.bits + ARB_BITS) for x in self.start]
        self._end = [x.at("z", 1) for x in states]
        with ctx.workprec(ARB_BITS):
            [begin] = joined(self.numbers, states, end, [self.bound])
            [leap] = defects(self.numbers, states, half)
            # Finer parts cost eight times as much: they are tried only where coarse ones leave a
            # sign in doubt. The tube is bounded anew with them, by smaller bounds on |M3|.
            for parts in PART_COUNTS:
                M3, beside = at_ends(states[2], parts)
                sizes = [(abs(a) + abs(b)) / 2 + beside for a, b in pairwise(M3)]
                self.bound, _ = tube(sizes, half.bound, begin + 2 * leap, self.numbers)
                try:
                    found = self._crossings(states, half.bound, parts)
                    break
                except Undecided as doubt:
                    reason = doubt
            else:
                raise reason
            self.crossings += found
            self.time += 2 * half.bound

    def _crossings(self, states: Sequence[Path], half: arb, parts: int) -> list[ProvenCrossing]:
        """H4: the crossings of a step, between parts on which the sign of M3 is shown."""
        away, found = self.bound / self.growth.upright, []
        sides = [(x > away) - (x < -away) for x in on_parts(states[2], parts)]
        # Both ends must be told. No crossing falls between two steps then: the exact M3 where they
        # join has the sign of either polynomial, for each is farther from zero than from it.
        if not (sides[0] and sides[-1]):
            raise Undecided("H4: M3 is too near zero at an end of a step for its sign to be told")
        runs = [list(run) for _, run in groupby(range(parts), sides.__getitem__)]
        for before, run, behind in zip(runs, runs[1:], runs[2:], strict=False):
            if sides[run[0]]:
                continue
            # The same side again: a touch of M3 = 0, or two crossings that these parts do not part.
            if sides[before[0]] == sides[behind[0]]:
                raise Undecided("H4: M3 comes too near zero without crossing it")
            found.append(self._crossing(states, slice(run[0], run[-1] + 1), half, parts))
        return found

    def _crossing(
        self, states: Sequence[Path], where: slice, half: arb, parts: int
    ) -> ProvenCrossing:
        """H5: the one crossing on a run of parts."""
        slopes, apart = states[2].derivative(), self._rate_apart(states, half)
        rates = on_parts(slopes, parts)[where]
        # Neighbouring parts share an end, so a positive bound on each gives one sign on all.
        if not all(abs(x) > apart for x in rates):
            raise Undecided("H5: M3 crosses zero too slowly for it to be one crossing")
        # Where M3 rises, beside 2 and 4, Qp is large and its sign tells which; where it falls,
        # beside 1 and 3, it is Qm.
        rising = rates[0] > 0
        large = on_parts(states[0 if rising else 1], parts)[where]
        if not all(abs(x) > self.bound for x in large):
            raise Undecided("H5: Q is too near zero at a crossing to tell its separatrix")
        ends = [(2 * k - parts) / parts for k in (where.start, where.stop)]
        x = self._zero(states[2], slopes, ends, min(abs(x).lower() for x in rates))
        # x = -1 is the beginning of the step, and times here are in units of 1/unit.
        time = (self.time + (1 + x) * half) / self.unit
        separatrix = separatrix_beside(rising, large[0], large[0])
        middle = float(time.mid())
        radius = double_above(abs(time - arb(middle)))
        return ProvenCrossing(middle, radius, separatrix, double_above(self.bound))

    def _rate_apart(self, states: Sequence[Path], half: arb) -> arb:
        """The right side of H5, a bound on the distance of dM3/dx from that of the exact orbit."""
        # 1/(4 lambda) is `twist`, and mu the length of (mu r1, mu r2). The mean of polynomial and
        # orbit, at which the lemma takes the derivative, has |Qp| + |Qm| at most `widest`.
        c, radius = self.numbers.field, self.bound
        widest = states[0].bound + states[1].bound + radius
        torque = (c.mu_r1**2 + c.mu_r2**2).sqrt() * self.growth.weight
        # |D_3| is at most |D|/sigma, and the radius includes the defect |D|.
        own = radius / self.growth.upright
        return upper(half * (2 * abs(c.twist) * widest + torque) * radius + own)

    def _zero(self, M3: Path, slopes: Path, ends: Sequence[float], least: arb) -> arb:
        """An enclosure of the place x of a crossing, about the polynomial's zero in doubles.

        It is between `ends`, where the polynomial's slope is `least` or more in size.
        """
        x = sum(ends) / 2
        for _ in range(NEWTON):
            x -= float((M3.value(arb(x)) / slopes.value(arb(x))).mid())
            # Newton's step may leave the run, beyond which no slope is bounded. Any x inside is
            # valid: |M3| there over the least slope is at least its distance from the zero.
            x = min(max(x, ends[0]), ends[1])
        off = abs(M3.value(arb(x))) + self.bound / self.growth.upright
        return arb(x, (off / least).upper())


def proof_of(problem: RouteProblem, theta2_0: Exact, steps: Sequence[Step]) -> Proof:
    """The proof that given steps are, as far as it goes, checked without integration."""
    if not steps:
        return Proof([], [], "there are no steps")
    found, reason = list[ProvenCrossing](), ""
    try:
        # In as many bits as `prove` took, so that times and bounds are the same, bit for bit.
        checker = OrbitChecker(enclosed(problem, theta2_0, steps[0].bits + AT_START))
        found = checker.crossings
        for step in steps:
            checker.take(step)
    except Undecided as doubt:
        reason = str(doubt)
    crossings = found[: problem.n_symbols + 1]
    if not reason and len(crossings) <= problem.n_symbols:
        reason = "the steps end before the last crossing"
    return Proof(crossings, list(steps), reason)
