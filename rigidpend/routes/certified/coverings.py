"""The checker of covering relations: whether given polynomials prove what a passage does to a set.

It knows nothing of how they were found. `docs/full-shift.md` has the theorems; C1 to C8 below are
its hypotheses. Whatever is not shown ends in :class:`Undecided`, never in a relation.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from fractions import Fraction
from itertools import combinations, pairwise
from typing import NamedTuple

from flint import arb, arb_mat

from rigidpend.machine.workers import check_stop
from rigidpend.mechanics.body import Body
from rigidpend.mechanics.equations import AlignedCoefficients, aligned, aligned_coefficients
from rigidpend.numbers.exact import Exact
from rigidpend.routes.certified.balls import BALLS, angles
from rigidpend.routes.certified.checker import SCALARS, Undecided
from rigidpend.routes.certified.families import PARAMETERS, Family
from rigidpend.routes.certified.growth import LogarithmicNorm
from rigidpend.routes.certified.pieces import CLOCK, FamilyStep, Quad, StartLine
from rigidpend.routes.certified.precision import precision
from rigidpend.routes.certified.signs import BITS as VALUES
from rigidpend.routes.certified.signs import Values

BITS = 160
"""Bits in which the numbers of the problem are enclosed."""
PARTS = 32
"""Parts of a step on which signs and rates are told."""
ALONE, THIN = 2.0**-5, 2.0**-20
"""Distances within which a point of the section, and of a line of starts, is alone."""
WIDEST = 2.0**-12
"""Radius of a tube at most."""
TRIES, ROOM = 4, 4
"""Trials of a tube's radius, and the first over what it has at the beginning."""
LIGHT = 64
"""Weight of w in differences of orbits of different energies.

Any number will do."""
ENERGY = Family.of({(0, 0, 0, 1): 2}, 0)
"""w, by which energies differ."""
ALONG = [Family.of({(0, 0, 0): 2 * k}, 0) for k in (0, 0, 1)]
"""Its derivatives in u, v and w."""


def curve(p: Sequence[Fraction], g: Family) -> Family:
    """p(g)."""
    return _summed([Family.of_fraction(x, BITS) for x in p], g)


def moved(curves: Sequence[Sequence[Fraction]], g: Family, w: Family) -> Family:
    """The sum of w^m p_m(g)."""
    return _summed([curve(p, g) for p in curves], w)


def _summed(p: Sequence[Family], x: Family) -> Family:
    found = p[-1] if p else Family.of_fraction(0, BITS)
    for each in p[-2::-1]:
        found = found * x + each
    return found


def place(quad: Quad) -> tuple[Family, Family]:
    """d and g of the points of a set, as polynomials in u, v and w."""
    u, v = Family.of({(0, 1, 0): 2}, 0), Family.of({(0, 0, 1): 2}, 0)
    by_u, by_v, from_0, a = (
        Family.of_fraction(x, BITS)
        for x in (quad.a / quad.l1, quad.b / quad.l1, quad.l0 / quad.l1, quad.a)
    )
    g = u * by_u - v * by_v - from_0
    return moved((quad.p, *quad.moves), g, ENERGY) + u * a, g


def coordinates(quad: Quad, d: Family, g: Family, w: Family = ENERGY) -> tuple[Family, Family]:
    """U and V of points of the section, of the energies of w."""
    off = d - moved((quad.p, *quad.moves), g, w)
    l0, l1, by_a, by_b = (
        Family.of_fraction(x, BITS) for x in (quad.l0, quad.l1, 1 / quad.a, 1 / quad.b)
    )
    return off * by_a, (off - l0 - l1 * g) * by_b


def directions(quad: Quad, g: Family, w: Family, along: Sequence[Family]) -> tuple[Family, Family]:
    """Derivatives of U and V, where those of d, g and w are `along`."""
    by_d, by_g, by_w = along
    curves = quad.p, *quad.moves
    leaning = moved([[k * x for k, x in enumerate(p)][1:] for p in curves], g, w)
    moving = moved([[m * x for x in p] for m, p in enumerate(curves)][1:], g, w)
    off = by_d - leaning * by_g - moving * by_w
    l1, by_a, by_b = (Family.of_fraction(x, BITS) for x in (quad.l1, 1 / quad.a, 1 / quad.b))
    return off * by_a, (off - l1 * by_g) * by_b


