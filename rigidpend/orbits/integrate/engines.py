"""Engines: their names and tolerances, and which can run here. Imports none of them."""

from __future__ import annotations

import functools
import importlib.util
from collections.abc import Sequence

from rigidpend.numbers.expressions import named

ENGINES = ("taylor", "scipy")
DEFAULT_TOLERANCE = {"taylor": 3e-14, "scipy": 1e-13}
"""Local tolerance of each engine in double precision.

The Taylor series' error is then below rounding: with 2.2e-16, three orders more and 12 % slower,
crossing times err alike."""
FINEST_TOLERANCE = {"taylor": 2.0**-52, "scipy": 2.5e-14}
"""The finest local tolerance of each engine in double precision."""

PAIRS = 106
"""Bits up to which the kernel of engine `taylor` serves, which needs llvmlite alone.

Above 53 its numbers are pairs of doubles, whatever is asked for: the series are cut off by it."""
SLOWER = 6
"""Factor by which integers of 113 bits take longer than heyoka's numbers."""


class EngineError(RuntimeError):
    """An engine that is not known or not installed."""


def default_engine() -> str:
    """`taylor` where llvmlite is installed, which compiles its kernels, else `scipy`."""
    return "taylor" if _installed("llvmlite") else "scipy"


def check_engine(engine: str) -> str:
    """The engine's name, if it is known and can run here.

    Raises
    ------
    EngineError
        It is not, with what to do about it.
    """
    if not isinstance(engine, str) or engine not in ENGINES:
        known = ", ".join(ENGINES)
        raise EngineError(f"engine {named(engine)} is not known; choose one of {known}")
    if engine == "taylor" and not _installed("llvmlite"):
        raise EngineError(
            "engine 'taylor' needs the package llvmlite, which is not installed; choose 'scipy'"
        )
    return engine


def has_own_type(engine: str, bits: int) -> bool:
    """True if the engine computes in `bits` bits itself, rather than through `bigint`."""
    if engine != "taylor":
        return bits == 53
    if bits <= PAIRS:
        return True
    if not has_heyoka():
        return False
    from rigidpend.orbits.integrate import taylor

    return taylor.offers(bits)


def runs_in_threads(engine: str, bits: int) -> bool:
    """True if the engine's arithmetic of `bits` bits leaves the interpreter to other threads."""
    return engine == "taylor" and has_own_type(engine, bits)


def has_heyoka() -> bool:
    """True if heyoka is installed, whose numbers have the precisions that the kernel lacks."""
    return _installed("heyoka")


def slow_precisions(engine: str, precisions: Sequence[int]) -> str:
    """Say which precisions are slow for want of heyoka, and what to do; empty if none is.

    Parameters
    ----------
    engine : str
    precisions : sequence of int
        Those that a computation may come to, bits.
    """
    # heyoka is asked for first: to learn its types would import it.
    if engine != "taylor" or has_heyoka():
        return ""
    slow = [f"{bits}" for bits in precisions if not has_own_type(engine, bits)]
    if not slow:
        return ""
    return (
        f"what needs {' or '.join(slow)} bits is computed in integers, some {SLOWER} times slower:"
        " heyoka is not installed (pip has it for Linux, conda-forge also for macOS and Windows:"
        " conda install -c conda-forge heyoka.py)"
    )


@functools.cache
def _installed(package: str) -> bool:
    """True if a package is installed; looked up once, for that takes a millisecond."""
    return importlib.util.find_spec(package) is not None
