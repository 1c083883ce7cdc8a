"""The checker of passages: whether given polynomials are those of the orbits of a set.

It knows nothing of how they were found. `docs/full-shift.md` has the theorems; C2 to C5 below are
its hypotheses, with what C7 carries along. Whatever is not shown ends in :class:`Undecided`, never
in a crossing.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import pairwise
from typing import NamedTuple

from flint import arb, ctx

from rigidpend.machine.workers import check_stop
from rigidpend.mechanics.equations import AlignedCoefficients, aligned
from rigidpend.routes.certified import checker
from rigidpend.routes.certified.balls import SCALARS, LogarithmicNorm, double_above, upper
from rigidpend.routes.certified.checker import LARGEST, Undecided
from rigidpend.routes.certified.models import VALUE_BITS as VALUES
from rigidpend.routes.certified.models import Family, Values
from rigidpend.routes.certified.pieces import CLOCK, FamilyStep, Quad, StartLine
from rigidpend.routes.certified.sections import (
    ALONG,
    BITS,
    ENERGY,
    Numbers,
    beginning,
    distances,
    largest,
    line_beginning,
    norms,
)

PARTS = 32
"""Parts of a step on which signs and rates are told."""
WIDEST = 2.0**-12
"""Radius of a tube about the orbits of a set at most."""
TUBES = {"C": (WIDEST, 1.0), "H": (LARGEST, 0.5)}
"""Radius of a tube at most, and the share of it within which growth is bounded, by hypotheses.

