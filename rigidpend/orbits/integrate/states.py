"""States of orbits at given times, and at their first crossings of M3 = 0 (J1 = J2/2).

Orbits of any field are followed in doubles, those of the aligned field in any precision. A kernel
(`kernel.following`) computes in doubles and in sums of doubles, engine `scipy` in doubles; integers
serve beyond the kernel's numbers.
"""

import functools
from collections.abc import Callable, Sequence
from fractions import Fraction
from typing import Any, TypeAlias

import numpy as np

from rigidpend.machine.workers import check_stop, side_by_side, spread
from rigidpend.mechanics.equations import AlignedCoefficients, on_section
from rigidpend.numbers import Array, Numbers
from rigidpend.numbers.exact import fraction
from rigidpend.orbits.integrate import Orbits, Outcome, crossings, in_unit
from rigidpend.orbits.integrate.arithmetic import (
    FINEST_TOLERANCE,
    PAIRS,
    TRIPLES,
    bits_of_numbers,
    check_engine,
    in_kernel,
    rung,
)
from rigidpend.orbits.integrate.kernel import following, taylor_step
from rigidpend.orbits.integrate.kernel.lane_numbers import exactly, in_parts
from rigidpend.orbits.integrate.kernel.machine_code import lanes_for
from rigidpend.orbits.integrate.kernel.tape import ALIGNED, trace
from rigidpend.orbits.integrate.sum_arrays import SumArray

Field: TypeAlias = Callable[[Any], Any]

SPARE_BITS = 8
"""Bits beyond the precision to which series are summed, where the numbers have as many."""
STEPS = 5_000
"""Steps of all vectors of lanes in a call of the kernel, which cannot be interrupted: 3 ms."""
TOGETHER = 256
"""Orbits in a call at most, which keeps its arrays of samples small."""
FIRST_ENGINE = "taylor"
"""Engine that finds the first crossing in doubles: unlike `scipy`, it misses no touch."""
GAINED = 40
"""Bits of the crossing's time that a Newton iteration gains at least, its step being a double."""


def states_at(
    field: Field | AlignedCoefficients,
    states: Numbers,
    times: Numbers,
    bits: int = 53,
    jobs: int = 1,
    *,
    engine: str = "taylor",
    tolerance: float | None = None,
) -> Any:
    """States of orbits at times of either sign, (d, k, n), or (d, k) of a single orbit.

    ``field(state)`` gives the d rates in doubles; for engine `taylor` it may use ``+ - * /`` only.
    `AlignedCoefficients` stand for the aligned field, in time t'. States at time 0 are (d, n), or
    (d,) of a single orbit. Times are (k,) for all orbits, or (k, n) with each orbit's own; they
    ascend or descend from 0. All numbers are of the precision `bits`: doubles, pairs of them,
    Fractions, or mpmath's. `jobs` threads share the orbits if numbers are Fractions; where integers
    serve, which for Fractions is what engine `scipy` means, these are processes.

    The local tolerance is by default the finest that the numbers can keep. With a coarser one
    integrals of the motion drift in proportion to the time; by rounding alone they drift as its
    square root.

    ArithmeticError is raised if an orbit does not reach the last of its times. ValueError is raised
    for times in another order, a tolerance that is not above 0, or a field other than the aligned
    one in more than 53 bits.
    """
    if tolerance is not None and not 0 < tolerance < float("inf"):
        raise ValueError(f"tolerance must be a number above 0, got {tolerance}")
    if bits == 53:
        return _in_doubles(field, states, times, check_engine(engine), tolerance)
    if not isinstance(field, AlignedCoefficients):
        raise ValueError(f"{bits} bits follow the aligned field alone: give its coefficients")
    if isinstance(states, SumArray):
        exact = AlignedCoefficients(*(x.exactly() for x in field))
        # (parts, k, n), or (parts, k, 1) where all orbits have the same times.
        grid = times.parts.reshape(*times.parts.shape[:2], -1)
        return SumArray(_sampled(exact, states.parts, grid, bits, tolerance))
    states, times = (np.asarray(x, dtype=object) for x in (states, times))
    if isinstance(states.flat[0], Fraction):
        times = times.reshape(len(times), -1)
        parts = spread(np.arange(states.shape[1]), jobs, 0)
        own = times.shape[1] > 1
        tasks = [(states[:, part], times[:, part] if own else times) for part in parts]
        further = field, bits, tolerance, engine
        found = side_by_side(_exact, further, not in_kernel(engine, bits), tasks, jobs)
        return np.concatenate(found, axis=2)
    # mpmath's numbers become Fractions, and the results numbers of the same context.
    exactly_, number = np.frompyfunc(fraction, 1, 1), type(states.flat[0]).context.mpf
    given = AlignedCoefficients(*map(fraction, field)), exactly_(states), exactly_(times)
    back = np.frompyfunc(lambda x: number(x.numerator) / x.denominator, 1, 1)
    return back(states_at(*given, bits, jobs, tolerance=tolerance))


