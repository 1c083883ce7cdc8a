"""Addresses of given orbits, and the round phases whose orbits have a given code.

An address follows from the crossings, which the map or an integration gives. Round phases have few
decimals. Thousands of intervals of theta2_0 belong to a code of five symbols, so that the code
alone does not name an orbit; trying phases one after another finds round ones in such intervals.
"""

import contextlib
import math
from collections.abc import Sequence
from decimal import Decimal
from fractions import Fraction
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rigidpend.mechanics.body import Body
from rigidpend.mechanics.equations import on_section
from rigidpend.numbers import Array, Scalar, checked
from rigidpend.numbers.checked import ParameterError
from rigidpend.numbers.exact import PRECISIONS
from rigidpend.orbits.integrate.arithmetic import resolve
from rigidpend.orbits.integrate.states import states_at
from rigidpend.orbits.precision import precision
from rigidpend.orbits.return_map import MapError, SectionPoint
from rigidpend.routes.codes import codes_of, route_codes
from rigidpend.routes.problem import RouteProblem
from rigidpend.routes.start import Scales, start, states_exact
from rigidpend.routes.symbolic.address import Address, Code, parsed
from rigidpend.routes.symbolic.chain import section_points
from rigidpend.routes.symbolic.levels import ChainLevel, OrbitFamily, each_alone, onward, orbits_of

LEAST_BITS = 64
"""Least precision, bits, of the states at crossings."""
MOST_DECIMALS = 4
"""Largest number of decimals of round phases: 62,832 phases are then tried."""
MOST_SYMBOLS = 50
"""Largest number of symbols in a code whose round phases are sought."""


def address_of(
    body: Body,
    theta2_0: Scalar,
    *,
    h0: Scalar,
    J1_0: Scalar,
    n_symbols: int = 15,
    precisions: Sequence[int] = PRECISIONS,
) -> Address:
    """The address of an orbit of S1-: the inverse of `find_orbit`.

    The orbit is integrated; the address ends before the first symbol that is not certain.

    Parameters
    ----------
    body : Body
    theta2_0 : number
        Initial phase, radians.
    h0, J1_0 : number
        As in `route_codes`.
    n_symbols : int, optional
    precisions : sequence of int, optional
        Bits, ascending.

    Raises
    ------
    MapError
        The orbit leaves the range of the return map, or has none.
    ParameterError, ExactError
        A value is excluded or is no number.
    """
    problem = RouteProblem(body, h0, J1_0, n_symbols)
    phase = checked.number("theta2_0", theta2_0)
    routes = codes_of(problem, [phase], resolve(precisions=precisions), method="integration")
    n = int(np.logical_and.accumulate(routes.certain[:, 0] & (routes.codes[:, 0] < 2)).sum())
    if not n:
        raise MapError("the orbit has no certain symbol")
    # Route codes keep the times of crossings only; the states there come from an integration to
    # these times.
    times = [Fraction(float(t)) for t in routes.crossing_time[: n + 1, 0]]
    bits = max(LEAST_BITS, int(routes.bits[0]))
    begin = start(problem, bits, Scales())
    states = states_exact(begin, [phase], bits)
    there = states_at(begin.coefficients, states, times, bits)[..., 0].astype(float)
    orbits = orbits_of(problem)
    level = ChainLevel(orbits.return_map, orbits.energy(float(phase)))
    # Times are doubles: a step of Newton's method leads to M3 = 0, of which d changes by as little.
    there, _ = on_section(there, level.c.aligned)
    points = section_points(level, np.array(there), level.h, level.c, precision(53))
    return addressed(level, points, routes.codes[:n, 0])


def addressed(level: ChainLevel, points: SectionPoint, symbols: NDArray[np.uint8]) -> Address:
    """The address of n + 1 crossings with n symbols, each followed by the map through one passage.

    MapError is raised where a passage leaves the tables or has another symbol.
    """
    n = len(symbols)
    passed = each_alone(level.map_level, points.d[:n], points.chi[:n])
    wrong = np.flatnonzero(~passed.inside | (passed.symbol != symbols))
    if wrong.size:
        raise MapError(f"passage {wrong[0] + 1} of the orbit lies outside of the return map")
    chi = points.chi[0] + np.concatenate(([0.0], np.cumsum(passed.turned)))
    # The sum gives whole turns only; chi itself is each crossing's own, so that errors do not add
    # up.
    at = points.chi + 2 * np.pi * np.rint((chi - points.chi) / (2 * np.pi))
    return Address.of(at, symbols)


