"""Route codes of a body's orbits from their initial phases."""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rigidpend.machine.wording import counted
from rigidpend.mechanics.body import Body
from rigidpend.mechanics.free_body import symbols
from rigidpend.numbers import Scalar, checked
from rigidpend.numbers.exact import PRECISIONS, Exact
from rigidpend.numbers.texts import words
from rigidpend.orbits.integrate.arithmetic import Arithmetic, resolve
from rigidpend.routes import choice
from rigidpend.routes.certainty import Decided
from rigidpend.routes.phases import Phases
from rigidpend.routes.problem import RouteProblem
from rigidpend.routes.run import Run


class RouteCodes(NamedTuple):
    """The routes of n orbits; t' is the dimensionless time."""

    theta2_0: NDArray[np.float64]
    """(n,), radians."""
    codes: NDArray[np.uint8]
    """(n_symbols, n), row 0 = symbol 1: 0 left, 1 right, 255 no symbol (no return)."""
    certain: NDArray[np.bool_]
    """(n_symbols, n), True where independent computations establish the symbol."""
    bits: NDArray[np.uint16]
    """(n,), the precision in bits of the last computation of the column."""
    crossing_time: NDArray[np.float64]
    """(n_symbols + 1, n), t' of the crossings of J1 = J2/2; NaN where there is none."""
    separatrix: NDArray[np.uint8]
    """(n_symbols + 1, n), 1..4; 0 where there is no crossing.

    The half plane of M3 = 0 that M crosses decides: upwards 2 where Q+ > 0, else 4; downwards 1
    where Q- < 0, else 3. With a large mu orbits cross far from all four separatrices.
    """
    by_map: NDArray[np.bool_]
    """(n,), True where return maps alone found the column, and no part of it was integrated."""

    @property
    def words(self) -> list[str]:
        """Codes as text, one for each orbit: 0, 1, ``.`` for no symbol, ``?`` where uncertain."""
        return words(self.codes, self.certain)

    def __repr__(self) -> str:
        return shown("routes", self.theta2_0, self.words)


def shown(what: str, theta2_0: NDArray[np.float64], codes: Sequence[str]) -> str:
    """The representation of some routes: how many, and the phases and codes of the first five."""
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

    Each orbit starts at theta1_0 = alpha0 + beta0, J1_0, theta2_0 and J2_0 = sqrt(2 h0/kappa), with
    J3 = 0. Symbol i tells on which side the orbit leaves a periodic orbit between its crossings i
    and i + 1 of J1 = J2/2.

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
        Number of symbols to find on each orbit.
    engine : {"taylor", "scipy"}, optional
        `taylor` by default.
    tolerance : number, optional
        Local tolerance in double precision; by default the engine's own. The engine's finest
        replaces a finer one.
    precisions : sequence of int, optional
        Bits, from 53 to 9,000, ascending by 11 or more. Columns with an uncertain symbol go to the
        next precision. 64 is left out where integers would compute it.
    jobs : int, optional
        Number of threads (or processes, where Python itself computes). No result depends on it.
    method : {"auto", "map", "integration"}, optional
        Whether double precision is two return maps (`rigidpend.return_map`) or two integrations.
        "auto" takes the maps where integration is expected to take a second of a core or more, and
        the tables less than they save; for few orbits of a problem that is asked for often, in all
        calls together, or where the maps are kept from before. `by_map` says which was
        taken. In either case orbits that leave the tables are integrated, uncertain ones are
        integrated in more bits as far as that gains symbols, and a sample is integrated to its
        end, which must agree.

    Returns
    -------
    RouteCodes

    Raises
    ------
    ParameterError, ExactError
        A value is excluded or is no number, or there are more symbols than memory holds; the
        message says which.
    EngineError
        The engine is not known.
    MapError
        The method is "map" and the orbits have none; the message gives the reason.
    Contradiction
        Maps and integration call different symbols of an orbit certain.

    Notes
    -----
    Numbers given as text, Fraction or Decimal are exact in every precision; a float stands for
    exactly the double that it is. A symbol is certain where independent computations agree on all
    crossing times up to the one behind it; `rigidpend.routes.certainty` has the rule and the
    measurements behind its limits.
    """
    problem = RouteProblem(body, h0, J1_0, n_symbols)
    arithmetic = resolve(engine, tolerance, precisions)
    jobs = checked.whole("jobs", jobs, 1)
    return codes_of(problem, theta2_0, arithmetic, jobs, method, use_kept=True)


def codes_of(
    problem: RouteProblem,
    theta2_0: Any,
    arithmetic: Arithmetic,
    jobs: int = 1,
    method: str = "auto",
    *,
    use_kept: bool = False,
    task_orbits: int | None = None,
) -> RouteCodes:
    """The binary route codes of the orbits of a checked problem: see :func:`route_codes`.

    `use_kept` is as in `choice.decide`, and `task_orbits` as in `Run`.
    """
    phases = Phases(theta2_0)
    problem.afford(len(phases))
    run = Run(problem, phases, arithmetic, jobs, task_orbits=task_orbits)
    return routes_of(phases, choice.decide(run, method, use_kept=use_kept))


def routes_of(phases: Phases, found: Decided) -> RouteCodes:
    """The routes of some phases, from their decided crossings."""
    (time, separatrix, _), certain, bits, by_map = found
    codes = symbols(separatrix)
    return RouteCodes(phases.high, codes, certain, bits, time, separatrix, by_map)
