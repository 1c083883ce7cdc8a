"""Check the symbols proven on intervals of starts once more, without a line of the package.

    .venv/bin/python -m scripts.check_intervals FILE [--config FIG4_INTERVALS.yaml] [-j PROCESSES]

It follows Theorem 9 of docs/full-shift.md in Python's integers and fractions, with the series of
scripts/check_series.py: H1 to H5 of docs/certified.md for families of orbits. The shares of
the line are counted anew from the intervals.
"""

import json
import sys
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from fractions import Fraction
from itertools import groupby, pairwise
from pathlib import Path
from typing import Any

from scripts.check_certificate import (
    NONE,
    Fails,
    Interval,
    Refused,
    answered,
    bounded,
    check_against,
    number,
    pi,
    shape_of,
    sqrt,
    start_of,
    stated_by,
    symbol,
)
from scripts.check_orbit import each
from scripts.check_passages import tube
from scripts.check_proof_data import PROOF, steps_of_sets, whole
from scripts.check_sections import Problem, Step, problem_of
from scripts.check_series import DIGITS, Series, around

INTERVALS, SYMBOLS, DEPTH = 20_000, 8, 64
"""Intervals, symbols and halvings at most."""
TERMS = 80
"""Terms of cosine and sine: of an angle of 4 the next one is 2^-234."""
WIDEST = Fraction(1, 64)
"""Radius of a tube at most."""
GIVEN = ("A", "r", "mu", "h0", "J1_0", "n_symbols")
"""What a config says of the line and of the symbols wanted."""


def turned(angle: Interval) -> list[Series]:
    """Cosine and sine of angle u, for |u| <= 1 and an angle of less than 4."""
    found, term = [Series.of(0), Series.of(0)], Interval.of(1)
    for k in range(TERMS):
        power = Series.made({(0, k, 0): 1}, 0)
        found[k % 2] = found[k % 2] + power * (term if k % 4 < 2 else -term)
        term = term * angle * Fraction(1, k + 1)
    # What is left of either series is less than twice the first term left out.
    return [each.wider(2 * term.size.above) for each in found]


def starts(p: Problem, given: dict[str, Any], place: int, depth: int) -> list[Series]:
    """The starts with theta2_0/2 pi from place/2^depth on, 1/2^depth long."""
    assert p.h0 is not None
    body, J1 = shape_of(given), Interval.of(number(given["J1_0"]))
    middle, wide = (pi() * Fraction(n, 1 << depth) for n in (2 * place + 1, 1))
    found = start_of(body, J1, sqrt(2 * p.h0 / body.kappa), middle, *turned(wide))
    return list(map(Series.of, found))


def signs(p: Problem, step: Step, bound: Fraction) -> Iterator[int]:
    """H4, H5: of each part the sign of M3, -1 or 1, or else the separatrix beside it, 2 to 5."""
    apart = p.apart(bound)
    parts = [state.on_parts() for state in step.states]
    for k, M3 in enumerate(parts[2]):
        sides = [side for side in (-1, 1) if (side * M3 - apart[2]).low > 0]
        if sides:
            yield sides[0]
            continue
        box = [around(x[k], e) for x, e in zip(parts, apart, strict=True)]
        rate = p.field(box)[2]
        if rate.low <= 0 <= rate.high:
            raise Fails("H5: neither the sign of M3 nor that of its rate is told on a part")
        rising = rate.low > 0
        Q = box[0 if rising else 1]
        if Q.low <= 0 <= Q.high:
            raise Fails("H5: Q is too near zero at a crossing to tell its separatrix")
        # 5 stands for 1, for that is a sign of M3.
        yield (2 if Q.low > 0 else 4) if rising else (3 if Q.low > 0 else 5)


def prove(given: dict[str, Any], place: int, depth: int, steps: Sequence[Step]) -> list[int]:
    """The symbols of all orbits that start on an interval; raises Fails with what is not shown."""
    p = problem_of(given)
    before, bound, told = starts(p, given, place, depth), Fraction(0), list[int]()
    for step in steps:
        if step.half.ball().low <= 0:
            raise Fails("H2: the length of a step is not shown to be positive")
        pairs = zip(step.states, before, strict=True)
        gap = p.norm(*((a.at(0, -1) - b).most for a, b in pairs))
        rates = zip(step.states, p.field(step.states), strict=True)
        leap = p.norm(*((y.slope() - step.half * f).most for y, f in rates))
        # Growth halfway between both orbits counts.
        bound, _ = tube(p, step, bound + gap + 2 * leap, Fraction(1, 2), "H3", WIDEST)
        told += signs(p, step, bound)
        before = [state.at(0, 1) for state in step.states]
    runs = [x for x, _ in groupby(told)]
    wanted = ((-1,), (2, 4), (1,), (3, 5))
    if len(runs) % 2 == 0 or any(x not in wanted[k % 4] for k, x in enumerate(runs)):
        raise Fails("H4: M3 is not shown to change its sign at crossings alone")
    return [symbol(a, b) for a, b in pairwise(runs[1::2])]