class Numbers(NamedTuple):
    """Numbers of a body and an energy, or of all near them, balls."""

    field: AlignedCoefficients
    to_M1: arb
    to_M2: arb
    h: arb
    spread: Fraction
    """The energies are h + spread w."""
    h0: arb | None
    """Energy constant of starts of one J2_0, if they are not of one energy."""
    along: str = PARAMETERS
    """Variables in which derivatives are bounded: none where no theorem asks for C7."""

    @classmethod
    def of(
        cls,
        body: Body,
        h: Exact,
        spread: Fraction = Fraction(0),
        h0: Exact | None = None,
    ) -> Numbers:
        """Enclose those of a body."""
        with precision(BITS):
            p = angles(body)
            half, found, h_ball = p.alpha0 / 2, aligned_coefficients(p, BALLS), arb(h.over(BALLS))
            held = arb(h0.over(BALLS)) if h0 is not None else None
            return cls(found, 1 / (2 * half.cos()), 1 / (2 * half.sin()), h_ball, spread, held)

    @property
    def energies(self) -> Family:
        """The energies, with w."""
        return Family.of_ball(self.h, BITS) + Family.of_fraction(self.spread, BITS) * ENERGY


class Reached(NamedTuple):
    """The next crossings of the orbits of a set."""

    d: Family
    g: Family
    right: bool
    """The symbol: True for 1."""
    box: tuple[arb, arb, arb]
    """Q, gamma1 and gamma2 of all of them, as if beside separatrix 2 or 3."""
    bound: float
    """Bound on the distance of the polynomials from the orbits."""
    late: float
    """Bound on the distance of the crossings from the end of the last step, t'."""
    duration: tuple[float, float]
    """The passage takes at least and at most so long, t'."""
    begin: Sequence[arb]
    """Q, gamma1 and gamma2 at the beginning."""
    slopes: Sequence[Sequence[Family]]
    """Derivatives of d, and of g, in u, v and w, if they are asked for."""
    w: Family = ENERGY
    """That of their energies."""
    slopes_of_w: Sequence[Family] = ALONG
    """Its derivatives."""


class Relation(NamedTuple):
    """A covering relation: by how much it holds."""

    target: int
    """Place of the set that is covered."""
    orientation: int
    """1 where u = 1 is stretched beyond U = 1, -1 where it is beyond U = -1."""
    edge: float
    """Lower bound on |U| on the edges u = -1 and 1; 1 is needed."""
    across: float
    """Upper bound on |V| of all points; less than 1 is needed."""
    stretch: float
    """Lower bound on |dU/du| - |dU/dv| - |dU/dw|/64 of all points; uniqueness needs more than 1.

    Along a line of starts of one J2_0 64 |dw/du| is taken off besides."""
    squeeze: float
    """Upper bound on |dV/du| + |dV/dv| + |dV/dw|/64 of all points; uniqueness needs less than 1."""


def arrival(numbers: Numbers, start: Quad | StartLine, pieces: Sequence[FamilyStep]) -> Reached:
    """Check the orbits of a set, or of a line of starts, up to their next crossing.

    Raises
    ------
    Undecided
        A hypothesis is not shown; the text begins with its name.
    """
    if not pieces:
        raise Undecided("there are no steps")
    with precision(SCALARS):
        growth = LogarithmicNorm.of(numbers.field)
    if isinstance(start, StartLine):
        side, order = -1, [0, -1]
        begin, bounds = line_beginning(numbers, start, pieces[0], growth)
    else:
        side, order = 1 if start.rising else -1, [1, 0, -1]
        begin, bounds = beginning(numbers, start, pieces[0], growth)
    signs: list[int] = []
    time, starts = arb(0), bounds
    for states, half, apart in followed(numbers, pieces, bounds, growth):
        with precision(SCALARS):
            time += 2 * half.range
            signs += _signs(numbers, states, apart[0], growth, side)
    _check_signs(signs, order)
    end = [state.at("z", 1) for state in states]
    with precision(SCALARS):
        found = _crossing(numbers, end, apart, growth, side, begin, time)
        if not isinstance(start, StartLine) or numbers.h0 is None:
            return found
        w, slopes = _energies_along(numbers, numbers.h0, pieces[0], starts, growth)
        return found._replace(w=w, slopes_of_w=slopes)


