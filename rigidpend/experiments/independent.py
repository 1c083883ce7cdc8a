"""Orbits by heyoka, which shares no arithmetic with ours: a peer, and the truth of others.

Euler's and Poisson's equations themselves, in M and gamma and physical time, know nothing of
separatrices, of J1 or of aligned components. The one module that imports heyoka.
"""

from __future__ import annotations

import functools
import importlib.util
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from rigidpend.mechanics.body import Body
from rigidpend.mechanics.coordinates import momentum, scale, vertical
from rigidpend.numbers.exact import GUARD_BITS, context
from rigidpend.numbers.generic import Scalar
from rigidpend.routes.problem import RouteProblem


def has_heyoka() -> bool:
    """True if heyoka is installed."""
    return importlib.util.find_spec("heyoka") is not None


@functools.cache
def heyoka() -> Any:
    """Import heyoka, without its cache on disk: it believes whatever it reads there."""
    import heyoka as imported

    imported.set_logger_level_error()
    imported.llvm_state.set_diskcache_enabled(False)
    return imported


def number_type(bits: int) -> Any:
    """The type of numbers of 53, 64 or 113 bits; None where heyoka has none on this machine."""
    real128 = getattr(heyoka(), "real128", None)
    long = np.longdouble if np.finfo(np.longdouble).nmant == 63 else None
    return {53: float, 64: long, 113: real128}[bits]


def typed(x: Scalar, kind: Any) -> Any:
    """A number of a type, from a float or an mpmath number: a sum of doubles, each step exact."""
    total, rest = kind(0), x
    while rest and (head := float(rest)):
        total, rest = total + kind(head), rest - type(x)(head)
    return total


def integrator(
    body: Body,
    field: Callable[..., Callable[[Any], Sequence[Any]]],
    size: int,
    bits: int,
    **options: Any,
) -> Any:
    """heyoka's integrator of one orbit in numbers of so many bits, to their rounding.

    Parameters
    ----------
    body : Body
    field : callable
        ``field(A, r, mu)`` gives the function from `size` components to their derivatives.
    size, bits : int
        The bits are 53, 64 or 113.
    **options
        ``section``, the number of a component, and ``callback``: what is called where it is zero.
    """
    hy, kind, m = heyoka(), number_type(bits), context(bits + GUARD_BITS)
    names = [hy.make_vars(f"x{i}") for i in range(size)]
    A, r, mu = [hy.par[i] for i in range(3)], [hy.par[i] for i in range(3, 6)], hy.par[6]
    numbers = (*body.A, *body.r, body.mu)
    events = {}
    if options:
        section = names[options["section"]]
        events["t_events"] = [hy.t_event(section, fp_type=kind, callback=options["callback"])]
    return hy.taylor_adaptive(
        list(zip(names, field(A, r, mu)(names), strict=True)),
        [kind(0)] * size,
        pars=[typed(context(bits).mpf(x.in_context(m)), kind) for x in numbers],
        time=kind(0),
        fp_type=kind,
        tol=kind(2.0 ** (1 - bits)),
        compact_mode=bits > 53,
        **events,
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
