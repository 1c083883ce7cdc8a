"""The checker of passages: it decides if polynomials are near the orbits of a set, to a crossing.

It knows nothing of how they were found. `docs/full-shift.md` states the theorems, whose hypotheses
C2 to C5 are checked here; the bounds on derivatives that C7 needs are carried along. A hypothesis
that is not shown ends in :class:`Undecided`, never in a crossing. M and t' are dimensionless.
"""

from collections.abc import Iterator, Sequence
from itertools import groupby
from typing import NamedTuple, TypeVar

from flint import arb, ctx

from rigidpend.machine.workers import check_stop
from rigidpend.mechanics.equations import AlignedCoefficients, aligned
from rigidpend.routes.certified.balls import ARB_BITS, double_above, double_below, upper
from rigidpend.routes.certified.models import INPUT_BITS, Family, on_parts
from rigidpend.routes.certified.proof_data import CLOCK, FamilyStep, Source, StartLine, Undecided
from rigidpend.routes.certified.sections import W_FAMILY, Numbers, beginning, begun, largest

Kind = TypeVar("Kind", bound=Family)
Turned = TypeVar("Turned", Family, arb)

PARTS = 32
"""Parts of a step on which signs and rates are told."""
WIDEST, WIDEST_OF_SET = 2.0**-6, 2.0**-12
"""Largest radius of a tube in the unit of M: where a distance may be larger nothing is decided."""
RADIUS_TRIALS, FIRST_RADIUS = 4, 4
"""Trials of a tube's radius, and the first radius over the distance that it has to hold."""
DEFECT_BITS = 32
"""Bits of a defect beyond those of its polynomials: it has about a unit of these."""
TUBES = {"C": (WIDEST_OF_SET, 1.0), "H": (WIDEST, 0.5)}
"""Largest radius of a tube, and the share of it at which growth is bounded, by hypotheses.

C bounds growth at the orbits themselves, because derivatives grow there; H halfway between orbits
and polynomials."""
BOUND_TRIALS = 4
"""Trials of a bound on the way from the end of the last step to the crossing."""


class Reached(NamedTuple):
    """The next crossings of the orbits of a set.

    The symmetry has turned those beside separatrix 1 or 4 to 3 or 2.
    """

    d: Family
    """The small one of Qp and Qm."""
    g: Family
    """gamma3."""
    right: bool
    """The symbol: True for 1."""
    box: tuple[arb, arb, arb]
    """Q, gamma1 and gamma2 of all of them, in their units."""
    bound: float
    """Bound on the distance of the polynomials from the orbits, in the norm."""
    late: float
    """Bound on the time from the end of the last step to a crossing, before or after it, t'."""
    duration: tuple[float, float]
    """Lower and upper bound on the time of the passage, t'."""
    begin: Sequence[arb]
    """The same three of the polynomials at the beginning."""
    slopes: Sequence[tuple[Family, Family, Family]]
    """Those of d, g and w in u, in v and in w; empty where they are not asked for."""
    w: Family = W_FAMILY
    """The energies, as w."""


def first_of(pieces: Sequence[FamilyStep]) -> FamilyStep:
    """The first step; Undecided where there are none."""
    if not pieces:
        raise Undecided("there are no steps")
    return pieces[0]


def arrival(numbers: Numbers, start: Source, pieces: Sequence[FamilyStep]) -> Reached:
    """Check the orbits of a set, or of a line of starts, up to their next crossing (C1 to C5).

    Undecided where a hypothesis is not shown; the text begins with its name.
    """
    begin, starts = beginning(numbers, start, first_of(pieces))
    side, signs, time, bounds = start.side, list[int](), arb(0), starts
    for states, half, apart in followed(numbers, pieces, bounds):
        with ctx.workprec(ARB_BITS):
            time += 2 * half.range
            parts = signs_on_parts(numbers, states, apart[0], "C4", [side])
            # 0 where M3 has the sign of the passage, else the sign of the rate of side * M3.
            signs += [side * rate if box else 0 for rate, box in parts]
    # A line begins at M3 < 0, not at M3 = 0.
    check_signs(signs, [0, -1] if isinstance(start, StartLine) else [1, 0, -1])
    end = [state.at("z", 1) for state in states]
    with ctx.workprec(ARB_BITS):
        found = crossing(numbers, end, apart, side, begin, time)
        if not isinstance(start, StartLine) or numbers.h0 is None:
            return found
        w, slopes = energies_along(numbers, numbers.h0, pieces[0], starts)
        own = [(*of[:2], by) for of, by in zip(found.slopes, slopes, strict=True)]
        return found._replace(w=w, slopes=own)


