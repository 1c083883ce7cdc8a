"""C6 and C7 of docs/full-shift.md, and the proof of a full shift from C1 to C9."""

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple, TypeAlias

from scripts.check_certificate import Fails, Interval
from scripts.check_connections import check_middle, check_transversal, farthest
from scripts.check_passages import Arrival, arrival
from scripts.check_sections import ALONE, Line, Problem, Quad, Step, beginning, phases, problem_of
from scripts.check_series import ENERGY, above, below, least, size

LIGHT = 64
"""Weight of w in a difference of two orbits of different energies."""

Sets: TypeAlias = Sequence[tuple[Quad, Arrival]]
"""Sets, and where their orbits cross next."""


def check_relation(source: Arrival, quad: Quad, begin: Sequence[Interval]) -> None:
    """C6: check that the image of a set lies across another one; Fails where it is not shown."""
    # So near to its polynomials the target has one point only with given d and gamma3 (C1).
    if any(size(a - b) > ALONE for a, b in zip(source.box, begin, strict=True)):
        raise Fails("C6: the crossings are on another sheet of the section")
    U, V = quad.coordinates(source.d, source.g, source.w)
    one, other = (U.at(1, side).ball() for side in (-1, 1))
    if not any(above(a) < -1 and below(b) > 1 for a, b in ((one, other), (other, one))):
        raise Fails("C6: an edge does not lie beyond the end of the set")
    if V.most >= 1:
        raise Fails("C6: the image is not between the sides of the set")


def check_apart(one: Quad, other: Quad) -> None:
    """Check that two sets of the same symbol have no point in common (Theorem 10)."""
    d, g = one.place()
    U, _ = other.coordinates(d, g, ENERGY)
    if least(U.ball()) <= 1:
        raise Fails("it has the symbol of another set, and is not shown to be apart from it")


def prove_link(p: Problem, link: tuple[Any, list[Step]], after: tuple[Any, list[Step]]) -> int:
    """Check that a set, or a line, covers the next one, if there is one: its passage's symbol.

    Raises Fails with what is not shown.
    """
    (source, steps), (target, following) = link, after
    if not steps:
        raise Fails("C2: a set has no steps")
    # A chain claims existence only: C7 and its derivatives are not needed.
    p = p._replace(along=())
    found = arrival(p, source, steps)
    if target is not None:
        if target.rising != crosses_upward(source) or not following:
            raise Fails("C6: the next set is not one of the section that is crossed")
        begin, _ = beginning(p, target, following[0])
        check_relation(found, target, begin)
    return found.symbol


def crosses_upward(source: Quad | Line) -> bool:
    """True if the next crossings of a set, or of a line, are upward."""
    return isinstance(source, Line) or not source.rising


def check_cone(source: Arrival, quad: Quad) -> None:
    """C7: check that differences of orbits grow along u or shrink along v; Fails if not shown."""
    (U_u, V_u), (U_v, V_v), (U_w, V_w) = (
        quad.directions(source.g, source.w, *slopes) for slopes in source.slopes
    )
    turned = U_v.most + U_w.most / LIGHT + LIGHT * source.slopes[0][2].most
    if least(U_u.ball()) - turned <= 1 or V_u.most + V_v.most + V_w.most / LIGHT >= 1:
        raise Fails("C7: the passage is not shown to stretch along u and to shrink along v")


class Proven(NamedTuple):
    """Proven facts of a full shift and its line of starts."""

    times: list[Interval]
    """Times of the passages from each set, t'."""
    word: str
    """Symbols of the approach from the line to the sets."""
    theta2: Interval
    """The phases of the line, radians."""
    doubts: list[str]
    """Reasons for which Theorems 3, 4 and 8 are undecided; empty texts where they are proven."""