def finest_tolerance(bits: int) -> float:
    """The finest local tolerance of states in a precision: its numbers keep spare bits, or none."""
    return FINEST_TOLERANCE["taylor"] * 2.0 ** (53 - min(_kind(bits), bits + SPARE_BITS))


def _in_doubles(
    field: Field | AlignedCoefficients,
    states: Numbers,
    times: Numbers,
    engine: str,
    tolerance: float | None,
) -> Array:
    states, times = np.asarray(states, dtype=float), np.asarray(times, dtype=float)
    if not times.ndim or not len(times) or not _leads_away(times).all():
        raise ValueError("times must be a list that ascends or descends from 0, with one at least")
    several, grid = states.reshape(len(states), -1), times.reshape(len(times), -1)
    if engine == "scipy" and states.size:
        from rigidpend.orbits.integrate import dop853

        found = dop853.sample(field, several, grid, tolerance or FINEST_TOLERANCE[engine])
    else:
        found = _sampled(field, several[None], grid[None], 53, tolerance)[0]
    return found.reshape(len(states), len(times), *states.shape[1:])


def _leads_away(times: Array) -> Any:
    """True for each orbit whose times ascend or descend from 0; the first may be 0."""
    steps = np.diff(times, axis=0)
    ahead = (times[0] >= 0) & (steps > 0).all(axis=0)
    return ahead | ((times[0] <= 0) & (steps < 0).all(axis=0))


def _exact(
    task: Any, field: AlignedCoefficients, bits: int, tolerance: float | None, engine: str
) -> Any:
    """States (6, k, n) of orbits of Fractions at their times, by the kernel or in integers."""
    states, times = task
    # In a unit of M the time is in its inverse.
    if in_kernel(engine, bits):
        kind = _kind(bits)
        unit, field, states = in_unit(field, states, kind)
        state, grid = (in_parts(x, kind) for x in (states, times * unit))
        found = exactly(_sampled(field, state, grid, bits, tolerance))
        found[:3] *= unit
        return found
    each = np.broadcast_to(times, (len(times), states.shape[1]))
    columns = [_in_integers(field, *one, bits) for one in zip(states.T, each.T, strict=True)]
    return np.array(columns, dtype=object).transpose(2, 1, 0)


def _in_integers(
    c: AlignedCoefficients, state: Sequence[Fraction], times: Sequence[Fraction], bits: int
) -> list[Any]:
    """The 6 components at each of the times, Fractions, by Taylor series in integers."""
    from rigidpend.orbits.integrate import bigint

    # The reversal: with t, M3 and gamma3 replaced by their negatives the field is the same. Integer
    # steps go forward only.
    sense = np.array([1, 1, -1, 1, 1, -1]) if times[-1] < 0 else np.ones(6, dtype=int)
    found: list[Any] = []
    for step in bigint.steps(c, state * sense, bits):
        while (at := step.since_begin(abs(times[len(found)]))) <= step.length:
            found.append(np.array(step.at(at)) * sense)
            if len(found) == len(times):
                return found
    # `bigint.steps` never ends.
    raise AssertionError


