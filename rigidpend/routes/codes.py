"""From a body and initial phases to binary route codes."""

from __future__ import annotations

import functools
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rigidpend.machine.workers import side_by_side
from rigidpend.mechanics.body import Body
from rigidpend.numbers import checked
from rigidpend.numbers.alphabet import words
from rigidpend.numbers.exact import PRECISIONS, Exact
from rigidpend.numbers.generic import Scalar
from rigidpend.orbits import integrate
from rigidpend.orbits.integrate.arithmetic import Arithmetic, resolve
from rigidpend.orbits.integrate.kernel.writer import LANES
from rigidpend.orbits.integrate.records import Crossings, Orbits
from rigidpend.routes import certainty
from rigidpend.routes.certainty import Decided
from rigidpend.routes.cycle import symbols
from rigidpend.routes.phases import Phases
from rigidpend.routes.problem import ProblemError, RouteProblem, passage_limit, phase_rate
from rigidpend.routes.start import Scales, Start, start, states_double, states_exact

FEWEST, MOST, PIECES = 256, 1024, 8
"""Columns of a piece at least and at most, and pieces that each thread gets."""
PIECE = 2048
"""Columns of a piece where maps serve."""
METHODS = ("auto", "map", "integration")
"""Ways in which codes are computed in double precision."""
MANY = 8_000
"""Number of orbits from which on "auto" asks whether maps pay, which depends on the body.

With that of Fig. 4 they do: on one core orbits of 15 symbols, every symbol certain, take 0.12 ms
each by integration and 0.004 ms by maps, whose tables take 0.8 s where they are not kept yet."""

OFTEN = 750
"""Orbits of a problem in all calls of a process after which its kept maps serve few orbits, too.

To read them takes as long as to integrate so many with the body of Fig. 4. Of each so many further
ones a sample is integrated as well: the same share of few orbits as of many."""

PROBLEMS = 1_000
"""Problems that are counted; then the count begins anew."""

SHARPENING = 100
"""Factor by which further computations are finer, in doubles while these allow it."""


class RouteCodes(NamedTuple):
    """The routes of n orbits; t' is the dimensionless time."""

    theta2_0: NDArray[np.float64]
    """(n,), radians."""
    codes: NDArray[np.uint8]
    """(n_symbols, n), row 0 = symbol 1: 0 left, 1 right, 255 no symbol (no return)."""
    certain: NDArray[np.bool_]
    """(n_symbols, n), whether two computations establish the symbol."""
    bits: NDArray[np.uint16]
    """(n,), the precision that decided the column."""
    crossing_time: NDArray[np.float64]
    """(n_symbols + 1, n), t' of the crossings of J1 = J2/2; NaN where there is none."""
    separatrix: NDArray[np.uint8]
    """(n_symbols + 1, n), 1..4; 0 where there is no crossing."""
    by_map: NDArray[np.bool_]
    """(n,), True where return maps alone found the column, without integration of any part."""

    @property
    def words(self) -> list[str]:
        """Codes as texts, one an orbit: 0, 1, ``.`` for no symbol, ``?`` for an uncertain one."""
        return words(self.codes, self.certain)

    def __repr__(self) -> str:
        return shown("routes", self.theta2_0, self.words)


def shown(what: str, theta2_0: NDArray[np.float64], codes: Sequence[str]) -> str:
    """The first of some routes, as Python shows them: phases and codes."""
    told = [f"{x:.6g}: {word}" for x, word in zip(theta2_0[:5], codes, strict=False)]
    more = ", ..." if len(theta2_0) > len(told) else ""
    return f"<{what} of {len(theta2_0)} orbits; {', '.join(told)}{more}>"


