"""C8 and C9 of docs/full-shift.md: what orbits do beside the sets, and how surfaces cross."""

from collections.abc import Sequence
from fractions import Fraction
from typing import Any, NamedTuple

from scripts.check_certificate import Fails, Interval, exponential, hypotenuse, larger, sqrt
from scripts.check_passages import Arrival
from scripts.check_sections import ALONE, Line, Problem, Quad, Step, line_beginning
from scripts.check_series import above, around, least

STEEP = 64
"""Largest exponent of a bound's growth."""


class Middle(NamedTuple):
    """Numbers of C8 that C9 needs as well."""

    d0: Fraction
    """The largest |d| of sets and images."""
    level: Interval
    """h - mu."""
    mu: Interval
    kappa: Interval
    k: Interval
    K: Interval
    lean: Interval
    """1/(sqrt(2) chi)."""
    thin: Interval
    """1/2 over the larger of c and s."""
    m0: Interval
    m1: Interval
    time: Interval
    """m0/v: in which M3 passes from -m0 to 0."""
    N: Interval
    follow: Interval
    """Bound on |d| where |M3| <= m1, beside the sets."""

    def ratio(self, p: Problem) -> Interval:
        """The number r0 of C9."""
        return p.F * self.lean / (p.lam * self.m0 * self.m0)


def check_middle(p: Problem, small: Fraction) -> Middle:
    """C8: check that orbits with |d| <= small on M3 = 0 cross it on one of two sides, or never do.

    Interval ends are compared so that what is not certain Fails. Letters are the page's; `rise`
    and `fall` are its v and v', `rate` is its varrho and `apart` its D*.
    """
    mu, h, kappa = hypotenuse(*p.mu), p.energies.ball(), p.omega[2]
    K1, K2 = (omega * m for omega, m in zip(p.omega, p.to_M, strict=False))
    K, k = larger(K1, K2), -larger(-K1, -K2)
    if k.low <= 0:
        raise Fails("C8: the energy is not shown to be positive")
    # Any m0, m1 and q are valid; these leave room in all of the tests below.
    m1, q = 2 * sqrt(2 * h / kappa) / 3, sqrt(h / K) / 5
    m0, lean = m1 / 2, larger(*p.to_M) * sqrt(Interval.of(2))
    e = (h - mu - kappa * m1 * m1 / 2) / K
    rise = (e - 2 * q * q) / (4 * p.lam) - mu
    if rise.low <= 0:
        raise Fails("C8: M3 is not shown to rise beside the sets")
    rate = p.lam * m0 - p.F * lean / m0
    if rate.low <= 0:
        raise Fails("C8: the middle is not shown to be a saddle")
    time = m1 / rise
    steep = p.lam * m1 * time
    follow = exponential(steep) * (p.F * time + small) if steep.above <= STEEP else q
    if (q - follow).low <= 0:
        raise Fails("C8: orbits beside the sets are not shown to follow the separatrix")
    apart = 2 * sqrt(2 * p.lam * rate * e * (m1 - m0)) - 4 * p.lam * mu
    fall = apart / (8 * p.lam) - mu
    N = sqrt((h + mu) / k)
    if fall.low <= 0 or (apart - 4 * p.F * N * m0 / fall).low <= 0:
        raise Fails("C8: M3 is not shown to fall to zero where it leaves the middle")
    thin = -larger(-p.to_M[0], -p.to_M[1])
    return Middle(small, h - mu, mu, kappa, k, K, lean, thin, m0, m1, m0 / rise, N, follow)


def slant(p: Problem, upright: Interval, aside: Any) -> tuple[Interval, Interval]:
    """C9: the bound zeta on the unstable surface's slope, and the rate c(aside) that drives it."""
    l = larger(p.w * p.F, p.Omega / p.w)
    driven, rate = l + aside / sqrt(Interval.of(2)), p.lam * upright - l
    if rate.low <= 0 or (rate - 2 * driven).low <= 0:
        raise Fails("C9: the unstable surface is not shown to be a graph")
    return 2 * driven / rate, driven


