"""Integration of the orbits of one call, in any precision."""

from __future__ import annotations

import functools
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rigidpend.machine.workers import side_by_side
from rigidpend.numbers.exact import exact
from rigidpend.orbits import integrate
from rigidpend.orbits.integrate import Crossings, Orbits
from rigidpend.orbits.integrate.arithmetic import FINEST_TOLERANCE, Arithmetic, in_kernel
from rigidpend.orbits.integrate.kernel.machine_code import LANES
from rigidpend.orbits.records import columns as columns_of
from rigidpend.routes import certainty
from rigidpend.routes.certainty import Columns, Compute, Decided, Work
from rigidpend.routes.costs import RUNGS, fits
from rigidpend.routes.phases import Phases
from rigidpend.routes.problem import RouteProblem, passage_limit, phase_rate
from rigidpend.routes.start import Scales, Start, start, states_double, states_exact

FEWEST, MOST, PIECES = 256, 1024, 8
"""Columns of a piece at least and at most, and pieces that each thread gets."""
SHARPENING = 100
"""Factor by which further computations are finer, in doubles while these allow it."""

longest_wait = functools.lru_cache(maxsize=32)(passage_limit)
"""`passage_limit`, which takes mpmath and is the same for all columns of a run."""


class Starts(NamedTuple):
    """Starts whose J1_0 differ."""

    J1_0: NDArray[np.float64]
    """(n,), exact doubles in the place of the problem's, which is the largest."""
    least: RouteProblem
    """The problem with the least J1_0 of all, which waits longest for a crossing."""


