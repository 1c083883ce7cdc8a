"""The checker of intervals of starts: whether given polynomials prove the symbols of all of them.

It knows nothing of how they were found. `docs/full-shift.md` has the theorem, whose hypotheses are
H1 to H5 of `docs/certified.md` for a family. Whatever is not shown ends in :class:`Undecided`.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from fractions import Fraction
from itertools import pairwise
from typing import NamedTuple

from flint import arb, ctx

from rigidpend.mechanics.body import Body
from rigidpend.mechanics.free_body import separatrix_beside
from rigidpend.numbers.exact import Exact
from rigidpend.routes.certified.balls import SCALARS, start_of
from rigidpend.routes.certified.checker import Undecided
from rigidpend.routes.certified.models import Family
from rigidpend.routes.certified.passages import followed, told
from rigidpend.routes.certified.pieces import FamilyStep
from rigidpend.routes.certified.sections import BITS, Numbers

MOST_TERMS = 100
"""Terms of cosine and sine on an interval at most."""


class PhaseInterval(NamedTuple):
    """Starts with theta2_0/2 pi from place/2^depth to (place + 1)/2^depth."""

    place: int
    depth: int

    @property
    def share(self) -> Fraction:
        """Its share of the line."""
        return Fraction(1, 1 << self.depth)

    @property
    def ends(self) -> tuple[Fraction, Fraction]:
        """theta2_0/2 pi at its ends."""
        return Fraction(self.place, 1 << self.depth), Fraction(self.place + 1, 1 << self.depth)

    @property
    def middle(self) -> Fraction:
        """theta2_0/2 pi in the middle, where u = 0."""
        return Fraction(2 * self.place + 1, 2 << self.depth)

    @property
    def halves(self) -> list[PhaseInterval]:
        """Both halves of it."""
        return [PhaseInterval(2 * self.place + k, self.depth + 1) for k in (0, 1)]


class EnclosedStarts(NamedTuple):
    """Starts of one J1_0 and h0 on the left array's line, over balls."""

    numbers: Numbers
    body: Body
    J1: Fraction
    h0: Exact

    @classmethod
    def of(cls, body: Body, h0: Exact, J1: Fraction) -> EnclosedStarts:
        """Enclose the numbers of a problem."""
        return cls(Numbers.of(body, h0)._replace(along=""), body, J1, h0)

    def states(self, of: PhaseInterval) -> list[Family]:
        """The starts of an interval, as functions of u."""
        with ctx.workprec(BITS):
            turn, J1 = (arb(x.numerator) / x.denominator for x in (2 * of.middle, self.J1))
            here, ahead = (
                start_of(self.body, J1, self.h0, (turn + quarter) * arb.pi())[0]
                for quarter in (0, arb("0.5"))
            )
            # M does not depend on theta2, and gamma turns about it.
            cos, sin = turned(arb.pi() / 2**of.depth)
            fixed = [Family.of_ball(x, BITS) for x in here[:3]]
            turning = [
                Family.of_ball(x, BITS) * cos + Family.of_ball(y, BITS) * sin
                for x, y in zip(here[3:], ahead[3:], strict=True)
            ]
            return fixed + turning


def turned(angle: arb) -> tuple[Family, Family]:
    """Cosine and sine of angle u."""
    u, found = Family.of({(0, 1, 0): 2}, 0), [Family.of_fraction(0, 0) for _ in range(2)]
    power, term = Family.of_fraction(1, 0), arb(1)
    for k in range(MOST_TERMS):
        if term < arb(2) ** -BITS:
            # Terms are halved at least by now: what is left is less than twice this one.
            return found[0].widened(2 * term), found[1].widened(2 * term)
        sign = -1 if k % 4 > 1 else 1
        found[k % 2] += power * Family.of_ball(sign * term, BITS)
        power, term = power * u, term * angle / (k + 1)
    raise Undecided("H1: the interval is too long for its starts to be told")


def symbols(starts: EnclosedStarts, of: PhaseInterval, pieces: Sequence[FamilyStep]) -> list[bool]:
    """Check the orbits that start on an interval: the symbols that all of them have.

    The text of what is undecided begins with the name of the hypothesis.
    """
    return symbols_of(list(_signs(starts, starts.states(of), pieces)))


def symbols_of(told: Sequence[int | tuple[bool, int]]) -> list[bool]:
    """H4: the symbols of what is told of parts one after another.

    Of each part that is the sign of M3, or, beside a crossing, whether M3 rises and the sign of
    the large one of Q+ and Q-.
    """
    runs = [sign for k, sign in enumerate(told) if k == 0 or told[k - 1] != sign]
    # M3 < 0, a crossing on which it rises, M3 > 0, one on which it falls, and so on.
    order = [(-1, 1)[k // 2 % 2] if k % 2 == 0 else k % 4 == 1 for k in range(len(runs))]
    kinds = all(isinstance(x, tuple) == (k % 2 == 1) for k, x in enumerate(runs))
    heads = [x[0] if isinstance(x, tuple) else x for x in runs]
    if len(runs) % 2 == 0 or not kinds or heads != order:
        raise Undecided("H4: M3 is not shown to change its sign at crossings alone")
    passed = [separatrix_beside(*x, x[1]) for x in runs if isinstance(x, tuple)]
    return [(after - before) % 4 == 1 for before, after in pairwise(passed)]


def _signs(
    starts: EnclosedStarts, before: list[Family], pieces: Sequence[FamilyStep]
) -> Iterator[int | tuple[bool, int]]:
    """H1 to H5; on each part the sign of M3, or whether it rises with the sign of the large Q."""
    numbers = starts.numbers
    for states, _, [bound] in followed(numbers, pieces, [arb(0)], "H", before):
        with ctx.workprec(SCALARS):
            yield from signs_on_step(numbers, states, bound)


def signs_on_step(
    numbers: Numbers, states: Sequence[Family], bound: arb
) -> Iterator[int | tuple[bool, int]]:
    """H5: what is told of each part of a step, in the form of :func:`symbols_of`.

    The orbits are within `bound` of the polynomials.
    """
    for sign, box in told(numbers, states, bound, "H5", (-1, 1)):
        if not box:
            yield sign
            continue
        # Where M3 rises Qp is the large one, else Qm.
        large = box[0 if sign > 0 else 1]
        if not (large > 0 or large < 0):
            raise Undecided("H5: Q is too near zero at a crossing to tell its separatrix")
        yield sign > 0, 1 if large > 0 else -1