def checked(part: tuple[dict[str, Any], int, int, list[int], dict[str, Any]]) -> str:
    """Why an interval's symbols are not proven; empty where they are."""
    Interval.digits = DIGITS
    given, place, depth, claimed, proof = part
    try:
        found = prove(given, place, depth, steps_of_sets(proof, 1)[0])
    except Fails as error:
        return str(error)
    return "" if found[: len(claimed)] == claimed else f"the symbols are {found}"


# ---- The file.


def read(path: Path) -> tuple[dict[str, Any], dict[str, Any], list[float], dict[str, Any]]:
    """The config of a result, its intervals, its shares and the arrays of its steps."""
    import h5py

    try:
        with h5py.File(path) as file:
            bounded(file, path.stat().st_size)
            config = json.loads(file["config"].asstr()[()])
            proof = whole(file["data/proof"], PROOF)
            found = whole(file["data/intervals"], {"place": 1, "depth": 1, "codes": 2})
            intervals = {k: x.tolist() for k, x in found.items()}
            shares = [float(x) for x in file["data/shares"][()]]
        return config, intervals, shares, proof
    except (OSError, KeyError, ValueError, TypeError, AttributeError, IndexError, OverflowError,
            RuntimeError) as error:  # fmt: skip
        raise Refused(f"it cannot be read: {str(error)[:200]}") from None


def claims(codes: list[list[int]], n: int) -> list[list[int]]:
    """The symbols that are claimed of each of n intervals, of which nothing may follow a gap."""
    found = []
    for column in zip(*codes, strict=True):
        told = [x for x in column if x != NONE]
        if list(column[: len(told)]) != told or set(told) - {0, 1}:
            raise Refused("a symbol is none, or follows one that is not proven")
        found.append(told)
    if len(found) != n:
        raise Refused("there are symbols of other intervals than are stored")
    return found


def check(path: Path, given: Path | None = None, processes: int = 1) -> Iterator[str]:
    """Say what a file proves, and of which numbers; raises Refused or Fails."""
    config, intervals, shares, proof = read(path)
    try:
        if given:
            wanted = stated_by(given)["problem"]
            stated = config["problem"]
            check_against({k: stated[k] for k in GIVEN}, {k: wanted[k] for k in GIVEN})
        problem = {k: config["problem"][k] for k in GIVEN}
        of = "A = {}; r = {}; mu = {}; h0 = {}; J1_0 = {}".format(
            *(", ".join(problem[key]) for key in ("A", "r")), *(problem[k] for k in GIVEN[2:5])
        )
    except (KeyError, TypeError, AttributeError) as error:
        raise Refused(f"its config, or the one given, lacks something: {error!r}") from None
    places, depths, symbols = intervals["place"], intervals["depth"], len(intervals["codes"])
    if not len(places) == len(depths) <= INTERVALS:
        raise Refused("intervals are not as many as they say, or too many")
    if str(problem["n_symbols"]) != str(symbols) or not 0 < symbols <= SYMBOLS:
        raise Refused("symbols are not as many as its config asks for, or too many")
    if any(not (0 <= n <= DEPTH and 0 <= k < 1 << n) for k, n in zip(places, depths, strict=True)):
        raise Refused("an interval is none of the line")
    told = claims(intervals["codes"], len(places))
    ends = [
        (Fraction(k, 1 << n), Fraction(k + 1, 1 << n)) for k, n in zip(places, depths, strict=True)
    ]
    if any(a[1] > b[0] for a, b in pairwise(ends)):
        raise Refused("two intervals overlap, or are out of order")
    lengths = [b - a for a, b in ends]
    found = [
        sum((x for x, y in zip(lengths, told, strict=True) if len(y) >= n), Fraction(0))
        for n in range(1, symbols + 1)
    ]
    if [float(x) for x in found] != shares:
        raise Refused("the shares of the line are not those of the intervals")
    steps = iter(each(proof, [k for k, symbols in enumerate(told) if symbols], len(places)))
    parts = [
        (problem, place, depth, symbols, next(steps))
        for place, depth, symbols in zip(places, depths, told, strict=True)
        if symbols
    ]
    # There are no others.
    next(steps, None)
    with ProcessPoolExecutor(processes) as pool:
        for part, doubt in zip(parts, pool.map(checked, parts), strict=True):
            if doubt:
                raise Fails(f"the interval {part[1]}/2^{part[2]}: {doubt}")
    every = "; ".join(f"{n} on {x}, {float(x):.6g}" for n, x in enumerate(found, 1))
    yield f"proven of {of}: the first symbols of all starts on a share of the line: {every}"


def main(arguments: Sequence[str] | None = None) -> int:
    """Check a result; the exit code is 0 where all that it claims is proven."""
    return answered(arguments, __doc__, check)


if __name__ == "__main__":
    sys.exit(main())
