"""Orbits from their codes: the initial phase theta2_0 on S1- whose orbit has a given address."""

from __future__ import annotations

import math
from dataclasses import replace
from decimal import Decimal
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rigidpend.machine.wording import short
from rigidpend.mechanics.body import Body
from rigidpend.numbers import Array, Scalar, checked
from rigidpend.numbers.checked import ParameterError
from rigidpend.numbers.exact import exact
from rigidpend.orbits.integrate.arithmetic import resolve
from rigidpend.orbits.precision import precision
from rigidpend.routes.codes import codes_of
from rigidpend.routes.phases import DOUBLED, angle
from rigidpend.routes.problem import RouteProblem, narrower
from rigidpend.routes.symbolic.address import Address, Code, parsed
from rigidpend.routes.symbolic.chain import (
    Blurred,
    Chain,
    NoOrbit,
    System,
    alternating,
    passages,
    signs_of,
)
from rigidpend.routes.symbolic.follow import followed
from rigidpend.routes.symbolic.legs import ByEnergy
from rigidpend.routes.symbolic.levels import ChainLevel, OrbitFamily, orbits_of
from rigidpend.routes.symbolic.refine import Refined, refined
from rigidpend.routes.symbolic.shortest import shortest, with_half_turns

SECANTS = 12
"""Largest number of secant steps in the energy."""
SETTLED = 4e-15
"""Change of theta2_0, radians, below which its energy counts as found."""
ASIDE = 1e-3
"""Step in the energy to a chain beside one that is found at once, in units of mu."""
COARSE = 5e-8
"""Displacement of orbits by roundings of a map, radians, from which one beside midlines serves.

Corrections by derivatives that err by so much may leave the last digits of theta2_0 wrong."""
CLOSEST = 1e-60
"""J1_0 over J2_0 of starts so close to the surfaces that these alone limit how thin a layer is."""
MOST_SYMBOLS = 10_000
"""Largest number of symbols in a code."""
DIGITS = 28
"""Digits of theta2_0 behind the point, by default."""
MOST_DIGITS = 200
"""Largest number of digits of theta2_0: the time of an integration grows as their cube."""


class FoundOrbit(NamedTuple):
    """An orbit of S1- with a given address.

    Its last crossing is at gamma3 = 0, in the middle of its cell: the orbit is its own image under
    time reversal there, and returns on the way on which it came. Where no such orbit has the half
    rotations that are asked for, the last crossing is elsewhere in its cell; and where the orbit
    beside which one is sought has the whole code, it stays where that orbit has it.
    """

    theta2_0: Decimal
    """Radians, to `digits` digits behind the point; `route_codes` takes it as it is."""
    address: Address
    digits: int
    fixed: int
    """Number of first symbols that the digits determine."""
    confirmed: int
    """Number of first symbols that integration of the full equations has established."""
    bits: int
    """Precision of that integration, bits."""
    delay: float
    """Largest difference of times t' by integration and by the map, of the crossings refined."""
    passages: int
    """Number of passages with the right symbol, each integrated alone, in 53 or 106 bits."""
    passage_error: float
    """Largest error of the times of these passages, t'."""
    chi: Array
    """(n + 1,) radians: chi of the crossings, whole turns included, by the map."""
    d: Array
    """(n + 1,) the small component Q- or Q+ of the crossings, dimensionless."""
    I: Array
    """(n,) invariants of the passages, dimensionless."""
    crossing_time: Array
    """(n + 1,) t' of the crossings from the start, by the map."""
    residual: float
    """Largest gap where passages meet, in radians or in units of the tables' width."""

    @property
    def symbols(self) -> NDArray[np.uint8]:
        """The symbols, (n,)."""
        return np.array(self.address.symbols, dtype=np.uint8)

    @property
    def word(self) -> str:
        """The symbols as text."""
        return "".join(map(str, self.address.symbols))

    def __repr__(self) -> str:
        return f"<orbit {short(self.word)}; theta2_0 = {self.theta2_0}; {short(self.address)}>"


