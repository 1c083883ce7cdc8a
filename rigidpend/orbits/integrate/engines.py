"""Engines: their names, tolerances and precisions. Imports none of them."""

from __future__ import annotations

from rigidpend.numbers.expressions import named

ENGINES = ("taylor", "scipy")
DEFAULT_TOLERANCE = {"taylor": 3e-14, "scipy": 1e-13}
"""Local tolerance of each engine in double precision.

The Taylor series' error is then below rounding: with 2.2e-16, three orders more and 12 % slower,
crossing times err alike."""
FINEST_TOLERANCE = {"taylor": 2.0**-52, "scipy": 2.5e-14}
"""The finest local tolerance of each engine in double precision."""

PAIRS = 106
"""Bits of pairs of doubles."""
LADDER = (53, PAIRS, 212, 424)
"""Bits of the numbers of engine `taylor`: one double, two, four, or eight.

A precision is computed in the first that has as many bits, its series cut off by what was asked
for. Integers have any number of bits, and serve beyond."""


class EngineError(RuntimeError):
    """An engine that is not known."""


def default_engine() -> str:
    """The engine where none is asked for."""
    return ENGINES[0]


def check_engine(engine: str) -> str:
    """The engine's name, if it is known.

    Raises
    ------
    EngineError
        It is not, with what to do about it.
    """
    if not isinstance(engine, str) or engine not in ENGINES:
        known = ", ".join(ENGINES)
        raise EngineError(f"engine {named(engine)} is not known; choose one of {known}")
    return engine


def in_kernel(engine: str, bits: int) -> bool:
    """True if machine code of our own computes, which leaves the interpreter to other threads."""
    return engine == "taylor" and bits <= LADDER[-1]


def kernel_bits(bits: int) -> int:
    """The bits of the kernel's numbers that serve so many."""
    return next(kind for kind in LADDER if kind >= bits)
