"""Routes of phases that lie close together: all beside one reference orbit.

A phase beyond doubles costs an integration beyond doubles, but only one: the reference in high
precision, once in each of the scales of `certainty`. All others are differences from it, in
doubles or 64 bits, whatever their distance (`integrate.neighbours`), and their symbols become
certain by the same rule as elsewhere. What two references in 64 bits leave open is integrated by
itself, in as many bits as the distance asks for.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from rigidpend.numbers.exact import PI, Exact, exact
from rigidpend.orbits.integrate import Crossings, neighbours
from rigidpend.orbits.integrate.arithmetic import Arithmetic
from rigidpend.orbits.integrate.differences import KINDS, array
from rigidpend.orbits.integrate.neighbours import Neighbours
from rigidpend.orbits.integrate.reference_orbit import ReferenceOrbit, followed, reference_bits
from rigidpend.routes import certainty
from rigidpend.routes.choice import Mapped
from rigidpend.routes.codes import RouteCodes, routes_of
from rigidpend.routes.phases import Phases
from rigidpend.routes.problem import RouteProblem, passage_limit, phase_rate
from rigidpend.routes.run import tolerance_of
from rigidpend.routes.start import Scales, start, states_exact


class Neighbourhood:
    """Routes in the neighbourhood of one phase.

    Parameters
    ----------
    problem : RouteProblem
    centre : Exact
        Phase of the reference orbit, theta2_0, radians.
    finest : float
        Least distance of phases that is to be resolved, radians.
    arithmetic : Arithmetic
        Its precisions are relative to the distances: 53 and 64 bits by differences, higher ones
        by integration, first in so many bits more as the least distance takes.
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
        # One reference serves 53 and 64 bits: it is made for the higher of those asked for.
        self.finest_bits = max((b for b in arithmetic.precisions if b in KINDS), default=53)
        self.bits = reference_bits(finest, self.finest_bits)
        """Bits of the reference orbit."""
        self._references: dict[Scales, ReferenceOrbit] = {}

    def routes(self, phases: Sequence[Exact]) -> RouteCodes:
        """The routes of some phases theta2_0, radians, every symbol certain or marked."""
        taken = Phases(phases)

        def compute(bits: int, scales: Scales, columns: Any) -> Crossings:
            return self.crossings(bits, scales, taken.exactly(columns))

        rate, n = phase_rate(self.problem), len(taken)
        known = certainty.decide(compute, n, rate, self.arithmetic.precisions)
        return routes_of(taken, Mapped(known, np.zeros(n, dtype=bool)))

    def crossings(self, bits: int, scales: Scales, phases: Sequence[Exact]) -> Crossings:
        """The crossings of some phases in `bits` bits, relative to their distances, in t'."""
        if bits not in KINDS:
            return self._alone(bits, scales, phases)
        reference = self._reference(scales)
        begin = start(self.problem, self.bits, scales)
        states = states_exact(begin, [self.centre, *phases], self.bits)
        # Differences of fractions are exact; `self.bits` leave the closest enough of their own.
        apart = [[x - y for x, y in zip(other, states[0], strict=True)] for other in states[1:]]
        unit = float(begin.time_unit)
        found = neighbours.crossings(
            reference,
            Neighbours(
                array(apart, bits).T,
                np.array([float(phase - self.centre) for phase in phases]),
                self.problem.n_symbols + 1,
                passage_limit(self.problem, bits) / unit,
            ),
            bits=bits,
            tolerance=tolerance_of(self.arithmetic, bits, scales),
            jobs=self.jobs,
        )
        return found._replace(time=found.time * unit)

    def _reference(self, scales: Scales) -> ReferenceOrbit:
        if scales not in self._references:
            self._references[scales] = self._orbit(self.centre, self.bits, scales)
        return self._references[scales]

    def _orbit(self, phase: Exact, bits: int, scales: Scales) -> ReferenceOrbit:
        """The orbit of a phase, with its derivative in the phase."""
        begin = start(self.problem, bits, scales)
        # A quarter turn further on gamma is its own derivative; M does not depend on the phase.
        state, further = states_exact(begin, [phase, phase + PI / 2], bits)
        return ReferenceOrbit(
            begin.coefficients,
            state,
            [0 * further[0]] * 3 + further[3:],
            tangent_bits=self.finest_bits,
            longest=passage_limit(self.problem, bits) / float(begin.time_unit),
            engine=self.arithmetic.engine,
            bits=bits,
            tolerance=tolerance_of(self.arithmetic, bits, scales),
        )

    def _alone(self, bits: int, scales: Scales, phases: Sequence[Exact]) -> Crossings:
        """Each orbit by itself, in `bits` bits relative to its distance."""
        # Each in a precision of its own, by its distance: none share a step. What is closer than
        # is to be resolved gets no further bits.
        apart = [max(self.finest, abs(float(phase - self.centre))) for phase in phases]
        orbits = [
            self._orbit(phase, reference_bits(distance, bits), scales)
            for phase, distance in zip(phases, apart, strict=True)
        ]
        found = followed(orbits, self.problem.n_symbols + 1)
        return found._replace(time=found.time * float(exact(scales.momentum)))
