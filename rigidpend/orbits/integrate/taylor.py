"""Engine `taylor` above 106 bits: heyoka's adaptive Taylor integrator, one orbit at a time.

113 bits are real128, more are MPFR's numbers. As in `batch`, an
orbit goes some steps at a time, without events, for these lose a double zero of M3; what the
bounds of `bounds` do not exclude is integrated again with every step's series.

Compiled code depends on the kind of numbers and the tolerance only: the body enters through
parameters. Integrators are reused, never shared between threads, and never leave this package.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from fractions import Fraction
from typing import Any

import numpy as np

from rigidpend.machine.workers import check_stop
from rigidpend.mechanics.equations import AlignedCoefficients
from rigidpend.numbers.generic import Numbers
from rigidpend.orbits.integrate.bounds import (
    bounds,
    leaving_zero,
    slopes,
    touch,
    without_zero,
)
from rigidpend.orbits.integrate.compiled import (
    begin,
    borrowed,
    exactly,
    heyoka,
    stepper,
    working_type,
)
from rigidpend.orbits.integrate.passages import UNDECIDED, Found, crossings_of_series
from rigidpend.orbits.integrate.records import (
    Crossings,
    Orbits,
    Outcome,
    no_crossings,
    silent_outcome,
)
from rigidpend.orbits.integrate.roots import value_at

MAX_STEPS = 1_000_000
"""Steps without a crossing after which an orbit counts as failed; a passage takes some hundred."""
STRIDE = 4
"""Steps in a call, of which those with a crossing are made twice: a tenth of the time."""
KEPT = 4096
"""Calls whose ends are kept until they are looked at."""
POLISH = 3
"""Newton's iterations from a double, of which each doubles the digits, as long as they are few."""


def precisions() -> tuple[int, ...]:
    """The precisions, in bits, of which the kernel or this machine's numbers are."""
    return (53, 64, 106, *((113,) if offers(113) else ()))


def offers(bits: int) -> bool:
    """True if heyoka has a type of so many bits."""
    return hasattr(heyoka(), "real128") if bits == 113 else bits > 113 and hasattr(heyoka(), "real")


