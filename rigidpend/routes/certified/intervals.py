"""The checker of intervals of starts: it decides if polynomials prove symbols of all their orbits.

It knows nothing of how they were found. `docs/full-shift.md` states the theorem (Theorem 9), whose
hypotheses are H1 to H5 of `docs/certified.md` for a family. A hypothesis that is not shown ends in
:class:`Undecided`.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from fractions import Fraction
from itertools import groupby, pairwise
from typing import NamedTuple

from flint import arb, ctx

from rigidpend.mechanics.body import Body
from rigidpend.mechanics.free_body import separatrix_beside
from rigidpend.numbers.exact import Exact
from rigidpend.routes.certified.balls import ARB_BITS, ball_of, start_of
from rigidpend.routes.certified.models import INPUT_BITS, Family
from rigidpend.routes.certified.passages import followed, signs_on_parts
from rigidpend.routes.certified.proof_data import FamilyStep, Undecided
from rigidpend.routes.certified.sections import Numbers

TERMS = 64
"""Terms of cosine and sine on an interval: of an angle of 4 the next one is 2^-168."""


class PhaseInterval(NamedTuple):
    """The starts with theta2_0/(2 pi) from place/2^depth to (place + 1)/2^depth."""

    place: int
    depth: int

    @property
    def share(self) -> Fraction:
        """The interval's share of the line 0 <= theta2_0 < 2 pi."""
        return Fraction(1, 1 << self.depth)

    @property
    def ends(self) -> tuple[Fraction, Fraction]:
        """The values of theta2_0/(2 pi) at both ends."""
        return Fraction(self.place, 1 << self.depth), Fraction(self.place + 1, 1 << self.depth)

    @property
    def middle(self) -> Fraction:
        """The value of theta2_0/(2 pi) in the middle, where u = 0."""
        return Fraction(2 * self.place + 1, 2 << self.depth)

    @property
    def halves(self) -> list[PhaseInterval]:
        """Both halves of the interval."""
        return [PhaseInterval(2 * self.place + k, self.depth + 1) for k in (0, 1)]


class EnclosedStarts(NamedTuple):
    """The starts of one J1_0 and one h0 on the left array's line of Fig. 4, over balls."""

    numbers: Numbers
    body: Body
    J1: Fraction
    h0: Exact

    @classmethod
    def of(cls, body: Body, h0: Exact, J1: Fraction) -> EnclosedStarts:
        """Enclose the numbers of a problem."""
        return cls(Numbers.of(body, h0).of_symbols, body, J1, h0)

    def states(self, of: PhaseInterval) -> list[Family]:
        """The aligned components of the starts of an interval, as functions of u."""
        with ctx.workprec(INPUT_BITS):
            turn, J1 = ball_of(2 * of.middle), ball_of(self.J1)
            here, ahead = (
                start_of(self.body, J1, self.h0, (turn + quarter) * arb.pi())[0]
                for quarter in (0, arb("0.5"))
            )
            # M does not depend on theta2, and gamma turns about it: from that of the middle and
            # that a quarter of a turn later follow all others.
            cos, sin = turned(arb.pi() / 2**of.depth)
            fixed = [Family.of_ball(x, INPUT_BITS) for x in here[:3]]
            turning = [
                Family.of_ball(x, INPUT_BITS) * cos + Family.of_ball(y, INPUT_BITS) * sin
                for x, y in zip(here[3:], ahead[3:], strict=True)
            ]
            return fixed + turning


def turned(angle: arb) -> tuple[Family, Family]:
    """Cosine and sine of angle * u, as functions of u, for an angle of less than 4."""
    u, found = Family.of({(0, 1, 0): 2}, 0), [Family.of_fraction(0, 0) for _ in range(2)]
    power, term = Family.of_fraction(1, 0), arb(1)
    for k in range(TERMS):
        sign = -1 if k % 4 > 1 else 1
        found[k % 2] += power * Family.of_ball(sign * term, INPUT_BITS)
        power, term = power * u, term * angle / (k + 1)
    # By now each term is at most half of the one before: the rest is less than twice this one.
    return found[0].widened(2 * term), found[1].widened(2 * term)


def symbols(starts: EnclosedStarts, of: PhaseInterval, pieces: Sequence[FamilyStep]) -> list[bool]:
    """Check the orbits that start on an interval: True for 1 for each symbol that all of them have.

    Undecided where a hypothesis is not shown; the text begins with its name.
    """
    numbers, told = starts.numbers, list[int | tuple[bool, int]]()
    for states, _, [bound] in followed(numbers, pieces, [arb(0)], starts.states(of)):
        with ctx.workprec(ARB_BITS):
            told += signs_on_step(numbers, states, bound)
    return symbols_of(told)


def symbols_of(told: Sequence[int | tuple[bool, int]]) -> list[bool]:
    """H4: the symbols that follow from what is told of parts one after the other.

    Each part tells the sign of M3 or, beside a crossing, the pair of True if M3 rises and the sign
    of the large one of Q+ and Q-. Undecided if M3 may change its sign elsewhere.
    """
    runs = [part for part, _ in groupby(told)]
    # M3 < 0, a crossing on which it rises, M3 > 0, one on which it falls, and so on.
    order = [(-1, 1)[k // 2 % 2] if k % 2 == 0 else k % 4 == 1 for k in range(len(runs))]
    kinds = all(isinstance(x, tuple) == (k % 2 == 1) for k, x in enumerate(runs))
    heads = [x[0] if isinstance(x, tuple) else x for x in runs]
    if len(runs) % 2 == 0 or not kinds or heads != order:
        raise Undecided("H4: M3 is not shown to change its sign at crossings alone")
    passed = [separatrix_beside(*x, x[1]) for x in runs if isinstance(x, tuple)]
    return [(after - before) % 4 == 1 for before, after in pairwise(passed)]


def signs_on_step(
    numbers: Numbers, states: Sequence[Family], bound: arb
) -> Iterator[int | tuple[bool, int]]:
    """H5: tell of each part of a step what :func:`symbols_of` takes.

    The orbits are within `bound` of the polynomials.
    """
    for sign, box in signs_on_parts(numbers, states, bound, "H5", (-1, 1)):
        if not box:
            yield sign
            continue
        # Where M3 rises Qp is the large one, else Qm.
        large = box[0 if sign > 0 else 1]
        if not (large > 0 or large < 0):
            raise Undecided("H5: Q is too near zero at a crossing to tell its separatrix")
        yield sign > 0, 1 if large > 0 else -1
