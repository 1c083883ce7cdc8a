"""C2 to C5 of docs/full-shift.md: orbits of a set or a line, followed up to their next crossing."""

from collections.abc import Iterator, Sequence
from fractions import Fraction
from typing import NamedTuple

from scripts.check_certificate import Fails, Interval, exponential, grown
from scripts.check_sections import Bounds, Line, Problem, Quad, Step, beginning, line_beginning
from scripts.check_series import ALONG, ENERGY, Series, above, around, below, orders, size

WIDEST = Fraction(1, 4096)
"""Largest radius of a tube, in the unit of momenta."""


class Arrival(NamedTuple):
    """The next crossings of the orbits of a set, taken by the symmetry beside separatrix 2 or 3."""

    d: Series
    g: Series
    symbol: int
    box: list[Interval]
    """Q, gamma1 and gamma2 of all of them, Q in its unit."""
    begin: list[Interval]
    """The same three of the polynomials at the beginning; empty for a line."""
    time: Interval
    """The time of the passage, t'."""
    slopes: Sequence[tuple[Series, ...]]
    """The derivatives of d, g and w in u, those in v, and those in w, if they are asked for."""
    w: Series = ENERGY


def arrival(p: Problem, start: Quad | Line, steps: Sequence[Step]) -> Arrival:
    """C1 to C5 of the orbits of a set, or of a line of starts, up to their next crossing."""
    # `side` is the sign of M3 during the passage; a line begins at M3 < 0, not at M3 = 0.
    begin: list[Interval] = []
    if isinstance(start, Line):
        side, order, bounds = -1, [0, -1], line_beginning(p, start, steps[0])
    else:
        side, order = 1 if start.rising else -1, [1, 0, -1]
        begin, bounds = beginning(p, start, steps[0])
    starts, told, end = bounds, list[int](), list[Series]()
    for step in steps:
        if step.half.ball().low <= 0:
            raise Fails("C2: the length of a step is not shown to be positive")
        if end:
            bounds = joined(p, end, step, bounds)
        bounds = carried(p, step, bounds, defects(p, step))
        told += signs(p, step, bounds[0], side)
        end = [state.at(0, 1) for state in step.states]
    if [x for k, x in enumerate(told) if not k or told[k - 1] != x] != order:
        raise Fails("C4: M3 is not shown to leave zero at once and to return at the end")
    found = crossing(p, end, bounds, side)
    passed = sum((2 * step.half.ball() for step in steps), Interval.of(0))
    found = found._replace(begin=begin, time=passed + found.time)
    if isinstance(start, Line) and p.h0 is not None:
        w, by_w = energies_along(p, p.h0, steps[0], starts)
        slopes = [(d, g, each) for (d, g, _), each in zip(found.slopes, by_w, strict=True)]
        return found._replace(w=w, slopes=slopes)
    return found


def joined(p: Problem, end: Sequence[Series], step: Step, bounds: Bounds) -> Bounds:
    """C3: bounds at the beginning of a step, from those at the end of the step before."""
    joint = zip(step.states, end, strict=True)
    gap = p.norms([orders(state.at(0, -1) - before, p.along) for state, before in joint])
    return [a + b for a, b in zip(bounds, gap, strict=True)]


def tube(
    p: Problem, step: Step, begin: Fraction, away: Fraction, name: str, widest: Fraction
) -> tuple[Fraction, Fraction]:
    """The bound on the distance over a step and the factor of its growth, as `grown` has them.

    `begin` is epsilon + 2 delta, and `widest` is in the unit of momenta.
    """
    sizes = [x.size for x in step.states[2].on_parts()]
    return grown(p, sizes, step.half.most, begin, away, widest * p.unit, name)


def defects(p: Problem, step: Step) -> Bounds:
    """C2: bounds on the defect of a step and on its derivatives."""
    pairs = zip(step.states, p.field(step.states), strict=True)
    return p.norms([orders(y.slope() - step.half * f, p.along) for y, f in pairs])


def carried(p: Problem, step: Step, begin: Bounds, leaps: Bounds) -> Bounds:
    """C3: bounds at the end of a step, from those at its beginning and on its defect."""
    # A defect is bounded over x from -1 to 1, a length of 2.
    first, *along = (a + 2 * b for a, b in zip(begin, leaps, strict=True))
    bound, growth = tube(p, step, first, Fraction(1), "C3", WIDEST)
    size, *slopes = p.norms([orders(y, p.along) for y in step.states])
    length, *lengths = orders(step.half, p.along)
    found = [bound]
    for x, slope, changed in zip(along, slopes, lengths, strict=True):
        # The derivative of f differs between orbits and polynomials, by the second derivative times
        # their distance; where the length depends on the variable, so does f itself.
        bent = p.bending * length * slope + p.steepness(size + WIDEST * p.unit) * changed
        found.append(growth * (x + 2 * bent * first))
    # Rounded upward to fewer digits: fractions that are multiplied over and over grow long.
    return [above(x) for x in found]


