"""Orbits from their codes: the initial phase theta2_0 on S1- whose orbit has a given address."""

from __future__ import annotations

import math
from collections.abc import Sequence
from decimal import Decimal
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rigidpend.body import Body
from rigidpend.numbers.exact import Exact, exact
from rigidpend.routes.problem import ProblemError, RouteProblem
from rigidpend.symbolic.address import Address, AddressError, parsed
from rigidpend.symbolic.chain import NoOrbit, signs_of
from rigidpend.symbolic.follow import followed
from rigidpend.symbolic.refine import Refined, refined
from rigidpend.symbolic.shortest import Path, path, shortest
from rigidpend.symbolic.surface import SECANTS, SETTLED, Surface, surface
from rigidpend.symbolic.tables import Array, Level

MOST_SYMBOLS = 10_000
DIGITS = 30
MOST_DIGITS = 200
"""Largest number of digits of theta2_0: the orbit is integrated in as many, to their cube slower."""


class FoundOrbit(NamedTuple):
    """An orbit of S1- with a given address, which ends where it is its own image in time.

    Its last crossing is at gamma3 = 0, in the middle of its cell: the orbit comes back there on
    the reversed way.
    """

    theta2_0: Decimal
    """Radians, to `digits` digits behind the point; `route_codes` takes it as it is."""
    address: Address
    digits: int
    fixed: int
    """Number of the first symbols that so many digits of theta2_0 determine."""
    integrated: int
    """Number of the first crossings that integration of the full equations has confirmed."""
    bits: int
    """Precision of that integration."""
    delay: float
    """Largest |t'| between a confirmed crossing's time by integration and by the map."""
    chi: Array
    """(n + 1,) radians: chi of the crossings, whole turns included, by the map."""
    d: Array
    """(n + 1,) the small component Q- or Q+ of the crossings, dimensionless."""
    I: Array
    """(n,) invariants of the passages, dimensionless."""
    crossing_time: Array
    """(n + 1,) t' of the crossings from the start, by the map."""
    residual: float
    """Largest disagreement where passages meet, radians or shares of the tables' width."""

    @property
    def symbols(self) -> NDArray[np.uint8]:
        """The symbols, (n,)."""
        return np.array(self.address.symbols, dtype=np.uint8)


class Solved(NamedTuple):
    """A path at its own energy."""

    path: Path
    level: Level
    by_energy: float
    """Derivative of theta2_0 in the energy, at a given end."""


def find_orbit(
    body: Body,
    code: str | Sequence[int] | Address,
    *,
    h0: Exact | float | str,
    J1_0: Exact | float | str,
    near: Exact | float | str | None = None,
    digits: int = DIGITS,
) -> FoundOrbit:
    """The orbit of Fig. 4's kind whose route code, or address, is given.

    Parameters
    ----------
    body : Body
    code : str, sequence of int, or Address
        Symbols, "0011", or with the half rotations of every passage, "a 0^9 0^10 1^9 1^11": see
        `rigidpend.symbolic.address`. Where they are free they are as few as an orbit with room
        around its crossings can take.
    h0 : number
        Energy constant, greater than mu.
    J1_0 : number
        Initial action, dimensionless, small beside J2_0.
    near : number, optional
        A phase, radians: half rotations are taken from its orbit as far as that has the code.
    digits : int, optional
        Digits of theta2_0 behind the point, 10 to 200. Some 2 symbols take a digit.

    Returns
    -------
    FoundOrbit

    Raises
    ------
    NoOrbit
        There is no such orbit in the range of the return map; the message gives the reason.
    AddressError, ProblemError, ExactError
        A value that is excluded or that is no number; the message says which.
    MapError
        The body's orbits have no return map, or J1_0 lies outside of it.

    Examples
    --------
    >>> body = Body(A=(2, 1, "3/2"), r=(1, 1, 0), mu="0.001")
    >>> found = find_orbit(body, "0011", h0="1.3342", J1_0="1e-8")
    >>> str(found.address)
    'a 0^9 0^9 1^9 1^9'
    """
    address = parsed(code)
    if not 10 <= digits <= MOST_DIGITS:
        raise ProblemError("digits", f"digits must be 10 to {MOST_DIGITS}, got {digits}")
    n = len(address.symbols)
    if n > MOST_SYMBOLS:
        raise AddressError(f"a code has at most {MOST_SYMBOLS} symbols, got {n}")
    problem = RouteProblem(body, exact(h0), exact(J1_0), n)
    orbits = surface(problem)
    solved = _solved(orbits, address, None if near is None else exact(near))
    return _record(solved, address, refined(orbits, solved, digits), digits)


