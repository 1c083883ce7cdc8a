"""Round phases of a code: those of few decimals whose orbits have it.

Thousands of intervals of theta2_0 belong to a code of five symbols, so that the code alone names
no orbit. What is found by trying phases one after the other is a round one in such an interval.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from decimal import Decimal
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rigidpend.mechanics.body import Body
from rigidpend.numbers import checked
from rigidpend.numbers.generic import Scalar
from rigidpend.orbits.return_map import MapError
from rigidpend.routes.codes import route_codes
from rigidpend.routes.problem import ProblemError, RouteProblem
from rigidpend.routes.symbolic.address import Address, AddressError, parsed
from rigidpend.routes.symbolic.follow import address_of, followed
from rigidpend.routes.symbolic.surface import surface

IN_DOUBLES = 53
"""Bits of doubles."""
MOST_DECIMALS = 4
"""At most 62,832 phases are tried."""
MOST_SYMBOLS = 50


class RoundPhases(NamedTuple):
    """The phases of so many decimals whose orbits have a code."""

    theta2_0: tuple[Decimal, ...]
    """Radians, ascending in [0, 2 pi)."""
    addresses: tuple[Address | None, ...]
    """The address of each; None where the orbit leaves the return map."""
    tried: int
    """Number of phases with so many decimals."""
    uncertain: int
    """Number of these whose symbols, as many as the code has, are not all established."""


def round_phases(
    body: Body,
    code: str | Sequence[int] | NDArray[np.integer[Any]] | Address,
    *,
    h0: Scalar,
    J1_0: Scalar,
    decimals: int,
    jobs: int = 1,
) -> RoundPhases:
    """The phases of few decimals whose orbits have a code, or an address.

    Parameters
    ----------
    body : Body
    code : str, sequence of int, or Address
        As in `find_orbit`.
    h0, J1_0 : number
        As in `route_codes`.
    decimals : int
        Decimals of the phases, 0 to 4.
    jobs : int, optional
        Threads.

    Raises
    ------
    AddressError, ProblemError, ExactError
        A value that is excluded or that is no number; the message says which.
    """
    address = parsed(code)
    n = len(address.symbols)
    decimals = checked.whole("decimals", decimals, 0, MOST_DECIMALS, ProblemError)
    if n > MOST_SYMBOLS:
        raise AddressError(f"a code of round phases has at most {MOST_SYMBOLS} symbols, got {n}")
    tried = math.floor(2 * math.pi * 10**decimals) + 1
    phases = [Decimal(k).scaleb(-decimals) for k in range(tried)]
    routes = route_codes(body, phases, h0=h0, J1_0=J1_0, n_symbols=n, jobs=jobs)
    certain = routes.certain.all(axis=0)
    asked = np.array(address.symbols)[:, None]
    found = np.flatnonzero(certain & (routes.codes == asked).all(axis=0))
    problem = RouteProblem(body, h0, J1_0, n)
    each = {
        phases[k]: _address(
            problem, phases[k], address.symbols, in_doubles=routes.bits[k] <= IN_DOUBLES
        )
        for k in found
    }
    kept = {phase: own for phase, own in each.items() if _meant(address, own)}
    return RoundPhases(tuple(kept), tuple(kept.values()), tried, int((~certain).sum()))


def _address(
    problem: RouteProblem, phase: Decimal, symbols: tuple[int, ...], *, in_doubles: bool
) -> Address | None:
    """The address of an orbit whose symbols are known, as are the bits that decided them."""
    try:
        if in_doubles:
            own, _ = followed(surface(problem), float(phase), len(symbols))
            if own.symbols == symbols:
                return own
        # Beyond what doubles follow their symbols may still be right by chance, their turns not.
        return address_of(
            problem.body, phase, h0=problem.h0, J1_0=problem.J1_0, n_symbols=len(symbols)
        )
    except MapError:
        return None


def _meant(asked: Address, own: Address | None) -> bool:
    """True if an orbit with the symbols that are asked for has the rest of the address too."""
    if own is None:
        return asked.first is None and asked.half_turns is None
    given = own.first if asked.first is None else asked.first, asked.half_turns or own.half_turns
    return given == (own.first, own.half_turns)
