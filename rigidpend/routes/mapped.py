"""Crossings of the orbits of Fig. 4 by return maps instead of integration.

Two maps of different design take the places of two integrations in other units, in 53 and 64
bits: their tables
differ in orders, nodes, arcs and units, so they share neither truncation nor rounding. Their
energies are those of all phases, h0 + mu sin(theta2_0) and the like.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from rigidpend.equations import hamiltonian_J3_0
from rigidpend.integrate.records import Crossings, Outcome
from rigidpend.numbers.exact import GUARD_BITS, context, exact
from rigidpend.return_map import MapError, ReturnMap, return_map
from rigidpend.return_map.build import FIRST, SECOND
from rigidpend.return_map.itinerary import enter, entry_phase, follow
from rigidpend.return_map.precision import native, precision
from rigidpend.routes import certainty
from rigidpend.routes.certainty import Decided
from rigidpend.routes.cycle import symbols
from rigidpend.routes.phases import Phases
from rigidpend.routes.problem import RouteProblem
from rigidpend.routes.start import Scales, start

BLOCK = 500
"""Orbits at a time: their tables then take some 6 MB."""
SAMPLE = 64
"""Number of orbits that are integrated as well and compared."""

DESIGNS = {certainty.FIRST: FIRST, certainty.SECOND: SECOND}

Compute: TypeAlias = Callable[[int, Scales, Any], Crossings]


class Maps:
    """Return maps for all phases of a problem, two independent ones in each precision.

    Raises
    ------
    MapError
        The body's orbits have no such map, or J1_0 is too large to begin in the normal form.
    """

    def __init__(self, problem: RouteProblem, phases: Phases) -> None:
        self.problem, self.phases = problem, phases
        for scales in DESIGNS:
            # One orbit shows whether the start lies in the range of the normal form.
            if self.crossings(53, scales, np.arange(1)).outcome[0] == Outcome.FAILED:
                raise MapError(f"J1_0 = {problem.J1_0} lies outside of the normal form")

    def serve(self, bits: int, scales: Scales) -> bool:
        """True if there is such a map: in NumPy's own types, for two of three computations."""
        return bits <= 64 and native(bits) is not None and scales in DESIGNS

    def crossings(self, bits: int, scales: Scales, columns: Any) -> Crossings:
        """The crossings of some columns in t'; FAILED where an orbit leaves the tables."""
        low, high = (self.problem.h0 + side * self.problem.body.mu for side in (-1, 1))
        made = return_map(self.problem.body, h=(low, high), bits=bits, design=DESIGNS[scales])
        blocks = [columns[k : k + BLOCK] for k in range(0, len(columns), BLOCK)]
        parts = [self._follow(made, block) for block in blocks]
        time, separatrix, inside = (np.concatenate(x, axis=1) for x in zip(*parts, strict=True))
        outcome = np.where(inside.all(axis=0), Outcome.COMPLETE, Outcome.FAILED)
        return Crossings(time, separatrix, outcome.astype(np.uint8))

    def _follow(self, made: ReturnMap, columns: Any) -> tuple[Any, Any, Any]:
        """Times (n + 1, N) in t', separatrices, and whether the tables reach so far."""
        problem, unit = self.problem, made.design.unit
        begin = start(problem, made.bits, Scales(unit, "1"))
        if made.bits == 53:
            phase, h = self._begin_double(made, columns)
        else:
            phase, h = self._begin_exact(made, columns)
        level = made.at(h)
        Qp = precision(made.bits).number(begin.Qp)
        with np.errstate(invalid="ignore"):
            found = follow(level, enter(level, Qp, phase), problem.n_symbols)
        time = np.where(found.inside, found.time.astype(float) * float(exact(unit)), np.nan)
        return time, np.where(found.inside, found.separatrix, 0).astype(np.uint8), found.inside

    def _begin_double(self, made: ReturnMap, columns: Any) -> tuple[Any, Any]:
        """The phase of entry and the energy, (N,) each.

        Phases are rounded at another place in each design; what that loses goes to the rest.
        """
        p, theta2 = self.problem.body.angles(), self.phases.high[columns]
        origin = made.design.origin
        shifted = theta2 + origin
        back = shifted - origin
        lost = (theta2 - back) + (origin - (shifted - back))
        rest = self.phases.rest[columns] + lost
        phase = entry_phase(shifted, rest, p.beta0, precision(53)) + origin
        return phase, self._energy(theta2, 53, np)

    def _begin_exact(self, made: ReturnMap, columns: Any) -> tuple[Any, Any]:
        """The same from the exact phases."""
        m, a = context(made.bits + GUARD_BITS), precision(made.bits)
        beta0 = self.problem.body.angles(m.prec).beta0
        found = []
        for theta2 in (x.in_context(m) for x in self.phases.exactly(columns)):
            phase = (m.pi / 2 - beta0 / 2 - theta2) % (2 * m.pi)
            found.append((phase, self._energy(theta2, m.prec, m)))
        return a.array([x for x, _ in found]), a.array([x for _, x in found])

    def _energy(self, theta2: Any, bits: int, m: Any) -> Any:
        p, J2 = self.problem.body.angles(bits), self.problem.J2_0(bits)
        J1 = self.problem.J1_0.at(bits)
        if bits == 53:
            J1, J2 = float(J1), float(J2)
        return hamiltonian_J3_0(J1, J2, (p.alpha0 + p.beta0, theta2), p, m)


