"""Data of proofs, of one orbit and of covering relations: steps and sets, and these as arrays.

Nothing is computed or proven here; what a checker does not find proven ends in `Undecided`. Arrays
that are no such data raise ValueError when they are read. A set is one of `docs/full-shift.md`;
times are dimensionless.
"""

import itertools
import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from fractions import Fraction
from typing import Any, NamedTuple, TypeAlias

import numpy as np

ORBIT_CLOCK = 32
"""Binary digits behind the point of the half-length of a step of one orbit."""
ORBIT_BITS, ORBIT_TERMS, ORBIT_STEPS = 4096, 4096, 20_000
"""Limits on one orbit: bits of a unit, coefficients of a component, and steps."""


class Undecided(ArithmeticError):
    """Error: the polynomials do not prove what comes next; the text says why."""


class Step(NamedTuple):
    """A piece of an approximate orbit: six Chebyshev series over x in [-1, 1]."""

    half_length: int
    """Half of its length in the orbit's unit of time, in units of 2^-ORBIT_CLOCK."""
    bits: int
    series: Sequence[Sequence[int]]
    """Coefficients w of w_0/2 + sum_j w_j T_j of each component, in units of 2^-bits."""


Powers: TypeAlias = tuple[int, ...]
"""Exponents of a term: j of T_j(x), then those of u and v, and of w where the energy varies."""

CLOCK = 50
"""Binary digits behind the point of the half-length of a step of a family."""
WORD = 62
"""Bits of a coefficient as it is stored, without its sign: it fits a signed word of 64 bits."""
MOST_BITS, MOST_DEGREE, MOST_STEPS = 124, 100, 1000
"""Limits on a family: bits of a unit, degree in a variable, and steps."""
COMPONENTS = 7
"""Qp, Qm, M3, gamma1, gamma2, gamma3, and half of the step's length in time."""


class Quad(NamedTuple):
    """A set: the curved quadrilateral |U| <= 1, |V| <= 1 of the section M3 = 0.

    U = (d - c)/a and V = (d - c - l0 - l1 g)/b, where d is the small one of Qp and Qm, g is gamma3,
    and c = sum of w^m p_m(g), polynomials p_m. If there are several, the set moves with the energy.
    """

    rising: bool
    a: Fraction
    b: Fraction
    l0: Fraction
    l1: Fraction
    p: tuple[tuple[Fraction, ...], ...]
    """The coefficients of p_0, p_1 and so on, of each as many."""

    @property
    def side(self) -> int:
        """The sign of M3 between the set and the next crossing."""
        return 1 if self.rising else -1


class StartLine(NamedTuple):
    """A line of starts: Qm = 0 < Qp, M . gamma = 0 and a given J1, so theta1 = alpha0 + beta0.

    These are the starts of Fig. 4. On the line e1 gamma1 + e2 gamma2 = c + half u, |u| <= 1, with
    c = sum of centre_m w^m. The line is the middle of a strip Qm = wide v, |v| <= 1, on which Qp
    follows from J1 and M3 as it does on the line.
    """

    J1: Fraction
    e1: Fraction
    e2: Fraction
    centre: tuple[Fraction, ...]
    half: Fraction
    wide: Fraction = Fraction(0)

    @property
    def side(self) -> int:
        """The sign of M3 up to the next crossing; the starts have it too."""
        return -1


Source: TypeAlias = Quad | StartLine
"""Points of which the orbits are followed up to their next crossing."""


class FamilyStep(NamedTuple):
    """A step of a family of approximate orbits: polynomials in x, u and v, and in w if it varies.

    A coefficient of T_0 is twice what it stands for, also in `half_length`, which has no other T_j.
    """

    bits: int
    half_length: Mapping[Powers, int]
    """Half of the step's length in time, a polynomial in u, v and w, in units of 2^-CLOCK."""
    terms: Sequence[Mapping[Powers, int]]
    """Polynomials of Qp, Qm, M3, gamma1, gamma2, gamma3 over x in [-1, 1], in units of 2^-bits."""


Followed: TypeAlias = tuple[Source, Sequence[FamilyStep]]
"""A source with polynomials of its orbits."""


def packed_quads(quads: Sequence[Quad]) -> dict[str, Any]:
    """Sets as arrays; their numbers are doubles, which stand for themselves exactly."""
    return {
        "rising": np.array([q.rising for q in quads]),
        "p": np.array([q.p[0] for q in quads], dtype=float),
        **{name: np.array([float(getattr(q, name)) for q in quads]) for name in OF_SET},
    }


OF_SET = ("a", "b", "l0", "l1")


def packed_line(line: StartLine) -> dict[str, float]:
    """The numbers of a line of starts, or of a strip, but for its J1."""
    names, numbers = ("e1", "e2", "centre", "half", "wide"), (*line[1:3], line.centre[0], *line[4:])
    return dict(zip(names, map(float, numbers), strict=True))


