"""Choice between maps and integration: which decides a call's orbits, and those maps leave open."""

from __future__ import annotations

import contextlib
import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rigidpend.mechanics.free_body import symbols
from rigidpend.numbers import checked
from rigidpend.numbers.checked import ParameterError
from rigidpend.numbers.exact import PRECISIONS
from rigidpend.orbits import put
from rigidpend.orbits.integrate import Crossings, Outcome
from rigidpend.orbits.integrate.arithmetic import in_kernel
from rigidpend.routes import certainty, costs
from rigidpend.routes.certainty import Compute, Decided
from rigidpend.routes.ladder import Columns, rungs
from rigidpend.routes.problem import RouteProblem
from rigidpend.routes.run import Run
from rigidpend.routes.start import Scales

if TYPE_CHECKING:
    from rigidpend.routes.mapped import Maps

METHODS = ("auto", "map", "integration")
"""Ways to compute codes in double precision."""
PIECE = 2**19
"""Number of passages that maps follow in one piece, which bounds the memory."""
OFTEN = 0.1
"""Seconds of integration of one problem, in all calls, after which kept maps serve few orbits too.

Reading the maps takes as long. After every so many seconds more a sample is integrated again."""
SELDOM = 100_000
"""Number of orbits of a problem between two samples of large calls.

A sample takes 3 to 5 % of the time of so many orbits."""
PROBLEMS = 1_000
"""Number of problems whose orbits are counted; after that the count begins anew."""
SAMPLE = 64
"""Number of orbits that are also integrated in doubles and compared, unless the maps are kept."""
ABREAST = 4
"""Number of neighbouring orbits that enter a sample together."""
LEAST_SAMPLE = 8
"""Least size of the sample of a part of the orbits, and size of that in one more precision."""
SLOWER = 2.0
"""Time of orbits on a common machine, over that of `costs`, which was measured on a fast one.

On a crowded machine, whose cores are 1.7 times slower than a Xeon's, 1,000 to 20,000 orbits of 15
to 60 symbols took 2.7 to 4.1 times as long by integration and by maps, in 53 to 160 bits alike. The
factor leaves estimates within one of two there and on a fast machine. No choice depends on it."""


def expected_seconds(
    problem: RouteProblem, orbits: int, precisions: Sequence[int] = PRECISIONS
) -> float:
    """Expected seconds of a core for so many orbits of one body.

    Where maps would be chosen, the estimate is theirs and includes the tables, as if none were
    kept, and the samples that are integrated too; otherwise it is that of integration.
    """
    if costs.at_stake(problem, orbits, precisions):
        from rigidpend.routes.mapped import expected_tables

        budget = costs.budget(problem, orbits, precisions)
        tables = expected_tables(problem, orbits, budget, precisions)
        if tables < math.inf:
            # Integrated once, where orbits that integration decides are integrated twice.
            samples = sum(
                min(orbits, size) * costs.integration(problem, precisions[:most]) / 2
                for size, most in ((SAMPLE, 1), (LEAST_SAMPLE, 2))
            )
            return SLOWER * (tables + samples + orbits * costs.by_maps(problem, precisions))
    return SLOWER * orbits * costs.integration(problem, precisions)