@dataclass(frozen=True, eq=False)
class Run:
    """One call's orbits and means; computes any columns in any precision."""

    problem: RouteProblem
    """Problem that all have in common; without `starts` it says how long to wait for a crossing."""
    phases: Phases
    """theta2_0 of the orbits."""
    arithmetic: Arithmetic
    jobs: int = 1
    """Threads, or processes where Python itself computes. No result depends on it."""
    starts: Starts | None = None
    """J1_0 of each orbit."""
    each: Sequence[RouteProblem] | None = None
    """The problem of each orbit: of one body, with energies and J1_0 of their own."""
    of: int | None = None
    """Number of orbits in all, if these are a part: many take return maps."""

    @property
    def orbits(self) -> int:
        """The number of orbits in all."""
        return self.of or len(self.phases)

    @property
    def rate(self) -> float:
        """The fastest rate of all orbits, radians per unit of t'."""
        return max(map(phase_rate, self.each or [self.problem]))

    def beyond(self, known: int) -> tuple[int, ...]:
        """The precisions by which orbits climb that so many bits leave open: rungs among them."""
        engine, _, precisions = self.arithmetic
        asked = [x for x in precisions if x > known]
        rungs = [x for x in RUNGS if in_kernel(engine, x) and fits(x, (known, *asked))]
        return tuple(sorted((*asked, *rungs)))

    def most(self, bits: int) -> int:
        """The most computations of a precision: one on a rung, which the next one is to decide."""
        return 3 if bits in self.arithmetic.precisions else 1

    def crossings(self, bits: int, scales: Scales, columns: Any) -> Crossings:
        """The crossings of those columns in `bits` bits, in t'."""
        begin, states = self.begin(bits, scales, columns)
        unit = scales.time_unit
        patient = self.starts.least if self.starts else self.problem
        limit = longest_wait(patient, bits) / unit
        found = integrate.crossings(
            Orbits(begin.coefficients, states, self.problem.n_symbols + 1, limit),
            engine=self.arithmetic.engine,
            bits=bits,
            tolerance=tolerance_of(self.arithmetic, bits, scales),
            jobs=self.jobs,
        )
        return found._replace(time=found.time * unit)

    def begin(self, bits: int, scales: Scales, columns: Any) -> tuple[Start, Any]:
        """The start in those units, and the states of those columns.

        Where orbits differ it is that of the first: its coefficients and units are the body's.
        """
        keys: NDArray[Any]
        problem_of: Callable[[Any], RouteProblem]
        if self.starts is not None:
            keys, problem_of = self.starts.J1_0, functools.partial(_with_action, self.problem)
        elif self.each is not None:
            keys, problem_of = np.arange(len(self.each)), self.each.__getitem__
        else:
            return self._begun(self.problem, bits, scales, columns)
        alike, which = np.unique(keys[columns], return_inverse=True)
        groups = [np.flatnonzero(which == k) for k in range(len(alike))]
        begun = [
            self._begun(problem_of(key), bits, scales, columns[here])
            for key, here in zip(alike, groups, strict=True)
        ]
        back = np.argsort(np.concatenate(groups))
        return begun[0][0], np.concatenate([x for _, x in begun], axis=1)[:, back]

    def _begun(
        self, problem: RouteProblem, bits: int, scales: Scales, columns: Any
    ) -> tuple[Start, Any]:
        begin = start(problem, bits, scales)
        if bits == 53:
            return begin, states_double(begin, self.phases.near[columns], self.phases.rest[columns])
        return begin, states_exact(begin, self.phases.exactly(columns), bits)

    def decided(self) -> Decided:
        """Decide all columns by integration.

        Where a precision is compiled, threads share the columns and decide their own to its end;
        else processes share the orbits of each computation.
        """
        # Threads that share the columns start none of their own.
        alone, of_few, n = replace(self, jobs=1), abreast(self), len(self.phases)

        def in_own(bits: int) -> bool:
            return in_kernel(self.arithmetic.engine, bits)

        def compute(bits: int, scales: Scales, columns: Any) -> Crossings:
            # So few are one piece, beside which no thread is at work.
            if n <= LANES:
                return of_few(bits, scales, columns)
            return (alone if in_own(bits) else self).crossings(bits, scales, columns)

        def share(work: Work, columns: Columns, bits: int) -> list[tuple[Columns, Decided]]:
            if not in_own(bits):
                return certainty.undivided(work, columns, bits)
            # Of no more columns than the threads have lanes each thread gets some.
            fewest = LANES if bits > 53 or n <= LANES * self.jobs else FEWEST
            size = min(MOST, max(fewest, -(-len(columns) // (PIECES * self.jobs))))
            return in_pieces(work, columns, size, self.jobs)

        least = self.arithmetic.precisions[0]
        ladder = least, *self.beyond(least)
        return certainty.decide(compute, n, self.rate, ladder, share, self.most)


def abreast(run: Run) -> Compute:
    """The computations of a run; of few orbits both of a precision are made at once.

    Each takes a thread, and the other would be idle, though the second may not be asked for. Where
    Python itself computes they are processes, which begin only for what is asked for in any case.
    """
    seconds: dict[int, tuple[Columns, Crossings]] = {}
    engine, _, precisions = run.arithmetic

    def compute(bits: int, scales: Scales, columns: Columns) -> Crossings:
        python = not in_kernel(engine, bits)
        idle = (
            run.jobs > 1
            and (bits == precisions[0] if python else run.most(bits) > 1)
            and integrate.on_one_thread(engine, bits, len(columns))
        )
        if scales == certainty.FIRST and idle:
            both = certainty.FIRST, certainty.SECOND
            first, second = side_by_side(_in_scales, (run, bits, columns), python, both, 2)
            seconds[bits] = columns, second
            return first
        if scales == certainty.SECOND and bits in seconds:
            known, second = seconds[bits]
            return columns_of(second, np.searchsorted(known, columns))
        return run.crossings(bits, scales, columns)

    return compute


@functools.lru_cache(maxsize=64)
def _with_action(problem: RouteProblem, J1_0: float) -> RouteProblem:
    """The problem with another J1_0, kept for the next computation in other scales."""
    return replace(problem, J1_0=exact(float(J1_0)))


def _in_scales(scales: Scales, run: Run, bits: int, columns: Any) -> Crossings:
    """One computation of those that go side by side."""
    return run.crossings(bits, scales, columns)


def in_pieces(work: Work, columns: Columns, size: int, jobs: int) -> list[tuple[Columns, Decided]]:
    """Let threads decide columns, so many at a time."""
    parts = [columns[k : k + size] for k in range(0, len(columns), size)] or [columns]
    return list(zip(parts, side_by_side(work, (), False, parts, jobs), strict=True))


def tolerance_of(arithmetic: Arithmetic, bits: int, scales: Scales) -> float:
    """The tolerance of a computation, at 53 bits.

    The first one has a tolerance of its own: what a series leaves out is alike.
    """
    engine, tolerance, _ = arithmetic
    first, finest = scales == certainty.FIRST, FINEST_TOLERANCE[engine]
    if bits > 53:
        return finest if first else finest / SHARPENING
    return tolerance if first else max(tolerance / SHARPENING, finest)
