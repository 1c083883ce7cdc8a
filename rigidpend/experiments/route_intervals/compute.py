"""Experiment `route_intervals`: symbols proven for whole intervals of starts, not for points."""

from collections.abc import Sequence
from dataclasses import replace
from fractions import Fraction
from functools import partial
from itertools import compress, pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rigidpend.experiments.contract import Means
from rigidpend.experiments.data import Data, Tree
from rigidpend.experiments.route_intervals import COLUMNS, INTERVALS
from rigidpend.experiments.route_intervals.schema import Config, Problem
from rigidpend.experiments.shared import rational
from rigidpend.machine import progress
from rigidpend.machine.wording import counted
from rigidpend.machine.workers import cores, side_by_side
from rigidpend.numbers.exact import Exact, context
from rigidpend.numbers.texts import NO_SYMBOL
from rigidpend.orbits.integrate.arithmetic import resolve
from rigidpend.routes.certified import intervals as lines
from rigidpend.routes.certified import proof_data
from rigidpend.routes.certified.balls import alone
from rigidpend.routes.certified.intervals import EnclosedStarts, PhaseInterval
from rigidpend.routes.certified.proof_data import FamilyStep, Undecided
from rigidpend.routes.phases import DOUBLED, angle

FIRST = 5
"""Halvings with which the search begins."""
ROUND = 2
"""Intervals for each process in a part, which is then stored."""
EACH = 0.15
"""Seconds of a core that an interval takes whatever its symbols, most of them of its process."""
COLUMN_SYMBOLS = 15
"""Symbols of a column: as many as Fig. 4 has rows."""


@alone
def compute(config: Config, means: Means) -> Tree:
    """Prove symbols of intervals, and halve those where not all symbols are proven."""
    from rigidpend.routes.certified import interval_search

    interval_search.check_provable(config.problem.routes)
    first = min(FIRST, config.problem.halvings)
    every = [PhaseInterval(k, first) for k in range(1 << first)]
    at_once, trees = ROUND * means.jobs, list[Tree]()
    for k in range(0, len(every), at_once):
        means.report(progress.PartDone(f"{k} of {len(every)} parts", k, len(every)))
        work = partial(_part, every[k : k + at_once], config, means.jobs)
        trees.append(means.part(f"intervals.{k:08d}.{at_once}", work))
    return _joined(config, trees, means)


def _joined(config: Config, trees: Sequence[Tree], means: Means) -> Tree:
    intervals = {
        name: np.concatenate([tree["intervals"][name] for tree in trees], axis=-1)
        for name in INTERVALS
    }
    sizes = [len(tree["intervals"]["place"]) for tree in trees]
    proof = proof_data.joined([tree["proof"] for tree in trees], sizes)
    if not len(proof["family"]):
        raise ArithmeticError("undecided: no symbol is proven on any interval")
    shares = shares_of(unpacked(intervals), intervals["codes"])
    columns = _columns(config.problem, means.jobs)
    # Nothing is stored then: either a proof or an integration must be wrong.
    if contradicted := contradictions(intervals, config.problem.columns.phases, columns):
        raise ArithmeticError(f"proven symbols contradict those of theta2_0 = {contradicted}")
    told = ", ".join(f"{float(share):.4g}" for share in shares)
    means.report(f"{intervals['place'].size} intervals; shares of the line: {told}")
    return {
        "intervals": intervals,
        "shares": np.array([float(x) for x in shares]),
        "columns": columns,
        "proof": proof,
    }


def _columns(problem: Problem, jobs: int) -> Data:
    """Symbols of single starts, by integration; no proof depends on them."""
    from rigidpend.routes.codes import codes_of

    asked = replace(problem.routes, n_symbols=COLUMN_SYMBOLS)
    found = codes_of(asked, problem.columns.phases, resolve(), jobs)
    return {name: getattr(found, name) for name in COLUMNS}


def contradictions(intervals: Data, phases: Sequence[Exact], columns: Data) -> list[float]:
    """Phases theta2_0 of columns with certain symbols that contradict those of their interval."""
    # In more bits than doubles, in which a large phase loses its place within the turn.
    m = context(DOUBLED)
    of_turn = 1 / (2 * m.pi)
    turns = [m.frac(angle(x, DOUBLED) * of_turn) for x in phases]
    count = len(intervals["codes"])
    codes, certain = columns["codes"][:count], columns["certain"][:count]
    found = np.zeros(len(phases), dtype=bool)
    for place, depth, proven in zip(
        intervals["place"], intervals["depth"], intervals["codes"].T, strict=True
    ):
        inside = np.array([int(m.ldexp(x, int(depth))) == place for x in turns])
        told = (proven[: len(codes), None] != NO_SYMBOL) & certain
        found |= inside & (told & (codes != proven[: len(codes), None])).any(axis=0)
    return [float(x) for x in columns["theta2_0"][found]]


