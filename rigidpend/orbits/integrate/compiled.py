"""Shared part of the compiled integrators: heyoka, the field as its symbols, their reuse."""

from __future__ import annotations

import contextlib
import functools
import threading
from collections.abc import Iterator, Sequence
from fractions import Fraction
from typing import Any

import numpy as np

from rigidpend.mechanics.equations import AlignedCoefficients, aligned
from rigidpend.numbers.generic import Numbers, Scalar
from rigidpend.orbits.integrate import compile_cache


@functools.cache
def heyoka() -> Any:
    """heyoka as this package uses it: what it has compiled before is read, and checked."""
    import heyoka as imported

    imported.set_logger_level_error()
    return compile_cache.with_cache(imported)


def aligned_system(hy: Any) -> tuple[list[Any], Any]:
    """The aligned field as heyoka's expressions, and M3, whose zeros are the crossings."""
    names = hy.make_vars("Qp", "Qm", "M3", "gamma1", "gamma2", "gamma3")
    parameters = AlignedCoefficients(*(hy.par[i] for i in range(9)))
    return list(zip(names, aligned(names, parameters), strict=True)), names[2]


KEPT = 24
"""Number of kinds of integrators that are kept; the one used longest ago goes first."""

_idle: dict[tuple[Any, ...], list[Any]] = {}
_idle_lock = threading.Lock()


@contextlib.contextmanager
def borrowed(make: type[Any], *key: Any) -> Iterator[Any]:
    """An integrator ``make(*key)`` for one caller's use alone, kept afterwards for the next."""
    with _idle_lock:
        shelf = _idle[make, *key] = _idle.pop((make, *key), [])
        made = shelf.pop() if shelf else None
        if len(_idle) > KEPT:
            del _idle[next(iter(_idle))]
    if made is None:
        made = make(*key)
    yield made
    with _idle_lock:
        shelf.append(made)


def working_type(bits: int) -> Any:
    """Type of numbers of so many bits: 53, 64 or 113, or any above."""
    hy = heyoka()
    kinds = {53: float, 64: np.longdouble, 113: getattr(hy, "real128", None)}
    return kinds.get(bits) or functools.partial(_real, bits)


def _real(bits: int, x: Scalar) -> Any:
    """A number of heyoka's arbitrary precision; a whole number counts as a double."""
    hy = heyoka()
    return x if isinstance(x, hy.real) else hy.real(float(x), bits)


def stepper(bits: int, tolerance: float, **events: Any) -> Any:
    """An integrator of one orbit of the aligned field.

    The tolerance is that at 53 bits; every bit more halves it.
    """
    hy, kind = heyoka(), working_type(bits)
    field, _ = aligned_system(hy)
    zero, finer = kind(0), kind(tolerance)
    for _ in range(bits - 53):
        finer = finer * kind(0.5)
    return hy.taylor_adaptive(
        field,
        [zero] * 6,
        time=zero,
        pars=[zero] * 9,
        **_of_type(bits),
        tol=finer,
        compact_mode=bits > 64,
        **events,
    )


def to_crossings(bits: int, tolerance: float) -> Any:
    """An integrator of one orbit of the aligned field that stops where M3 = 0."""
    hy = heyoka()
    _, M3 = aligned_system(hy)
    fp_type = _of_type(bits)["fp_type"]
    return stepper(bits, tolerance, t_events=[hy.t_event(M3, fp_type=fp_type)])


def _of_type(bits: int) -> dict[str, Any]:
    """heyoka's arguments for a type of so many bits."""
    hy = heyoka()
    if bits in (53, 64, 113):
        return {"fp_type": working_type(bits)}
    return {"fp_type": hy.real, "prec": bits}


def begin(integrator: Any, kind: Any, coefficients: Any, state: Numbers) -> None:
    """Put an orbit at time 0 into such an integrator, whatever it did before."""
    integrator.pars[:] = [typed(x, kind) for x in coefficients]
    restart(integrator, kind, state)


def restart(integrator: Any, kind: Any, state: Numbers) -> None:
    """Put another orbit of the same body at time 0."""
    integrator.state[:] = [typed(x, kind) for x in state]
    integrator.time = kind(0)
    if integrator.with_events:
        integrator.reset_cooldowns()


def typed(x: Scalar, kind: Any) -> Any:
    """A number of the working type, from a float, a Fraction or an mpmath number.

    It is a sum of doubles, each step exact.
    """
    total, rest = kind(0), x
    while rest:
        head = float(rest)
        if not head:
            break
        total, rest = total + kind(head), rest - type(x)(head)
    return total


def exactly(x: Scalar) -> Fraction:
    """The value of a number of a working type: a sum of doubles."""
    total, head, kind = Fraction(0), float(x), type(x)
    while head:
        total, x = total + Fraction(head), x - kind(head)
        head = float(x)
    return total


def in_series(
    coefficients: AlignedCoefficients,
    state: Sequence[Fraction],
    times: Sequence[Fraction],
    bits: int,
    tolerance: float,
) -> list[list[Fraction]]:
    """Aligned components by heyoka's series, at times of either sign; exact in and out."""
    kind = working_type(bits)
    with borrowed(_Sampler, bits, tolerance) as sampler:
        begin(sampler.integrator, kind, coefficients, state)
        grid = np.array([kind(0), *(typed(t, kind) for t in times)])
        found = sampler.integrator.propagate_grid(grid)[-1]
    if len(found) != len(grid):
        raise ArithmeticError("an orbit did not reach the last of the times")
    return [[_sum_of_doubles(x, kind) for x in row] for row in found[1:]]


class _Sampler:
    """An integrator of one orbit, without events."""

    def __init__(self, bits: int, tolerance: float) -> None:
        self.integrator = stepper(bits, tolerance)


def _sum_of_doubles(x: Any, kind: Any) -> Fraction:
    """A number of any type, exactly, as a sum of doubles."""
    total, rest = Fraction(0), x
    while head := float(rest):
        total, rest = total + Fraction(head), rest - kind(head)
    return total
