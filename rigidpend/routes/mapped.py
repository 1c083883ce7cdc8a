"""Crossings of the orbits of Fig. 4 by return maps instead of integration.

Three maps of different design take the places of integrations in other units, in 53 and 64
bits: their tables differ in orders, nodes, arcs and units, so they share neither truncation nor
rounding. Their energies are those of all phases, h0 + mu sin(theta2_0) and the like.
"""

from __future__ import annotations

import contextlib
import functools
import math
import threading
import warnings
from collections.abc import Callable
from typing import Any, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from rigidpend.machine.workers import side_by_side
from rigidpend.mechanics.body import Angles
from rigidpend.mechanics.coordinates import Canonical, aligned_from_canonical
from rigidpend.mechanics.equations import height
from rigidpend.numbers.exact import GUARD_BITS, exact
from rigidpend.orbits.integrate.records import Crossings, Outcome, no_crossings
from rigidpend.orbits.return_map import MapError, ReturnMap, kernel, return_map
from rigidpend.orbits.return_map.build import (
    FIRST,
    SECOND,
    THIRD,
    Costly,
    Design,
    expected_cost,
    is_kept,
)
from rigidpend.orbits.return_map.itinerary import entry_phase
from rigidpend.orbits.return_map.precision import precision
from rigidpend.orbits.return_map.program import Program
from rigidpend.routes import certainty
from rigidpend.routes.certainty import Decided
from rigidpend.routes.cycle import symbols
from rigidpend.routes.phases import Phases
from rigidpend.routes.problem import RouteProblem, passage_rotations
from rigidpend.routes.start import Scales

BLOCK = 2048
"""Orbits at a time: their rows then stay in a core's own memory."""
THIRDS = 100_000
"""Orbits from which on a third map is cheaper than one of more bits for one orbit in seven.

Its tables take 0.3 s of a core and more; it saves 0.8 microseconds an orbit in this call and in
those that follow."""
SAMPLE = 64
"""Number of orbits that are integrated as well in doubles, and compared, unless maps are kept."""
LEAST_SAMPLE = 8
"""Number of them in each part of the orbits, at least, and of those in one more precision."""

SHARPER, SHARPEST = 64, 80
"""Bits of the maps that decide what those in doubles leave open, in pairs of doubles.

Those of most bits are made where the others leave so many orbits open that this pays, and at once
where this is expected."""
DEEP = 9.5
"""Rotations in a passage from which on it is.

Of 35 bodies drawn by lot maps of 64 bits left 0.2 to 7 % of the orbits open at 9 to 14 rotations,
and 0 to 0.5 % below, where sharper tables, which cost twice as much, would not pay."""
UNKEPT = 0.8
"""Seconds of a core for the tables of the three designs of Fig. 4, where they are not kept yet."""
SYMBOL, ROTATION, MAPPED = 3e-6, 1e-6, 0.5e-6
"""Seconds of a core a symbol takes: by integration, beside what each rotation takes; by maps.

Measured on 17 bodies drawn by lot, twice in doubles, at 1.4 to 151 rotations a passage, on a busy
machine: integration took some 0.8 to 1.4 times as long."""
PAIRS = 11
"""Factor by which deciding an orbit in pairs of doubles takes longer: 8.5 to 12.6 with 6 bodies."""
FURTHER = 4
"""Factor by which orbits that maps leave open take longer than one computation in pairs.

Of 446 and 623 such orbits of two bodies 15 to 23 % took two or three computations, and 7 and 19 %
quadruples of doubles besides, ten times as slow: 4.4 and 3.5 times as long in all."""
SLOW, LONG = 100e-6 / 15, 1.0
"""Seconds a symbol, and in all, from which on it is said that orbits are integrated."""
STAKE = 2
"""Time that tables may take over that which they are expected to save.

They are kept: the next calls with the same body have them for nothing."""
DESIGNS = {certainty.FIRST: FIRST, certainty.SECOND: SECOND, certainty.THIRD: THIRD}
"""The map in the place of an integration in some scales, with the same unit of M."""

Compute: TypeAlias = Callable[[int, Scales, Any], Crossings]


class Starts(NamedTuple):
    """Starts whose J1_0 differ."""

    J1_0: NDArray[np.float64]
    """(n,), exact doubles in the place of the problem's, which is the largest."""
    least: float
    """Least J1_0 of all."""
    orbits: int
    """Number of orbits in all, if these are a part."""


class SlowRoutesWarning(UserWarning):
    """Warning of many orbits that are integrated, with the reason."""