def _record(solved: Solved, address: Address, fine: Refined, digits: int) -> FoundOrbit:
    made = solved.path
    first = int(made.cells[0]) % 2
    return FoundOrbit(
        fine.theta2_0,
        Address(first, address.symbols, made.half_turns),
        digits,
        fine.fixed,
        0,
        fine.bits,
        fine.delay,
        made.chain.chi,
        made.chain.d,
        made.chain.I,
        fine.crossing_time,
        made.chain.residual,
    )


def _solved(orbits: Surface, address: Address, near: Exact | None) -> Solved:
    """The path of an address at its own energy, which depends on theta2_0."""
    h0 = float(orbits.problem.h0)
    level = orbits.level(h0)
    given: tuple[int, ...] = address.half_turns or ()
    first = address.first
    if near is not None:
        other = followed(orbits, float(near), len(address.symbols))
        same = other.agreeing(address.symbols)
        if first is None:
            first = other.first
        if not given and first == other.first:
            given = other.half_turns[:same]
    made = _either(orbits, level, address, first, given, near)
    return _at_own_energy(orbits, made, h0, level)


def _either(
    orbits: Surface,
    level: Level,
    address: Address,
    first: int | None,
    given: tuple[int, ...],
    near: Exact | None,
) -> Path:
    """The path from the first cell that is asked for, or from the one that takes less time."""
    signs, begin = signs_of(np.array(address.symbols)), orbits.begin(level)
    found, reason = [], None
    # From chi at theta2_0 = 0 the first cells within a turn of theta2_0 follow.
    origin = float(level.crossings(*_lower(begin(0.0).I, begin(0.0).b)).chi[0])
    base = 0.0 if near is None else float(near) % (2 * math.pi) - math.pi
    lowest = math.ceil((origin + base) / math.pi)
    for cell in (lowest, lowest + 1):
        if first is not None and cell % 2 != first:
            continue
        try:
            unknown = math.pi * cell - origin
            found.append(shortest(level, begin, signs, cell, unknown, given))
        except NoOrbit as error:
            reason = error
    if not found:
        raise NoOrbit(str(reason))
    return min(found, key=lambda each: float(each.chain.time.sum()))


def _lower(I: float, b: float) -> tuple[NDArray[np.bool_], NDArray[np.bool_], Array, Array]:
    """A passage past the lower orbit that ends in an upward crossing."""
    return np.array([True]), np.array([False]), np.array([I]), np.array([b])


def _at_own_energy(orbits: Surface, made: Path, h: float, level: Level) -> Solved:
    """The path where theta2_0 and the energy belong together, by secants in the energy."""
    problem, signs = orbits.problem, signs_of(np.array(made_symbols(made)))
    del problem

    def solve(level: Level, made: Path) -> Path:
        return path(level, orbits.begin(level), signs, made.cells, made.chain.unknown)

    theta, slope = made.chain.unknown, 0.0
    for _ in range(SECANTS):
        off = orbits.energy(theta) - h
        step = off / (1 - orbits.energy_slope(theta) * slope)
        if abs(step) < 2e-16 * abs(h):
            break
        h, before = h + step, theta
        level = orbits.level(h)
        made = solve(level, made)
        theta = made.chain.unknown
        if abs(step) > 1e-9 * abs(h):
            slope = (theta - before) / step
        if abs(theta - before) < SETTLED:
            break
    return Solved(made, level, slope)


def made_symbols(made: Path) -> list[int]:
    """The symbols of a path."""
    return [int((I > 0) == (k % 2 == 0)) for k, I in enumerate(made.chain.I)]