def followed(orbits: OrbitFamily, theta2: float, n: int) -> tuple[Address, Array]:
    """The address of the orbit of a phase through at most n passages, by the map in doubles.

    The second result is chi of its crossings, radians, whole turns included. Both end before the
    first passage that leaves the tables.
    """
    level = ChainLevel(orbits.return_map, orbits.energy(theta2))
    at = level.arriving(*orbits.begin(level)(theta2)[:2])
    symbols, chi = [], [float(at.chi[0])]
    for passed in onward(level.map_level, SectionPoint(True, at.d, at.chi), n):
        if not passed.inside[0]:
            break
        symbols.append(int(passed.symbol[0]))
        chi.append(chi[-1] + float(passed.turned[0]))
    return Address.of(chi, symbols), np.array(chi)


class RoundPhases(NamedTuple):
    """The phases with a number of decimals whose orbits have a code."""

    theta2_0: tuple[Decimal, ...]
    """Radians, ascending in [0, 2 pi)."""
    addresses: tuple[Address | None, ...]
    """The address of each orbit; None where the orbit leaves the return map."""
    tried: int
    """Number of all phases with so many decimals."""
    uncertain: int
    """Number of phases whose symbols, as many as the code has, are not all established."""


def round_phases(
    body: Body,
    code: Code,
    *,
    h0: Scalar,
    J1_0: Scalar,
    decimals: int,
    jobs: int = 1,
) -> RoundPhases:
    """The phases with 0 to 4 decimals whose orbits have a code, or an address, as in `find_orbit`.

    ParameterError or ExactError says which value is excluded or is no number.
    """
    address = parsed(code)
    n = len(address.symbols)
    decimals = checked.whole("decimals", decimals, 0, MOST_DECIMALS)
    if n > MOST_SYMBOLS:
        raise ParameterError(
            "code", f"a code of round phases has at most {MOST_SYMBOLS} symbols, got {n}"
        )
    tried = math.floor(2 * math.pi * 10**decimals) + 1
    phases = [Decimal(k).scaleb(-decimals) for k in range(tried)]
    routes = route_codes(body, phases, h0=h0, J1_0=J1_0, n_symbols=n, jobs=jobs)
    certain = routes.certain.all(axis=0)
    asked = np.array(address.symbols)[:, None]
    found = np.flatnonzero(certain & (routes.codes == asked).all(axis=0))
    problem = RouteProblem(body, h0, J1_0, n)
    kept: dict[Decimal, Address | None] = {}
    for k in found:
        own = _address(problem, phases[k], address.symbols, doubles=routes.bits[k] == 53)
        # The orbit must also have the first cell and the half rotations, if they are asked for.
        parts = (address.first, own and own.first), (address.half_turns, own and own.half_turns)
        if all(asked in (None, mine) for asked, mine in parts):
            kept[phases[k]] = own
    return RoundPhases(tuple(kept), tuple(kept.values()), tried, int((~certain).sum()))


def _address(
    problem: RouteProblem, phase: Decimal, symbols: tuple[int, ...], *, doubles: bool
) -> Address | None:
    """The address of an orbit with known symbols, or None where it leaves the return map.

    `doubles` tells that double precision has decided the symbols, so that the map may follow them.
    """
    try:
        orbits = orbits_of(problem)
        # The map may still follow an orbit that starts outside of its normal form.
        with contextlib.suppress(MapError):
            if doubles:
                own, _ = followed(orbits, float(phase), len(symbols))
                if own.symbols == symbols:
                    return own
        # An orbit that doubles do not follow may have the right symbols by chance in the map, but
        # not the right half rotations: it is integrated.
        return address_of(
            problem.body, phase, h0=problem.h0, J1_0=problem.J1_0, n_symbols=len(symbols)
        )
    except MapError:
        return None
