"""Orbits in principal axes by heyoka, which share no arithmetic and no component with ours.

The Euler-Poisson equations, in M and gamma and physical time, contain no separatrices, no J1 and
no aligned components. The separatrix of a crossing is found from the angle theta1 alone, so that
these symbols have only the body in common with those of route codes.

heyoka is a peer in speed and an independent truth for the benchmark and the stress trials.
Nothing that computes a result uses it; it comes with the extra `bench`.
"""

import functools
import importlib.util
import math
import time
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rigidpend.machine.workers import side_by_side, spread
from rigidpend.mechanics.body import Body
from rigidpend.mechanics.coordinates import TURN, momentum, scale, vertical
from rigidpend.mechanics.equations import euler_poisson
from rigidpend.mechanics.free_body import separatrix_theta1, symbols
from rigidpend.numbers import Array, Scalar
from rigidpend.numbers.exact import GUARD_BITS, context, exact
from rigidpend.routes.problem import RouteProblem, passage_limit


def installed() -> bool:
    """True if heyoka is installed."""
    return importlib.util.find_spec("heyoka") is not None


@functools.cache
def heyoka() -> Any:
    """The module heyoka, without messages, and without its disk cache, which is not verified."""
    import heyoka as imported

    imported.set_logger_level_error()
    imported.llvm_state.set_diskcache_enabled(False)
    return imported


def working_type(bits: int) -> Any:
    """Type of heyoka's numbers of 53, 64 or 113 bits; None if this machine has none."""
    long = np.longdouble if np.finfo(np.longdouble).nmant == 63 else None
    return {53: float, 64: long, 113: getattr(heyoka(), "real128", None)}[bits]


def typed(x: Scalar, kind: Any) -> Any:
    """A float, Fraction or mpmath number as a number of another type, by a sum of doubles."""
    total, rest = kind(0), x
    # Each head is the double nearest to the rest, so that the subtractions are exact.
    while head := float(rest):
        total, rest = total + kind(head), rest - type(x)(head)
    return total


TRUTH_BITS = 64, 113
"""Precisions that decide which of two computations is right."""
DEARER = 30.0
"""Time of an orbit in 113 bits over that in 64: 20 to 37 with four bodies."""


def integrator(
    body: Body,
    field: Callable[..., Callable[[Any], Sequence[Any]]],
    size: int,
    bits: int,
    crossed: Callable[[Any, int], bool] | None = None,
) -> Any:
    """Make heyoka's integrator of one orbit in 53, 64 or 113 bits, with a rounding as tolerance.

    ``field(A, r, mu)`` gives the function from `size` components to their derivatives. At M3 = 0
    `crossed` is called with the integrator and a sign; the integration goes on if it returns True.
    """
    hy, kind, m = heyoka(), working_type(bits), context(bits + GUARD_BITS)
    names = [hy.make_vars(f"x{i}") for i in range(size)]
    A, r, mu = [hy.par[i] for i in range(3)], [hy.par[i] for i in range(3, 6)], hy.par[6]
    numbers = (*body.A, *body.r, body.mu)
    events = [hy.t_event(names[2], fp_type=kind, callback=crossed)] if crossed else []
    return hy.taylor_adaptive(
        list(zip(names, field(A, r, mu)(names), strict=True)),
        [kind(0)] * size,
        pars=[typed(context(bits).mpf(x.at(m.prec)), kind) for x in numbers],
        time=kind(0),
        fp_type=kind,
        tol=kind(2.0 ** (1 - bits)),
        compact_mode=bits > 53,
        t_events=events,
    )


def carry(made: Any, state: Sequence[Any], end: float) -> list[float]:
    """Integrate a state from time 0 to `end` with `integrator`'s product; rounded to doubles."""
    kind = type(made.time)
    made.time, made.state[:] = kind(0), [typed(x, kind) for x in state]
    if made.with_events:
        # heyoka ignores an event for a while after it; the last orbit's must not hide this one's.
        made.reset_cooldowns()
    made.propagate_until(kind(end))
    return [float(x) for x in made.state]


def initial(problem: RouteProblem, theta2_0: Any, bits: int = 53) -> list[list[Any]]:
    """Physical M and gamma at the start of each orbit: n lists of 6 numbers in `bits` bits.

    The start is theta1_0 = alpha0 + beta0, J1_0, J2_0, J3 = 0 in Andoyer variables, rounded
    once; each theta2_0 is exact.
    """
    m = context(bits + GUARD_BITS)
    p, A = problem.body.angles(bits + GUARD_BITS), [x.at(m.prec) for x in problem.body.A]
    J1, J2 = problem.J1_0.at(m.prec), m.mpf(problem.J2_0(bits + GUARD_BITS))
    p_pair = ((2 * J1 - J2) / J2, 2 * m.sqrt(J1 * (J2 - J1)) / J2)
    sinl, cosl = m.sin(p.alpha0 / 2), m.cos(p.alpha0 / 2)
    M = momentum(J2 / scale(A, m), *p_pair, sinl, cosl)
    found = []
    for theta2 in theta2_0:
        g = (p.alpha0 + p.beta0) / 2 + theta2.at(m.prec)
        gamma = vertical(p_pair, (m.mpf(0), m.mpf(1)), (m.sin(g), m.cos(g)), (sinl, cosl))
        found.append([context(bits).mpf(x) for x in (*M, *gamma)])
    return found


