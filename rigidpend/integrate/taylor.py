"""Engine `taylor`: heyoka's adaptive Taylor integrator on the aligned field.

At 53 bits orbits run in batches as wide as the processor's vectors. A lane whose orbit is
done takes the next one at once, so no lane waits for the slowest. At 64 bits (x87 long
double) and at 113 bits (real128) orbits run one by one.

Compiled code depends on the kind of numbers, the tolerance and the width only: the body
enters through parameters. Integrators are reused, never shared between threads, and never
leave this module.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from rigidpend.integrate.compiled import (
    aligned_system,
    begin,
    borrowed,
    heyoka,
    to_crossings,
    working_type,
)
from rigidpend.integrate.records import (
    Crossings,
    Orbits,
    Outcome,
    no_crossings,
    separatrix_beside,
    silent_outcome,
)

MAX_STEPS = 1_000_000
"""Steps in one call after which an orbit counts as failed; a passage takes some hundred."""


def precisions() -> tuple[int, ...]:
    """The precisions, in bits, that this machine's number types offer."""
    hy = heyoka()
    extended = (64,) if np.finfo(np.longdouble).nmant == 63 else ()
    return (53, *extended, *((113,) if hasattr(hy, "real128") else ()))


def crossings_batch(orbits: Orbits, tolerance: float) -> Crossings:
    """Crossings of orbits in double precision, by SIMD batches.

    Parameters
    ----------
    orbits : Orbits
        With states (6, n).
    tolerance : float
        Of the Taylor series.
    """
    with borrowed(_Batch, tolerance) as batch:
        return batch.run(orbits)


def crossings_scalar(orbits: Orbits, bits: int, tolerance: float) -> Crossings:
    """Crossings of orbits in 64 or 113 bits, one by one.

    Parameters
    ----------
    orbits : Orbits
        With states as lists of Fractions.
    bits : int
    tolerance : float
        Of the Taylor series in 53 bits; every bit more halves it.
    """
    found = no_crossings(orbits.n_crossings, len(orbits.states))
    with borrowed(_Scalar, bits, tolerance) as scalar:
        for column, state in enumerate(orbits.states):
            scalar.run(orbits, state, found, column)
    return found


@functools.cache
def _failures() -> frozenset[int]:
    """heyoka's outcomes that end an orbit without a result."""
    outcomes = heyoka().taylor_outcome
    return frozenset(map(int, (outcomes.err_nf_state, outcomes.step_limit)))


