"""Integration of the orbits of one call, in any precision."""

import functools
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rigidpend.machine.workers import side_by_side
from rigidpend.numbers.exact import exact
from rigidpend.orbits import columns as columns_of
from rigidpend.orbits import integrate
from rigidpend.orbits.integrate import Crossings, Orbits
from rigidpend.orbits.integrate.arithmetic import FINEST_TOLERANCE, Arithmetic, in_kernel
from rigidpend.orbits.integrate.kernel.machine_code import LANES
from rigidpend.routes import certainty
from rigidpend.routes.certainty import Compute, Decided
from rigidpend.routes.ladder import Columns, Rung, integrations
from rigidpend.routes.phases import Phases
from rigidpend.routes.problem import RouteProblem, passage_limit, phase_rate
from rigidpend.routes.start import Scales, Start, start, states_double, states_exact

FEWEST_COLUMNS, MOST_COLUMNS, PIECES_A_THREAD = 256, 1024, 8
"""Least and largest number of columns in a piece, and the number of pieces for each thread."""
SHARPENING = 100
"""Factor by which further computations have a finer tolerance, in doubles as far as these go."""


class Starts(NamedTuple):
    """Starts with different J1_0."""

    J1_0: NDArray[np.float64]
    """(n,), dimensionless, doubles taken as exact; the problem itself has the largest of them."""
    least_problem: RouteProblem
    """The problem with the least J1_0, whose orbits take longest to cross."""