def energies_along(
    numbers: Numbers, h0: arb, piece: FamilyStep, bounds: Sequence[arb]
) -> tuple[Family, list[Family]]:
    """The energies along a line of starts of one J2_0, as w, and its derivatives.

    The energy is h0 = kappa J2_0^2/2 and that of the weight, which gamma tells.
    """
    (_, _, _, gamma1, gamma2, _), c = begun(piece), numbers.field
    with ctx.workprec(INPUT_BITS):
        r1, r2, off = (Family.of_ball(x, INPUT_BITS) for x in (c.mu_r1, c.mu_r2, h0 - numbers.h))
        per = Family.of_fraction(1 / numbers.spread, INPUT_BITS)
        found = (r1 * gamma1 + r2 * gamma2 + off) * per
        # By how much w differs where gamma is off by a distance of 1 in the norm.
        unsure = (abs(c.mu_r1) + abs(c.mu_r2)) * per.bound * numbers.growth.weight
        w = found.widened(unsure * bounds[0])
        if not w.bound <= 1:
            said = f"the energies of its starts have |w| <= {float(w.bound):.4g}"
            raise Undecided(f"C6: {said}, and 1 is all that is known of")
        apart = dict(zip(numbers.along, bounds[1:], strict=True))
        return w, [found.partial(name).widened(unsure * each) for name, each in apart.items()]


def followed(
    numbers: Numbers,
    pieces: Sequence[FamilyStep],
    bounds: list[arb],
    end: Sequence[Family] | None = None,
) -> Iterator[tuple[list[Family], Family, list[arb]]]:
    """Check steps one after the other (C2, C3; H1 to H3).

    Yields for each its six states, its half-length, and bounds on the distance of the polynomials
    from the orbits throughout it and on those of its derivatives in the variables `numbers.along`.
    The given `bounds` are those at the beginning of the first step or, if `end` is given, those of
    these states from the orbits: then the jump to the first step counts as well.
    """
    for piece in pieces:
        check_stop()
        states = [Family.of(terms, piece.bits) for terms in piece.terms]
        half = Family.of(piece.half_length, CLOCK)
        with ctx.workprec(ARB_BITS):
            if not half.range > 0:
                said = "the length of a step is not shown to be positive"
                raise Undecided(f"{numbers.letter}2: {said}")
            if end is not None:
                bounds = joined(numbers, states, end, bounds)
            end = [state.at("z", 1) for state in states]
            leaps = defects(numbers, states, half)
            bounds = carried(numbers, states, half, bounds, leaps)
        yield states, half, bounds


def joined(
    numbers: Numbers, states: Sequence[Kind], end: Sequence[Kind], bounds: Sequence[arb]
) -> list[arb]:
    """H1: bounds as in :func:`followed` where a step begins, from those at the end of another."""
    off = [s.at("z", -1) - e for s, e in zip(states, end, strict=True)]
    gaps = numbers.norms(off)
    return [upper(bound + gap) for bound, gap in zip(bounds, gaps, strict=True)]


def defects(numbers: Numbers, states: Sequence[Kind], half: Kind) -> list[arb]:
    """C2, H2: bounds on the norm of dP/dx - half f(P) over a step, and on those of its derivatives.

    f is the aligned field; the derivatives are those in the variables `numbers.along`.
    """
    c = AlignedCoefficients(*map(states[0].constant, numbers.field))
    # Products are exact, and most of their terms are far below a unit of the polynomials. What is
    # rounded stays a polynomial of no higher degree, so derivatives are bounded too.
    fine = states[0].bits + DEFECT_BITS
    rates = [half * rate.rounded(fine) for rate in aligned(states, c)]
    off = [P.derivative() - rate.rounded(fine) for P, rate in zip(states, rates, strict=True)]
    return numbers.norms(off)