def _energies_along(
    numbers: Numbers, h0: arb, piece: FamilyStep, bounds: Sequence[arb], growth: LogarithmicNorm
) -> tuple[Family, list[Family]]:
    """w along a line of starts of one J2_0, and its derivatives; kappa J2_0^2/2 is h0."""
    gamma1, gamma2 = (Family.of(terms, piece.bits).at("z", -1) for terms in piece.terms[3:5])
    c = numbers.field
    with precision(BITS):
        r1, r2, off = (Family.of_ball(x, BITS) for x in (c.mu_r1, c.mu_r2, h0 - numbers.h))
        per = Family.of_fraction(1 / numbers.spread, BITS)
        found = (r1 * gamma1 + r2 * gamma2 + off) * per
        unsure = (abs(c.mu_r1) + abs(c.mu_r2)) * per.bound * growth.weight
        w = found.widened(unsure * bounds[0])
        if not w.bound <= 1:
            said = f"the energies of its starts have |w| <= {float(w.bound):.4g}"
            raise Undecided(f"C6: {said}, and 1 is all that is known of")
        apart = dict(zip(numbers.along, bounds[1:], strict=True))
        return w, [found.partial(name).widened(unsure * each) for name, each in apart.items()]


def followed(
    numbers: Numbers, pieces: Sequence[FamilyStep], bounds: list[arb], growth: LogarithmicNorm
) -> Iterator[tuple[list[Family], Family, list[arb]]]:
    """Check steps one after the other (C2, C3): states, half-length and distances over each.

    Parameters
    ----------
    numbers : Numbers
    pieces : sequence of FamilyStep
    bounds : arb, one and one of each variable in numbers.along
        On the distance of the polynomials from the orbits at the beginning, and on those of its
        derivatives.
    growth : LogarithmicNorm

    Raises
    ------
    Undecided
    """
    end: list[Family] | None = None
    for piece in pieces:
        check_stop()
        states = [Family.of(terms, piece.bits) for terms in piece.terms]
        half = Family.of(piece.half, CLOCK)
        with precision(SCALARS):
            if not half.range > 0:
                raise Undecided("C2: the length of a step is not shown to be positive")
            if end is not None:
                off = [s.at("z", -1) - e for s, e in zip(states, end, strict=True)]
                gaps = norms(off, growth, numbers.along)
                bounds = [_up(bound + gap) for bound, gap in zip(bounds, gaps, strict=True)]
            end = [state.at("z", 1) for state in states]
            leaps = defects(numbers, states, half, growth)
            bounds = _carried(states, half, bounds, leaps, growth)
        yield states, half, bounds


def beginning(
    numbers: Numbers, quad: Quad, piece: FamilyStep, growth: LogarithmicNorm
) -> tuple[list[arb], list[arb]]:
    """C1: where the orbits of a set begin, alone nearby; bounds on the polynomials' distance.

    The large Q, gamma1 and gamma2 follow from d and g by M . gamma = 0, |gamma| = 1 and the energy.
    """
    states = [Family.of(terms, piece.bits).at("z", -1) for terms in piece.terms]
    c, large, small = numbers.field, 0 if quad.rising else 1, 1 if quad.rising else 0
    d, g = place(quad)
    Q, gamma1, gamma2 = states[large], states[3], states[4]
    with precision(BITS):
        # Arb rounds even where a sign is changed.
        by = numbers.to_M1, numbers.to_M2 if quad.rising else -numbers.to_M2

    def slopes(one: int, *at: arb) -> arb_mat:
        """The derivatives of the residual in Q, gamma1 and gamma2, linear in 1 and in `at`."""
        q, d, y1, y2 = at
        n1, n2 = (q + d) * by[0], (q - d) * by[1]
        spin = c.kappa * (n1 * by[0] + n2 * by[1]) - d / 2
        return arb_mat(
            [
                [y1 * by[0] + y2 * by[1], n1, n2],
                [0, 2 * y1, 2 * y2],
                [spin, one * c.mu_r1, one * c.mu_r2],
            ]
        )

    with precision(BITS):
        constants = (*by, c.kappa / 2, c.mu_r1, c.mu_r2)
        m1, m2, spin, r1, r2 = (Family.of_ball(x, BITS) for x in constants)
        M1, M2 = (Q + d) * m1, (Q - d) * m2
        one, half = (Family.of_fraction(x, 1) for x in (Fraction(1), Fraction(1, 2)))
        residual = (
            M1 * gamma1 + M2 * gamma2,
            gamma1 * gamma1 + gamma2 * gamma2 + g * g - one,
            spin * (M1 * M1 + M2 * M2)
            - half * Q * d
            + r1 * gamma1
            + r2 * gamma2
            - numbers.energies,
        )
        q, y1, y2 = (each.range + arb(0, ALONE) for each in (Q, gamma1, gamma2))
        turned = {
            name: slopes(0, *(each.partial(name).range for each in (Q, d, gamma1, gamma2)))
            for name in numbers.along
        }
        near = _nearest(residual, slopes(1, q, d.range, y1, y2), turned, ALONE)
        if not q > 0:
            raise Undecided("C1: the large Q is not shown to be positive at the points of a set")
        off = {small: states[small] - d, 2: states[2], 5: states[5] - g}
        apart = [_orders(off[j], numbers.along) if j in off else near for j in range(6)]
    with precision(SCALARS):
        return [each.range for each in (Q, gamma1, gamma2)], _normed(apart, growth)


