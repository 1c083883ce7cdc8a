"""C1: where the orbits of a set, or of a line of starts, begin; of which theta2 those are."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from fractions import Fraction

from flint import arb, arb_mat

from rigidpend.routes.certified.balls import LogarithmicNorm, precision
from rigidpend.routes.certified.checker import SCALARS, Undecided
from rigidpend.routes.certified.families import Family
from rigidpend.routes.certified.pieces import FamilyStep, Quad, StartLine
from rigidpend.routes.certified.sections import (
    BITS,
    ENERGY,
    Numbers,
    curve,
    distances,
    double_above,
    largest,
    normed,
    orders,
    place,
    upper,
)

ALONE, THIN = 2.0**-5, 2.0**-20
"""Distances within which a point of the section, and of a line of starts, is alone."""


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
        apart = [orders(off[j], numbers.along) if j in off else near for j in range(6)]
    with precision(SCALARS):
        return [each.range for each in (Q, gamma1, gamma2)], normed(apart, growth)


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
        return [], normed([near, orders(Qm - aside, numbers.along), near, near, near, near], growth)


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

    values, *along = zip(*(orders(each, turned) for each in residual), strict=True)
    if not (share < 1 and (near := upper(solved(values))) < room):
        raise Undecided("C1: no points are shown to be where the orbits begin")
    return [near] + [
        upper(solved([
            right[i] + sum((abs(turn[i, j]) for j in range(n)), arb(0)) * near for i in range(n)
        ]))
        for right, turn in zip(along, turned.values(), strict=True)
    ]  # fmt: skip


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
        return -double_above(-found), double_above(found)


def told(low: float, high: float) -> str:
    """Words on phases between two numbers, of which nine digits are rounded outward."""
    return f"theta2_0 from {math.floor(low * 1e9) / 1e9:.9f} to {math.ceil(high * 1e9) / 1e9:.9f}"