def crossings_scalar(orbits: Orbits, bits: int, tolerance: float) -> Crossings:
    """Crossings of orbits in more than 106 bits, one by one.

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
            found.outcome[column], crossed = scalar.run(orbits, state)
            columns = np.full(len(crossed), column)
            times, separatrix = np.array(crossed, dtype=float).reshape(-1, 2).T
            Found(columns, times, separatrix.astype(int)).write(found, orbits.passage_limit)
    return found


def advance(
    coefficients: AlignedCoefficients,
    state: Sequence[Fraction],
    count: int,
    bits: int,
    tolerance: float,
) -> list[tuple[Fraction, tuple[Fraction, ...]]]:
    """Carry an orbit some steps of natural length: times since the start, and states.

    Parameters
    ----------
    coefficients : AlignedCoefficients
        Fractions, as the six components of `state`.
    count : int
        Number of steps.
    bits : int
        Working precision.
    tolerance : float
        Of the Taylor series in 53 bits; every bit more halves it.
    """
    found = []
    with borrowed(_Scalar, bits, tolerance) as scalar:
        begin(scalar.integrator, scalar.type, coefficients, state)
        for _ in range(count):
            check_stop()
            scalar.integrator.propagate_until(scalar.far, max_steps=1)
            found.append(
                (exactly(scalar.integrator.time), tuple(map(exactly, scalar.integrator.state)))
            )
    return found


class _Scalar:
    """An integrator of one orbit in an extended type."""

    def __init__(self, bits: int, tolerance: float) -> None:
        self.bits, self.type = bits, working_type(bits)
        self.integrator = stepper(bits, tolerance)
        self.far = self.type(1e300)

    def run(self, orbits: Orbits, state: Any) -> tuple[Outcome, list[tuple[float, int]]]:
        """Follow one orbit: its outcome, and its crossings as (time, separatrix)."""
        begin(self.integrator, self.type, orbits.coefficients, state)
        self.floats = type(orbits.coefficients)(*map(float, orbits.coefficients))
        crossed: list[tuple[float, int]] = []
        count, last, outcome = 0, 0.0, None
        stride = min(STRIDE, MAX_STEPS)
        patience = MAX_STEPS // stride
        while outcome is None:
            rows = [self._here()]
            while outcome is None and len(rows) < KEPT:
                check_stop()
                self.integrator.propagate_until(self.far, max_steps=stride)
                rows.append(self._here())
                patience -= 1
                if (rows[-1][2][2] < 0) != (rows[-2][2][2] < 0):
                    count, last, patience = count + 1, float(rows[-1][0]), MAX_STEPS // stride
                outcome = self._ending(orbits, rows[-1], count, last, patience)
            crossed += self._crossings(rows, stride)
        return outcome, crossed

    def _here(self) -> tuple[Any, Any, list[float]]:
        """The time, the state, and the state in doubles."""
        state = self.integrator.state.copy()
        return self.integrator.time, state, [float(x) for x in state]

    def _ending(
        self, orbits: Orbits, row: Any, count: int, last: float, patience: int
    ) -> Outcome | None:
        """Outcome of the orbit, if it has ended."""
        if count >= orbits.n_crossings:
            return Outcome.COMPLETE
        if patience <= 0 or not np.isfinite(row[2]).all():
            return Outcome.FAILED
        if float(row[0]) > last + orbits.passage_limit:
            return silent_outcome(*(x for x in row[2][:2]))
        return None

    def _crossings(self, rows: Any, stride: int) -> Iterator[tuple[float, int]]:
        """The crossings between the rows; the integrator is put back where it was."""
        times, states, doubles = zip(*rows, strict=True)
        for k in self._open(np.array(doubles).T, np.array(times, dtype=float)):
            depth = touch(self.bits) * float(np.linalg.norm(doubles[k][:3]))
            self._to(self.type(0), states[k])
            for time, separatrix in self._stepped(stride, depth):
                yield float(times[k] + time), separatrix
        self._to(times[-1], states[-1])

    def _open(self, states: Any, times: Numbers) -> list[int]:
        """The stretches from row to row that the bounds leave open."""
        before, after, durations = states[:, :-1], states[:, 1:], np.diff(times)
        with np.errstate(all="ignore"):
            b = bounds(before, durations, self.floats)
            ends = before[2], after[2]
            steep = slopes(before, self.floats), slopes(after, self.floats)
            closed = without_zero(b, *ends, durations) | leaving_zero(b, ends, steep, durations)
        whole = np.isfinite(after).all(axis=0)
        return [int(k) for k in np.flatnonzero(~closed & whole)]

    def _to(self, time: Any, state: Any) -> None:
        self.integrator.time = time
        self.integrator.state[:] = state

    def _stepped(self, stride: int, depth: float) -> Iterator[tuple[Any, int]]:
        """(time, separatrix) of each crossing on the next steps, times in the working type."""
        integrator = self.integrator
        for _ in range(stride):
            start = integrator.time
            integrator.propagate_until(self.far, max_steps=1, write_tc=True)
            step, M3 = integrator.last_h, list(integrator.tc[2])
            scaled = _scaled(integrator.tc[:3], float(step))

            def exactly(share: float, step: Any = step, M3: Any = M3) -> float:
                return float(value_at(M3, self.type(share) * step))

            for share, separatrix in crossings_of_series(scaled, depth, exactly):
                at = self.type(share) * step
                if separatrix != UNDECIDED:
                    at = self._polished(M3, at)
                yield start + at, separatrix

    def _polished(self, M3: list[Any], at: Any) -> Any:
        """The zero of the series beside `at`, to the working precision."""
        rates = [self.type(float(k)) * x for k, x in enumerate(M3)][1:]
        for _ in range(max(POLISH, (self.bits // 32).bit_length())):
            at = at - value_at(M3, at) / value_at(rates, at)
        return at


def _scaled(series: Numbers, step: float) -> Any:
    """Series of the working type in doubles, with the step as the unit of time."""
    doubles = np.array([[float(x) for x in row] for row in series])
    return doubles * step ** np.arange(doubles.shape[1])
