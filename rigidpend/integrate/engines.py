"""Engines: their names and tolerances, and which can run here. Imports none of them."""

from __future__ import annotations

import functools
import importlib.util

ENGINES = ("taylor", "scipy")
DEFAULT_TOLERANCE = {"taylor": 3e-14, "scipy": 1e-13}
"""Local tolerance of each engine in double precision.

The Taylor series' error is then below rounding: with 2.2e-16, three orders more and 12 % slower,
crossing times err alike."""
FINEST_TOLERANCE = {"taylor": 2.0**-52, "scipy": 2.5e-14}
"""The finest local tolerance of each engine in double precision."""


class EngineError(RuntimeError):
    """An engine that is not known or not installed."""


def default_engine() -> str:
    """`taylor` where heyoka is installed, else `scipy`."""
    return "taylor" if _has_heyoka() else "scipy"


def check_engine(engine: str) -> str:
    """The engine's name, if it is known and can run here.

    Raises
    ------
    EngineError
        It is not, with what to do about it.
    """
    if engine not in ENGINES:
        raise EngineError(f"engine {engine!r} is not known; choose one of {', '.join(ENGINES)}")
    if engine == "taylor" and not _has_heyoka():
        raise EngineError(
            "engine 'taylor' needs the package heyoka, which is not installed"
            " (it exists for Linux); choose 'scipy'"
        )
    return engine


def has_own_type(engine: str, bits: int) -> bool:
    """True if the engine computes in `bits` bits itself, rather than through `bigint`."""
    if engine == "taylor":
        from rigidpend.integrate import taylor

        return taylor.offers(bits)
    return bits == 53


def runs_in_threads(engine: str, bits: int) -> bool:
    """True if the engine's arithmetic of `bits` bits leaves the interpreter to other threads."""
    return engine == "taylor" and has_own_type(engine, bits)


@functools.cache
def _has_heyoka() -> bool:
    """True if heyoka is installed; looked up once, for that takes a millisecond."""
    return importlib.util.find_spec("heyoka") is not None