def route_codes(
    body: Body,
    theta2_0: Any,
    *,
    h0: Scalar,
    J1_0: Scalar,
    n_symbols: int = 15,
    engine: str | None = None,
    tolerance: Exact | float | str | None = None,
    precisions: Sequence[int] = PRECISIONS,
    jobs: int = 1,
    method: str = "auto",
) -> RouteCodes:
    """The binary route codes of orbits on S1-, as in Fig. 4.

    Each orbit starts at theta1_0 = alpha0 + beta0, J1_0, theta2_0 and
    J2_0 = sqrt(2 h0/kappa), with J3 = 0. Symbol i tells on which side it leaves between its
    crossings i and i + 1 of J1 = J2/2.

    Parameters
    ----------
    body : Body
    theta2_0 : number or sequence of numbers
        Initial phases in radians.
    h0 : number
        Energy constant, greater than mu.
    J1_0 : number
        Initial action, dimensionless, 0 < J1_0 < J2_0, not J2_0/2.
    n_symbols : int, optional
        How many symbols to find on each orbit.
    engine : {"taylor", "scipy"}, optional
        `taylor` by default.
    tolerance : number, optional
        Local tolerance in double precision; by default the engine's own, at least its finest.
    precisions : sequence of int, optional
        Bits, from 53 to 9,000, ascending by 11 or more. Columns with an uncertain symbol go to the
        next. 64 is passed over where integers would serve.
    jobs : int, optional
        How many threads (or processes, where Python itself computes). No result depends on it.
    method : {"auto", "map", "integration"}, optional
        Whether double precision is two return maps (`rigidpend.return_map`) or two integrations;
        "auto" takes the maps where there are orbits enough to pay for their tables, as is
        expected of this body and these numbers, or, from the 750th orbit of a process on, where
        they are kept from before; `by_map` says which. Orbits that
        leave the tables, and uncertain ones, are integrated in either case, and so is a sample,
        which must agree.

    Returns
    -------
    RouteCodes

    Raises
    ------
    ParameterError, ExactError
        A value that is excluded or that is no number, or more symbols than memory holds; the
        message says which.
    EngineError
        An engine that is not known.
    MapError
        The method is "map" and the orbits have none; the message gives the reason.
    Contradiction
        Maps and integration call different symbols of an orbit certain.

    Notes
    -----
    Numbers given as text, Fraction or Decimal are exact in every precision, floats are the
    doubles that they are. A symbol is certain where two independent computations agree on
    all crossing times up to the one behind it: see `rigidpend.routes.certainty`, which says
    the rule and the measurement behind its threshold.
    """
    problem = RouteProblem(body, h0, J1_0, n_symbols)
    arithmetic = resolve(engine, tolerance, precisions)
    jobs = checked.whole("jobs", jobs, 1, error=ProblemError)
    return codes_of(problem, theta2_0, arithmetic, jobs, method, kept=True)


def codes_of(
    problem: RouteProblem,
    theta2_0: Any,
    arithmetic: Arithmetic,
    jobs: int = 1,
    method: str = "auto",
    *,
    kept: bool = False,
) -> RouteCodes:
    """The binary route codes of the orbits of a checked problem: see :func:`route_codes`.

    `kept` allows few orbits maps that are there from before. What is stored does without: a
    result hangs on no cache.
    """
    phases = Phases(theta2_0)
    problem.afford(len(phases))
    run = Run(problem, phases, arithmetic, jobs)
    return routes_of(phases, *_decided(run, phase_rate(problem), method, kept))


def routes_of(
    phases: Phases,
    found: Crossings,
    certain: NDArray[np.bool_],
    bits: NDArray[np.uint16],
    by_map: NDArray[np.bool_],
) -> RouteCodes:
    """The routes of some phases from their crossings and what is known of them."""
    return RouteCodes(
        theta2_0=phases.high,
        codes=symbols(found.separatrix),
        certain=certain,
        bits=bits,
        crossing_time=found.time,
        separatrix=found.separatrix,
        by_map=by_map,
    )


