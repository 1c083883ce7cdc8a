"""Orbits in principal axes by heyoka: they share no arithmetic and no component with ours.

Euler's and Poisson's equations themselves, in M and gamma and physical time, know nothing of
separatrices, of J1 or of aligned components. A crossing is told by the angle theta1 alone, so
that symbols that are found so share the body with those of route codes, and nothing else.

heyoka is a peer in speed and an independent truth, for the benchmark and the stress trials:
nothing that computes a result uses it, and it comes with the extra `bench`.
"""

from __future__ import annotations

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
from rigidpend.mechanics.free_body import separatrix_theta1
from rigidpend.numbers.exact import GUARD_BITS, context, exacts
from rigidpend.numbers.generic import Array, Scalar
from rigidpend.routes.cycle import symbols
from rigidpend.routes.problem import RouteProblem, passage_limit


def installed() -> bool:
    """True if heyoka is installed."""
    return importlib.util.find_spec("heyoka") is not None


@functools.cache
def heyoka() -> Any:
    """heyoka, quiet, and without its cache on disk, which believes whatever it reads."""
    import heyoka as imported

    imported.set_logger_level_error()
    imported.llvm_state.set_diskcache_enabled(False)
    return imported


def offers(bits: int) -> bool:
    """True if it has a type of so many bits here: 53, or 64 or 113 on some machines."""
    if bits == 64:
        return np.finfo(np.longdouble).nmant == 63
    return bits == 53 or (bits == 113 and hasattr(heyoka(), "real128"))


def working_type(bits: int) -> Any:
    """Its type of numbers of 53, 64 or 113 bits."""
    return {53: float, 64: np.longdouble, 113: getattr(heyoka(), "real128", None)}[bits]


def typed(x: Scalar, kind: Any) -> Any:
    """A number of a type, from a float, a Fraction or an mpmath number: a sum of doubles."""
    total, rest = kind(0), x
    while head := float(rest):
        total, rest = total + kind(head), rest - type(x)(head)
    return total


TRUTH_BITS = 64, 113
"""Precisions that say which of two computations is right."""
DEARER = 30.0
"""Time of an orbit in 113 bits over that in 64: 20 to 37 on four bodies."""


def integrator(
    body: Body,
    field: Callable[..., Callable[[Any], Sequence[Any]]],
    size: int,
    bits: int,
    crossed: Callable[[Any, int], bool] | None = None,
) -> Any:
    """heyoka's integrator of one orbit in numbers of 53, 64 or 113 bits, to their rounding.

    ``field(A, r, mu)`` gives the function from `size` components to their derivatives. `crossed` is
    called with the integrator, and a sign, where M3 = 0; it goes on where that gives True.
    """
    hy, kind, m = heyoka(), working_type(bits), context(bits + GUARD_BITS)
    names = [hy.make_vars(f"x{i}") for i in range(size)]
    A, r, mu = [hy.par[i] for i in range(3)], [hy.par[i] for i in range(3, 6)], hy.par[6]
    numbers = (*body.A, *body.r, body.mu)
    events = [hy.t_event(names[2], fp_type=kind, callback=crossed)] if crossed else []
    return hy.taylor_adaptive(
        list(zip(names, field(A, r, mu)(names), strict=True)),
        [kind(0)] * size,
        pars=[typed(context(bits).mpf(x.in_context(m)), kind) for x in numbers],
        time=kind(0),
        fp_type=kind,
        tol=kind(2.0 ** (1 - bits)),
        compact_mode=bits > 53,
        t_events=events,
    )


def carry(made: Any, state: Sequence[Any], end: float) -> list[float]:
    """Carry a state from time 0 to a later one, with such an integrator; rounded to doubles."""
    kind = type(made.time)
    made.time, made.state[:] = kind(0), [typed(x, kind) for x in state]
    if made.with_events:
        # heyoka looks away from an event for a while after it: the last orbit's are not this one's.
        made.reset_cooldowns()
    made.propagate_until(kind(end))
    return [float(x) for x in made.state]