def decide(run: Run, method: str = "auto", *, use_kept: bool = False) -> Decided:
    """Decide all orbits of a run, by maps where these are expected to take less time.

    Parameters
    ----------
    run : Run
    method : {"auto", "map", "integration"}, optional
    use_kept : bool, optional
        Whether a problem that is asked for often may use what earlier calls left: few orbits the
        maps that are kept, many orbits the sample of an earlier call. Where none are kept, maps are
        made as soon as they pay for the orbits of all calls. Stored results are computed without
        this, so that they depend on no cache.

    Raises
    ------
    ParameterError
        The method is not known, or it is "map" and the precisions do not begin with doubles.
    MapError
        The method is "map" and the orbits have none.
    Contradiction
        Maps and integration call different symbols of an orbit certain.
    """
    checked.choice("method", method, METHODS)
    precisions = run.arithmetic.precisions
    if method == "map" and precisions[0] != 53:
        message = (
            f"the maps are in double precision: precisions must begin with 53, got {precisions}"
        )
        raise ParameterError("precisions", message)
    auto = method == "auto" and precisions[0] == 53
    asked, often, due = _counted(run) if use_kept and auto else (run.orbits, False, True)
    # Of few orbits integration is so cheap that only maps that exist already may be faster, or such
    # as pay for the orbits of all calls.
    few = auto and not costs.at_stake(run.problem, run.orbits, precisions)
    pays = auto and costs.at_stake(run.problem, asked, precisions)
    if run.orbits and (method == "map" or often or pays):
        from rigidpend.orbits.return_map import MapError
        from rigidpend.routes.mapped import Maps

        try:
            if few and (kept := _kept(run)):
                return by_maps(kept, sampled=due)
            if pays or not few:
                maps = Maps(run, orbits=asked if few else run.orbits, least_time=auto)
                # A sample is taken of few orbits too: no others were followed by these maps before.
                return by_maps(maps, sampled=due or few)
        except certainty.Contradiction:
            # The count is forgotten, so that the next call takes a sample again. Without one it
            # would call wrong symbols certain.
            _asked.pop(run.problem, None)
            raise
        except MapError as reason:
            # A method that was asked for by name is not replaced in silence.
            if method == "map":
                raise
            each, all_ = costs.integration(run.problem, precisions), run.orbits
            costs.warned(run.problem, all_, all_, each, f"there are no return maps: {reason}")
    # The other engines have no limit of rotations.
    if in_kernel(run.arithmetic.engine, precisions[0]):
        costs.warned_of_none(run.problem)
    return run.by_integration()


def _kept(run: Run) -> Maps | None:
    """Maps that were built before; None if none is kept."""
    from rigidpend.orbits.return_map import MapError
    from rigidpend.routes.mapped import Maps

    with contextlib.suppress(MapError):
        return Maps(run, only_kept=True)
    return None


class _Asked(NamedTuple):
    """Number of orbits of a problem in all calls, and that number at the last sample."""

    all_: int = 0
    sampled: float = -math.inf
    """Minus infinity before the first sample, which is therefore due at once."""


_asked: dict[RouteProblem, _Asked] = {}


def _counted(run: Run) -> tuple[int, bool, bool]:
    """Count a run's orbits: the number of its problem's orbits in all calls.

    Then come True if these are so many that kept maps serve few orbits too, and True if a sample
    of them is due.
    """
    if len(_asked) >= PROBLEMS:
        _asked.clear()
    problem, precisions = run.problem, run.arithmetic.precisions
    before = _asked.get(problem, _Asked())
    now, wait = before.all_ + run.orbits, OFTEN / costs.integration(problem, precisions)
    often, few = now >= wait, not costs.at_stake(problem, run.orbits, precisions)
    due = (often or not few) and now - before.sampled >= (wait if few else SELDOM)
    _asked[problem] = _Asked(now, now if due else before.sampled)
    return now, often, due