def check_graph(p: Problem, of: Middle) -> None:
    """C9: check that the unstable surface, where it crosses M3 = 0, is a graph over gamma3."""
    zeta, c = slant(p, of.m0, larger(of.follow, of.ratio(p) * of.N))
    square, passed = of.level / of.K, c * of.time
    T = of.lean / (of.thin * sqrt(2 * square))
    pushed = of.mu / (2 * of.k * sqrt(square - of.d0 * of.d0))
    left = 1 - T * pushed
    if left.low <= 0:
        raise Fails("C9: the weight is too large beside the energy")
    C = 1 + 2 * T * (pushed + 1 / p.w) / left
    if passed.above > STEEP or (1 - exponential(2 * passed) * (zeta + passed) * C).low <= 0:
        raise Fails("C9: the unstable surface is not shown to be a graph over gamma3")


def check_strip(p: Problem, of: Middle, line: Line, step: Step) -> None:
    """C9: check that the unstable surface is a curve from end to end in a strip of starts."""
    bounds = line_beginning(p, line, step)
    states = [state.at(0, -1) for state in step.states]
    P = states[0].most + bounds[0]
    if (states[2].ball(above(bounds[0] / p.sigma)) + of.m1).high >= 0:
        raise Fails("C9: the strip is not shown to be beside the periodic orbit")
    r0 = of.ratio(p)
    if (line.wide - r0 * P).low <= 0:
        raise Fails("C9: the unstable surface is not shown to pass between the strip's sides")
    square = P * P * ((1 + r0 * r0) / (1 - r0 * r0))
    left = of.level - of.K * square
    if left.low <= 0:
        raise Fails("C9: the strip is not shown to be beside the periodic orbit")
    zeta, _ = slant(p, sqrt(2 * left / of.kappa), r0 * sqrt(square))
    # A_u and A_v bound the derivatives of all components but Qm = wide v.
    sizes = [
        p.norm(*(Fraction(0) if j == 1 else x.partial(i).most for j, x in enumerate(states)))
        for i in (1, 2)
    ]
    if (line.wide - zeta * (sum(sizes) + bounds[1] + bounds[2])).low <= 0:
        raise Fails("C9: the unstable surface is not shown to lie along the strip")


def check_crossings(
    start: Arrival, reach: Fraction, sheets: Sequence[Interval], images: Sequence[Arrival]
) -> None:
    """C9: check that the images of the strip and of sets cross the surface's mirror image.

    `reach` is G of C9, and `sheets` are intervals of gamma2.
    """
    if not (all(x.low > 0 for x in sheets) or all(x.high < 0 for x in sheets)):
        raise Fails("C9: the sets and images are not shown to be on one sheet of the section")
    ends = sorted(((start.g.at(1, side).ball()) for side in (-1, 1)), key=lambda x: x.low)
    far = Interval.of(reach)
    if ends[0].high >= -far.high or ends[1].low <= far.high:
        raise Fails("C9: the strip's image is not shown to reach as far as all sets and images")
    (d_u, g_u, _), (d_v, g_v, _), _ = start.slopes
    along = g_u.ball(g_v.most)
    slope = d_u.ball(d_v.most) / along if least(along) > 0 else Interval(-1, 1)
    if least(slope) <= 0:
        raise Fails("C9: the surfaces are not shown to cross each other at an angle")
    for found in images:
        by_u, by_v = (d + g * slope for d, g, _ in found.slopes[:2])
        if least(by_u.ball()) <= by_v.most:
            raise Fails("C9: an image is not shown to cross the stable surface at an angle")


def check_transversal(
    p: Problem,
    line: tuple[Line, Step, Arrival | None],
    quads: Sequence[Quad],
    found: Sequence[Arrival],
) -> None:
    """C9, with C8: check that S1- and S2+ cross transversally, once for each even word."""
    strip, step, start = line
    if p.h0 is not None:
        raise Fails("C9: the starts are of several energies")
    if start is None:
        raise Fails("C9: the starts come to the sets by an approach")
    of = check_middle(p, farthest(quads, [*found, start]))
    check_graph(p, of)
    check_strip(p, of, strip, step)
    both = list(zip(quads, found, strict=True))
    images = [x for quad, x in both if not quad.rising]
    # The points of a set are within ALONE of its polynomials (C1).
    sheets = [around(x.begin[2], ALONE) for quad, x in both if quad.rising]
    sheets += [x.box[2] for x in (start, *images)]
    extent = [quad.place()[1].most for quad in quads if quad.rising] + [x.g.most for x in images]
    check_crossings(start, max(extent), sheets, images)


def farthest(quads: Sequence[Quad], found: Sequence[Arrival]) -> Fraction:
    """The largest |d| of sets and images."""
    return max(x.most for x in (*(q.place()[0] for q in quads), *(y.d for y in found)))