class _Batch:
    """A batch integrator with what its event callback writes to."""

    def __init__(self, tolerance: float) -> None:
        hy = heyoka()
        self.width = hy.recommended_simd_size()
        self.found = no_crossings(0, 0)
        self.column, self.count = [0] * self.width, [0] * self.width
        field, M3 = aligned_system(hy)
        self.integrator = hy.taylor_adaptive_batch(
            field,
            np.zeros((6, self.width)),
            pars=np.zeros((9, self.width)),
            tol=tolerance,
            t_events=[hy.t_event_batch(M3, callback=self._recorder())],
        )
        self.state, self.time = self.integrator.state, self.integrator.time
        self.Qp, self.Qm = self.state[:2]

    def _recorder(self) -> Callable[[Any, int, int], bool]:
        """The callback at a crossing. A closure, for heyoka copies callable objects."""
        batch, counts, columns = self, self.count, self.column

        def record(_: Any, direction: int, lane: int) -> bool:
            found, k, column = batch.found, counts[lane], columns[lane]
            found.time[k, column] = batch.time[lane]
            found.separatrix[k, column] = separatrix_beside(
                direction > 0, batch.Qp[lane], batch.Qm[lane]
            )
            counts[lane] = k = k + 1
            return k < len(found.time)

        return record

    def run(self, orbits: Orbits) -> Crossings:
        n = orbits.states.shape[1]
        self.found = no_crossings(orbits.n_crossings, n)
        self.integrator.pars[:] = np.asarray(orbits.coefficients)[:, None]
        self.state[:] = orbits.states[:, :1]
        self.integrator.set_time(0.0)
        waiting = iter(range(n))
        # Where an idle lane stands and is sent to: it takes no step.
        until = np.zeros(self.width)
        busy = {lane for lane in range(self.width) if self._load(lane, waiting, orbits, until)}
        while busy:
            self.integrator.propagate_until(until, max_steps=MAX_STEPS)
            endings = [int(result[0]) for result in self.integrator.propagate_res]
            for lane in [
                lane for lane in busy if self._is_done(lane, endings[lane], orbits, until)
            ]:
                if not self._load(lane, waiting, orbits, until):
                    busy.discard(lane)
        return self.found

    def _load(self, lane: int, waiting: Iterator[int], orbits: Orbits, until: Any) -> bool:
        """Put the next orbit into the lane; without one, let it idle and return False."""
        column = next(waiting, None)
        self._set_time(lane, 0.0)
        self.count[lane] = 0
        if column is None:
            # A number that is not finite would stop the lanes that still work.
            self.state[:, lane], until[lane] = 0.0, 0.0
            return False
        self.column[lane], until[lane] = column, orbits.passage_limit
        self.state[:, lane] = orbits.states[:, column]
        self.integrator.reset_cooldowns(lane)
        return True

    def _set_time(self, lane: int, value: float) -> None:
        """Set one lane's time; the others keep theirs to the last bit, low words included."""
        high, low = (part.copy() for part in self.integrator.dtime)
        high[lane], low[lane] = value, 0.0
        if not math.isfinite(high.sum()):
            # Another lane has failed and waits for its next orbit.
            high[~np.isfinite(high)] = 0.0
            low[~np.isfinite(low)] = 0.0
        self.integrator.set_dtime(high, low)

    def _is_done(self, lane: int, ending: int, orbits: Orbits, until: Any) -> bool:
        """Whether the lane's orbit is done, with its outcome; if not, how far it goes next."""
        count, column = self.count[lane], self.column[lane]
        if count == orbits.n_crossings:
            self.found.outcome[column] = Outcome.COMPLETE
            return True
        if ending in _failures():
            return True
        if self.time[lane] < until[lane]:
            return False
        # The limit counts from the last crossing. It moves only when it is reached, so that
        # no step depends on when the neighbours end.
        last = self.found.time[count - 1, column] if count else 0.0
        if self.time[lane] >= last + orbits.passage_limit:
            self.found.outcome[column] = silent_outcome(self.Qp[lane], self.Qm[lane])
            return True
        until[lane] = last + orbits.passage_limit
        return False


class _Scalar:
    """An integrator of one orbit in an extended type."""

    def __init__(self, bits: int, tolerance: float) -> None:
        self.type = working_type(bits)
        self.crossings: list[tuple[float, int]] = []
        self.wanted = 0
        self.integrator = to_crossings(bits, tolerance, self._recorder())

    def _recorder(self) -> Callable[[Any, int], bool]:
        scalar = self

        def record(integrator: Any, direction: int) -> bool:
            Qp, Qm = integrator.state[:2]
            separatrix = separatrix_beside(direction > 0, Qp, Qm)
            scalar.crossings.append((float(integrator.time), separatrix))
            return len(scalar.crossings) < scalar.wanted

        return record

    def run(self, orbits: Orbits, state: Any, found: Crossings, column: int) -> None:
        """Integrate one orbit and write its crossings into `found`."""
        begin(self.integrator, self.type, orbits.coefficients, state)
        self.crossings.clear()
        self.wanted = orbits.n_crossings
        found.outcome[column] = self._follow(orbits)
        for k, (time, separatrix) in enumerate(self.crossings):
            found.time[k, column], found.separatrix[k, column] = time, separatrix

    def _follow(self, orbits: Orbits) -> Outcome:
        outcomes = heyoka().taylor_outcome
        integrator = self.integrator
        while True:
            last = self.crossings[-1][0] if self.crossings else 0.0
            until = self.type(last + orbits.passage_limit)
            if integrator.time >= until:
                return silent_outcome(*integrator.state[:2])
            ended = int(integrator.propagate_until(until, max_steps=MAX_STEPS)[0])
            if len(self.crossings) == orbits.n_crossings:
                return Outcome.COMPLETE
            if ended != int(outcomes.time_limit):
                return Outcome.FAILED
