"""What all compiled integrators share: heyoka, the field as its symbols, and their reuse."""

from __future__ import annotations

import contextlib
import functools
import threading
from collections.abc import Iterator
from typing import Any

from rigidpend.equations import AlignedCoefficients, aligned
from rigidpend.integrate import compile_cache
from rigidpend.signals import held


@functools.cache
def heyoka() -> Any:
    compile_cache.choose()
    with held():
        import heyoka as imported

    # A cache that cannot be written costs a compilation, which is no news for a user.
    imported.set_logger_level_error()
    return imported


def aligned_system(hy: Any) -> tuple[list[Any], Any]:
    """The aligned field as heyoka's expressions, and M3, whose zeros are the crossings."""
    names = hy.make_vars("Qp", "Qm", "M3", "gamma1", "gamma2", "gamma3")
    parameters = AlignedCoefficients(*(hy.par[i] for i in range(9)))
    return list(zip(names, aligned(names, parameters), strict=True)), names[2]


KEPT = 24
"""How many kinds of integrators are kept; the one used longest ago goes first."""

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


def typed(x: Any, kind: Any) -> Any:
    """A number of the working type, from a float, a Fraction or an mpmath number.

    It is a sum of doubles, each step exact.
    """
    total, rest = kind(0), x
    for _ in range(3):
        head = float(rest)
        total, rest = total + kind(head), rest - type(x)(head)
    return total