def signs(p: Problem, step: Step, bound: Fraction, side: int) -> Iterator[int]:
    """C4: for each part 0 if M3 has the sign of the passage, `side`, else the sign of side M3'."""
    apart = p.apart(bound)
    parts = [state.on_parts() for state in step.states]
    for k, M3 in enumerate(parts[2]):
        if (side * M3 - apart[2]).low > 0:
            yield 0
            continue
        rate = side * p.field([around(x[k], e) for x, e in zip(parts, apart, strict=True)])[2]
        if rate.low <= 0 <= rate.high:
            raise Fails("C4: neither the sign of M3 nor that of its rate is told on a part")
        yield 1 if rate.low > 0 else -1


def crossing(p: Problem, end: list[Series], bounds: Bounds, side: int) -> Arrival:
    """C5: the crossings beside the end of the last step, from which their time counts."""
    apart = p.apart(bounds[0])
    box, time, slowest = last_box(p, end, apart, side)
    rates = list(map(size, p.field(box)))
    fastest = max(x / unit for x, unit in zip(rates, p.units, strict=True))
    places = [x.wider(e + time * rate) for x, e, rate in zip(end, apart, rates, strict=True)]
    # Derivatives change on the way to the crossing, and with the time of the crossing, whose
    # derivative is that of M3 over the rate of M3.
    steep = p.steepness(p.norm(*map(size, box)))
    more = exponential(Interval.of(steep * time)).above - 1
    slopes = []
    for i in p.along:
        moved = [state.partial(i) for state in end]
        most = p.norm(*(x.most for x in moved)) + bounds[i]
        off = p.apart(bounds[i] + more * most)
        timed = (moved[2].most + off[2]) * fastest / slowest
        every = zip(moved, off, p.units, strict=True)
        slopes.append([x.wider(e + timed * unit) for x, e, unit in every])
    return reached(p, [places, *slopes], box, side)._replace(time=around(0, time))


def last_box(
    p: Problem, end: list[Series], apart: list[Fraction], side: int
) -> tuple[list[Interval], Fraction, Fraction]:
    """C5: a box in which orbits stay until they cross, their time, and the least rate of |M3|."""
    M3 = end[2].most + apart[2]
    room = (M3 + apart[2]) / p.unit
    for _ in range(4):
        # In this box |M3| falls at the rate `slowest` at least: an orbit that stays in it crosses
        # within `time`. It does stay, if it moves by `room` at most in that time, in any unit.
        every = zip(end, apart, p.units, strict=True)
        box = [state.ball(e + room * unit) for state, e, unit in every]
        rates = p.field(box)
        slowest = below(-side * rates[2])
        if slowest <= 0:
            break
        time = M3 / slowest
        moved = time * max(size(x) / unit for x, unit in zip(rates, p.units, strict=True))
        if moved <= room:
            return box, time, slowest
        room = 2 * moved
    raise Fails("C5: M3 crosses zero too slowly")


def reached(p: Problem, places: list[list[Series]], box: list[Interval], side: int) -> Arrival:
    """C5: the side on which the orbits cross, by the sign of the large Q, and where they do."""
    large = 1 if side > 0 else 0
    if box[large].low <= 0 <= box[large].high:
        raise Fails("C5: the side on which the orbits leave is not told")
    sign = 1 if box[large].low > 0 else -1
    (d, g), *along = ((x[1 - large] * sign, x[5] * sign) for x in places)
    # Derivatives in all of u, v and w are asked for, or none; that of w itself is 0, 0 and 1.
    slopes = [(*each, Series.of(int(i == 3))) for i, each in zip(ALONG, along, strict=False)]
    there = [sign * box[large] / p.unit, box[3], box[4]]
    return Arrival(d, g, int(sign == side), there, [], Interval.of(0), slopes)


def energies_along(
    p: Problem, h0: Interval, step: Step, bounds: Sequence[Fraction]
) -> tuple[Series, list[Series]]:
    """C6: w along a line of starts of one J2, and its derivatives.

    The energy is h0 and that of the weight, which gamma tells.
    """
    g1, g2 = (step.states[k].at(0, -1) for k in (3, 4))
    per = 1 / p.spread
    w = (g1 * p.mu[0] + g2 * p.mu[1] + (h0 - p.h)) * per
    unsure = above((p.mu[0].size + p.mu[1].size) * p.w * per)
    found = w.wider(unsure * bounds[0])
    if found.most > 1:
        raise Fails("C6: energies along the line are others than those of the sets")
    apart = zip(p.along, bounds[1:], strict=True)
    return found, [w.partial(i).wider(unsure * bound) for i, bound in apart]