def find_orbit(
    body: Body,
    code: Code,
    *,
    h0: Scalar,
    J1_0: Scalar,
    near: Scalar | None = None,
    digits: int = DIGITS,
    jobs: int = 1,
) -> FoundOrbit:
    """The orbit of S1-, as in Fig. 4, that has a given route code or address.

    Parameters
    ----------
    body : Body
    code : str, sequence of int, or Address
        Symbols, "0011", or with the half rotations of every passage, "a 0^11 1^10 1^11": see
        `rigidpend.routes.symbolic.address`. Where they are not given, they are as few as an orbit
        can take whose crossings stay away from the borders of their cells.
    h0 : number
        Energy constant, greater than mu.
    J1_0 : number
        Initial action, dimensionless, small beside J2_0.
    near : number, optional
        A phase, radians. Half rotations are taken from its orbit as far as this has the code; an
        orbit that has all of it is found itself, as exactly as the map in doubles knows it.
    digits : int, optional
        Digits of theta2_0 behind the point, 10 to 200. A symbol takes 1.2 or more of them.
    jobs : int, optional
        Number of threads, or of processes beyond 424 bits, that refine the phase and establish its
        symbols. No result depends on it.

    Returns
    -------
    FoundOrbit

    Raises
    ------
    NoOrbit
        There is no such orbit in the range of the return map; the message gives the reason.
    ParameterError, ExactError
        A value is excluded or is no number; the message says which.
    MapError
        The body's orbits have no return map, or J1_0 lies outside of it.

    Examples
    --------
    >>> body = Body(A=(2, 1, "3/2"), r=(1, 1, 0), mu="0.001")
    >>> found = find_orbit(body, "0011", h0="1.3342", J1_0="1e-8")
    >>> str(found.address)
    'b (0^11)*2 (1^11)*2'
    """
    address = parsed(code)
    digits = checked.whole("digits", digits, 10, MOST_DIGITS)
    jobs = checked.whole("jobs", jobs, 1)
    n = len(address.symbols)
    if n > MOST_SYMBOLS:
        raise ParameterError("code", f"a code has at most {MOST_SYMBOLS} symbols, got {n}")
    problem = RouteProblem(body, h0, J1_0, n)
    beside = None if near is None else _phase(near)
    fewer = narrower(problem)
    try:
        return _by_either_map(problem, fewer, address, beside, digits, jobs)
    except Blurred as error:
        # The closer to the surfaces orbits start, the thinner their layer may be.
        closest = replace(problem, J1_0=exact(CLOSEST * float(problem.J2_0(53))))
        if narrower(closest) <= fewer:
            raise
        raise NoOrbit(f"{error}; a smaller J1_0 may help") from None


def _by_either_map(problem: RouteProblem, fewer: int, *task: Any) -> FoundOrbit:
    """The orbit by the map of the whole layer, or by one of a layer `fewer` bits narrower."""
    try:
        orbits = orbits_of(problem)
        if not fewer or ChainLevel(orbits.return_map, problem.h0).displaced(53) < COARSE:
            return _found(orbits, *task)
    except Blurred:
        # Tables of the whole layer are too coarse: those beside midlines are left.
        if not fewer:
            raise
    return _found(orbits_of(problem, fewer), *task)


def _phase(near: Scalar) -> float:
    """The double nearest to a phase, radians; without its whole turns where it is far from zero."""
    phase = checked.number("near", near)
    if not math.isfinite(float(phase)):
        raise ParameterError("near", f"near must be a finite double, got {phase}")
    return float(angle(phase, DOUBLED))


def _found(
    orbits: OrbitFamily, address: Address, near: float | None, digits: int, jobs: int
) -> FoundOrbit:
    """The orbit with an address, by the map of a family."""
    chain, by_energy = _solved(orbits, address, near)
    fine = refined(orbits, chain, by_energy, digits, jobs)
    right, error = passages(chain)
    rising = alternating(len(chain.chi), chain.chi)
    return FoundOrbit(
        **fine._asdict(),
        address=Address.of(chain.chi, address.symbols),
        digits=digits,
        confirmed=_confirmed(orbits.problem, address, fine, jobs),
        passages=int(right.sum()),
        passage_error=float(error[right].max(initial=0.0)),
        chi=chain.chi,
        d=chain.d + chain.level.midlines(rising, chain.chi, chain.level.h, precision(53)),
        I=chain.I,
        residual=float(chain.residual),
    )


def _confirmed(problem: RouteProblem, address: Address, fine: Refined, jobs: int) -> int:
    """Number of first symbols that two integrations of the full equations establish.

    NoOrbit is raised where they establish another symbol than the code's.
    """
    if not fine.fixed:
        return 0
    of = replace(problem, n_symbols=fine.fixed)
    arithmetic = resolve(precisions=(fine.bits,))
    routes = codes_of(of, [fine.theta2_0], arithmetic, jobs, "integration")
    right = routes.codes[:, 0] == np.array(address.symbols[: fine.fixed])
    if not right[routes.certain[:, 0]].all():
        raise NoOrbit("integration of the full equations finds other symbols")
    return int(np.logical_and.accumulate(routes.certain[:, 0] & right).sum())


