"""Maps or integration: which of them decides the orbits of a call, and what maps leave open."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rigidpend.numbers import checked
from rigidpend.numbers.exact import PRECISIONS
from rigidpend.orbits.integrate import Crossings, Outcome
from rigidpend.orbits.records import put
from rigidpend.routes import certainty, costs
from rigidpend.routes.certainty import Columns, Compute, Decided
from rigidpend.routes.cycle import symbols
from rigidpend.routes.problem import ProblemError, RouteProblem
from rigidpend.routes.run import Run, in_pieces
from rigidpend.routes.start import Scales

if TYPE_CHECKING:
    from rigidpend.routes.mapped import Maps

METHODS = ("auto", "map", "integration")
"""Ways in which codes are computed in double precision."""
PIECE = 2**19
"""Passages of a piece where maps serve, which bounds the memory."""
OFTEN = 0.1
"""Seconds of integration of a problem, in all calls, after which kept maps serve few orbits too.

To read them takes as long. Of each so many further ones a sample is integrated as well."""
SELDOM = 100_000
"""Orbits of a problem from one sample of many to the next, which takes 3 to 5 % of their time."""
PROBLEMS = 1_000
"""Problems whose orbits are counted; then the count begins anew."""
SAMPLE = 64
"""Number of orbits that are integrated as well in doubles, and compared, unless maps are kept."""
ABREAST = 4
"""Neighbours that are taken together into a sample."""
LEAST_SAMPLE = 8
"""Number of them in each part of the orbits, at least, and of those in one more precision."""


class Mapped(NamedTuple):
    """Orbits decided, and by which way."""

    decided: Decided
    by_map: NDArray[np.bool_]
    """(n,), False where an orbit was integrated, for some or all of its way."""


def expected_seconds(
    problem: RouteProblem, orbits: int, precisions: Sequence[int] = PRECISIONS
) -> float:
    """Seconds of a core that so many orbits of one body are expected to take.

    By maps that are not kept yet, tables included, where these are chosen; else by integration.
    """
    if costs.at_stake(problem, orbits, precisions):
        from rigidpend.routes.mapped import expected_tables

        tables = expected_tables(problem, orbits, costs.budget(problem, orbits, precisions))
        if tables < math.inf:
            return tables + orbits * costs.by_maps(problem, precisions)
    return orbits * costs.integration(problem, precisions)


def decided(run: Run, method: str = "auto", *, kept: bool = False) -> Mapped:
    """Decide all orbits of a run, by maps where these are expected to take less time.

    Parameters
    ----------
    run : Run
    method : {"auto", "map", "integration"}, optional
    kept : bool, optional
        Whether few orbits may take maps that are there from before, and many the sample of a call
        before this, if their problem is asked for often. What is stored does without: a result
        hangs on no cache.

    Raises
    ------
    ProblemError
        A method that is not known, or maps without doubles.
    MapError
        The method is "map" and the orbits have none.
    Contradiction
        Maps and integration call different symbols of an orbit certain.
    """
    checked.choice("method", method, METHODS, ProblemError)
    ladder = run.arithmetic.precisions
    if method == "map" and ladder[0] != 53:
        message = f"the maps are in double precision: precisions must begin with 53, got {ladder}"
        raise ProblemError("precisions", message)
    few = method == "auto" and not costs.at_stake(run.problem, run.orbits, ladder)
    likely, sampled = not few, True
    if kept and method == "auto" and ladder[0] == 53:
        likely, sampled = _counted(run, few)
    if run.orbits and (method == "map" or (method == "auto" and likely)):
        from rigidpend.orbits.return_map import MapError
        from rigidpend.routes.mapped import Maps

        try:
            maps = Maps(run, least_time=method == "auto" and not few, kept=few)
            return decided_by(maps, sampled=sampled)
        except certainty.Contradiction:
            # Asked once more, without a sample, wrong symbols would be called certain.
            _asked.pop(run.problem, None)
            raise
        except MapError as reason:
            # What was asked for by name is not replaced in silence.
            if method == "map":
                raise
            if not few:
                each, all_ = costs.integration(run.problem), run.orbits
                said = f"there are no return maps: {reason}"
                costs.warned(run.problem, all_, all_, each, said)
    return Mapped(run.decided(), np.zeros(len(run.phases), dtype=bool))


class _Asked(NamedTuple):
    """Orbits of a problem in all calls, and in those up to the last sample."""

    all_: int = 0
    sampled: float = -math.inf


_asked: dict[RouteProblem, _Asked] = {}


def _counted(run: Run, few: bool) -> tuple[bool, bool]:
    """True if orbits may take maps, after all before them; and if they need a sample."""
    if len(_asked) >= PROBLEMS:
        _asked.clear()
    before = _asked.get(run.problem, _Asked())
    now, often = before.all_ + run.orbits, OFTEN / costs.integration(run.problem)
    likely = not few or now >= often
    due = likely and now - before.sampled >= (often if few else SELDOM)
    _asked[run.problem] = _Asked(now, now if due else before.sampled)
    return likely, due


def decided_by(maps: Maps, *, sampled: bool = True) -> Mapped:
    """Decide as `certainty.decide`, with maps in the places of integrations.

    What maps leave open is integrated if the precisions go beyond theirs, and compared with what
    they found last. A sample is integrated as well, unless the flags alone are on trial.

    Raises
    ------
    Contradiction
        A certain symbol is another one by integration.
    """
    from rigidpend.routes.handover import handed_over

    run = maps.run
    n, rate, precisions = len(run.phases), run.rate, run.arithmetic.precisions
    within = tuple(p for p in maps.ladder if p <= maps.most_bits)
    compute, left = with_maps(maps, run.crossings, precisions)

    def share(work: certainty.Work, columns: Columns, _: int) -> list[tuple[Columns, Decided]]:
        return in_pieces(work, columns, max(1, PIECE // (run.problem.n_symbols + 1)), 1)

    known = certainty.decide(compute, n, rate, within, share, most=maps.most)
    open_ = np.flatnonzero(~known.certain.all(axis=0))
    beyond = run.beyond(maps.most_bits)
    if open_.size and beyond:
        # Parts of a plane would say so again and again.
        if n == run.orbits:
            reason = f"their symbols ask for more than the {maps.most_bits} bits of the maps"
            costs.warned(run.problem, open_.size, n, costs.beyond_maps(run.problem), reason)
        climbing = handed_over(maps, run.crossings, known, beyond)
        # One computation of a precision: the next one settles more than a second would.
        last = beyond[-1]
        certainty.climb(climbing, known, rate, beyond, lambda x: run.most(x) if x == last else 1)
    if sampled:
        # Doubles decide at least the first symbols of each; what is beyond them takes long.
        size = -(-SAMPLE * n // run.orbits)
        samples = (size, precisions[:1]), (LEAST_SAMPLE, precisions[:2])
        # In a small part of all orbits the second sample has the first in it.
        for here, ladder in samples[maps.kept or size <= LEAST_SAMPLE :]:
            wrong = contradicted(known, run.crossings, rate, ladder, here)
            if wrong.size:
                raise certainty.Contradiction(_alarm(run, wrong))
    # What was integrated for being open has more bits than maps have.
    return Mapped(known, (known.bits <= maps.most_bits) & ~left)


def with_maps(
    maps: Maps, integrated: Compute, precisions: tuple[int, ...]
) -> tuple[Compute, NDArray[np.bool_]]:
    """Computations by maps, and by integration where these do not serve.

    Nothing is integrated but in the precisions that are given. The second result tells, when all
    is done, of which columns something was integrated.
    """
    left = np.zeros(len(maps.run.phases), dtype=bool)

    def by_integration(bits: int, scales: Scales, columns: Columns) -> Crossings:
        left[columns] = True
        return integrated(bits, scales, columns)

    def compute(bits: int, scales: Scales, columns: Columns) -> Crossings:
        if not maps.serve(bits, scales):
            return by_integration(bits, scales, columns)
        found = maps.crossings(bits, scales, columns)
        outside = np.flatnonzero(found.outcome != Outcome.COMPLETE)
        if outside.size and bits in precisions:
            put(found, outside, by_integration(bits, scales, columns[outside]))
        return found

    return compute, left


def _alarm(run: Run, wrong: NDArray[np.intp]) -> str:
    """Sentence about orbits of a sample of which maps and integration find other symbols."""
    first = wrong[0]
    J1 = run.starts.J1_0[first] if run.starts else run.problem.J1_0
    return (
        "return maps and integration call different symbols certain, so that neither is to be"
        f" believed: of a sample {wrong.size} differ, the first at theta2_0 ="
        f" {run.phases.high[first]} and J1_0 = {J1}; please report it (precisions that do not"
        " begin with 53 do without maps)"
    )


def contradicted(
    known: Decided, integrated: Compute, rate: float, precisions: tuple[int, ...], size: int
) -> NDArray[np.intp]:
    """Integrate a sample of the columns; those of which a certain symbol is another one."""
    n = len(known.bits)
    # Spread evenly and not by lot: the same sample in every run. Neighbours have their J1_0 in
    # common where that differs, and most of what a single orbit takes is to begin it.
    first = np.linspace(0, max(0, n - ABREAST), -(-min(n, size) // ABREAST)).astype(int)
    sample = np.unique(np.minimum(first[:, None] + np.arange(ABREAST), n - 1))
    again = certainty.decide(
        lambda bits, scales, columns: integrated(bits, scales, sample[columns]),
        sample.size,
        rate,
        precisions,
    )
    both = again.certain & known.certain[:, sample]
    differ = symbols(again.crossings.separatrix) != symbols(known.crossings.separatrix[:, sample])
    return sample[(both & differ).any(axis=0)]