def told(problem: RouteProblem, orbits: int, reason: str) -> None:
    """Say at once why many orbits take long, if integrating them is expected to."""
    each = _integrated(problem)
    _warned(problem, orbits, orbits, each, f"there are no return maps: {reason}")


def _warned(problem: RouteProblem, orbits: int, of: int, each: float, reason: str) -> None:
    """Warn if some of all orbits, of so many seconds each, make all of them slow."""
    if orbits * each > max(LONG, SLOW * problem.n_symbols * of):
        warnings.warn(
            f"{orbits} of {of} orbits are integrated, {1e6 * each:.2g} microseconds each on a core,"
            f" some {orbits * each:.2g} s in all: {reason}",
            SlowRoutesWarning,
            stacklevel=2,
        )


def _integrated(problem: RouteProblem) -> float:
    """Seconds of a core that an orbit takes by integration."""
    rotations = passage_rotations(problem)
    # The share of orbits that doubles leave open: as 14 bodies at 2.7 to 555 rotations had it
    # within a factor of 3. A wrong guess costs time and no symbol.
    beyond = min(0.003 * rotations**2, 0.03 * rotations, 1.0)
    return problem.n_symbols * (SYMBOL + ROTATION * rotations) * (1 + PAIRS * beyond)


def budget(problem: RouteProblem, orbits: int) -> float:
    """Seconds of a core that the tables of all designs may take, if they are to pay."""
    return STAKE * orbits * (_integrated(problem) - MAPPED * problem.n_symbols)


def budget_in_pairs(problem: RouteProblem, orbits: float) -> float:
    """The same for orbits that would be integrated in pairs of doubles."""
    return STAKE * orbits * _in_pairs(problem)


def _in_pairs(problem: RouteProblem) -> float:
    """Seconds of a core that an orbit takes in pairs of doubles."""
    return problem.n_symbols * PAIRS * (SYMBOL + ROTATION * passage_rotations(problem))


def beyond_maps(problem: RouteProblem) -> float:
    """Seconds of a core that an orbit takes whose symbols ask for more bits than maps have."""
    return FURTHER * _in_pairs(problem)


def wanted(problem: RouteProblem) -> tuple[int, ...]:
    """Bits of the tables that a problem's orbits ask for; fewer where these do not settle."""
    more = (SHARPEST,) if passage_rotations(problem) >= DEEP else ()
    return *more, SHARPER, 53


def expected_seconds(problem: RouteProblem, orbits: int) -> float:
    """Seconds of a core that so many orbits of one body are expected to take.

    By maps that are not kept yet, tables included, where they pay; else by integration.
    """
    most, mapped = budget(problem, orbits), MAPPED * orbits * problem.n_symbols
    designs = DESIGNS.values() if orbits >= THIRDS else (FIRST, SECOND)
    try:
        which = problem.body, *problem.energies, wanted(problem)[0]
        tables = sum(expected_cost(*which, design) for design in designs)
    except MapError:
        tables = math.inf
    return tables + mapped if tables <= most else orbits * _integrated(problem)


