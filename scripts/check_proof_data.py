"""Sets and steps as files hold them, for the checkers of docs/full-shift.md."""

from collections.abc import Iterable, Iterator
from fractions import Fraction
from typing import Any

from scripts.check_certificate import Refused
from scripts.check_sections import Quad, Step
from scripts.check_series import Series

CLOCK = 50
"""Binary digits behind the point of a half-length of a step."""
MOST = {"sets": 32, "steps": 4000, "work": 10**10, "degree": 100, "bits": 124, "curve": 20}
"""Largest sizes of a proof; work is that of multiplying term by term, minutes."""
QUAD = ("rising", "a", "b", "l0", "l1", "p")
LINE = ("e1", "e2", "centre", "half")
PROOF = {"family": 1, "bits": 1, "terms": 1, "powers": 2, "coefficients": 2}
"""Names of arrays of sets, of a line of starts, and of steps, the last with their dimensions."""
ENERGIES = ("shift", "spread", "moves", "line")
"""Names of arrays where there are several energies: the config's and shift + spread w."""


def whole(group: Any, dimensions: dict[str, int]) -> dict[str, Any]:
    """Arrays of integers as a file holds them; raises Refused for any others."""
    for name, n in dimensions.items():
        if group[name].ndim != n or group[name].dtype.kind not in "iu":
            raise Refused(f"{name} has another shape or kind")
    return {name: group[name][()] for name in dimensions}


def doubles(group: Any, names: Iterable[str]) -> dict[str, Any]:
    """Arrays of doubles as a file holds them, and `rising`; raises Refused for any others."""
    for name in names:
        if group[name].dtype.kind != ("b" if name == "rising" else "f"):
            raise Refused(f"{name} holds no numbers of its kind")
    return {name: group[name][()] for name in names}


def quads_of(sets: dict[str, Any], moves: Any) -> Iterator[Quad]:
    """The sets of a file, whose numbers are doubles, taken exactly."""
    if not 0 < sets["p"].shape[1] <= MOST["curve"]:
        raise Refused(f"a curve has no coefficients, or more than {MOST['curve']}")
    rows = (sets[name] for name in QUAD)
    for (up, *numbers, p), curves in zip(zip(*rows, strict=True), moves, strict=True):
        a, b, l0, l1 = (Fraction(float(x)) for x in numbers)
        of = [[Fraction(float(x)) for x in curve] for curve in (p, *curves)]
        yield Quad(bool(up), a, b, l0, l1, of[0], of[1:])


def steps_of_sets(proof: dict[str, Any], n: int) -> list[list[Step]]:
    """The steps of each of n sets or lines of a file; their sizes are checked before."""
    if n > MOST["sets"]:
        raise Refused(f"there are more than {MOST['sets']} sets")
    counts, bits = [int(x) for x in proof["terms"]], [int(x) for x in proof["bits"]]
    powers = [tuple(int(x) for x in row) for row in proof["powers"]]
    values = [[int(x) for x in row] for row in proof["coefficients"]]
    orbits: list[list[Step]] = [[] for _ in range(n)]
    of = [int(x) for x in proof["family"]]
    if not len(counts) == len(bits) == len(of) <= MOST["steps"] or min(counts) < 1:
        raise Refused("steps are not as many as they say")
    if sum(counts) != len(powers) or len(powers) != len(values):
        raise Refused("terms are not as many as they say")
    if not all(1 <= x <= MOST["bits"] for x in bits) or not set(of) <= set(range(2 * len(orbits))):
        raise Refused("a step has too many bits, or is of no set")
    if any(len(at) not in (3, 4) or not all(0 <= n <= MOST["degree"] for n in at) for at in powers):
        raise Refused("a term is of no degree, or of one too high")
    first, left = 0, MOST["work"]
    for k, count, fine in zip(of, counts, bits, strict=True):
        here = range(first, first + count)
        if len({powers[i] for i in here}) < count or any(len(values[i]) != 7 for i in here):
            raise Refused("a step has a term twice, or one that is not of seven numbers")
        # Stored coefficients of T_0 are twice what they stand for: with one digit more, all others
        # are doubled instead.
        columns = [
            {
                powers[i]: values[i][c] * (1 if powers[i][0] == 0 else 2)
                for i in here
                if values[i][c]
            }
            for c in range(7)
        ]
        states = [Series.made(terms, fine + 1) for terms in columns[:6]]
        left -= count * count * (1 + len(columns[6]))
        if left < 0:
            raise Refused("there are more terms than can be multiplied in minutes")
        if any(at[0] for at in columns[6]):
            raise Refused("the length of a step depends on time")
        first += count
        if k < len(orbits):
            orbits[k].append(Step(Series.made(columns[6], CLOCK + 1), states))
            continue
        # Digits that did not fit a word are added to the last step of their set.
        steps = orbits[k - len(orbits)]
        if not steps or columns[6]:
            raise Refused("what is added to a step is of no step, or has a length")
        coarse = steps.pop()
        both = [x + y for x, y in zip(coarse.states, states, strict=True)]
        steps.append(Step(coarse.half, both))
    return orbits