@dataclass(frozen=True, eq=False)
class Run:
    """The orbits of one call and their arithmetic; computes any columns in any precision."""

    problem: RouteProblem
    """Problem that all orbits share; without `starts` it sets how long to wait for a crossing."""
    phases: Phases
    """theta2_0 of the orbits."""
    arithmetic: Arithmetic
    jobs: int = 1
    """Threads, or processes where Python itself computes. No result depends on it."""
    starts: Starts | None = None
    """J1_0 of each orbit, where they differ."""
    problems: Sequence[RouteProblem] | None = None
    """The problem of each orbit, where energies differ too; all have the same body."""
    task_orbits: int | None = None
    """Number of orbits in the whole task, if these are a part of it: many take return maps."""

    @property
    def orbits(self) -> int:
        """The number of orbits in the whole task."""
        return self.task_orbits or len(self.phases)

    @property
    def rate(self) -> float:
        """The fastest rate of all orbits, radians per unit of t'."""
        return max(map(phase_rate, self.problems or [self.problem]))

    def crossings(self, bits: int, scales: Scales, columns: Any) -> Crossings:
        """The crossings of some columns, computed in `bits` bits in the given scales; times t'."""
        begin, states = self.begin(bits, scales, columns)
        unit = scales.time_unit
        # One limit for all columns, whatever their J1_0: so an orbit's result does not depend on
        # the columns beside it. It is the same in every precision, so that an orbit that two
        # computations do not see return by then has no symbol in more bits either.
        patient = self.starts.least_problem if self.starts else self.problem
        limit = passage_limit(patient, self.arithmetic.precisions[-1]) / unit
        found = integrate.crossings(
            Orbits(begin.coefficients, states, self.problem.n_symbols + 1, limit),
            engine=self.arithmetic.engine,
            bits=bits,
            tolerance=tolerance_of(self.arithmetic, bits, scales),
            jobs=self.jobs,
        )
        return found._replace(time=found.time * unit)

    def begin(self, bits: int, scales: Scales, columns: Any) -> tuple[Start, Any]:
        """The start in the given scales, and the initial states (6, n) of some columns.

        Where J1_0 or h0 differ, only the coefficients of the start are to be used: these belong to
        the body and the scales, and are the same for all orbits.
        """
        keys: NDArray[Any]
        problem_of: Callable[[Any], RouteProblem]
        if self.starts is not None:
            keys, problem_of = self.starts.J1_0, functools.partial(_with_action, self.problem)
        elif self.problems is not None:
            keys, problem_of = np.arange(len(self.problems)), self.problems.__getitem__
        else:
            return self._begun(self.problem, bits, scales, columns)
        # A start takes mpmath and serves any phases: one for each group of equal parameters.
        alike, which = np.unique(keys[columns], return_inverse=True)
        groups = [np.flatnonzero(which == k) for k in range(len(alike))]
        begun = [
            self._begun(problem_of(key), bits, scales, columns[here])
            for key, here in zip(alike, groups, strict=True)
        ]
        # The states come group by group; the inverse permutation restores the order of the columns.
        back = np.argsort(np.concatenate(groups))
        return begun[0][0], np.concatenate([x for _, x in begun], axis=1)[:, back]

    def _begun(
        self, problem: RouteProblem, bits: int, scales: Scales, columns: Any
    ) -> tuple[Start, Any]:
        """The start of one problem, and the states (6, n) of the phases of some columns."""
        begin = start(problem, bits, scales)
        if bits == 53:
            return begin, states_double(begin, self.phases.near[columns], self.phases.rest[columns])
        return begin, states_exact(begin, self.phases.exactly(columns), bits)

    def by_integration(self) -> Decided:
        """Decide all columns by integration.

        Where the arithmetic of a precision is compiled, threads share the columns, and each decides
        its own in that precision; otherwise processes share the orbits of each computation.
        """
        # A thread that decides its share of the columns starts no further threads: jobs=1.
        alone, of_few, n = replace(self, jobs=1), abreast(self), len(self.phases)

        def in_own(bits: int) -> bool:
            return in_kernel(self.arithmetic.engine, bits)

        def fewest(bits: int) -> int:
            # In more than 53 bits a single vector of lanes is worth a piece; in doubles only where
            # there are so few columns that some threads would otherwise get none.
            return LANES if bits > 53 or n <= LANES * self.jobs else FEWEST_COLUMNS

        def compute(bits: int, scales: Scales, columns: Any) -> Crossings:
            # Of columns that are a single piece all other threads are idle, and `abreast` gives one
            # of them the second computation.
            if n <= fewest(bits):
                return of_few(bits, scales, columns)
            return (alone if in_own(bits) else self).crossings(bits, scales, columns)

        def division(count: int, bits: int) -> tuple[int, int]:
            if not in_own(bits):
                return certainty.undivided(count, bits)
            size = max(fewest(bits), -(-count // (PIECES_A_THREAD * self.jobs)))
            return min(MOST_COLUMNS, size), self.jobs

        engine, _, (least, *further) = self.arithmetic
        ladder = Rung(least), *integrations(engine, further, least)
        return certainty.decide(compute, n, self.rate, ladder, division)


def abreast(run: Run) -> Compute:
    """The computations of a run; of few orbits the first two of a precision are made at once.

    Few orbits occupy one thread, and another would be idle: it makes the second computation, though
    this may not be asked for. Where Python itself computes, the workers are processes, which are
    slow to begin: there both are made at once in the first precision alone, which needs both.
    """
    # The second computation in each precision, with the columns for which it was made.
    seconds: dict[int, tuple[Columns, Crossings]] = {}
    engine, _, precisions = run.arithmetic

    def compute(bits: int, scales: Scales, columns: Columns) -> Crossings:
        python = not in_kernel(engine, bits)
        idle = (
            run.jobs > 1
            and bits in (precisions[:1] if python else precisions)
            and integrate.on_one_thread(engine, bits, len(columns))
        )
        if scales == certainty.FIRST_SCALES and idle:
            both = certainty.FIRST_SCALES, certainty.SECOND_SCALES
            first, second = side_by_side(_in_scales, (run, bits, columns), python, both, 2)
            seconds[bits] = columns, second
            return first
        if scales == certainty.SECOND_SCALES and bits in seconds:
            # The columns asked for now are some of the first computation's, which ascend.
            known, second = seconds[bits]
            return columns_of(second, np.searchsorted(known, columns))
        return run.crossings(bits, scales, columns)

    return compute


@functools.lru_cache(maxsize=64)
def _with_action(problem: RouteProblem, J1_0: float) -> RouteProblem:
    """The problem with another J1_0, remembered for further computations in other scales."""
    return replace(problem, J1_0=exact(float(J1_0)))


def _in_scales(scales: Scales, run: Run, bits: int, columns: Any) -> Crossings:
    """One of the computations that go side by side: `Run.crossings` with the scales first."""
    return run.crossings(bits, scales, columns)


def tolerance_of(arithmetic: Arithmetic, bits: int, scales: Scales) -> float:
    """The local tolerance of a computation in `bits` bits, stated as one at 53 bits.

    The first computation of a precision has a coarser tolerance than the others, so that its
    series have another order: those of one order have the same truncation error in all scales.
    """
    engine, tolerance, _ = arithmetic
    first, finest = scales == certainty.FIRST_SCALES, FINEST_TOLERANCE[engine]
    # `finest` is as far as doubles go. Every further bit halves the tolerance that is stated here.
    if bits > 53:
        return finest if first else finest / SHARPENING
    return tolerance if first else max(tolerance / SHARPENING, finest)