def line_beginning(
    numbers: Numbers, line: StartLine, piece: FamilyStep, growth: LogarithmicNorm
) -> tuple[list[arb], list[arb]]:
    """C1 of a line of starts: Qp, M3 and gamma follow from J1, Qm and the place on the line.

    And from the energy, or from h0, which is that without the weight.
    """
    states = [Family.of(terms, piece.bits).at("z", -1) for terms in piece.terms]
    Qp, Qm, M3, *gamma = states
    c = numbers.field
    with precision(BITS):
        across = numbers.to_M1**2 + numbers.to_M2**2
        weight = (c.mu_r1, c.mu_r2) if numbers.h0 is None else (arb(0), arb(0))
        level = numbers.energies if numbers.h0 is None else Family.of_ball(numbers.h0, BITS)
        constants = (numbers.to_M1, numbers.to_M2, across, c.kappa / 2, *weight)
        m1, m2, square, spin, r1, r2 = (Family.of_ball(x, BITS) for x in constants)
        J1, e1, e2, half, wide = (
            Family.of_fraction(x, BITS) for x in (*line[:3], line.half, line.wide)
        )
        centre = curve((line.centre, *line.moves), ENERGY)
        one, four, by_two = (Family.of_fraction(x, 1) for x in (1, 4, Fraction(1, 2)))
        u, aside = Family.of({(0, 1, 0): 2}, 0), wide * Family.of({(0, 0, 1): 2}, 0)
        M1, M2 = (Qp + aside) * m1, (Qp - aside) * m2
        residual = (
            M1 * gamma[0] + M2 * gamma[1] + M3 * gamma[2],
            gamma[0] * gamma[0] + gamma[1] * gamma[1] + gamma[2] * gamma[2] - one,
            spin * (M1 * M1 + M2 * M2 + M3 * M3)
            - by_two * Qp * aside
            + r1 * gamma[0]
            + r2 * gamma[1]
            - level,
            # Of Qm = 0 that is |M| = 2 J1 - M3.
            square * Qp * Qp - four * J1 * (J1 - M3),
            e1 * gamma[0] + e2 * gamma[1] - centre - half * u,
        )

        def slopes(one: int, *at: arb) -> arb_mat:
            """The derivatives of the residual in Qp, M3 and gamma, linear in 1 and in `at`."""
            q, m, y1, y2, y3, d = at
            n1, n2 = (q + d) * numbers.to_M1, (q - d) * numbers.to_M2
            spin = c.kappa * (n1 * numbers.to_M1 + n2 * numbers.to_M2) - d / 2
            return arb_mat(
                [
                    [numbers.to_M1 * y1 + numbers.to_M2 * y2, y3, n1, n2, m],
                    [0, 0, 2 * y1, 2 * y2, 2 * y3],
                    [spin, c.kappa * m, one * weight[0], one * weight[1], 0],
                    [2 * q * across, one * 4 * J1.range, 0, 0, 0],
                    [0, 0, one * e1.range, one * e2.range, 0],
                ]
            )

        found = (Qp, M3, *gamma)
        box = [each.range + arb(0, THIN) for each in found]
        turned = {
            name: slopes(0, *(each.partial(name).range for each in (*found, aside)))
            for name in numbers.along
        }
        near = _nearest(residual, slopes(1, *box, aside.range), turned, THIN)
        if not (box[0] > 0 and box[1] < 0):
            raise Undecided("C1: Qp > 0 > M3 is not shown at the starts")
    with precision(SCALARS):
        return [], _normed(
            [near, _orders(Qm - aside, numbers.along), near, near, near, near], growth
        )


