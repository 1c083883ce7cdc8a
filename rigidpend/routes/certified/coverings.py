"""The checker of covering relations: whether given polynomials prove what a passage does to a set.

It knows nothing of how they were found. `docs/full-shift.md` states the theorem; C1 to C6 below are
its hypotheses. Whatever is not shown ends in :class:`Undecided`, never in a relation.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from fractions import Fraction
from itertools import pairwise
from typing import NamedTuple

from flint import arb, arb_mat

from rigidpend.machine.workers import check_stop
from rigidpend.mechanics.body import Body
from rigidpend.mechanics.equations import AlignedCoefficients, aligned, aligned_coefficients
from rigidpend.numbers.exact import Exact
from rigidpend.routes.certified.balls import BALLS, angles
from rigidpend.routes.certified.checker import SCALARS, Undecided
from rigidpend.routes.certified.families import Family, Powers
from rigidpend.routes.certified.growth import LogarithmicNorm
from rigidpend.routes.certified.precision import precision
from rigidpend.routes.certified.signs import BITS as VALUES
from rigidpend.routes.certified.signs import Values

CLOCK = 50
"""Binary digits behind the point of a half-length of a step."""
BITS = 160
"""Bits in which the numbers of the problem are enclosed."""
PARTS = 32
"""Parts of a step on which signs and rates are told."""
ALONE = Fraction(1, 32)
"""Distance in Q, gamma1 and gamma2 within which a point of the section is alone."""
WIDEST = 2.0**-12
"""Radius of a tube at most."""
TRIES, ROOM = 4, 4
"""Trials of a tube's radius, and the first over what it has at the beginning."""


class Quad(NamedTuple):
    """A curved quadrilateral of the section M3 = 0: |U| <= 1 and |V| <= 1 with

    U = (d - p(g))/a,  V = (d - p(g) - l0 - l1 g)/b,  g = gamma3 and p a polynomial.
    """

    rising: bool
    p: tuple[Fraction, ...]
    a: Fraction
    b: Fraction
    l0: Fraction
    l1: Fraction

    def curve(self, g: Family, bits: int) -> Family:
        """p(g)."""
        found = Family.of_fraction(self.p[-1], bits)
        for x in self.p[-2::-1]:
            found = found * g + Family.of_fraction(x, bits)
        return found

    def place(self, bits: int) -> tuple[Family, Family]:
        """d and g of its points, as polynomials in u and v."""
        u, v = Family.of({(0, 1, 0): 2}, 0), Family.of({(0, 0, 1): 2}, 0)
        au, bv = u * Family.of_fraction(self.a / self.l1, bits), v * Family.of_fraction(
            self.b / self.l1, bits
        )
        g = au - bv - Family.of_fraction(self.l0 / self.l1, bits)
        return self.curve(g, bits) + u * Family.of_fraction(self.a, bits), g

    def coordinates(self, d: Family, g: Family, bits: int) -> tuple[Family, Family]:
        """U and V of points of the section."""
        off = d - self.curve(g, bits)
        l0, l1, a, b = (
            Family.of_fraction(x, bits) for x in (self.l0, self.l1, 1 / self.a, 1 / self.b)
        )
        return off * a, (off - l0 - l1 * g) * b


class Piece(NamedTuple):
    """Step of a family of approximate orbits: polynomials in x, u and v, in units of 2^-bits."""

    bits: int
    half: Mapping[Powers, int]
    """Half of its length in time, a polynomial in u and v in units of 2^-CLOCK."""
    terms: Sequence[Mapping[Powers, int]]
    """Those of Qp, Qm, M3, gamma1, gamma2, gamma3 over x in [-1, 1]."""


class Numbers(NamedTuple):
    """Numbers of a body and an energy, balls."""

    field: AlignedCoefficients
    to_M1: arb
    to_M2: arb
    h: arb

    @classmethod
    def of(cls, body: Body, h: Exact) -> Numbers:
        """Enclose those of a body."""
        with precision(BITS):
            p = angles(body)
            half = p.alpha0 / 2
            found = aligned_coefficients(p, BALLS)
            return cls(found, 1 / (2 * half.cos()), 1 / (2 * half.sin()), arb(h.over(BALLS)))


class Arrival(NamedTuple):
    """Where the orbits of a set cross the section next."""

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
    begin: Sequence[arb]
    """Q, gamma1 and gamma2 at the beginning."""


class Relation(NamedTuple):
    """A covering relation: by how much it holds."""

    orientation: int
    edge: float
    """Lower bound on |U| on the edges u = -1 and 1; 1 is needed."""
    across: float
    """Upper bound on |V| of all points; less than 1 is needed."""