def _shared(
    jobs: int, work: Callable[[Any], Decided], columns: Any, bits: int
) -> list[tuple[Any, Decided]]:
    """Let threads decide columns, in pieces that are small beside a thread's share."""
    fewest = LANES if bits > 53 else FEWEST
    size = min(MOST, max(fewest, -(-len(columns) // (PIECES * jobs))))
    parts = [columns[k : k + size] for k in range(0, len(columns), size)] or [columns]
    return list(zip(parts, side_by_side(work, (), False, parts, jobs), strict=True))


def in_threads(
    jobs: int, work: Callable[[Any], Decided], columns: Any, bits: int
) -> list[tuple[Any, Decided]]:
    """Let threads decide columns in doubles, in pieces of one size; the rest at once.

    Return maps serve many columns best, and round alike where the pieces are.
    """
    if bits > 53:
        return [(columns, work(columns))]
    parts = [columns[k : k + PIECE] for k in range(0, len(columns), PIECE)]
    return list(zip(parts, side_by_side(work, (), False, parts, jobs), strict=True))


_asked: dict[RouteProblem, int] = {}
"""Orbits that were asked for, a few at a time."""


def _counted(problem: RouteProblem, orbits: int) -> tuple[bool, bool]:
    """True if few orbits may take kept maps, after all before them; and if they need a sample."""
    if len(_asked) >= PROBLEMS:
        _asked.clear()
    before = _asked.get(problem, 0)
    _asked[problem] = before + orbits
    return before + orbits >= OFTEN, (before + orbits) // OFTEN > before // OFTEN


def _decided(
    run: Run, rate: float, method: str, kept: bool
) -> tuple[Crossings, NDArray[np.bool_], NDArray[np.uint16], NDArray[np.bool_]]:
    """Crossings, which symbols are certain, in which precision, and which columns by maps."""
    checked.choice("method", method, METHODS, ProblemError)
    n, ladder = len(run.phases), run.arithmetic.precisions
    if method == "map" and ladder[0] != 53:
        message = f"the maps are in double precision: precisions must begin with 53, got {ladder}"
        raise ProblemError("precisions", message)
    few = method == "auto" and n < MANY
    likely, sampled = _counted(run.problem, n) if few and kept else (not few, True)
    if method == "map" or (method == "auto" and ladder[0] == 53 and likely):
        from rigidpend.orbits.return_map import MapError
        from rigidpend.routes import mapped

        try:
            share = functools.partial(in_threads, run.jobs)
            known, by_map = mapped.decided(
                run.crossings,
                run.problem,
                run.phases,
                rate,
                ladder,
                share,
                jobs=run.jobs,
                least_time=method == "auto" and not few,
                kept=few,
                sampled=sampled,
            )
            return *known, by_map
        except MapError as reason:
            # What was asked for by name is not replaced in silence.
            if method == "map":
                raise
            if not few:
                mapped.told(run.problem, n, str(reason))
    return *_integrated(run, rate), np.zeros(n, dtype=bool)


def _integrated(run: Run, rate: float) -> Decided:
    """Decide all columns by integration.

    Where a precision is compiled, threads share the columns and decide their own to its end; else
    processes share the orbits of each computation.
    """

    def in_own(bits: int) -> bool:
        return integrate.in_kernel(run.arithmetic.engine, bits)

    def compute(bits: int, scales: Scales, columns: Any) -> Crossings:
        # Threads that share the columns start none of their own.
        return (run._replace(jobs=1) if in_own(bits) else run).crossings(bits, scales, columns)

    def share(work: Callable[[Any], Decided], columns: Any, bits: int) -> list[tuple[Any, Decided]]:
        if in_own(bits):
            return _shared(run.jobs, work, columns, bits)
        return certainty.undivided(work, columns, bits)

    n, precisions = len(run.phases), run.arithmetic.precisions
    compiled = in_own(precisions[0])
    # Where threads or processes would have no columns of their own to share.
    few = run.jobs > 1 and n <= (LANES if compiled else run.jobs // 2)

    def both(columns: Any) -> list[Crossings]:
        each = run._replace(jobs=1) if compiled or few else run
        scales, jobs = (certainty.FIRST, certainty.SECOND), 2 if few else 1
        return side_by_side(_in_scales, (each, precisions[0], columns), not compiled, scales, jobs)

    return certainty.decide(compute, n, rate, precisions, share, both)


def _in_scales(scales: Scales, run: Run, bits: int, columns: Any) -> Crossings:
    """One computation of those that go side by side."""
    return run.crossings(bits, scales, columns)


class Run(NamedTuple):
    """One call's problem and means; computes any columns in any precision."""

    problem: RouteProblem
    phases: Phases
    arithmetic: Arithmetic
    jobs: int

    def crossings(self, bits: int, scales: Scales, columns: Any) -> Crossings:
        """The crossings of those columns in `bits` bits, in t'."""
        return self.integrate(*self.begin(bits, scales, columns), bits, scales)

    def begin(self, bits: int, scales: Scales, columns: Any) -> tuple[Start, Any]:
        """The start in those units, and the states of those columns."""
        begin = start(self.problem, bits, scales)
        if bits == 53:
            return begin, states_double(begin, self.phases.high[columns], self.phases.rest[columns])
        return begin, states_exact(begin, self.phases.exactly(columns), bits)

    def integrate(self, begin: Start, states: Any, bits: int, scales: Scales) -> Crossings:
        """The crossings of orbits from given states, in t'."""
        unit = float(begin.time_unit)
        limit = longest_wait(self.problem, bits) / unit
        found = integrate.crossings(
            Orbits(begin.coefficients, states, self.problem.n_symbols + 1, limit),
            engine=self.arithmetic.engine,
            bits=bits,
            tolerance=tolerance_of(self.arithmetic, bits, scales),
            jobs=self.jobs,
        )
        return found._replace(time=found.time * unit)


def tolerance_of(arithmetic: Arithmetic, bits: int, scales: Scales) -> float:
    """The tolerance of a computation, at 53 bits.

    The first one has a tolerance of its own: what a series leaves out is alike.
    """
    engine, tolerance, _ = arithmetic
    first, finest = scales == certainty.FIRST, integrate.FINEST_TOLERANCE[engine]
    if bits > 53:
        return finest if first else finest / SHARPENING
    return tolerance if first else max(tolerance / SHARPENING, finest)


longest_wait = functools.lru_cache(maxsize=32)(passage_limit)
"""`passage_limit`, which takes mpmath and is the same for all columns of a run."""