def _nearest(
    residual: Sequence[Family], slopes: arb_mat, turned: Mapping[str, arb_mat], room: float
) -> list[arb]:
    """C1: how near a solution is, the only one so near as `room`, where the derivatives hold.

    Newton's iteration with a fixed matrix contracts the box of that size into itself. By how much
    the solution's derivatives in u, v and w differ follows with those of the matrix, `turned`.
    """
    n = len(residual)
    try:
        inverse = slopes.mid().inv().mid()
    except ZeroDivisionError:
        raise Undecided("C1: the derivatives have no inverse where the orbits begin") from None
    off = inverse * slopes
    share = largest(sum((abs(off[i, j] - (i == j)) for j in range(n)), arb(0)) for i in range(n))

    def solved(right: Sequence[arb]) -> arb:
        rows = (sum((abs(inverse[i, j]) * right[j] for j in range(n)), arb(0)) for i in range(n))
        return largest(rows) / (1 - share)

    values, *along = zip(*(_orders(each, turned) for each in residual), strict=True)
    if not (share < 1 and (near := _up(solved(values))) < room):
        raise Undecided("C1: no points are shown to be where the orbits begin")
    return [near] + [
        _up(solved([
            right[i] + sum((abs(turn[i, j]) for j in range(n)), arb(0)) * near for i in range(n)
        ]))
        for right, turn in zip(along, turned.values(), strict=True)
    ]  # fmt: skip


def defects(
    numbers: Numbers, states: Sequence[Family], half: Family, growth: LogarithmicNorm
) -> list[arb]:
    """C2: bounds on the norm of dP/dx - half f(P) over the step, f the aligned field.

    All but the first are of its derivatives.
    """
    c = AlignedCoefficients(*(Family.of_ball(x, BITS) for x in numbers.field))
    rates = aligned(states, c)
    off = [P.derivative() - half * rate for P, rate in zip(states, rates, strict=True)]
    return norms(off, growth, numbers.along)


def _carried(
    states: Sequence[Family],
    half: Family,
    begin: Sequence[arb],
    leaps: Sequence[arb],
    growth: LogarithmicNorm,
) -> list[arb]:
    """C3: the distance over the whole step, and those of the derivatives."""
    # At the orbits themselves, and not halfway to the polynomials, for the derivatives' sake.
    bound, factor = tube(states[2], half, begin[0] + 2 * leaps[0], growth, 1, ("C3", WIDEST))
    along = PARAMETERS[: len(begin) - 1]
    size, *slopes = norms(states, growth, along)
    apart = begin[0] + 2 * leaps[0]
    rate = growth.steepness(size + WIDEST)
    found = [bound]
    for k, (name, slope) in enumerate(zip(along, slopes, strict=True)):
        # Where orbits and polynomials differ, so does what carries their derivatives.
        bent = half.bound * growth.bending * slope + half.partial(name).bound * rate
        found.append(_up(factor * (begin[1 + k] + 2 * (leaps[1 + k] + bent * apart))))
    return found


def tube(
    M3: Family,
    half: Family,
    begin: arb,
    growth: LogarithmicNorm,
    away: Fraction | int,
    allowed: tuple[str, float],
) -> tuple[arb, arb]:
    """The distance over a whole step, from the assumed radius of a tube, and its growth.

    Parameters
    ----------
    M3, half : Family
        Of the polynomials; half of the length in time.
    begin : arb
        What the distance is at the beginning, and what the step adds.
    growth : LogarithmicNorm
    away : Fraction or int
        How far from the polynomials, beside the radius, growth is bounded.
    allowed : str and float
        Name of the hypothesis, and the largest radius.

    Raises
    ------
    Undecided
    """
    name, widest = allowed
    sizes, length = [abs(each).upper() for each in on_parts(M3)], 2 * half.bound / PARTS
    share = arb(away.numerator) / away.denominator
    assumed = ROOM * begin
    for _ in range(TRIES):
        assumed = assumed.min(arb(widest))
        wide = share * assumed / growth.upright
        rates = (growth.rate(m + wide, 2 * share * assumed) for m in sizes)
        factor = (sum(rates, arb(0)) * length).exp()
        grown = _up(factor * begin)
        # Balls compare as true only where that is certain.
        if grown < assumed:
            return grown, factor
        assumed = 2 * grown
    said = f"{name}: the orbits are shown to stay within {float(grown):.3g} of the polynomials"
    raise Undecided(f"{said}, and within {widest:.3g} is needed")


def _signs(
    numbers: Numbers, states: Sequence[Family], bound: arb, growth: LogarithmicNorm, side: int
) -> list[int]:
    """C4: on each part 0 where M3 has the sign of the passage, else that of M3' by then."""
    found, M3 = [], on_parts(states[2])
    apart = distances(bound, growth)
    for k, value in enumerate(M3):
        if side * value > apart[2]:
            found.append(0)
            continue
        box = [on_parts(s)[k] + arb(0, e) for s, e in zip(states, apart, strict=True)]
        rate = side * aligned(box, numbers.field)[2]
        if not (rate > 0 or rate < 0):
            raise Undecided("C4: neither the sign of M3 nor that of its rate is told on a part")
        found.append(1 if rate > 0 else -1)
    return found