def carried(
    numbers: Numbers,
    states: Sequence[Family],
    half: Family,
    begin: Sequence[arb],
    leaps: Sequence[arb],
) -> list[arb]:
    """C3, H3: bounds on the distance over a whole step, and those on its derivatives (C7)."""
    growth, apart = numbers.growth, begin[0] + 2 * leaps[0]
    sizes = [abs(each).upper() for each in on_parts(states[2], PARTS)]
    bound, factor = tube(sizes, half.bound, apart, numbers)
    size, *slopes = numbers.norms(states)
    rate = growth.steepness(size + WIDEST_OF_SET * numbers.unit)
    found = [bound]
    for k, (name, slope) in enumerate(zip(numbers.along, slopes, strict=True)):
        # The derivative of f differs between orbits and polynomials by at most its second
        # derivative times their distance; where the half-length depends on the variable, so does
        # f itself.
        bent = half.bound * growth.bending * slope + half.partial(name).bound * rate
        found.append(upper(factor * (begin[1 + k] + 2 * (leaps[1 + k] + bent * apart))))
    return found


def tube(sizes: Sequence[arb], half: arb, begin: arb, numbers: Numbers) -> tuple[arb, arb]:
    """C3, H3: a bound on the distance over a whole step, and the factor of its growth.

    `sizes` bound |M3| of the polynomials on equal parts, `half` half of the step's length in time;
    `begin` is the distance at the beginning with what the step's defect adds. Undecided where the
    tube would be too wide.
    """
    (room, share), growth = TUBES[numbers.letter], numbers.growth
    widest, length = room * numbers.unit, 2 * half / len(sizes)
    # A radius is assumed, then verified: as long as the distance is below `assumed` it is at most
    # `grown`, and if that is less, it never reaches `assumed`. The rate depends on it but little.
    assumed = FIRST_RADIUS * begin
    for _ in range(RADIUS_TRIALS):
        # A wider tube decides nothing, and the rate would be larger in it.
        assumed = assumed.min(widest)
        wide = share * assumed / growth.upright
        rates = (growth.rate(size + wide, 2 * share * assumed) for size in sizes)
        factor = (sum(rates, arb(0)) * length).exp()
        grown = upper(factor * begin)
        # Balls compare as true only where that is certain: what may be larger counts as larger.
        if grown < assumed:
            return grown, factor
        if not grown < widest:
            break
        assumed = 2 * grown
    said = f"the orbits are shown to stay within {float(grown):.3g} of the polynomials"
    needed = f"within {float(widest):.3g} is needed; more bits would help"
    raise Undecided(f"{numbers.letter}3: {said}, and {needed}")


def signs_on_parts(
    numbers: Numbers, states: Sequence[Family], bound: arb, name: str, sides: Sequence[int]
) -> Iterator[tuple[int, list[arb]]]:
    """Tell of each part of a step the sign of M3, with an empty list, if it is one of `sides`.

    Else yield the sign of its rate, with balls that contain all states there. Undecided, under the
    `name` of a hypothesis, where neither sign is told.
    """
    M3, every = on_parts(states[2], PARTS), list[list[arb]]()
    apart = numbers.growth.distances(bound)
    for k, value in enumerate(M3):
        if side := next((side for side in sides if side * value > apart[2]), 0):
            yield side, []
            continue
        # Only the few parts beside a crossing need the other components.
        every = every or [on_parts(state, PARTS) for state in states]
        box = [each[k] + arb(0, e) for each, e in zip(every, apart, strict=True)]
        rate = aligned(box, numbers.field)[2]
        if not (rate > 0 or rate < 0):
            said = "neither the sign of M3 nor that of its rate is told on a part"
            raise Undecided(f"{name}: {said}")
        yield (1 if rate > 0 else -1), box