With C it is at the orbits themselves, for the derivatives' sake, with H halfway to the polynomials.
"""
TRIES = 4
"""Trials of the time by which orbits cross earlier or later than polynomials."""


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


def arrival(numbers: Numbers, start: Quad | StartLine, pieces: Sequence[FamilyStep]) -> Reached:
    """Check the orbits of a set, or of a line of starts, up to their next crossing.

    The text of what is undecided begins with the name of the hypothesis.
    """
    if not pieces:
        raise Undecided("there are no steps")
    if isinstance(start, StartLine):
        side, order = -1, [0, -1]
        begin, bounds = line_beginning(numbers, start, pieces[0])
    else:
        side, order = 1 if start.rising else -1, [1, 0, -1]
        begin, bounds = beginning(numbers, start, pieces[0])
    signs: list[int] = []
    time, starts = arb(0), bounds
    for states, half, apart in followed(numbers, pieces, bounds):
        with ctx.workprec(SCALARS):
            time += 2 * half.range
            parts = told(numbers, states, apart[0], "C4", [side])
            # 0 where M3 has the sign of the passage, else that of M3' by then.
            signs += [side * rate if box else 0 for rate, box in parts]
    check_signs(signs, order)
    end = [state.at("z", 1) for state in states]
    with ctx.workprec(SCALARS):
        found = crossing(numbers, end, apart, side, begin, time)
        if not isinstance(start, StartLine) or numbers.h0 is None:
            return found
        w, slopes = energies_along(numbers, numbers.h0, pieces[0], starts)
        return found._replace(w=w, slopes_of_w=slopes)


def energies_along(
    numbers: Numbers, h0: arb, piece: FamilyStep, bounds: Sequence[arb]
) -> tuple[Family, list[Family]]:
    """w along a line of starts of one J2_0, and its derivatives; kappa J2_0^2/2 is h0."""
    gamma1, gamma2 = (Family.of(terms, piece.bits).at("z", -1) for terms in piece.terms[3:5])
    c = numbers.field
    with ctx.workprec(BITS):
        r1, r2, off = (Family.of_ball(x, BITS) for x in (c.mu_r1, c.mu_r2, h0 - numbers.h))
        per = Family.of_fraction(1 / numbers.spread, BITS)
        found = (r1 * gamma1 + r2 * gamma2 + off) * per
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
    letter: str = "C",
    end: Sequence[Family] | None = None,
) -> Iterator[tuple[list[Family], Family, list[arb]]]:
    """Check steps one after the other (C2, C3; H1 to H3): states, half-length and distances.

    The `bounds` are on the distance of the polynomials from the orbits at the beginning, and on
    those of its derivatives in the variables of `numbers.along`. Where the orbits begin at `end`,
    they are on the distance there.
    """
    for piece in pieces:
        check_stop()
        states = [Family.of(terms, piece.bits) for terms in piece.terms]
        half = Family.of(piece.half, CLOCK)
        with ctx.workprec(SCALARS):
            if not half.range > 0:
                raise Undecided(f"{letter}2: the length of a step is not shown to be positive")
            if end is not None:
                off = [s.at("z", -1) - e for s, e in zip(states, end, strict=True)]
                gaps = norms(off, numbers.growth, numbers.along)
                bounds = [upper(bound + gap) for bound, gap in zip(bounds, gaps, strict=True)]
            end = [state.at("z", 1) for state in states]
            leaps = defects(numbers, states, half)
            bounds = _carried(numbers, states, half, bounds, leaps, letter)
        yield states, half, bounds


def defects(numbers: Numbers, states: Sequence[Family], half: Family) -> list[arb]:
    """C2: bounds on the norm of dP/dx - half f(P) over the step, f the aligned field.

    All but the first are of its derivatives.
    """
    c = AlignedCoefficients(*(Family.of_ball(x, BITS) for x in numbers.field))
    rates = aligned(states, c)
    off = [P.derivative() - half * rate for P, rate in zip(states, rates, strict=True)]
    return norms(off, numbers.growth, numbers.along)


def _carried(
    numbers: Numbers,
    states: Sequence[Family],
    half: Family,
    begin: Sequence[arb],
    leaps: Sequence[arb],
    letter: str = "C",
) -> list[arb]:
    """C3, H3: the distance over the whole step, and those of the derivatives."""
    growth, apart = numbers.growth, begin[0] + 2 * leaps[0]
    bound, factor = tube(states[2], half, apart, growth, letter)
    size, *slopes = norms(states, growth, numbers.along)
    rate = growth.steepness(size + WIDEST)
    found = [bound]
    for k, (name, slope) in enumerate(zip(numbers.along, slopes, strict=True)):
        # Where orbits and polynomials differ, so does what carries their derivatives.
        bent = half.bound * growth.bending * slope + half.partial(name).bound * rate
        found.append(upper(factor * (begin[1 + k] + 2 * (leaps[1 + k] + bent * apart))))
    return found


def tube(
    M3: Family, half: Family, begin: arb, growth: LogarithmicNorm, letter: str
) -> tuple[arb, arb]:
    """The distance over a whole step, from the assumed radius of a tube, and its growth.

    M3 and half of the length in time are those of the polynomials; `begin` is the distance at the
    beginning with what the step adds.
    """
    widest, share = TUBES[letter]
    sizes, length = [abs(each).upper() for each in on_parts(M3)], 2 * half.bound / PARTS
    grown, factor, holds = checker.tube(sizes, length, begin, growth, widest, share)
    if holds:
        return grown, factor
    said = f"{letter}3: the orbits are shown to stay within {float(grown):.3g} of the polynomials"
    raise Undecided(f"{said}, and within {widest:.3g} is needed")


def told(
    numbers: Numbers, states: Sequence[Family], bound: arb, name: str, sides: Sequence[int]
) -> Iterator[tuple[int, list[arb]]]:
    """On each part of a step the sign of M3, if it is one of `sides`.

    Else that of its rate, with all states there, as balls.
    """
    M3, every, apart = on_parts(states[2]), list[list[arb]](), distances(bound, numbers.growth)
    for k, value in enumerate(M3):
        if side := next((side for side in sides if side * value > apart[2]), 0):
            yield side, []
            continue
        every = every or [on_parts(state) for state in states]
        box = [each[k] + arb(0, e) for each, e in zip(every, apart, strict=True)]
        rate = aligned(box, numbers.field)[2]
        if not (rate > 0 or rate < 0):
            said = "neither the sign of M3 nor that of its rate is told on a part"
            raise Undecided(f"{name}: {said}")
        yield (1 if rate > 0 else -1), box


def check_signs(signs: Sequence[int], order: Sequence[int]) -> None:
    """C4: M3 leaves zero once, unless it begins elsewhere, keeps its sign, and comes back once."""
    runs = [sign for k, sign in enumerate(signs) if k == 0 or signs[k - 1] != sign]
    if runs != list(order):
        raise Undecided("C4: M3 is not shown to leave zero at once and to return at the end")


def crossing(
    numbers: Numbers,
    end: Sequence[Family],
    bounds: Sequence[arb],
    side: int,
    begin: Sequence[arb],
    passed: arb,
) -> Reached:
    """C5: the crossing beside the end of the last step, on which side, and where."""
    growth = numbers.growth
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
        time = upper(M3 / slowest)
        if time * fastest <= late:
            break
        late = upper(2 * time * fastest)
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
    steep = growth.steepness(growth.norm(tuple(upper(abs(x)) for x in box)))
    slopes: list[list[Family]] = [[], []]
    for k, (name, size) in enumerate(zip(numbers.along, sizes, strict=True)):
        off = distances(
            upper(bounds[1 + k] + (steep * time).expm1() * (size + bounds[1 + k])), growth
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
    duration = -double_above(time - passed), double_above(passed + time)
    ends = double_above(bounds[0]), double_above(time)
    return Reached(d, g, right, there, *ends, duration, begin, slopes)


def on_parts(state: Family) -> list[arb]:
    """Values over each part of a step, for all u, v and w."""
    values = Values(state.middle(), PARTS)
    found = []
    for first, last in pairwise(values.at):
        # Between its ends it is within half of its largest change of their middle.
        beside = arb(values.change + 1) / 2 + values.doubt
        found.append((arb(first + last) / 2 + arb(0, beside)) / arb(2) ** VALUES)
    return found