class Maps:
    """Return maps for orbits that start with J2_0 = sqrt(2 h0/kappa), as in Fig. 4.

    Parameters
    ----------
    problem : RouteProblem
    phases : Phases
        theta2_0 of the orbits.
    starts : Starts, optional
        Where J1_0 differs from orbit to orbit.
    jobs : int, optional
        Threads, for the making of the maps.
    least_time : bool, optional
        Whether maps are wanted only where they are expected to take less than integration.
    kept : bool, optional
        Whether only maps are wanted that were built before.

    Raises
    ------
    MapError
        The body's orbits have no such map, none that pays, or none that is kept, or J1_0 is too
        large to begin in the normal form.
    """

    def __init__(
        self,
        problem: RouteProblem,
        phases: Phases,
        starts: Starts | None = None,
        *,
        jobs: int = 1,
        least_time: bool = False,
        kept: bool = False,
    ) -> None:
        self.problem, self.phases, self.starts = problem, phases, starts
        self.orbits = starts.orbits if starts else len(phases)
        self._lock, self._ready = threading.Lock(), dict[tuple[int, Design], Program]()
        self._jobs, self._budgets = jobs, dict[tuple[int, Design], float]()
        self.designs = list(DESIGNS.values())[: 3 if self.orbits >= THIRDS else 2]
        self.kept = kept
        self._settle(budget(problem, self.orbits) if least_time else math.inf)
        for scales in (certainty.FIRST, certainty.SECOND):
            # The first crossing shows whether starts lie in the range of the normal form; where an
            # orbit goes from there is its own affair.
            if not self.crossings(53, scales, np.arange(1)).separatrix[0, 0]:
                raise MapError(f"J1_0 = {problem.J1_0} lies outside of the normal form")

    def _settle(self, most: float) -> None:
        """Make the maps, of as many bits as are wanted or of the next that settle and pay."""
        *more, self.table_bits = wanted(self.problem)
        for bits in more:
            with contextlib.suppress(MapError):
                self._make(bits, most)
                self.table_bits = bits
                return
        self._make(self.table_bits, most)

    def _make(self, bits: int, most: float, used: list[Design] | None = None) -> None:
        """Make maps side by side, of all designs in use, if they are expected to take no more."""
        used = used or self.designs
        which = self.problem.body, *self.problem.energies, bits
        if self.kept and not all(is_kept(*which, design) for design in used):
            raise MapError("none is kept")
        if most < math.inf:
            costs = [
                expected_cost(self.problem.body, *self.problem.energies, bits, x) for x in used
            ]
            if sum(costs) > most:
                raise Costly(sum(costs), most)
            for design, each in zip(used, costs, strict=True):
                self._budgets[bits, design] = most * each / sum(costs)
        side_by_side(self.made, (bits,), False, used, self._jobs)

    def sharpen(self, share: float) -> bool:
        """Make maps of more bits, if they pay where a share of the orbits is left open."""
        if self.table_bits == SHARPER:
            with contextlib.suppress(MapError):
                most = budget_in_pairs(self.problem, share * self.orbits)
                self._make(SHARPEST, most)
                self.table_bits = SHARPEST
        return self.table_bits == SHARPEST

    def add_third(self, share: float) -> bool:
        """Make a third map, if it pays for a share of the orbits that would be integrated."""
        with self._lock:
            if THIRD not in self.designs:
                with contextlib.suppress(MapError):
                    most = budget_in_pairs(self.problem, share * self.orbits)
                    self._make(self.table_bits, most, [THIRD])
                    self.designs.append(THIRD)
            return THIRD in self.designs

    def ladder(self, precisions: tuple[int, ...]) -> tuple[int, ...]:
        """The precisions with that of the tables among them, which costs maps next to nothing."""
        more = self.table_bits not in precisions and self.table_bits < max(precisions)
        return tuple(sorted((*precisions, self.table_bits))) if more else precisions

    def serve(self, bits: int, scales: Scales) -> bool:
        """True if there is such a map."""
        return bits <= self.table_bits and DESIGNS.get(scales) in self.designs

    def crossings(self, bits: int, scales: Scales, columns: Any) -> Crossings:
        """The crossings of some columns in t'; FAILED where an orbit leaves the tables."""
        design, program = DESIGNS[scales], self._program(bits, DESIGNS[scales])
        blocks = [columns[k : k + BLOCK] for k in range(0, len(columns), BLOCK)] or [columns]
        parts = [self._follow(program, bits, design, block) for block in blocks]
        time, separatrix = (np.concatenate(x, axis=1) for x in zip(*parts, strict=True))
        outcome = np.where(separatrix[-1] != 0, Outcome.COMPLETE, Outcome.FAILED)
        return Crossings(time, separatrix, outcome.astype(np.uint8))

    def made(self, design: Design, bits: int) -> ReturnMap:
        """The map of a design over the energies of all phases."""
        return return_map(
            self.problem.body,
            h=self.problem.energies,
            bits=bits,
            design=design,
            budget=self._budgets.get((bits, design), math.inf),
        )

    def _program(self, bits: int, design: Design) -> Program:
        """The map of a design, ready for use."""
        # Threads ask for the same map: one makes it, and the others wait.
        with self._lock:
            if (bits, design) not in self._ready:
                made = self.made(design, self.table_bits)
                least, most = (
                    start_Qp(self.problem, design.unit, made.bits, J1)
                    for J1 in (self.starts.least if self.starts else None, None)
                )
                self._ready[bits, design] = made.program(bits, least, most)
            return self._ready[bits, design]

    def _follow(self, program: Program, bits: int, design: Design, columns: Any) -> tuple[Any, Any]:
        """Times (n + 1, N) in t' and separatrices; NaN and 0 where the tables end."""
        J1 = self.starts.J1_0[columns] if self.starts else None
        Qp = start_Qp(self.problem, design.unit, bits, J1)
        phase, height = self._begin(bits, design, J1, columns)
        found = kernel.follow(program, Qp + 0 * phase, phase, height, self.problem.n_symbols + 1)
        return found.time * _unit(design.unit, 53), found.separatrix

    def _begin(self, bits: int, design: Design, J1_0: Any, columns: Any) -> tuple[Any, Any]:
        """The phase of entry, and the energy less h0 in units of mu, (N,) each.

        Phases are rounded at another place in each design; what that loses goes to the rest.
        """
        a, theta2 = precision(bits), self.phases.high[columns]
        p, J2, J1 = _constants(self.problem, bits)
        shifted = theta2 + design.origin
        # Knuth's two-sum: what rounding the sum has lost, exactly.
        back = shifted - design.origin
        lost = (theta2 - back) + (design.origin - (shifted - back))
        rest = a.array(self.phases.rest[columns] + lost)
        cos, sin = a.cos(a.array(shifted)), a.sin(a.array(shifted))
        cos, sin = cos - rest * sin, sin + rest * cos
        J1 = J1 if J1_0 is None else a.array(J1_0)
        # The height is linear in the cosine and the sine of the phase.
        along, across = (
            height(J1, J2, (p.alpha0 + p.beta0, x - design.origin), a)
            for x in (a.number(0.0), a.pi / 2)
        )
        return entry_phase(cos, sin, p.beta0, a) + design.origin, along * cos + across * sin