def _check_signs(signs: Sequence[int], order: Sequence[int]) -> None:
    """C4: M3 leaves zero once, unless it begins elsewhere, keeps its sign, and comes back once."""
    runs = [sign for k, sign in enumerate(signs) if k == 0 or signs[k - 1] != sign]
    if runs != list(order):
        raise Undecided("C4: M3 is not shown to leave zero at once and to return at the end")


def _crossing(
    numbers: Numbers,
    end: Sequence[Family],
    bounds: Sequence[arb],
    growth: LogarithmicNorm,
    side: int,
    begin: Sequence[arb],
    passed: arb,
) -> Reached:
    """C5: the crossing beside the end of the last step, on which side, and where."""
    apart = distances(bounds[0], growth)
    M3 = end[2].bound + apart[2]
    late = apart[2] + M3
    for _ in range(TRIES):
        # Within so long a time the orbits stay within this box, where M3 changes fast enough.
        box = [s.range + arb(0, e + late) for s, e in zip(end, apart, strict=True)]
        rates = aligned(box, numbers.field)
        fastest = largest(map(abs, rates))
        slowest = (-side * rates[2]).lower()
        if not slowest > 0:
            break
        time = _up(M3 / slowest)
        if time * fastest <= late:
            break
        late = _up(2 * time * fastest)
    else:
        slowest = arb(-1)
    if not slowest > 0:
        raise Undecided("C5: M3 crosses zero too slowly")
    small, large = (0, 1) if side > 0 else (1, 0)
    if not (box[large] > 0 or box[large] < 0):
        raise Undecided("C5: the side on which the orbits leave is not told")
    mirrored = bool(box[large] < 0)
    # (-M1, -M2, M3, gamma1, gamma2, -gamma3) makes separatrix 1 or 4 of 3 or 2.
    d, g = (end[j].widened(apart[j] + time * abs(rates[j])) for j in (small, 5))
    # The derivatives change until the crossing, and by the time of it, which M3 tells.
    _, *sizes = norms(end, growth, numbers.along)
    steep = growth.steepness(growth.norm(tuple(_up(abs(x)) for x in box)))
    slopes: list[list[Family]] = [[], []]
    for k, (name, size) in enumerate(zip(numbers.along, sizes, strict=True)):
        off = distances(
            _up(bounds[1 + k] + (steep * time).expm1() * (size + bounds[1 + k])), growth
        )
        timed = (end[2].partial(name).bound + off[2]) * fastest / slowest
        for of, j in zip(slopes, (small, 5), strict=True):
            of.append(end[j].partial(name).widened(off[j] + timed))
    if mirrored:
        d, g = -d, -g
        slopes = [[-each for each in of] for of in slopes]
    Q = -box[large] if mirrored else box[large]
    right = (not mirrored) if side > 0 else mirrored
    there = (Q, box[3], box[4])
    duration = -_double(time - passed), _double(passed + time)
    return Reached(d, g, right, there, _double(bounds[0]), _double(time), duration, begin, slopes)


def relation(source: Reached, target: Quad, begin: Sequence[arb], place: int) -> Relation:
    """C6: whether the orbits of a set cover another.

    Parameters
    ----------
    source : Reached
    target : Quad
        Of the section that they cross.
    begin : 3 arb
        Q, gamma1 and gamma2 of the target's points.
    place : int
        Of the target in the list.

    Raises
    ------
    Undecided
    """
    with precision(SCALARS):
        if not all(abs(a - b) <= ALONE for a, b in zip(source.box, begin, strict=True)):
            raise Undecided("C6: the crossings are on another sheet of the section")
        U, V = coordinates(target, source.d, source.g, source.w)
        low, high = (U.at("u", side).range for side in (-1, 1))
        forward, back = (-low).lower().min(high.lower()), low.lower().min((-high).lower())
        least, orientation = (forward, 1) if forward > back else (back, -1)
        if not least > 1:
            said = f"C6: an edge lies at |U| >= {float(least):.4g} of set {place}"
            raise Undecided(f"{said}, and more than 1 is needed")
        if not V.bound < 1:
            said = f"C6: the image lies within |V| <= {float(V.bound):.4g} of set {place}"
            raise Undecided(f"{said}, and less than 1 is needed")
        return Relation(
            place, orientation, -_double(-least), _double(V.bound), *_cone(source, target)
        )