def arrival(numbers: Numbers, quad: Quad, pieces: Sequence[Piece]) -> Arrival:
    """Check the orbits of a set up to their next crossing.

    Raises
    ------
    Undecided
        A hypothesis is not shown; the text begins with its name.
    """
    if not pieces:
        raise Undecided("there are no steps")
    with precision(SCALARS):
        growth, side = LogarithmicNorm.of(numbers.field), 1 if quad.rising else -1
    begin, bound = beginning(numbers, quad, pieces[0], growth)
    end: list[Family] | None = None
    signs: list[int] = []
    for piece in pieces:
        check_stop()
        states = [Family.of(terms, piece.bits) for terms in piece.terms]
        half = Family.of(piece.half, CLOCK)
        with precision(SCALARS):
            if not half.range > 0:
                raise Undecided("C2: the length of a step is not shown to be positive")
            if end is not None:
                gap = tuple((s.at(z=-1) - e).bound for s, e in zip(states, end, strict=True))
                bound = _up(bound + growth.norm(gap))
            end = [state.at(z=1) for state in states]
            leap = defect(numbers, states, half, growth)
            bound = _tube(states, half, bound, leap, growth)
            signs += _signs(numbers, states, bound, growth, side)
    _check_signs(signs)
    with precision(SCALARS):
        return _crossing(numbers, end or [], bound, growth, side, begin)


def beginning(
    numbers: Numbers, quad: Quad, piece: Piece, growth: LogarithmicNorm
) -> tuple[list[arb], arb]:
    """C1: where the orbits of a set begin, alone nearby, and a bound on the polynomials' distance.

    The large Q, gamma1 and gamma2 follow from d and g by M . gamma = 0, |gamma| = 1 and the energy.
    """
    states = [Family.of(terms, piece.bits).at(z=-1) for terms in piece.terms]
    c, large, small = numbers.field, 0 if quad.rising else 1, 1 if quad.rising else 0
    d, g = quad.place(BITS)
    Q, gamma1, gamma2 = states[large], states[3], states[4]
    with precision(BITS):
        constants = (numbers.to_M1, numbers.to_M2, c.kappa / 2, c.mu_r1, c.mu_r2, numbers.h)
        m1, m2, spin, r1, r2, h = (Family.of_ball(x, BITS) for x in constants)
        Qp, Qm = (Q, d) if quad.rising else (d, Q)
        M1, M2 = (Qp + Qm) * m1, (Qp - Qm) * m2
        one, half = (Family.of_fraction(x, 1) for x in (Fraction(1), Fraction(1, 2)))
        residual = (
            M1 * gamma1 + M2 * gamma2,
            gamma1 * gamma1 + gamma2 * gamma2 + g * g - one,
            spin * (M1 * M1 + M2 * M2) - half * Qp * Qm + r1 * gamma1 + r2 * gamma2 - h,
        )
        inside = arb(0, arb(ALONE.numerator) / ALONE.denominator)
        # The derivatives of these in Q, gamma1 and gamma2, over all points so near.
        q, y1, y2 = (each.range + inside for each in (Q, gamma1, gamma2))
        qp, qm = (q, d.range) if quad.rising else (d.range, q)
        n1, n2 = (qp + qm) * numbers.to_M1, (qp - qm) * numbers.to_M2
        by = numbers.to_M1, numbers.to_M2 if quad.rising else -numbers.to_M2
        slopes = arb_mat(
            [
                [y1 * by[0] + y2 * by[1], n1, n2],
                [0, 2 * y1, 2 * y2],
                [c.kappa * (n1 * by[0] + n2 * by[1]) - d.range / 2, c.mu_r1, c.mu_r2],
            ]
        )
        try:
            inverse = slopes.mid().inv().mid()
        except ZeroDivisionError:
            raise Undecided("C1: the section is not shown to be a surface") from None
        off = inverse * slopes
        unit = [[abs(off[i, j] - (i == j)).upper() for j in range(3)] for i in range(3)]
        share = _largest(sum(row, arb(0)) for row in unit)
        away = _largest(
            sum((abs(inverse[i, j]) * residual[j].bound for j in range(3)), arb(0))
            for i in range(3)
        )
        room = arb(ALONE.numerator) / ALONE.denominator
        if not (share < 1 and away <= (1 - share) * room):
            raise Undecided("C1: no points of the section are shown to be where the orbits begin")
        near = _up(away / (1 - share))
        apart = [near, near, states[2].bound, near, near, (states[5] - g).bound]
        apart[small] = (states[small] - d).bound
    with precision(SCALARS):
        return [each.range for each in (Q, gamma1, gamma2)], _up(growth.norm(tuple(apart)))


def defect(
    numbers: Numbers, states: Sequence[Family], half: Family, growth: LogarithmicNorm
) -> arb:
    """C2: bound on the norm of dP/dx - half f(P) over the step, f the aligned field."""
    c = AlignedCoefficients(*(Family.of_ball(x, BITS) for x in numbers.field))
    rates = aligned(states, c)
    parts = [P.derivative() - half * rate for P, rate in zip(states, rates, strict=True)]
    return _up(growth.norm(tuple(part.bound for part in parts)))