class Mapped(NamedTuple):
    """Crossings that maps have found, with what is known of them."""

    decided: Decided
    by_map: NDArray[np.bool_]
    """(n,), False where an orbit was integrated after all."""


def decided(
    integrated: Compute,
    problem: RouteProblem,
    phases: Phases,
    rate: float,
    precisions: tuple[int, ...],
) -> Mapped:
    """Decide as `certainty.decide`, with two maps in the places of two integrations in doubles.

    Parameters
    ----------
    integrated : callable
        ``integrated(bits, scales, columns)`` gives crossings by integration, in t'.
    problem : RouteProblem
    phases : Phases
    rate : float
        Radians per unit of t'.
    precisions : tuple of int
        Bits, ascending from 53.

    Raises
    ------
    MapError
        The orbits have no map, or a certain symbol differs from the sample's.
    """
    maps, n = Maps(problem, phases), len(phases)
    left = np.zeros(n, dtype=bool)

    def compute(bits: int, scales: Scales, columns: Any) -> Crossings:
        if not maps.serve(bits, scales):
            return integrated(bits, scales, columns)
        try:
            found = maps.crossings(bits, scales, columns)
        except MapError:
            # Tables in more bits may not settle where those in doubles do.
            if bits == 53:
                raise
            left[columns] = True
            return integrated(bits, scales, columns)
        outside = np.flatnonzero(found.outcome != Outcome.COMPLETE)
        if outside.size:
            left[columns[outside]] = True
            certainty.put(found, outside, integrated(bits, scales, columns[outside]))
        return found

    known = certainty.decide(compute, n, rate, precisions)
    _compare_sample(known, integrated, rate, precisions)
    return Mapped(known, (known.bits <= 64) & ~left)


def _compare_sample(
    known: Decided, integrated: Compute, rate: float, precisions: tuple[int, ...]
) -> None:
    """Integrate a sample of the columns; raise MapError if a certain symbol is another one."""
    n = len(known.bits)
    sample = np.unique(np.linspace(0, n - 1, min(n, SAMPLE)).astype(int))
    again = certainty.decide(
        lambda bits, scales, columns: integrated(bits, scales, sample[columns]),
        sample.size,
        rate,
        precisions,
    )
    both = again.certain & known.certain[:, sample]
    differ = symbols(again.crossings.separatrix) != symbols(known.crossings.separatrix[:, sample])
    if (both & differ).any():
        raise MapError("integration finds other symbols than the maps for orbits of a sample")