def _cone(source: Reached, target: Quad) -> tuple[float, float]:
    """C7: the stretch and the squeeze of a relation, unknown without derivatives."""
    if not source.slopes[0]:
        return 0.0, math.inf
    by_u, by_v, by_w = (
        directions(target, source.g, source.w, along)
        for along in zip(*source.slopes, source.slopes_of_w, strict=True)
    )
    other = by_v[0].bound + by_w[0].bound / LIGHT + LIGHT * source.slopes_of_w[0].bound
    stretch = abs(by_u[0].range).lower() - other
    return -_double(-stretch), _double(by_u[1].bound + by_v[1].bound + by_w[1].bound / LIGHT)


def prove_cones(relations: Iterable[Relation]) -> None:
    """C7: every difference of two orbits grows along u, or shrinks along v.

    Raises
    ------
    Undecided
    """
    for each in relations:
        if not (each.stretch > 1 and each.squeeze < 1):
            raise Undecided(
                f"C7: the passage to set {each.target} is not shown to stretch along u and to"
                " shrink along v"
            )


def prove(
    numbers: Numbers, quads: Sequence[Quad], orbits: Sequence[Sequence[FamilyStep]]
) -> tuple[list[Reached], list[list[Relation]]]:
    """Check the full shift: sets of each symbol on each section, which cover all of the other one.

    Parameters
    ----------
    numbers : Numbers
    quads : n Quad
    orbits : n sequences of FamilyStep

    Returns
    -------
    arrivals : n Reached
    relations : n lists of Relation

    Raises
    ------
    Undecided
        The first that is not shown; the text names the set.
    """
    arrivals = []
    for k, (quad, pieces) in enumerate(zip(quads, orbits, strict=True)):
        with _of_set(k):
            arrivals.append(arrival(numbers, quad, pieces))
    letters = [(quad.rising, found.right) for quad, found in zip(quads, arrivals, strict=True)]
    if len(set(letters)) < 4:
        raise Undecided("a section has no sets of both symbols")
    for j, k in combinations(range(len(quads)), 2):
        # Of different symbols they have no point in common.
        if letters[j] == letters[k]:
            _check_apart(quads[j], quads[k], f"sets {j} and {k}")
    relations = []
    for k, (quad, found) in enumerate(zip(quads, arrivals, strict=True)):
        others = [j for j, other in enumerate(quads) if other.rising != quad.rising]
        with _of_set(k):
            relations.append([relation(found, quads[j], arrivals[j].begin, j) for j in others])
    return arrivals, relations


def _check_apart(one: Quad, other: Quad, names: str) -> None:
    """Refuse sets that may have a point in common: |U| of one is more than 1 in the other."""
    with precision(SCALARS):
        if not abs(coordinates(other, *place(one))[0].range) > 1:
            raise Undecided(f"{names} have the same symbol, and are not shown to be apart")


def prove_line(
    numbers: Numbers,
    links: Sequence[tuple[Quad | StartLine, Sequence[FamilyStep]]],
    quads: Sequence[Quad],
    arrivals: Sequence[Reached],
) -> tuple[Reached, list[Relation], list[bool]]:
    """Check that a line of starts crosses the sets of a section, as an image does.

    Parameters
    ----------
    numbers : Numbers
    links : sequence of StartLine and Quad, with their FamilyStep
        The line, and sets of which each has to cover the next one, the last one those of a full
        shift: an approach. Without any the line itself crosses the upward ones.
    quads : n Quad
    arrivals : n Reached

    Returns
    -------
    end : Reached
        The next crossings of the last link.
    crossed : list of Relation
    symbols : list of bool
        Those of the passages up to there.

    Raises
    ------
    Undecided
    """
    symbols = []
    for k, link in enumerate(links):
        try:
            if k + 1 < len(links):
                symbols.append(prove_link(numbers, link, links[k + 1]))
                continue
            end, upward = arrival(numbers, *link), crosses_upward(link[0])
            targets = [j for j, quad in enumerate(quads) if quad.rising == upward]
            crossed = [relation(end, quads[j], arrivals[j].begin, j) for j in targets]
            # A line of starts has no symbol.
            return end, crossed, [*symbols, end.right][1:]
        except Undecided as doubt:
            name = f"set {k} of the approach" if k else "line of starts"
            raise Undecided(f"{name}: {doubt}") from None
    raise ValueError("there is no line of starts")