def check_signs(signs: Sequence[int], order: Sequence[int]) -> None:
    """C4: M3 leaves zero once, unless it begins elsewhere, keeps its sign, and returns once.

    `signs` are of parts one after the other, and `order` is that of the runs of equal ones.
    """
    if [sign for sign, _ in groupby(signs)] != list(order):
        raise Undecided("C4: M3 is not shown to leave zero at once and to return at the end")


def crossing(
    numbers: Numbers,
    end: Sequence[Family],
    bounds: Sequence[arb],
    side: int,
    begin: Sequence[arb],
    passed: arb,
) -> Reached:
    """C5: the crossings beside the end of the last step, the side on which they lie, and where.

    `end` are the polynomials there, `bounds` those on the distance of orbits and its derivatives,
    `side` the sign of M3 before the crossing, `begin` goes into the result, and `passed` is the
    time since the beginning, t'.
    """
    growth, units = numbers.growth, numbers.units
    apart = growth.distances(bounds[0])
    # |M3| of the orbits at the end of the step, and a first guess of the way from there.
    M3 = end[2].bound + apart[2]
    late = (apart[2] + M3) / numbers.unit
    for _ in range(BOUND_TRIALS):
        # In this box M3 changes at the rate `slowest` at least, so an orbit that stays in it
        # crosses within `time`. It does stay, if `time` times the largest rate is at most `late`,
        # each component counted in its unit.
        wide = zip(end, apart, units, strict=True)
        box = [s.range + arb(0, e + late * unit) for s, e, unit in wide]
        rates = aligned(box, numbers.field)
        fastest = largest(abs(rate) / unit for rate, unit in zip(rates, units, strict=True))
        slowest = (-side * rates[2]).lower()
        if not slowest > 0:
            break
        time = upper(M3 / slowest)
        if time * fastest <= late:
            break
        # Twice what is needed now, for rates in the wider box may be larger.
        late = upper(2 * time * fastest)
    else:
        slowest = arb(-1)
    if not slowest > 0:
        raise Undecided("C5: M3 crosses zero too slowly")
    small, large = (0, 1) if side > 0 else (1, 0)
    if not (box[large] > 0 or box[large] < 0):
        raise Undecided("C5: the side on which the orbits leave is not told")
    mirrored = bool(box[large] < 0)

    def turned(x: Turned) -> Turned:
        """A Q or gamma3 as it is after the symmetry."""
        # (-M1, -M2, M3, gamma1, gamma2, -gamma3) takes separatrices 1 and 4 to 3 and 2.
        return -x if mirrored else x

    d, g = (turned(end[j].widened(apart[j] + time * abs(rates[j]))) for j in (small, 5))
    # The derivatives change on the way to the crossing, by a factor of exp(steep time) at most,
    # and with the time of the crossing, whose derivative is that of M3 over the rate of M3.
    _, *sizes = numbers.norms(end)
    steep = growth.steepness(growth.norm(tuple(upper(abs(x)) for x in box)))
    slopes = []
    for name, size, bound in zip(numbers.along, sizes, bounds[1:], strict=True):
        off = growth.distances(upper(bound + (steep * time).expm1() * (size + bound)))
        timed = (end[2].partial(name).bound + off[2]) * fastest / slowest
        by_d, by_g = (
            turned(end[j].partial(name).widened(off[j] + timed * units[j])) for j in (small, 5)
        )
        slopes.append((by_d, by_g, W_FAMILY.partial(name)))
    # From separatrix 2 the next is 3 (symbol 1) or 1 (0); from 3 it is 4 (1) or 2 (0).
    right = (not mirrored) if side > 0 else mirrored
    there = (turned(box[large]) / numbers.unit, box[3], box[4])
    duration = double_below(passed - time), double_above(passed + time)
    ends = double_above(bounds[0]), double_above(time)
    return Reached(d, g, right, there, *ends, duration, begin, slopes)