def _kind(bits: int) -> int:
    """Bits of the kernel's numbers; sums of three serve only where they have bits to spare."""
    return bits_of_numbers(bits + SPARE_BITS) if PAIRS < bits <= TRIPLES else rung(bits)


def _sampled(
    field: Field | AlignedCoefficients,
    states: Array,
    times: Array,
    bits: int,
    tolerance: float | None,
) -> Array:
    """States (parts, d, k, n) at given times by the kernel, from states (parts, d, n) at time 0.

    Times are (parts, k, n), or (parts, k, 1) for all orbits.
    """
    (parts, size, n), kind = states.shape, _kind(bits)
    if tolerance is None:
        tolerance = finest_tolerance(bits)
    lanes = lanes_for(n)
    if isinstance(field, AlignedCoefficients):
        traced, parameters = ALIGNED, in_parts(field, kind)
    else:
        traced, numbers = _traced(field, size)
        parameters = np.array([numbers], dtype=float)
    kernel = following.sampling(taylor_step.order_of(tolerance), kind, traced, lanes)
    found = np.empty((parts, size, times.shape[1], n))
    senses = np.broadcast_to(np.where(times[0, -1] < 0, -1.0, 1.0), n)
    for sense in set(senses.tolist()):
        # All lanes of a call go forward in time, or all go back.
        going = np.flatnonzero(senses == sense)
        for columns in np.split(going, range(TOGETHER, going.size, TOGETHER)):
            grid = times if times.shape[2] == 1 else times[..., columns]
            given = states[..., columns], grid, parameters, sense, lanes
            found[..., columns] = _lanes(kernel, *given)
    return found


_traced = functools.lru_cache(maxsize=32)(trace)
"""Traced fields are kept: a field that is integrated again is not traced again."""


