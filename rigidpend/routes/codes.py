"""From a body and initial phases to binary route codes."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rigidpend.machine.wording import counted
from rigidpend.mechanics.body import Body
from rigidpend.numbers import checked
from rigidpend.numbers.exact import PRECISIONS, Exact
from rigidpend.numbers.expressions import words
from rigidpend.numbers.generic import Scalar
from rigidpend.orbits.integrate.arithmetic import Arithmetic, resolve
from rigidpend.routes import choice
from rigidpend.routes.choice import Mapped
from rigidpend.routes.cycle import symbols
from rigidpend.routes.phases import Phases
from rigidpend.routes.problem import ProblemError, RouteProblem
from rigidpend.routes.run import Run


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
    """(n_symbols + 1, n), 1..4; 0 where there is no crossing.

    By the half plane of M3 = 0 in which M is: upwards 2 where Q+ > 0, else 4; downwards 1 where
    Q- < 0, else 3. A large mu leads orbits far from all four.
    """
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
    return f"<{what} of {counted(len(theta2_0), 'orbit')}; {', '.join(told)}{more}>"


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
        "auto" takes the maps where integration would take a second of a core and more, and their
        tables less, as is expected of this body and these numbers; or, for few orbits of a problem
        that is asked for often, where they are kept from before; `by_map` says which. Orbits that
        leave the tables are integrated in either case, uncertain ones in more bits as far as that
        gains, and a sample, which must agree, to its end.

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
    of: int | None = None,
) -> RouteCodes:
    """The binary route codes of the orbits of a checked problem: see :func:`route_codes`.

    `kept` allows few orbits maps that are there from before. What is stored does without: a
    result hangs on no cache. `of` is the number of orbits in all, if these are a part.
    """
    phases = Phases(theta2_0)
    problem.afford(len(phases))
    run = Run(problem, phases, arithmetic, jobs, of=of)
    return routes_of(phases, choice.decided(run, method, kept=kept))


def routes_of(phases: Phases, found: Mapped) -> RouteCodes:
    """The routes of some phases from their crossings and what is known of them."""
    (time, separatrix, _), certain, bits = found.decided
    codes = symbols(separatrix)
    return RouteCodes(phases.high, codes, certain, bits, time, separatrix, found.by_map)