def prove(
    problem: dict[str, Any],
    quads: Sequence[Quad],
    line: Line,
    orbits: Sequence[list[Step]],
    approach: Sequence[Quad] = (),
) -> Proven:
    """Check all that a full shift and its line of starts need.

    `orbits` are the steps of the sets, then those of the line, then those of the approach. Raises
    Fails with what is not shown.
    """
    n = len(quads)
    if (
        not all(quad.a and quad.b and quad.l1 for quad in (*quads, *approach))
        or not all(orbits)
        or len(orbits) != n + 1 + len(approach)
    ):
        raise Fails("a set has no extent, or no steps")
    p = problem_of(problem)
    found = [_named(k, arrival, p, *of) for k, of in enumerate(zip(quads, orbits, strict=False))]
    sets = list(zip(quads, found, strict=True))
    check_symbols(sets)
    for k, each in enumerate(sets):
        check_image(k, *each, sets)
    links = list(zip((line, *approach), orbits[n:], strict=True))
    start, word = prove_starts(p, links, sets)
    return Proven(
        [x.time for x in found],
        word,
        phases(p, line, orbits[n][0]),
        further(p, (line, orbits[n][0], None if approach else start), sets),
    )


def check_symbols(sets: Sets) -> None:
    """Check that each section has sets of both symbols, and that sets have no point in common."""
    letters = [(quad.rising, image.symbol) for quad, image in sets]
    if set(letters) != {(up, symbol) for up in (False, True) for symbol in (0, 1)}:
        raise Fails("a section has no sets of both symbols")
    for k, (quad, _) in enumerate(sets):
        for j in range(k):
            # A point has one symbol: sets of different symbols have no point in common.
            if letters[j] == letters[k]:
                _named(k, check_apart, sets[j][0], quad)


def targets(source: Quad | Line, sets: Sets) -> Sets:
    """The sets of the section that the orbits of a set, or of a line, cross next."""
    return [each for each in sets if each[0].rising == crosses_upward(source)]


def check_image(name: int | str, source: Quad | Line, image: Arrival, sets: Sets) -> None:
    """C6: check that an image lies across all sets of its section."""
    for quad, other in targets(source, sets):
        _named(name, check_relation, image, quad, other.begin)


def prove_starts(p: Problem, links: Sequence[Any], sets: Sets) -> tuple[Arrival, str]:
    """Check that a line and the sets of its approach lead across all sets.

    `links` are the line and these sets with their steps. Returns the last image, and the symbols.
    """
    names = ["line", *(f"{k} of the approach" for k in range(1, len(links)))]
    pairs = zip(names, links, links[1:], strict=False)
    symbols = [_named(name, prove_link, p, *pair) for name, *pair in pairs]
    start = _named(names[-1], arrival, p, *links[-1])
    check_image(names[-1], links[-1][0], start, sets)
    # The line itself has no symbol.
    return start, "".join(map(str, [*symbols, start.symbol][1:]))


def further(p: Problem, line: tuple[Line, Step, Arrival | None], sets: Sets) -> list[str]:
    """Reasons for which Theorems 3, 4 and 8 are undecided, as in `Proven`.

    `line` is the line, its first step and its own image. Behind an approach there is none: C9 is
    about the strip's own, and nothing is claimed of how many starts have a code (C7).
    """
    quads, found = zip(*sets, strict=True)
    strip, _, start = line
    sources: list[Any] = [*enumerate(sets), *([("line", (strip, start))] if start else [])]

    def check_cones() -> None:
        for name, (source, image) in sources:
            for quad, _ in targets(source, sets):
                _named(name, check_cone, image, quad)

    C7 = _doubt(check_cones)
    C8 = _doubt(lambda: check_middle(p, farthest(quads, found)))
    C9 = _doubt(lambda: check_transversal(p, line, quads, found))
    # Theorem 8 needs C7 and C8 as well.
    return [C7, C8, C7 or C8 or C9]


def _doubt(check: Callable[[], Any]) -> str:
    """The reason for which something is undecided; empty where it is proven."""
    try:
        check()
    except Fails as doubt:
        return str(doubt)
    return ""


def _named(k: int | str, check: Callable[..., Any], *arguments: Any) -> Any:
    """The result of a check, or Fails with the name of the set."""
    try:
        return check(*arguments)
    except Fails as doubt:
        raise Fails(f"set {k}: {doubt}") from None
