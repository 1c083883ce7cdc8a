"""Routes of phases that lie close together: all beside one reference orbit.

A phase beyond doubles costs an integration beyond doubles, but only one: the reference in high
precision, once in each of the scales of `certainty`. All others are differences from it, in
doubles or 64 bits, whatever their distance (`integrate.neighbours`), and their symbols become
certain by the same rule as elsewhere. What two references in 64 bits leave open is integrated by
itself, in as many bits as the distance asks for.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from rigidpend.integrate import neighbours
from rigidpend.integrate.arithmetic import Arithmetic
from rigidpend.integrate.differences import KINDS, array
from rigidpend.integrate.neighbours import Neighbours
from rigidpend.integrate.records import Crossings
from rigidpend.integrate.reference_orbit import ReferenceOrbit, reference_bits
from rigidpend.numbers.exact import PI, Exact
from rigidpend.routes import certainty
from rigidpend.routes.codes import RouteCodes, Run, routes_of, tolerance_of
from rigidpend.routes.phases import Phases
from rigidpend.routes.problem import RouteProblem, passage_limit, phase_rate
from rigidpend.routes.start import Scales, Start, start, states_exact


class _Reference(NamedTuple):
    """The reference orbit in some scales."""

    begin: Start
    state: Any
    orbit: ReferenceOrbit


class Beside:
    """Routes beside that of one phase.

    Parameters
    ----------
    problem : RouteProblem
    centre : Exact
        Phase of the reference orbit, theta2_0, radians.
    finest : float
        Least distance of phases that is to be resolved, radians.
    arithmetic : Arithmetic
        Its precisions are relative to the distances: 53 and 64 bits by differences, higher ones by
        integration in so many bits more than the least distance takes.
    jobs : int
    """

    def __init__(
        self,
        problem: RouteProblem,
        centre: Exact,
        finest: float,
        arithmetic: Arithmetic,
        jobs: int = 1,
    ) -> None:
        self.problem, self.centre, self.finest = problem, centre, finest
        self.arithmetic, self.jobs = arithmetic, jobs
        self.bits = reference_bits(finest, max(KINDS))
        """Bits of the reference orbit."""
        self._references: dict[Scales, _Reference] = {}

    def routes(self, phases: Sequence[Exact]) -> RouteCodes:
        """The routes of some phases theta2_0, radians, every symbol certain or marked."""
        taken = Phases(phases)

        def compute(bits: int, scales: Scales, columns: Any) -> Crossings:
            return self.crossings(bits, scales, taken.exactly(columns))

        rate, n = phase_rate(self.problem), len(taken)
        known = certainty.decide(compute, n, rate, self.arithmetic.precisions)
        return routes_of(taken, *known, by_map=np.zeros(n, dtype=bool))

    def crossings(self, bits: int, scales: Scales, phases: Sequence[Exact]) -> Crossings:
        """The crossings of some phases in `bits` bits, relative to their distances, in t'."""
        if bits not in KINDS:
            run = Run(self.problem, Phases(phases), self.arithmetic, self.jobs)
            return run.crossings(reference_bits(self.finest, bits), scales, range(len(phases)))
        begin, state, orbit = self._reference(scales)
        unit = float(begin.time_unit)
        states = states_exact(begin, phases, self.bits)
        apart = [[x - y for x, y in zip(other, state, strict=True)] for other in states]
        shifts = [float(phase - self.centre) for phase in phases]
        limits = (passage_limit(self.problem, b) / unit for b in (bits, self.bits))
        found = neighbours.crossings(
            orbit,
            Neighbours(
                array(apart, bits).T,
                array(shifts, 53),
                self.problem.n_symbols + 1,
                next(limits),
            ),
            bits=bits,
            tolerance=tolerance_of(self.arithmetic, bits, scales),
            longest=next(limits),
            jobs=self.jobs,
        )
        return found._replace(time=found.time * unit)

    def _reference(self, scales: Scales) -> _Reference:
        if scales not in self._references:
            begin = start(self.problem, self.bits, scales)
            # A quarter turn further on gamma is its own derivative.
            state, further = states_exact(begin, [self.centre, self.centre + PI / 2], self.bits)
            orbit = ReferenceOrbit(
                begin.coefficients,
                state,
                [0 * further[0]] * 3 + further[3:],
                engine=self.arithmetic.engine,
                bits=self.bits,
                tolerance=tolerance_of(self.arithmetic, self.bits, scales),
            )
            self._references[scales] = _Reference(begin, state, orbit)
        return self._references[scales]
