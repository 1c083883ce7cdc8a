"""The checker of connections: orbits beside the sets (C8), and how surfaces cross each other (C9).

`docs/full-shift.md` states the theorems and defines the letters. T1 and T2 are the periodic orbits
of the energy. Every comparison is of balls, and true only if it is certain: a number that is not
defined, as the root of a negative ball, is NaN and decides nothing. M and t' are dimensionless.
"""

from collections.abc import Iterable, Sequence
from typing import NamedTuple

from flint import arb, ctx

from rigidpend.routes.certified.balls import ARB_BITS, LogarithmicNorm, ball_of
from rigidpend.routes.certified.models import INPUT_BITS, Family
from rigidpend.routes.certified.passages import Reached
from rigidpend.routes.certified.proof_data import FamilyStep, Quad, StartLine, Undecided
from rigidpend.routes.certified.sections import POINT_BOX, Numbers, beginning, begun, largest, place


def _heavy(text: str) -> Undecided:
    """Doubt where only body and weight count, however small the sets are."""
    return Undecided(f"{text}; a smaller mu/h would help")


def _no_strip(text: str) -> Undecided:
    """Doubt on a strip of starts: the image of one is wide where J1 is large, else bent."""
    return Undecided(f"{text}; a J1_0 of about 1e-9 J2_0 may help")


class Middle(NamedTuple):
    """Numbers of C8, balls, and what they say of T1's unstable surface (C9)."""

    growth: LogarithmicNorm
    small: arb
    """d0, the largest |d| of sets and images."""
    level: arb
    """h - mu."""
    mu: arb
    kappa: arb
    least: arb
    """k, the smaller one of K1 and K2."""
    most: arb
    """K, the larger one."""
    lean: arb
    """1/(sqrt(2) chi)."""
    thin: arb
    """1/2 over the larger one of c and s."""
    m0: arb
    m1: arb
    time: arb
    """m0/v, t', a bound on the time in which M3 passes from -m0 to 0."""
    widest: arb
    """N, a bound on the length of (Qp, Qm)."""
    follow: arb
    """Bound on the small one of Qp and Qm where |M3| <= m1, beside the sets."""

    @property
    def share(self) -> arb:
        """The number r0 of C9, a bound on |Qm/Qp| of orbits from T1 as long as M3 <= -m0."""
        return self.growth.torque * self.lean / (self.growth.saddle * self.m0**2)

    def coupling(self, aside: arb | int = 0) -> arb:
        """The number l of C9, or c(aside): the rate at which differences drive each other."""
        w = self.growth.weight
        return (w * self.growth.torque).max(self.growth.turning / w) + aside / arb(2).sqrt()

    def slant(self, upright: arb, aside: arb) -> arb:
        """C9: bound zeta on the slope of the unstable surface; Undecided if it is not below 1.

        Its orbits have |M3| >= upright and |Qm| <= aside ever before. The slope is the difference
        of two points in Qm over the norm of that in all other components.
        """
        rate = self.growth.saddle * upright - self.coupling()
        found = 2 * self.coupling(aside) / rate
        if not (rate > 0 and found < 1):
            raise _heavy("C9: the unstable surface is not shown to be a graph")
        return found

    def slant_at(self, momentum: arb) -> arb:
        """C9: bound on the surface's slope up to where Qp <= momentum."""
        # n1, m2 of C9: up to there |Qm| <= r0 |Qp|, and the energy leaves so much for M3.
        widest = momentum * ((1 + self.share**2) / (1 - self.share**2)).sqrt()
        left = self.level - self.most * widest**2
        if not left > 0:
            raise Undecided("C9: the strip is not shown to be beside the periodic orbit")
        return self.slant((2 * left / self.kappa).sqrt(), self.share * widest)

    def check_graph(self) -> None:
        """C9: check that the surface, where it first crosses M3 = 0, is a graph over gamma3."""
        aside = self.follow.max(self.share * self.widest)
        begin, rate = self.slant(self.m0, aside), self.coupling(aside)
        # The slope grows in the time from M3 = -m0 to 0, as the lemma on slopes says.
        steep = (2 * rate * self.time).exp() * (begin + rate * self.time)
        # T, mu' and C of C9: two points of one gamma3 differ in all components by at most C times
        # what they differ by in Qm.
        square = self.level / self.most
        turned = self.lean / (self.thin * (2 * square).sqrt())
        pushed = self.mu / (2 * self.least * (square - self.small**2).sqrt())
        left = 1 - turned * pushed
        if not left > 0:
            raise _heavy("C9: the weight is too large beside the energy")
        if not steep * (1 + 2 * turned * (pushed + 1 / self.growth.weight) / left) < 1:
            raise _heavy("C9: the unstable surface is not shown to be a graph over gamma3")


def prove_connections(
    numbers: Numbers, quads: Sequence[Quad], arrivals: Iterable[Reached]
) -> Middle:
    """C8: check that orbits beside the sets cross M3 = 0 on one of two sides, or tend to T1 or T2.

    The sets and images are those of a full shift.
    """
    small = [place(quad)[0].bound for quad in quads] + [found.d.bound for found in arrivals]
    with ctx.workprec(ARB_BITS):
        return check_middle(numbers, largest(small))


