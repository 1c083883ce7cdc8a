"""The checker of covering relations: it decides if a passage stretches a set across another.

`docs/full-shift.md` states the theorems, whose hypotheses C6 and C7 are checked here, from where
the orbits of sets cross. A hypothesis that is not shown ends in :class:`Undecided`, never in a
relation. Sets are numbered from 0.
"""

import math
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from functools import partial
from itertools import combinations, pairwise
from typing import NamedTuple

from flint import arb, ctx

from rigidpend.machine.workers import note
from rigidpend.routes.certified.balls import ARB_BITS, double_above, double_below
from rigidpend.routes.certified.passages import Reached, arrival, first_of
from rigidpend.routes.certified.proof_data import (
    FamilyStep,
    Followed,
    Quad,
    Source,
    StartLine,
    Undecided,
)
from rigidpend.routes.certified.sections import (
    POINT_BOX,
    W_WEIGHT,
    Numbers,
    beginning,
    coordinates,
    directions,
    place,
)


class Relation(NamedTuple):
    """A covering relation and the margins by which it holds; U and V are those of the target."""

    target: int
    """Number of the set that is covered."""
    orientation: int
    """1 if the edge u = 1 is stretched beyond U = 1, -1 if it is beyond U = -1."""
    edge: float
    """Lower bound on |U| on the edges u = -1 and 1; 1 is needed."""
    across: float
    """Upper bound on |V| of all points; less than 1 is needed."""
    stretch: float
    """Lower bound on |dU/du| - |dU/dv| - |dU/dw|/64 of all points; uniqueness needs more than 1.

    For a line of starts of one J2_0 64 |dw/du| is subtracted as well."""
    squeeze: float
    """Upper bound on |dV/du| + |dV/dv| + |dV/dw|/64 of all points; uniqueness needs less than 1."""


def relation(source: Reached, target: Quad, begin: Sequence[arb], number: int) -> Relation:
    """C6: check that the orbits of a set cover a target, a set of the section that they cross.

    `begin` has Q, gamma1 and gamma2 of the target's polynomials; `number` is its own.
    """
    with ctx.workprec(ARB_BITS):
        # So near to its polynomials the target has one point only with given d and gamma3 (C1): a
        # crossing with |U|, |V| <= 1 is a point of the target.
        if not all(abs(a - b) <= POINT_BOX for a, b in zip(source.box, begin, strict=True)):
            raise Undecided("C6: the crossings are on another sheet of the section")
        U, V = coordinates(target, source.d, source.g, source.w)
        low, high = (U.at("u", side).range for side in (-1, 1))
        # By how much both edges lie beyond the ends of the target, for either orientation.
        forward, back = (-low).lower().min(high.lower()), low.lower().min((-high).lower())
        least, orientation = (forward, 1) if forward > back else (back, -1)
        if not least > 1:
            # An edge on the wrong side of the middle has a negative bound.
            said = f"C6: an edge lies at |U| >= {max(0.0, float(least)):.4g} of set {number}"
            raise Undecided(f"{said}, and more than 1 is needed")
        if not V.bound < 1:
            said = f"C6: the image lies within |V| <= {float(V.bound):.4g} of set {number}"
            raise Undecided(f"{said}, and less than 1 is needed")
        return Relation(
            number, orientation, double_below(least), double_above(V.bound), *cone(source, target)
        )


def relations_of(
    source: Source, found: Reached, quads: Sequence[Quad], begins: Sequence[Sequence[arb]]
) -> list[Relation]:
    """C6: check that orbits cover all sets of the section that they cross.

    `begins` are Q, gamma1 and gamma2 of the polynomials of each set.
    """
    targets = [j for j, quad in enumerate(quads) if quad.side != source.side]
    return [relation(found, quads[j], begins[j], j) for j in targets]


def cone(source: Reached, target: Quad) -> tuple[float, float]:
    """C7: bounds on the stretch and the squeeze of a relation; 0 and infinity without derivatives.

    They are `stretch` and `squeeze` of :class:`Relation`.
    """
    if not source.slopes:
        return 0.0, math.inf
    by_u, by_v, by_w = (directions(target, source.g, source.w, by) for by in source.slopes)
    # Differences in w count W_WEIGHT times; along a line w itself may change with u.
    (_, _, moved), *_ = source.slopes
    other = by_v[0].bound + by_w[0].bound / W_WEIGHT + W_WEIGHT * moved.bound
    squeeze = by_u[1].bound + by_v[1].bound + by_w[1].bound / W_WEIGHT
    return double_below(abs(by_u[0].range).lower() - other), double_above(squeeze)