def _part(every: Sequence[PhaseInterval], config: Config, jobs: int) -> Tree:
    """Search some intervals, each by a process."""
    from rigidpend.routes.certified import interval_search
    from rigidpend.routes.certified.horseshoe import ShiftProblem

    problem = config.problem
    setting = ShiftProblem(problem.body, problem.h0, 1, h0=problem.h0)
    of = setting, rational(problem.J1_0), problem.n_symbols, problem.halvings
    parts = side_by_side(interval_search.proven_intervals, of, True, every, jobs)
    found = [x for some in parts for x in some]
    codes = np.full((problem.n_symbols, len(found)), NO_SYMBOL, dtype=np.uint8)
    for column, each in enumerate(found):
        codes[: len(each.symbols), column] = each.symbols
    intervals = {
        "place": np.array([each.interval.place for each in found]),
        "depth": np.array([each.interval.depth for each in found]),
        "codes": codes,
    }
    return {"intervals": intervals, "proof": proof_data.packed([each.pieces for each in found])}


def unpacked(intervals: Data) -> list[PhaseInterval]:
    """Intervals from their arrays; ValueError unless they ascend and no two overlap."""
    rows = zip(intervals["place"], intervals["depth"], strict=True)
    found = [PhaseInterval(int(place), int(depth)) for place, depth in rows]
    if not all(0 <= x.depth <= 64 and 0 <= x.place < 1 << x.depth for x in found):
        raise ValueError("an interval is not on the line")
    if any(a.ends[1] > b.ends[0] for a, b in pairwise(found)):
        raise ValueError("two intervals overlap, or are out of order")
    return found


def shares_of(intervals: Sequence[PhaseInterval], codes: NDArray[Any]) -> list[Fraction]:
    """Shares of the line on which at least one symbol is proven, at least two, and so on."""
    shares = [each.share for each in intervals]
    return [sum(compress(shares, row != NO_SYMBOL), Fraction(0)) for row in codes]


def theorems(config: Config, data: Data) -> list[str]:
    """Sentences that the proof in a result proves, checked again without integration."""
    parts, shares = arranged(config.problem, data)
    side_by_side(_again, (config.problem,), True, parts, cores())
    return [
        f"{counted(n, 'symbol')}, the same on each interval, of all starts on {share} of the"
        f" line, {float(share):.6g}"
        for n, share in enumerate(shares, 1)
        if share
    ]


def arranged(problem: Problem, data: Data) -> tuple[list[Any], list[Fraction]]:
    """Intervals with their steps and the symbols to be proven, and their shares of the line.

    ValueError if stored numbers contradict each other.
    """
    codes = data["intervals"]["codes"]
    every = unpacked(data["intervals"])
    if codes.shape != (problem.n_symbols, len(every)):
        raise ValueError(f"its config asks for {problem.n_symbols} symbols of each interval")
    if not set(codes.ravel().tolist()) <= {0, 1, NO_SYMBOL} or np.any(
        (codes[:-1] == NO_SYMBOL) & (codes[1:] != NO_SYMBOL)
    ):
        raise ValueError("a symbol is not 0 or 1, or follows one that is not proven")
    orbits = proof_data.unpacked(data["proof"], len(every))
    shares = shares_of(every, codes)
    # Both are exact fractions rounded to doubles, so that they must be equal.
    if [float(x) for x in shares] != data["shares"].tolist():
        raise ValueError("the shares of the line differ")
    parts = zip(every, orbits, codes.T.tolist(), strict=True)
    return [part for part in parts if part[2][0] != NO_SYMBOL], shares


def _again(
    part: tuple[PhaseInterval, Sequence[FamilyStep], Sequence[int]], problem: Problem
) -> None:
    """Check the stored symbols of one interval."""
    of, steps, stored = part
    proven = [x for x in stored if x != NO_SYMBOL]
    name = f"the interval {of.place}/2^{of.depth}"
    try:
        found = lines.symbols(
            EnclosedStarts.of(problem.body, problem.h0, rational(problem.J1_0)), of, steps
        )
    except Undecided as doubt:
        raise Undecided(f"{name}: {doubt}") from None
    if list(map(int, found[: len(proven)])) != stored[: len(proven)]:
        raise Undecided(f"{name}: its symbols differ, or fewer are proven")


def cost(config: Config) -> float:
    """Estimate of the seconds that a config takes on two cores."""
    from rigidpend.routes.certified.interval_search import expected_seconds

    problem = config.problem
    asked = replace(problem.routes, n_symbols=problem.n_symbols)
    intervals = 1 << min(problem.halvings, max(FIRST, 2 * problem.n_symbols + 1))
    return (expected_seconds(asked) + EACH) * intervals / 2