def initial(problem: RouteProblem, theta2_0: Any, bits: int = 53) -> list[list[Any]]:
    """M and gamma, physical, at the start of each orbit: n lists of 6 numbers in `bits` bits.

    The start is theta1_0 = alpha0 + beta0, J1_0, J2_0, J3 = 0 in Andoyer variables, rounded
    once; each theta2_0 is exact.
    """
    m = context(bits + GUARD_BITS)
    p, A = problem.body.angles(bits + GUARD_BITS), [x.in_context(m) for x in problem.body.A]
    J1, J2 = problem.J1_0.in_context(m), m.mpf(problem.J2_0(bits + GUARD_BITS))
    p_pair = ((2 * J1 - J2) / J2, 2 * m.sqrt(J1 * (J2 - J1)) / J2)
    sinl, cosl = m.sin(p.alpha0 / 2), m.cos(p.alpha0 / 2)
    M = momentum(J2 / scale(A, m), *p_pair, sinl, cosl)
    found = []
    for theta2 in theta2_0:
        g = (p.alpha0 + p.beta0) / 2 + theta2.in_context(m)
        gamma = vertical(p_pair, (m.mpf(0), m.mpf(1)), (m.sin(g), m.cos(g)), (sinl, cosl))
        found.append([context(bits).mpf(x) for x in (*M, *gamma)])
    return found


def euler_poisson_field(A: Any, r: Any, mu: Any) -> Any:
    """Euler-Poisson in principal axes, of 6 numbers."""
    return lambda y: euler_poisson(y[:3], y[3:6], A, r, mu)


def codes(
    problem: RouteProblem, phases: Sequence[Any], *, bits: int, jobs: int
) -> NDArray[np.uint8]:
    """The symbols of orbits, (n_symbols, n), `NO_SYMBOL` where there is none.

    Phases are theta2_0, radians; bits are 53, 64 or 113, of a type that heyoka has here; jobs are
    processes at a time.
    """
    body = problem.body
    # In physical time, t = t'/s.
    limit = passage_limit(problem, bits) / float(scale(body.floats()[0]))
    states = np.array(initial(problem, exacts(phases), bits), dtype=object)
    given = body, problem.n_symbols + 1, limit, bits
    found = side_by_side(_angles, given, True, spread(states, jobs, axis=0), jobs)
    theta1 = np.concatenate(found, axis=1)
    return symbols(beside(theta1 + body.beta0, separatrix_theta1(body.alpha0, body.beta0)))


def settled(
    problem: RouteProblem,
    phases: Any,
    doubted: NDArray[np.uint8],
    jobs: int,
    seconds: float = math.inf,
) -> tuple[NDArray[np.uint8], NDArray[np.intp]]:
    """The symbols of orbits in doubt, and the orbits that stay so where 113 bits are not offered.

    64 bits, at far less than the cost of 113, settle what agrees with the `doubted` symbols that
    were found otherwise; the word of 113 bits is final, if they take no more than some seconds.
    """
    true, columns = doubted.copy(), np.arange(len(phases))
    for bits in filter(offers, TRUTH_BITS):
        begun = time.perf_counter()
        if columns.size:
            true[:, columns] = codes(problem, phases[columns], bits=bits, jobs=jobs)
        differ = (true[:, columns] != doubted[:, columns]).any(axis=0)
        columns = columns[differ & (bits != TRUTH_BITS[-1])]
        if DEARER * (time.perf_counter() - begun) > seconds:
            break
    return true, columns


def judged(answer: Any, true: Any) -> dict[str, int]:
    """Numbers of symbols of as many orbits as the truth has: of all, of wrong ones, and so on.

    Those vouched for are told apart, and undecided ones; where it does not say which are `certain`
    all of its `codes` are vouched for.
    """
    n = true.shape[1]
    wrong = answer.codes[:, :n] != true
    trusted = np.ones_like(wrong) if answer.certain is None else answer.certain[:, :n]
    masks = {"symbols": wrong | True, "wrong_symbols": wrong, "wrong_trusted": wrong & trusted}
    return {name: int(mask.sum()) for name, mask in {**masks, "undecided": ~trusted}.items()}


def _angles(states: Any, body: Body, n_crossings: int, limit: float, bits: int) -> Array:
    """2 l, with l = atan2(M1, M2), at the crossings of M3 = 0: (n_crossings, n), NaN for none."""
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
    gaps = np.abs(np.remainder(theta1 - places[:, None, None] + TURN, 2 * TURN) - TURN)
    nearest = np.argmin(np.where(np.isnan(gaps), np.inf, gaps), axis=0) + 1
    return np.where(np.isnan(theta1), 0, nearest).astype(np.uint8)