def prove_cones(relations: Iterable[Relation], remedy: str = "a larger mu/h") -> None:
    """C7: check that differences of two orbits grow along u or shrink along v.

    The `remedy` is what may help where that is not shown.
    """
    for each in relations:
        if not (each.stretch > 1 and each.squeeze < 1):
            raise Undecided(
                f"C7: the passage to set {each.target} is not shown to stretch along u and to"
                f" shrink along v; {remedy} may help"
            )


def prove(
    numbers: Numbers, quads: Sequence[Quad], orbits: Sequence[Sequence[FamilyStep]]
) -> tuple[list[Reached], list[list[Relation]]]:
    """Check a full shift: sets of both symbols on both sections, each covering all of the other's.

    Returns the next crossings of each set and its relations. Undecided names the first set of
    which something is not shown.
    """
    begins: list[Sequence[arb]] = []
    arrivals, relations = list[Reached](), list[list[Relation]]()
    for k, (quad, pieces) in enumerate(zip(quads, orbits, strict=True)):
        with _named(f"set {k}"):
            begins.append(beginning(numbers, quad, first_of(pieces))[0])
    # The relations of a set before the orbits of the next one, which take nearly all of the time.
    for k, (quad, pieces) in enumerate(zip(quads, orbits, strict=True)):
        note(partial("polynomials of set {} of 0 to {} are checked".format, k, len(quads) - 1))
        with _named(f"set {k}"):
            arrivals.append(arrival(numbers, quad, pieces))
            relations.append(relations_of(quad, arrivals[k], quads, begins))
    letters = [(quad.rising, found.right) for quad, found in zip(quads, arrivals, strict=True)]
    if len(set(letters)) < 4:
        raise Undecided("a section has no sets of both symbols")
    for j, k in combinations(range(len(quads)), 2):
        # A point has one symbol: sets of different symbols have no point in common.
        if letters[j] == letters[k]:
            check_apart(quads[j], quads[k], f"sets {j} and {k}")
    return arrivals, relations


def check_apart(one: Quad, other: Quad, names: str) -> None:
    """Refuse sets that may have a point in common: |U| of `other` must exceed 1 on all of `one`."""
    with ctx.workprec(ARB_BITS):
        if not abs(coordinates(other, *place(one))[0].range) > 1:
            raise Undecided(f"{names} have the same symbol, and are not shown to be apart")


def prove_line(
    numbers: Numbers,
    links: Sequence[Followed],
    quads: Sequence[Quad],
    arrivals: Sequence[Reached],
) -> tuple[Reached, list[Relation], list[bool]]:
    """Check that a line of starts crosses the sets of a section of a full shift, as an image does.

    The `links` are the line and the sets of an approach, each of which has to cover the next; the
    last one has to cover the sets of the section that it reaches. Without an approach that is the
    line itself, and the section that of upward crossings. Returns the next crossings of the last
    link, its relations, and the symbols of the passages from the sets of the approach.
    """
    symbols, last = prove_chain(numbers, links, of=" of the approach"), links[-1]
    with _named(_link(len(links) - 1, " of the approach")):
        end = arrival(numbers, *last)
        crossed = relations_of(last[0], end, quads, [found.begin for found in arrivals])
    # A line of starts has no symbol.
    return end, crossed, [*symbols, end.right][1:]


def prove_chain(
    numbers: Numbers, links: Sequence[Followed | None], of: str = "", first: int = 0
) -> list[bool]:
    """Check that each link covers the next, and return the symbols of all but the last one.

    None behind the links lets the one before it go anywhere. `first` is the number of the first
    link, 0 for a line of starts; Undecided names a link by its number and `of`.
    """
    symbols = []
    for k, (link, after) in enumerate(pairwise(links), first):
        with _named(_link(k, of)):
            assert link is not None
            symbols.append(prove_link(numbers, link, after))
    return symbols


def _link(k: int, of: str) -> str:
    return f"set {k}{of}" if k else "line of starts"


def prove_link(numbers: Numbers, link: Followed, after: Followed | None) -> bool:
    """Check that a set, or a line of starts, covers the next one, and return its passage's symbol.

    `after` is None behind the last set.
    """
    # A chain claims existence only: C7 and its derivatives are not needed.
    numbers = numbers._replace(along="")
    found = arrival(numbers, *link)
    if after is not None:
        (source, _), (target, pieces) = link, after
        if isinstance(target, StartLine) or target.side == source.side or not pieces:
            raise Undecided("C6: the next set is not one of the section that is crossed")
        begin, _ = beginning(numbers, target, pieces[0])
        relation(found, target, begin, 0)
    return found.right


@contextmanager
def _named(what: str) -> Iterator[None]:
    """Begin the text of what is undecided with the name of the set."""
    try:
        yield
    except Undecided as doubt:
        raise Undecided(f"{what}: {doubt}") from None