def _lanes(
    kernel: Any, states: Array, times: Array, parameters: Array, sense: float, lanes: int
) -> Array:
    """States (parts, d, k, n) of a call's orbits; lanes without an orbit repeat the first."""
    (parts, size, n), count = states.shape, times.shape[1]
    groups = -(-n // lanes)
    width = groups * lanes
    filled = np.concatenate((np.arange(n), np.zeros(width - n, dtype=np.int64)))
    state = np.ascontiguousarray(states.reshape(parts * size, n)[:, filled])
    own = times.shape[2] > 1
    # (parts, lanes, k), or (parts, 1, k): the kernel finds a lane's times side by side.
    grid = times.transpose(0, 2, 1)
    grid = np.ascontiguousarray(grid[:, filled] if own else grid)
    time = np.zeros((2, width))
    passed, found = np.zeros(width, dtype=np.int64), np.empty((count, parts * size, width))
    given = state, width, time, parameters, grid, grid[0].size, count if own else 0, count
    left = width
    # Each call goes on with the states, times and numbers of passed times that the last one left.
    while left:
        check_stop()
        left = kernel(*given, passed, sense, groups, -(-STEPS // groups), found)
        if left and not np.isfinite(state[:, passed < count]).all():
            raise ArithmeticError("the integration ended early: an orbit did not reach its time")
    # The kernel writes (k, parts * d, lanes).
    return found[..., :n].reshape(count, parts, size, n).transpose(1, 2, 0, 3)


def first_crossings(
    coefficients: AlignedCoefficients,
    states: Any,
    limit: float,
    *,
    engine: str,
    bits: int,
    tolerance: float,
    jobs: int,
) -> tuple[Any, Any] | None:
    """Follow orbits to their first crossing of M3 = 0.

    The results are t' since the start, (n,), and the states there, (6, n); or None if an orbit does
    not cross within `limit`, t', or if that is not decided.

    `integrate.crossings` gives times only, as doubles. Here Newton's method carries each orbit on
    until M3 vanishes in the working precision.

    The coefficients, and the states (6, n) at time 0, are doubles at 53 bits by engine `taylor`,
    else Fractions of the working precision. `tolerance` is that of a compiled Taylor series at 53
    bits; every further bit halves it.
    """
    exact = states.dtype == object
    whole = _whole(engine, bits) if exact else 53
    floats = AlignedCoefficients(*map(float, coefficients))
    finest = max(tolerance, FINEST_TOLERANCE[FIRST_ENGINE])
    orbits = Orbits(floats, states.astype(float), 1, limit)
    seen = crossings(orbits, engine=FIRST_ENGINE, bits=53, tolerance=finest, jobs=jobs)
    if exact and (seen.outcome == Outcome.FAILED).any():
        # Doubles do not decide some of the orbits, such as those that touch M3 = 0.
        orbits = Orbits(coefficients, states, 1, limit)
        seen = crossings(orbits, engine=engine, bits=whole, tolerance=tolerance, jobs=jobs)
    if (seen.outcome != Outcome.COMPLETE).any():
        return None
    given = coefficients, states, seen.time[0], whole, tolerance
    # Newton's method may stop where times are off by less than four roundings of 1.
    return at_crossings(*given, 2.0 ** (2 - bits), engine=engine, jobs=jobs)[:2]


def at_crossings(
    coefficients: AlignedCoefficients,
    states: Any,
    times: Any,
    bits: int,
    tolerance: float,
    late: float,
    *,
    engine: str,
    jobs: int,
) -> tuple[Any, Any, Array]:
    """Carry orbits to crossings of M3 = 0 by Newton's method from approximate times, (n,), t'.

    It ends when all orbits are off by less than `late`, t', or when as many iterations are done as
    the bits can profit from. The results are t' since the start, (n,), the states there, (6, n),
    and how far off each orbit still is, t', (n,). All else is as in :func:`first_crossings`.
    """
    local, compiled = tolerance * 2.0 ** (53 - bits), in_kernel(engine, bits)
    unit, c, there = Fraction(1), coefficients, states
    if compiled:
        # The kernel goes on from numbers in its own parts: Fractions take longer than a step.
        unit, c, there = in_unit(coefficients, states, _kind(bits))
        there = in_parts(there, _kind(bits))
    floats, steps, taken = AlignedCoefficients(*map(float, c)), times * float(unit), []
    for _ in range(2 + bits // GAINED):
        # A step is a double, taken exactly: the state is that at the exact sum of the steps.
        taken.append(steps)
        if compiled:
            there = _carried(c, there, steps, bits, local, jobs)
        else:
            given = c, there, exactly([steps])[None], bits, jobs
            there = states_at(*given, engine=engine, tolerance=local)[:, 0]
        # Doubles suffice for a correction.
        seen = there[0] if compiled else there.astype(float)
        _, steps = on_section(seen, floats)
        if np.abs(steps).max() < late * unit:
            break
    if states.dtype != object:
        return sum(taken), there[0], steps
    found = exactly(there) if compiled else there
    return exactly(taken) / unit, np.array([*(found[:3] * unit), *found[3:]]), steps / float(unit)


def _carried(
    c: AlignedCoefficients, states: Array, steps: Array, bits: int, tolerance: float, jobs: int
) -> Array:
    """States (parts, 6, n) by the kernel, each after a step of its own, (n,), doubles."""
    grid = np.zeros((len(states), 1, steps.size))
    grid[0] = steps

    def carry(some: Array) -> Array:
        return _sampled(c, states[..., some], grid[..., some], bits, tolerance)[:, :, 0]

    parts = spread(np.arange(steps.size), jobs, 0)
    return np.concatenate(side_by_side(carry, (), False, parts, jobs), axis=2)


def _whole(engine: str, bits: int) -> int:
    """Bits of an integration that uses all bits of the kernel's numbers, if the kernel computes."""
    return rung(max(bits, PAIRS)) if in_kernel(engine, bits) else max(bits, 54)