def _solved(orbits: OrbitFamily, address: Address, near: float | None) -> tuple[Chain, ByEnergy]:
    """The chain of an address at its own energy, and its derivatives in the energy."""
    # The energy of an orbit depends on its theta2_0. A first chain is found at a guess of it.
    if near is None:
        level = ChainLevel(orbits.return_map, orbits.problem.h0)
        return _at_own_energy(orbits, _either(orbits, level, address, math.pi))
    level = ChainLevel(orbits.return_map, orbits.energy(near))
    other, beside = followed(orbits, near, len(address.symbols))
    for each in _nearby(address, other):
        own = beside if (each.symbols, each.half_turns) == other[1:] else None
        try:
            return _at_own_energy(orbits, _either(orbits, level, each, near, own))
        except NoOrbit as error:
            reason = error
    raise reason


def _nearby(address: Address, other: Address) -> list[Address]:
    """Addresses to try in turn, with ever fewer of another orbit's half rotations.

    The first has as many as the symbols of both agree, the last none.
    """
    # Half rotations that are given, or another first cell, leave nothing to take from the orbit.
    if address.half_turns or address.first not in (None, other.first):
        return [address]
    pairs = enumerate(zip(other.symbols, address.symbols, strict=False))
    same = next((k for k, (mine, its) in pairs if mine != its), len(other.symbols))
    turns = other.half_turns or ()
    return [Address(other.first, address.symbols, turns[:k]) for k in range(same, -1, -1)]


def _either(
    orbits: OrbitFamily,
    level: ChainLevel,
    address: Address,
    middle: float,
    beside: Array | None = None,
) -> Chain:
    """The chain from the first cell that is asked for, or from either: that which takes less time.

    The first cell is sought near theta2_0 = `middle`, radians. `beside` is chi of the crossings of
    an orbit with exactly this address, if one is known.
    """
    begin, given = orbits.begin(level), address.half_turns or ()
    system = System(level, begin, signs_of(address.symbols))
    found, reason = [], NoOrbit()
    # chi of the first crossing is close to this plus theta2_0.
    origin = float(level.arriving(*begin(0.0)[:2]).chi[0])
    place = (origin + middle) / math.pi
    # The cell of that place, and its nearer neighbour.
    for cell in (round(place), round(place) + (1 if place > round(place) else -1)):
        if address.first is not None and cell % 2 != address.first:
            continue
        parameter = math.pi * cell - origin
        at = begin(parameter)
        # Starts farther off the surface than this is split meet it at one phase, near any place.
        if far := math.hypot(at.I, at.I_slope) > level.splitting:
            parameter -= math.remainder(math.atan2(at.I, at.I_slope), math.pi)
        try:
            # Some half rotations are free, or all are given.
            if len(given) < len(address.symbols):
                found.append(shortest(system, cell, parameter, given, int(far)))
            else:
                here = beside is not None and round(float(beside[0]) / math.pi) == cell
                own, parameter = (beside, middle) if here else (None, parameter)
                found.append(with_half_turns(system, cell, parameter, given, own))
        except NoOrbit as error:
            reason = error
    if not found:
        raise reason
    return min(found, key=lambda each: float(each.time.sum()))


def _at_own_energy(orbits: OrbitFamily, made: Chain) -> tuple[Chain, ByEnergy]:
    """The chain at the energy that belongs to its own theta2_0, by secants in the energy.

    The second result are derivatives in the energy along chains with this last crossing.
    """
    # Solves energy(theta(h)) = h, where theta(h) is the phase of the chain at the energy h.
    signs, cells = np.sign(made.I).astype(int), made.cells
    beside, h, theta, slope = made, made.level.h, made.parameter, 0.0
    for _ in range(SECANTS):
        off = orbits.energy(theta) - h
        step = off / (1 - orbits.energy_slope(theta) * slope)
        if abs(step) < 2e-16 * abs(h):
            break
        h, before, other = h + step, theta, made
        level = ChainLevel(orbits.return_map, h)
        system = System(level, orbits.begin(level), signs, float(made.chi[-1]))
        made = system.solved(made.unknowns).in_cells(cells)
        theta = made.parameter
        # Shorter steps would make the difference one of roundings.
        if abs(step) > 1e-9 * abs(h):
            slope, beside = (theta - before) / step, other
        if abs(theta - before) < SETTLED:
            break
    if abs(beside.level.h - h) <= 1e-9 * abs(h):
        # The guess was the orbit itself, or nearly: a phase to which it is near was given.
        step = math.copysign(ASIDE * float(orbits.problem.body.mu), float(orbits.problem.h0) - h)
        level = ChainLevel(orbits.return_map, h + step)
        system = System(level, orbits.begin(level), signs, float(made.chi[-1]))
        beside = system.solved(made.unknowns)
    return made, ByEnergy.between(beside, made)
