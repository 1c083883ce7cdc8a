"""Orbits in principal axes by heyoka: they share no arithmetic and no component with ours.

Euler's and Poisson's equations themselves, in M and gamma and physical time, know nothing of
separatrices, of J1 or of aligned components.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from rigidpend.experiments.heyoka_peer import heyoka, typed, working_type
from rigidpend.mechanics.body import Body
from rigidpend.mechanics.coordinates import momentum, scale, vertical
from rigidpend.numbers.exact import GUARD_BITS, context
from rigidpend.routes.problem import RouteProblem


def integrator(
    body: Body,
    field: Callable[..., Callable[[Any], Sequence[Any]]],
    size: int,
    bits: int,
    crossed: Callable[[Any, int], bool] | None = None,
) -> Any:
    """heyoka's integrator of one orbit in numbers of so many bits, to their rounding.

    Parameters
    ----------
    body : Body
    field : callable
        ``field(A, r, mu)`` gives the function from `size` components to their derivatives.
    size, bits : int
        The bits are 53, 64 or 113.
    crossed : callable, optional
        Called with the integrator, and a sign, where M3 = 0; goes on where it gives True.
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