def packed_energies(
    shift: Fraction, spread: Fraction, quads: Sequence[Quad], line: StartLine
) -> dict[str, Any]:
    """Arrays of the energies and of how sets and a line of starts move with them, doubles."""
    return {
        "shift": float(shift),
        "spread": float(spread),
        "moves": np.array([q.p[1:] for q in quads], dtype=float),
        "line": np.array(line.centre[1:], dtype=float),
    }


def unpacked_energies(data: Mapping[str, Any] | None) -> tuple[Fraction, Fraction]:
    """The shift of the energies from that of a config, and their spread; both 0 without data."""
    if data is None:
        return Fraction(0), Fraction(0)
    if not data["spread"] > 0:
        raise ValueError("the energies are no interval")
    return exactly(data["shift"]), exactly(data["spread"])


def unpacked_quads(
    data: Mapping[str, Any], energies: Mapping[str, Any] | None = None
) -> list[Quad]:
    """The sets of some arrays, and how they move if there are several energies."""
    moves = [()] * len(data["p"]) if energies is None else energies["moves"].tolist()
    rows = zip(*(data[name] for name in ("rising", *OF_SET, "p")), moves, strict=True)
    found = [quad_from(bool(up), numbers, [p, *by]) for up, *numbers, p, by in rows]
    if not all(quad.p[0] and quad.a and quad.b and quad.l1 for quad in found):
        raise ValueError("a set has no extent")
    return found


def unpacked_line(
    J1: Fraction, data: Mapping[str, Any], energies: Mapping[str, Any] | None = None
) -> StartLine:
    """The line of starts, or the strip, of some stored numbers."""
    e1, e2, centre, half = (exactly(data[name]) for name in ("e1", "e2", "centre", "half"))
    moves = map(exactly, [] if energies is None else energies["line"])
    return StartLine(J1, e1, e2, (centre, *moves), half, exactly(data.get("wide", 0)))


def quad_from(rising: bool, numbers: Sequence[float], p: Iterable[Iterable[float]]) -> Quad:
    """The set that has these doubles as its a, b, l0, l1 and as coefficients of each p_m."""
    a, b, l0, l1 = map(exactly, numbers)
    return Quad(rising, a, b, l0, l1, tuple(tuple(map(exactly, each)) for each in p))


def exactly(x: Any) -> Fraction:
    """The rational number that a double is; ValueError for NaN and infinity."""
    if not math.isfinite(x):
        raise ValueError("a set, a line of starts or an energy has a number that is not finite")
    return Fraction(float(x))


OF_STEPS, OF_TERMS = ("family", "bits", "terms"), ("powers", "coefficients")
"""Names of the arrays with a row for each step, and of those with a row for each term."""


def packed(orbits: Sequence[Sequence[FamilyStep]]) -> dict[str, Any]:
    """The steps of each of n sets as arrays.

    Where coefficients of set k do not fit a word, their low digits follow as a step of set n + k.
    """
    n = len(orbits)
    every = [
        (k + n * finer, part)
        for k, pieces in enumerate(orbits)
        for piece in pieces
        for finer, part in enumerate(_words(piece))
    ]
    powers = (at for _, piece in every for terms in piece.terms for at in terms)
    wide = max(map(len, powers), default=len(("x", "u", "v")))
    tables = [list(_rows(piece, wide)) for _, piece in every]
    rows = [row for table in tables for row in table]
    return {
        "family": np.array([k for k, _ in every], dtype=np.int64),
        "bits": np.array([piece.bits for _, piece in every], dtype=np.int64),
        "terms": np.array([len(table) for table in tables], dtype=np.int64),
        "powers": np.array([at for at, _ in rows], dtype=np.uint8).reshape(-1, wide),
        "coefficients": np.array([row for _, row in rows], dtype=np.int64).reshape(-1, COMPONENTS),
    }


def of_some(data: Mapping[str, Any], n: int, which: range) -> dict[str, Any]:
    """The arrays of the steps of some of n sets, in which the first of these has the number 0.

    :func:`unpacked` reads them. ValueError where steps and terms do not fit each other.
    """
    family, terms = (np.asarray(data[name], dtype=np.int64) for name in ("family", "terms"))
    # Before they are repeated: numbers of terms may be anybody's, and ask for any memory.
    if np.any(terms < 1) or sum(map(int, terms)) != len(data["powers"]):
        raise ValueError("the steps have other terms than are stored")
    low, k = np.divmod(family, n)
    here = np.isin(k, which)
    found = {name: data[name][here] for name in OF_STEPS}
    found |= {name: data[name][np.repeat(here, terms)] for name in OF_TERMS}
    # Low digits of set k have the number n + k, and here len(which) + k - which.start.
    return found | {"family": (k - which.start + len(which) * low)[here]}