def check_middle(numbers: Numbers, small: arb) -> Middle:
    """C8, for orbits that cross M3 = 0 where |d| <= small; Undecided where it is not shown."""
    c, growth = numbers.field, numbers.growth
    energy = numbers.energies.range
    saddle, force = growth.saddle, growth.torque
    mu = (c.mu_r1**2 + c.mu_r2**2).sqrt()
    spins = c.omega1 * numbers.to_M1, c.omega2 * numbers.to_M2
    most, least = spins[0].max(spins[1]), spins[0].min(spins[1])
    # Any m0, m1 and q are valid; these leave room in all of the tests below.
    unit = (2 * energy / c.kappa).sqrt()
    m0, m1, q = unit / 3, 2 * unit / 3, (energy / most).sqrt() / 5
    lean = numbers.to_M1.max(numbers.to_M2) * arb(2).sqrt()
    # e and v: as long as |M3| <= m1 and the small Q is at most q, M3 rises at the rate v or more.
    square = (energy - mu - c.kappa * m1 * m1 / 2) / most
    rise = (square - 2 * q * q) / (4 * saddle) - mu
    if not rise > 0:
        raise _heavy("C8: M3 is not shown to rise beside the sets")
    # rho: where |M3| >= m0, D = Qm^2 - Qp^2 grows at the rate 2 rho n^2 or more.
    rate = saddle * m0 - force * lean / m0
    if not rate > 0:
        raise _heavy("C8: the middle is not shown to be a saddle")
    # The small Q stays below q until |M3| has reached m1.
    time = m1 / rise
    follow = (saddle * m1 * time).exp() * (small + force * time)
    if not follow < q:
        raise _heavy("C8: orbits beside the sets are not shown to follow the separatrix")
    # D* and v': an orbit that leaves the middle has D >= D*, and M3 falls to zero before D halves.
    apart = 2 * (2 * saddle * rate * square * (m1 - m0)).sqrt() - 4 * saddle * mu
    fall = apart / (8 * saddle) - mu
    widest = ((energy + mu) / least).sqrt()
    if not (fall > 0 and 4 * force * widest * m0 / fall < apart):
        raise _heavy("C8: M3 is not shown to fall to zero where it leaves the middle")
    thin = numbers.to_M1.min(numbers.to_M2)
    bodily = mu, c.kappa, least, most, lean, thin
    return Middle(growth, small, energy - mu, *bodily, m0, m1, m0 / rise, widest, follow)


def prove_transversal(
    numbers: Numbers,
    line: tuple[StartLine, Sequence[FamilyStep], Reached],
    quads: Sequence[Quad],
    arrivals: Sequence[Reached],
) -> None:
    """C9: check that the unstable surface of T1 and the stable one of T2 cross transversally.

    `line` is a strip of starts with its polynomials and its first crossings.
    """
    strip, pieces, start = line
    if numbers.h0 is not None:
        raise Undecided("C9: the starts are of several energies; give h in the place of h0")
    middle = prove_connections(numbers, quads, [*arrivals, start])
    with ctx.workprec(ARB_BITS):
        # The body comes before the strip, which it does not have where it is too heavy.
        middle.check_graph()
        check_strip(numbers, middle, strip, pieces[0])
        upward = [k for k, quad in enumerate(quads) if quad.rising]
        images = [found for quad, found in zip(quads, arrivals, strict=True) if not quad.rising]
        sheets = [found.box[2] for found in (start, *images)]
        # The points of a set are within POINT_BOX of its polynomials (C1).
        sheets += [arrivals[k].begin[2] + arb(0, POINT_BOX) for k in upward]
        reach = largest(
            [place(quads[k])[1].bound for k in upward] + [found.g.bound for found in images]
        )
        check_crossings(start, reach, sheets, images)


def check_strip(numbers: Numbers, middle: Middle, strip: StartLine, piece: FamilyStep) -> None:
    """C9: check that the unstable surface is a curve from end to end in a strip of starts."""
    _, bounds = beginning(numbers, strip, piece)
    states = begun(piece)
    momentum = states[0].bound + bounds[0]
    if not states[2].range + bounds[0] / middle.growth.upright < -middle.m1:
        raise Undecided("C9: the strip is not shown to be beside the periodic orbit")
    if not middle.share * momentum < (wide := ball_of(strip.wide)):
        raise _no_strip("C9: the unstable surface is not shown to pass between the strip's sides")
    # A_u and A_v bound the derivatives of all components but Qm = wide v.
    states[1] = Family.of({}, 0)
    _, by_u, by_v, _ = numbers.norms(states)
    if not middle.slant_at(momentum) * (by_u + bounds[1] + by_v + bounds[2]) < wide:
        raise Undecided("C9: the unstable surface is not shown to lie along the strip")


def check_crossings(
    start: Reached, reach: arb, sheets: Sequence[arb], images: Iterable[Reached]
) -> None:
    """C9: check that the images of the strip and of sets cross the surface's mirror image.

    `reach` is G of C9, and `sheets` are balls of gamma2.
    """
    if not (all(x > 0 for x in sheets) or all(x < 0 for x in sheets)):
        raise Undecided("C9: the sets and images are not shown to be on one sheet of the section")
    ends = [start.g.at("u", side).range for side in (-1, 1)]
    if not any(low < -reach and high > reach for low, high in (ends, ends[::-1])):
        raise _no_strip("C9: the strip's image is not shown to reach as far as all sets and images")
    slope = slope_of(start)
    if not (slope > 0 or slope < 0):
        raise Undecided("C9: the surfaces are not shown to cross each other at an angle")
    # The mirror image has slopes in -S: no tangent of an image may be among them.
    by = Family.of_ball(slope, INPUT_BITS)
    for found in images:
        by_u, by_v = (d + by * g for d, g, _ in found.slopes[:2])
        if not abs(by_u.range) > by_v.bound:
            raise Undecided("C9: an image is not shown to cross the stable surface at an angle")


def slope_of(start: Reached) -> arb:
    """The interval S of C9: slopes between points of a strip's image with |dv| <= |du|."""
    (d_u, g_u, _), (d_v, g_v, _), _ = start.slopes
    return (d_u.range + arb(0, d_v.bound)) / (g_u.range + arb(0, g_v.bound))