class Constants(NamedTuple):
    """A problem's numbers, each rounded once to a precision."""

    angles: Angles
    J2_0: Any
    J1_0: Any


@functools.lru_cache(maxsize=16)
def _constants(problem: RouteProblem, bits: int) -> Constants:
    a, guarded = precision(bits), bits + GUARD_BITS
    angles = Angles(*map(a.number, problem.body.angles(guarded)))
    return Constants(angles, a.number(problem.J2_0(guarded)), a.number(problem.J1_0.at(guarded)))


@functools.cache
def _unit(unit: str, bits: int) -> Any:
    """A design's unit of M in a precision."""
    return precision(bits).number(exact(unit).at(bits + GUARD_BITS))


def start_Qp(problem: RouteProblem, unit: str, bits: int, J1_0: Any = None) -> Any:
    """Qp of starts in units of a design, for the problem's J1_0 or for doubles in its place."""
    return _own_Qp(problem, unit, bits) if J1_0 is None else _Qp(problem, unit, bits, J1_0)


@functools.lru_cache(maxsize=16)
def _own_Qp(problem: RouteProblem, unit: str, bits: int) -> Any:
    return _Qp(problem, unit, bits, None)


def _Qp(problem: RouteProblem, unit: str, bits: int, J1_0: Any) -> Any:
    a, (p, J2, J1) = precision(bits), _constants(problem, bits)
    J1 = J1 if J1_0 is None else a.array(J1_0)[()]
    begin = Canonical(J1, J2 - J1, 0, p.alpha0 + p.beta0, 0 * J1, 0, 1)
    return _unit(unit, bits) * aligned_from_canonical(begin, p.alpha0, p.beta0, a).Qp


class Mapped(NamedTuple):
    """Crossings that maps have found, with what is known of them."""

    decided: Decided
    by_map: NDArray[np.bool_]
    """(n,), False where an orbit was integrated after all, for some or all of its way."""


def decided(
    integrated: Compute,
    problem: RouteProblem,
    phases: Phases,
    rate: float,
    precisions: tuple[int, ...],
    share: certainty.Share | None = None,
    *,
    jobs: int = 1,
    least_time: bool = False,
    kept: bool = False,
    sampled: bool = True,
) -> Mapped:
    """Decide as `certainty.decide`, with maps in the places of integrations.

    Parameters
    ----------
    integrated : callable
        ``integrated(bits, scales, columns)`` gives the crossings of those columns in t'.
    problem : RouteProblem
    phases : Phases
    rate : float
        Radians per unit of t'.
    precisions : tuple of int
        Bits, ascending from 53.
    share : callable, optional
        See `certainty.decide`.
    jobs, least_time, kept
        See :class:`Maps`.
    sampled : bool, optional
        Whether a sample is integrated as well.

    Raises
    ------
    MapError
        The orbits have no map, or none that pays.
    Contradiction
        A certain symbol is another one by integration.
    """
    maps = Maps(problem, phases, jobs=jobs, least_time=least_time, kept=kept)
    return decided_by(maps, integrated, rate, precisions, share, sampled=sampled)