def joined(parts: Sequence[Mapping[str, Any]], sizes: Sequence[int]) -> dict[str, Any]:
    """The arrays of the steps of all sets, from those of parts with `sizes` sets each, in order."""
    names = (*OF_STEPS, *OF_TERMS)
    found = {name: np.concatenate([part[name] for part in parts]) for name in names}
    n, firsts = sum(sizes), itertools.accumulate(sizes, initial=0)
    families = []
    for part, size, first in zip(parts, sizes, firsts, strict=False):
        low, k = np.divmod(part["family"], size)
        families.append(k + first + n * low)
    return found | {"family": np.concatenate(families)}


def _words(piece: FamilyStep) -> list[FamilyStep]:
    """The step, or, if its numbers are too large to store, its high digits and its low ones."""
    largest = max((abs(w) for column in piece.terms for w in column.values()), default=0)
    if (finer := largest.bit_length() - WORD) <= 0:
        return [piece]
    # A shift rounds down, so no low digits are negative, and both parts add up exactly.
    first = [{at: w >> finer for at, w in column.items()} for column in piece.terms]
    rest = [{at: w & ((1 << finer) - 1) for at, w in column.items()} for column in piece.terms]
    # The half-length belongs to the high digits alone.
    high = FamilyStep(piece.bits - finer, piece.half_length, first)
    return [high, FamilyStep(piece.bits, {}, rest)]


def _added(first: FamilyStep, rest: FamilyStep) -> FamilyStep:
    """The sum of a step's high digits and its low ones, which are in finer units."""
    finer = rest.bits - first.bits
    if finer < 0 or rest.half_length:
        raise ValueError("what is added to a step is not finer, or has a length")
    terms = []
    for column, more in zip(first.terms, rest.terms, strict=True):
        both = {at: w << finer for at, w in column.items()}
        terms.append(both | {at: both.get(at, 0) + w for at, w in more.items()})
    return FamilyStep(rest.bits, first.half_length, terms)


def _rows(piece: FamilyStep, wide: int) -> Iterator[tuple[Powers, list[int]]]:
    """Rows of a step: `wide` powers, where missing ones are 0, and the seven coefficients."""
    columns = [
        {(*at, 0)[:wide]: c for at, c in x.items()} for x in (*piece.terms, piece.half_length)
    ]
    for at in sorted({at for column in columns for at in column}):
        yield at, [column.get(at, 0) for column in columns]


def unpacked(data: Mapping[str, Any], n: int) -> list[list[FamilyStep]]:
    """The steps of each of n sets, from arrays that may be anybody's.

    ValueError where they do not fit each other or exceed a limit.
    """
    # Integers of Python, for those of NumPy overflow silently.
    counts = list(map(int, data["terms"]))
    ends = list(itertools.accumulate(counts))
    if not ends or ends[-1] != len(data["powers"]) or np.min(data["terms"]) < 1:
        raise ValueError("the steps have other terms than are stored")
    if np.min(data["bits"]) < 1 or np.max(data["bits"]) > MOST_BITS:
        raise ValueError(f"a step has fewer bits than 1 or more than {MOST_BITS}")
    if np.min(data["powers"]) < 0 or np.max(data["powers"]) > MOST_DEGREE:
        raise ValueError(f"a term has a degree of less than 0 or more than {MOST_DEGREE}")
    found: list[list[FamilyStep]] = [[] for _ in range(n)]
    for of, bits, end, terms in zip(data["family"], data["bits"], ends, counts, strict=True):
        if not 0 <= of < 2 * n or len(found[of % n]) == MOST_STEPS:
            raise ValueError(f"a step is of no set, or a set has more than {MOST_STEPS} steps")
        step = _step(int(bits), *(data[name][end - terms : end] for name in OF_TERMS))
        if of < n:
            found[of].append(step)
        elif found[of - n]:
            # They belong to the last step of that set, which they replace by the sum.
            found[of - n].append(_added(found[of - n].pop(), step))
        else:
            raise ValueError("what is added to a step is of no step")
    return found


def _step(bits: int, powers: Any, coefficients: Any) -> FamilyStep:
    """The step of some rows of powers and coefficients."""
    places = list(map(tuple, powers.tolist()))
    # Of two equal terms a dictionary would keep the last one alone.
    if len(set(places)) < len(places):
        raise ValueError("a step has a term twice")
    *columns, half = (
        {at: x for at, x in zip(places, column, strict=True) if x}
        for column in coefficients.T.tolist()
    )
    if any(at[0] for at in half):
        raise ValueError("the length of a step depends on time")
    return FamilyStep(bits, half, columns)
