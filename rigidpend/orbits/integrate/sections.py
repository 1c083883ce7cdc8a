"""First crossings of the Poincare section M3 = 0 (J1 = J2/2): states, in any precision.

`integrate.crossings` follows many orbits through many passages and keeps times only. Here each
orbit ends at its first crossing, and the state there is given to the last bit of the working
precision.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from fractions import Fraction
from typing import Any, NamedTuple

import numpy as np

from rigidpend.machine.workers import check_stop, side_by_side
from rigidpend.mechanics.equations import AlignedCoefficients
from rigidpend.numbers.generic import Numbers
from rigidpend.orbits.integrate import bigint
from rigidpend.orbits.integrate.batch_sections import first_in_doubles, first_in_pairs
from rigidpend.orbits.integrate.engines import PAIRS, has_own_type
from rigidpend.orbits.integrate.kernel.aligned_field import COMPONENTS
from rigidpend.orbits.integrate.roots import UndecidedTouch

AT_ONCE = 100
"""Steps in a call, which cannot be interrupted; in 113 bits they take 50 ms."""


class Crossing(NamedTuple):
    """A point of the section."""

    time: Fraction
    """t' since the start."""
    state: tuple[Fraction, ...]
    """The six aligned components."""


def first_crossings(
    coefficients: AlignedCoefficients,
    states: Sequence[Sequence[Fraction]],
    limit: float,
    *,
    engine: str,
    bits: int,
    tolerance: float,
    jobs: int,
) -> list[Crossing | None]:
    """Follow orbits to their first crossing of M3 = 0.

    Parameters
    ----------
    coefficients : AlignedCoefficients
        Fractions, numbers of the working precision.
    states : n lists of 6 Fractions
        Aligned components at time 0.
    limit : float
        How long, in t', to wait for the crossing.
    engine : str
        One of `integrate.ENGINES`; integers serve where it has no type of `bits` bits.
    bits : int
        Working precision, 53 or more.
    tolerance : float
        Of a compiled Taylor series at 53 bits; every bit more halves it.
    jobs : int
        How many orbits at a time.

    Returns
    -------
    list of n Crossing or None
        None for an orbit that does not cross within the limit.
    """
    compiled = engine == "taylor" and has_own_type(engine, bits)
    in_kernel: Any = _in_doubles if bits == 53 else _in_pairs
    follow = (in_kernel if bits <= PAIRS else _in_series) if compiled else _in_integers
    parts = [states[k::jobs] for k in range(min(jobs, len(states)))]
    done = side_by_side(follow, (coefficients, limit, bits, tolerance), not compiled, parts, jobs)
    found: list[Crossing | None] = [None] * len(states)
    for k, part in enumerate(done):
        found[k::jobs] = part
    return found


def _in_doubles(
    states: Sequence[Any], c: AlignedCoefficients, limit: float, _: int, tolerance: float
) -> list[Crossing | None]:
    """Find the crossings by the kernel, in doubles."""
    begin = np.array(states, dtype=float).reshape(-1, len(COMPONENTS)).T
    floats = AlignedCoefficients(*map(float, c))
    times, found = first_in_doubles(floats, begin, limit, tolerance)
    return [
        None if math.isnan(time) else Crossing(Fraction(time), tuple(map(Fraction, state)))
        for time, state in zip(times.tolist(), found.T.tolist(), strict=True)
    ]


def _in_pairs(
    states: Sequence[Any], c: AlignedCoefficients, limit: float, _: int, tolerance: float
) -> list[Crossing | None]:
    """Find the crossings by the kernel, in pairs of doubles."""
    found = first_in_pairs(states, c, limit, tolerance)
    return [None if one is None else Crossing(*one) for one in found]


def _in_series(
    states: Sequence[Any], c: AlignedCoefficients, limit: float, bits: int, tolerance: float
) -> list[Crossing | None]:
    """Find the crossings by heyoka's Taylor integrator in the type that has so many bits."""
    from rigidpend.orbits.integrate.compiled import borrowed

    with borrowed(_ToSection, bits, tolerance) as orbit:
        orbit.prepare(c)
        return [orbit.run(state, limit) for state in states]


def _in_integers(
    states: Sequence[Any], c: AlignedCoefficients, limit: float, bits: int, _: float
) -> list[Crossing | None]:
    """Find the crossings by Taylor series in integers, of an error below their rounding."""
    found: list[Crossing | None] = []
    for state in states:
        try:
            found.append(_integer_crossing(c, state, limit, bits))
        except UndecidedTouch:
            found.append(None)
    return found


def _integer_crossing(
    c: AlignedCoefficients, state: Sequence[Fraction], limit: float, bits: int
) -> Crossing | None:
    unit = bigint.unit_of(state)
    c, state = bigint.in_units(c, state, unit)
    P = bigint.fractional_bits((*state, *c), bits)
    flow = bigint.Flow([bigint.fixed(x, P) for x in c], P)
    here, time = [bigint.fixed(x, P) for x in state], 0
    depth = bigint.depth_of_touch(state, bits, P)
    while time < bigint.fixed(Fraction(limit) * unit, P):
        series, step = flow.expand(here)
        for at in bigint.crossings_within(series[2], step, P, depth):
            there = [Fraction(bigint.value_at(s, at, P), 1 << P) for s in series]
            momenta = (x * unit for x in there[:3])
            return Crossing(Fraction(time + at, 1 << P) / unit, (*momenta, *there[3:]))
        here = [bigint.value_at(s, step, P) for s in series]
        time += step
    return None


class _ToSection:
    """An integrator that stops at the section."""

    def __init__(self, bits: int, tolerance: float) -> None:
        from rigidpend.orbits.integrate.compiled import to_crossings, working_type

        self.type = working_type(bits)
        self.integrator = to_crossings(bits, tolerance)

    def prepare(self, c: AlignedCoefficients) -> None:
        """Make the following orbits those of a body."""
        from rigidpend.orbits.integrate.compiled import typed

        self.integrator.pars[:] = [typed(x, self.type) for x in c]

    def run(self, state: Numbers, limit: float) -> Crossing | None:
        """The first crossing of an orbit, if it comes within the limit."""
        from rigidpend.orbits.integrate.compiled import exactly, heyoka, restart

        integrator = self.integrator
        restart(integrator, self.type, state)
        end = self.type(limit)
        # The outcome of a terminal event that stops is -1 less its index.
        while (ended := int(integrator.propagate_until(end, max_steps=AT_ONCE)[0])) != -1:
            check_stop()
            if ended != int(heyoka().taylor_outcome.step_limit):
                return None
        return Crossing(
            exactly(integrator.time),
            tuple(map(exactly, integrator.state)),
        )