def euler_poisson_field(A: Any, r: Any, mu: Any) -> Any:
    """Field of the Euler-Poisson equations in principal axes, of 6 numbers, per physical t."""
    return lambda y: euler_poisson(y[:3], y[3:6], A, r, mu)


def codes(
    problem: RouteProblem, phases: Sequence[Any], *, bits: int, jobs: int
) -> NDArray[np.uint8]:
    """The symbols of orbits, (n_symbols, n), `NO_SYMBOL` where there is none.

    `phases` are theta2_0, radians; `bits` are 53, 64 or 113, as heyoka offers here; `jobs` is the
    number of processes.
    """
    body = problem.body
    # In physical time, t = t'/s.
    limit = passage_limit(problem, bits) / float(scale(body.floats()[0]))
    states = np.array(initial(problem, map(exact, phases), bits), dtype=object)
    given = body, problem.n_symbols + 1, limit, bits
    found = side_by_side(_angles, given, True, spread(states, jobs, axis=0), jobs)
    theta1 = np.concatenate(found, axis=1)
    return symbols(beside(theta1 + body.beta0, separatrix_theta1(body.alpha0, body.beta0)))


def settled(
    problem: RouteProblem,
    phases: Any,
    doubted: NDArray[np.uint8],
    jobs: int,
    ladder: Sequence[int] = TRUTH_BITS,
    seconds: float = math.inf,
) -> tuple[NDArray[np.uint8], NDArray[np.intp]]:
    """The true symbols of orbits, and the orbits that stay in doubt.

    Each precision of a `ladder` that heyoka offers settles orbits whose symbols agree with the
    `doubted` ones, which were found by other means; the last one decides all others. None begins
    that is expected to take more than `seconds`.
    """
    true, columns = doubted.copy(), np.arange(len(phases))
    for bits in filter(working_type, ladder):
        begun = time.perf_counter()
        if columns.size:
            true[:, columns] = codes(problem, phases[columns], bits=bits, jobs=jobs)
        differ = (true[:, columns] != doubted[:, columns]).any(axis=0)
        columns = columns[differ & (bits != ladder[-1])]
        if DEARER * (time.perf_counter() - begun) > seconds:
            break
    return true, columns


def judged(answer: Any, true: Any) -> dict[str, int]:
    """Count symbols of an answer, as far as the truth goes: all, wrong, wrong trusted, undecided.

    A symbol is trusted if the answer calls it `certain`; without that field all `codes` are.
    """
    n = true.shape[1]
    wrong = answer.codes[:, :n] != true
    trusted = np.ones_like(wrong) if answer.certain is None else answer.certain[:, :n]
    masks = {"symbols": wrong | True, "wrong_symbols": wrong, "wrong_trusted": wrong & trusted}
    return {name: int(mask.sum()) for name, mask in {**masks, "undecided": ~trusted}.items()}


def _angles(states: Any, body: Body, n_crossings: int, limit: float, bits: int) -> Array:
    """Angles 2 atan2(M1, M2) at the crossings of M3 = 0: (n_crossings, n), NaN for none."""
    orbit: list[float] = []

    def record(made: Any, _: int) -> bool:
        M1, M2 = map(float, made.state[:2])
        orbit.append(2 * math.atan2(M1, M2))
        return len(orbit) < n_crossings

    made = integrator(body, euler_poisson_field, 6, bits, record)
    found = np.full((n_crossings, len(states)), np.nan)
    for column, state in enumerate(states):
        orbit.clear()
        carry(made, state, limit * n_crossings)
        found[: len(orbit), column] = orbit
    return found


def beside(theta1: Array, places: Array) -> NDArray[np.uint8]:
    """The separatrix nearest in theta1, modulo 4 pi: 1..4, and 0 for no crossing."""
    # Distances modulo the period 4 pi of theta1, between 0 and 2 pi.
    gaps = np.abs(np.remainder(theta1 - places[:, None, None] + TURN, 2 * TURN) - TURN)
    nearest = np.argmin(np.where(np.isnan(gaps), np.inf, gaps), axis=0) + 1
    return np.where(np.isnan(theta1), 0, nearest).astype(np.uint8)