def _tube(
    states: Sequence[Family], half: Family, begin: arb, leap: arb, growth: LogarithmicNorm
) -> arb:
    """C3: the distance over the whole step, from the assumed radius of the tube."""
    M3 = [abs(each).upper() for each in _on_parts(states[2])]
    length = 2 * half.bound / PARTS
    assumed = ROOM * (begin + 2 * leap)
    for _ in range(TRIES):
        wide = assumed / (2 * growth.upright)
        total = sum((growth.rate(m + wide, assumed) for m in M3), arb(0)) * length
        grown = _up(total.exp() * (begin + 2 * leap))
        # Balls compare as true only where that is certain.
        if grown < assumed < WIDEST:
            return grown
        assumed = 2 * grown
    raise Undecided(f"C3: no tube below {WIDEST} is shown to hold the orbits")


def _signs(
    numbers: Numbers, states: Sequence[Family], bound: arb, growth: LogarithmicNorm, side: int
) -> list[int]:
    """C4: on each part 0 where M3 has the sign of the passage, else that of M3' by then."""
    found, M3 = [], _on_parts(states[2])
    apart = _apart(bound, growth)
    for k, value in enumerate(M3):
        if side * value > apart[2]:
            found.append(0)
            continue
        place = [_on_parts(s)[k] + arb(0, e) for s, e in zip(states, apart, strict=True)]
        rate = side * aligned(place, numbers.field)[2]
        if not (rate > 0 or rate < 0):
            raise Undecided("C4: neither the sign of M3 nor that of its rate is told on a part")
        found.append(1 if rate > 0 else -1)
    return found


def _check_signs(signs: Sequence[int]) -> None:
    """C4: M3 leaves zero once, keeps its sign, and comes back once."""
    order = [1, 0, -1]
    runs = [sign for k, sign in enumerate(signs) if k == 0 or signs[k - 1] != sign]
    if runs != order:
        raise Undecided("C4: M3 is not shown to leave zero at once and to return at the end")


def _crossing(
    numbers: Numbers,
    end: Sequence[Family],
    bound: arb,
    growth: LogarithmicNorm,
    side: int,
    begin: Sequence[arb],
) -> Arrival:
    """C5: the crossing beside the end of the last step, on which side, and where."""
    apart = _apart(bound, growth)
    M3 = end[2].bound + apart[2]
    late = apart[2] + M3
    for _ in range(TRIES):
        # Within so long a time the orbits stay within this box, where M3 changes fast enough.
        box = [s.range + arb(0, e + late) for s, e in zip(end, apart, strict=True)]
        rates = aligned(box, numbers.field)
        fastest = _largest(map(abs, rates))
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
    d, g = (end[j].widened(apart[j] + time * fastest) for j in (small, 5))
    if mirrored:
        d, g = -d, -g
    Q = -box[large] if mirrored else box[large]
    right = (not mirrored) if side > 0 else mirrored
    place = (Q, box[3], box[4])
    return Arrival(d, g, right, place, float(bound.upper()), float(time.upper()), begin)


def relation(source: Arrival, target: Quad, begin: Sequence[arb]) -> Relation:
    """C6: whether the orbits of a set cover another.

    Parameters
    ----------
    source : Arrival
    target : Quad
        Of the section that they cross.
    begin : 3 arb
        Q, gamma1 and gamma2 of the target's points.
    """
    with precision(SCALARS):
        room = arb(ALONE.numerator) / ALONE.denominator
        if not all(abs(a - b) <= room for a, b in zip(source.box, begin, strict=True)):
            raise Undecided("C6: the crossings are on another sheet of the section")
        U, V = target.coordinates(source.d, source.g, BITS)
        edges = [U.at(u=side).range for side in (-1, 1)]
        if edges[0] < -1 and edges[1] > 1:
            orientation = 1
        elif edges[0] > 1 and edges[1] < -1:
            orientation = -1
        else:
            raise Undecided("C6: an edge does not lie beyond the end of the set")
        if not V.bound < 1:
            raise Undecided("C6: the image is not between the sides of the set")
        least = min(float(abs(edge).lower()) for edge in edges)
        return Relation(orientation, least, float(V.bound.upper()))


def _on_parts(state: Family) -> list[arb]:
    """Values over each part of a step, for all u and v."""
    values = Values(state.middle(), PARTS)
    found = []
    for first, last in pairwise(values.at):
        # Between its ends it is within half of its largest change of their middle.
        beside = arb(values.change + 1) / 2 + values.doubt
        found.append((arb(first + last) / 2 + arb(0, beside)) / arb(2) ** VALUES)
    return found


def _apart(bound: arb, growth: LogarithmicNorm) -> list[arb]:
    """Bounds on the distance of each component."""
    return [bound, bound, _up(bound / growth.upright)] + 3 * [_up(bound * growth.weight)]


def _largest(balls: Iterable[arb]) -> arb:
    """An upper bound of all."""
    found = arb(0)
    for ball in balls:
        found = found.max(_up(ball))
    return found


def _up(x: arb) -> arb:
    return arb(x.upper())