def crosses_upward(source: Quad | StartLine) -> bool:
    """Whether the next crossings of a set, or of a line of starts, are upward."""
    return isinstance(source, StartLine) or not source.rising


def prove_link(
    numbers: Numbers,
    link: tuple[Quad | StartLine, Sequence[FamilyStep]],
    after: tuple[Quad | StartLine, Sequence[FamilyStep]] | None,
) -> bool:
    """Check that a set, or a line of starts, covers the next one: the symbol of its passage.

    Parameters
    ----------
    numbers : Numbers
    link, after : Quad and sequence of FamilyStep
        A set and the polynomials of its orbits; `after` is None behind the last set.

    Raises
    ------
    Undecided
    """
    # Nothing is asked of cones along a chain.
    numbers = numbers._replace(along="")
    found = arrival(numbers, *link)
    if after is not None:
        (source, _), (target, pieces) = link, after
        if isinstance(target, StartLine) or target.rising != crosses_upward(source) or not pieces:
            raise Undecided("C6: the next set is not one of the section that is crossed")
        with precision(SCALARS):
            growth = LogarithmicNorm.of(numbers.field)
        begin, _ = beginning(numbers, target, pieces[0], growth)
        relation(found, target, begin, 0)
    return found.right


def phases(numbers: Numbers, line: StartLine, pieces: Sequence[FamilyStep]) -> tuple[float, float]:
    """Bounds on theta2 of all starts of a line, radians, but for whole turns.

    Raises
    ------
    Undecided
    """
    c = numbers.field
    with precision(SCALARS):
        growth = LogarithmicNorm.of(c)
        _, (bound, *_) = line_beginning(numbers, line, pieces[0], growth)
        begin = [Family.of(terms, pieces[0].bits).at("z", -1).range for terms in pieces[0].terms]
        near = zip(begin, distances(bound, growth), strict=True)
        _, _, M3, g1, g2, _ = (x + arb(0, e) for x, e in near)
        cos, sin = 1 / (2 * numbers.to_M1), 1 / (2 * numbers.to_M2)
        # gamma of the starts, solved for sine and cosine of theta1/2 + theta2.
        lean = (2 * arb(line.J1.numerator) / line.J1.denominator - M3) / M3
        angle = arb.atan2(cos * g1 - sin * g2, (sin * g1 + cos * g2) * lean)
        found = angle - arb.atan2(sin, cos) - arb.atan2(c.mu_r2, c.mu_r1)
        if not found.is_finite():
            raise Undecided("C1: theta2 of the starts is not told")
        found = found + 2 * arb.pi() if found < 0 else found
        return -_double(-found), _double(found)


@contextmanager
def _of_set(k: int) -> Iterator[None]:
    """Name the set in what is undecided."""
    try:
        yield
    except Undecided as doubt:
        raise Undecided(f"set {k}: {doubt}") from None


def on_parts(state: Family) -> list[arb]:
    """Values over each part of a step, for all u, v and w."""
    values = Values(state.middle(), PARTS)
    found = []
    for first, last in pairwise(values.at):
        # Between its ends it is within half of its largest change of their middle.
        beside = arb(values.change + 1) / 2 + values.doubt
        found.append((arb(first + last) / 2 + arb(0, beside)) / arb(2) ** VALUES)
    return found


def _double(x: arb) -> float:
    """A double above a ball."""
    return math.nextafter(float(x.upper()), math.inf)


def distances(bound: arb, growth: LogarithmicNorm) -> list[arb]:
    """Bounds on the distance of each component."""
    return [bound, bound, _up(bound / growth.upright)] + 3 * [_up(bound * growth.weight)]


def _orders(state: Family, along: Iterable[str]) -> list[arb]:
    """Bounds on a family, and on its derivatives."""
    return [state.bound, *(state.partial(name).bound for name in along)]


def norms(states: Sequence[Family], growth: LogarithmicNorm, along: str) -> list[arb]:
    """Bounds on the norms of states, and of their derivatives."""
    return _normed([_orders(state, along) for state in states], growth)


def _normed(bounds: Sequence[Sequence[arb]], growth: LogarithmicNorm) -> list[arb]:
    return [_up(growth.norm(each)) for each in zip(*bounds, strict=True)]


def largest(balls: Iterable[arb]) -> arb:
    """An upper bound of all."""
    found = arb(0)
    for ball in balls:
        found = found.max(_up(ball))
    return found


def _up(x: arb) -> arb:
    return arb(x.upper())