def decided_by(
    maps: Maps,
    integrated: Compute,
    rate: float,
    precisions: tuple[int, ...],
    share: certainty.Share | None = None,
    *,
    sampled: bool = True,
) -> Mapped:
    """Decide all orbits of some maps: :func:`decided` without their making.

    What maps leave open is integrated if the precisions go beyond theirs, and compared with what
    they found last. A sample is integrated as well, unless
    the flags alone are on trial.
    """
    n, within = len(maps.phases), tuple(p for p in maps.ladder(precisions) if p <= maps.table_bits)
    compute, left = with_maps(maps, integrated, n, precisions)
    known = certainty.decide(compute, n, rate, within, share)
    open_ = np.flatnonzero(~known.certain.all(axis=0))
    beyond = tuple(p for p in precisions if p > SHARPEST)
    if open_.size and beyond and SHARPEST not in within and maps.sharpen(open_.size / n):
        certainty.climb(compute, known, open_, rate, (SHARPEST,))
        open_ = np.flatnonzero(~known.certain.all(axis=0))
    beyond = tuple(p for p in precisions if p > maps.table_bits)
    if open_.size and beyond:
        left[open_] = True
        # Parts of a plane would say so again and again.
        if n == maps.orbits:
            reason = f"their symbols ask for more than the {maps.table_bits} bits of the maps"
            _warned(maps.problem, open_.size, n, beyond_maps(maps.problem), reason)
        certainty.climb(integrated, known, open_, rate, beyond)
    if sampled:
        # Doubles decide at least the first symbols of each; what is beyond them takes long.
        samples = (SAMPLE, precisions[:1]), (LEAST_SAMPLE, precisions[:2])
        for size, ladder in samples[maps.kept :]:
            here = max(LEAST_SAMPLE, -(-size * n // maps.orbits))
            wrong = contradicted(known, integrated, rate, ladder, here)
            if wrong.size:
                raise certainty.Contradiction(_alarm(maps, wrong))
    return Mapped(known, (known.bits <= maps.table_bits) & ~left)


def with_maps(
    maps: Maps, integrated: Compute, n: int, precisions: tuple[int, ...]
) -> tuple[Compute, NDArray[np.bool_]]:
    """Computations of n columns by maps, and by integration where these do not serve.

    Nothing is integrated but in the precisions that are given. The second result tells, when all
    is done, which columns were integrated for leaving tables.
    """
    left = np.zeros(n, dtype=bool)

    def compute(bits: int, scales: Scales, columns: Any) -> Crossings:
        if not maps.serve(bits, scales):
            if scales != certainty.THIRD or bits >= max(precisions):
                return integrated(bits, scales, columns)
            if bits < maps.table_bits or not maps.add_third(len(columns) / n):
                # The next precision settles them, by one computation.
                return no_crossings(maps.problem.n_symbols + 1, len(columns))
        found = maps.crossings(bits, scales, columns)
        outside = np.flatnonzero(found.outcome != Outcome.COMPLETE)
        if outside.size and bits in precisions:
            left[columns[outside]] = True
            certainty.put(found, outside, integrated(bits, scales, columns[outside]))
        return found

    return compute, left


def _alarm(maps: Maps, wrong: NDArray[np.intp]) -> str:
    """Sentence about orbits of a sample of which maps and integration find other symbols."""
    first = wrong[0]
    J1 = maps.starts.J1_0[first] if maps.starts else maps.problem.J1_0
    return (
        "return maps and integration call different symbols certain, so that neither is to be"
        f" believed: of a sample {wrong.size} differ, the first at theta2_0 ="
        f" {maps.phases.high[first]} and J1_0 = {J1}; please report it (precisions that do not"
        " begin with 53 do without maps)"
    )


def contradicted(
    known: Decided, integrated: Compute, rate: float, precisions: tuple[int, ...], size: int
) -> NDArray[np.intp]:
    """Integrate a sample of the columns; those of which a certain symbol is another one."""
    n = len(known.bits)
    # Evenly spread and not by lot: the same sample in every run.
    sample = np.unique(np.linspace(0, n - 1, min(n, size)).astype(int))
    again = certainty.decide(
        lambda bits, scales, columns: integrated(bits, scales, sample[columns]),
        sample.size,
        rate,
        precisions,
    )
    both = again.certain & known.certain[:, sample]
    differ = symbols(again.crossings.separatrix) != symbols(known.crossings.separatrix[:, sample])
    return sample[(both & differ).any(axis=0)]