def by_maps(maps: Maps, *, sampled: bool = True) -> Decided:
    """Decide orbits as `certainty.decide` does, with maps in the place of integrations.

    Orbits that maps leave open are integrated if the precisions go beyond the maps', and compared
    with the last result of the maps. A sample is integrated too and must not contradict the maps;
    `sampled` = False leaves it out, as where the flags themselves are on trial.

    Raises
    ------
    Contradiction
        A certain symbol is another one by integration.
    """
    from rigidpend.routes.handover import handed_over

    run = maps.run
    n, rate, precisions = len(run.phases), run.rate, run.arithmetic.precisions
    compute, left = with_maps(maps, run.crossings, precisions)

    # The pieces follow one another, for the threads share the orbits within each.
    pieces = max(1, PIECE // (run.problem.n_symbols + 1)), 1
    known = certainty.decide(compute, n, rate, maps.ladder, lambda *_: pieces)
    open_ = certainty.open_columns(known)
    if open_.size and maps.beyond:
        # A plane is computed in parts, and each would repeat the warning.
        if n == run.orbits:
            reason = f"their symbols need more than the {maps.most_bits} bits of the maps"
            _, each = costs.beyond_maps(run.problem, precisions)
            costs.warned(run.problem, open_.size, n, each, reason)
        # Errors of regular motions hardly grow from passage to passage, so that one that a map adds
        # where it takes over would be as large in the end as that which it is to be free of.
        regular = costs.wanted(run.problem)[0] == (53, 53)
        beyond, own = maps.beyond, run.crossings
        climbing = own if regular else handed_over(maps, own, known, beyond)
        certainty.climb(climbing, known, rate, beyond)
    if sampled:
        # Where doubles confirm half of a small sample they serve for a larger one too; more bits
        # take long. A part of a plane has its share of the sample; few orbits that take kept maps
        # have the small one alone.
        few, size = sample_of(n, LEAST_SAMPLE), -(-SAMPLE * n // run.orbits)
        rest = np.setdiff1d(sample_of(n, 0 if maps.only_kept else size), few)
        for sample, within in ((few, precisions[:2]), (rest, precisions[:1])):
            wrong, telling = contradicted(known, run.crossings, rate, within, sample)
            if wrong.size:
                raise certainty.Contradiction(_alarm(run, wrong))
            if not (telling and rest.size):
                break
    # Orbits that were integrated because maps left them open have more bits than the maps.
    return known._replace(by_map=(known.bits <= maps.most_bits) & ~left)


def with_maps(
    maps: Maps, integrated: Compute, precisions: tuple[int, ...]
) -> tuple[Compute, NDArray[np.bool_]]:
    """Computations by maps, and by integration where there is no map or an orbit leaves its tables.

    Orbits that leave the tables are integrated in the given precisions only. The second result,
    (n,), is filled in as the computations run: True where a column was integrated.
    """
    left = np.zeros(len(maps.run.phases), dtype=bool)

    def by_integration(bits: int, scales: Scales, columns: Columns) -> Crossings:
        left[columns] = True
        return integrated(bits, scales, columns)

    def compute(bits: int, scales: Scales, columns: Columns) -> Crossings:
        if maps.design_of(bits, scales) is None:
            return by_integration(bits, scales, columns)
        found = maps.crossings(bits, scales, columns)
        outside = np.flatnonzero(found.outcome != Outcome.COMPLETE)
        # In the maps' own bits, which nobody asked for, such orbits stay open instead, and the next
        # precision decides them.
        if outside.size and bits in precisions:
            put(found, outside, by_integration(bits, scales, columns[outside]))
        return found

    return compute, left


def _alarm(run: Run, wrong: NDArray[np.intp]) -> str:
    """Message about the orbits of a sample whose symbols differ between maps and integration."""
    first = wrong[0]
    J1 = run.starts.J1_0[first] if run.starts else run.problem.J1_0
    return (
        "return maps and integration call different symbols certain, so neither can be trusted:"
        f" {wrong.size} of the orbits in a sample differ, the first at theta2_0 ="
        f" {run.phases.high[first]} and J1_0 = {J1}; please report it (precisions that do not"
        " begin with 53 use no maps)"
    )


def sample_of(n: int, size: int) -> NDArray[np.intp]:
    """A sample of n columns, in ascending order: at least `size` of them, or all.

    It is spread evenly and not drawn by lot, so that every run has the same. Groups of neighbours
    share their J1_0 on a plane, and with it the start, which takes most of the time.
    """
    first = np.linspace(0, max(0, n - ABREAST), -(-min(n, size) // ABREAST)).astype(int)
    return np.unique(np.minimum(first[:, None] + np.arange(ABREAST), n - 1))


def contradicted(
    known: Decided,
    integrated: Compute,
    rate: float,
    precisions: tuple[int, ...],
    sample: NDArray[np.intp],
) -> tuple[NDArray[np.intp], bool]:
    """The columns of a sample that contradict it: integration finds another certain symbol.

    They are integrated once in the least of the given precisions, and those in which it finds other
    symbols than are certain in the next one. Where that does so too, all precisions decide which
    symbols are right. Then comes True if the least precision alone confirms half of the sample.
    """

    def differing(found: Crossings, columns: NDArray[np.intp]) -> NDArray[np.bool_]:
        differ = symbols(found.separatrix) != symbols(known.crossings.separatrix[:, columns])
        return known.certain[:, columns] & differ

    def compute(bits: int, scales: Scales, columns: Columns) -> Crossings:
        return integrated(bits, scales, doubted[columns])

    doubted, telling = sample, True
    for bits in precisions:
        once = integrated(bits, certainty.FIRST_SCALES, doubted)
        doubted = doubted[differing(once, doubted).any(axis=0)]
        if not doubted.size:
            return doubted, telling
        telling = telling and 2 * doubted.size <= sample.size
    again = certainty.decide(compute, doubted.size, rate, rungs(precisions))
    return doubted[(again.certain & differing(again.crossings, doubted)).any(axis=0)], telling
