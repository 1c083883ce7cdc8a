"""The arithmetic of a computation: engine, tolerance and precisions, resolved once."""

import math
from collections.abc import Sequence
from typing import NamedTuple

from rigidpend.numbers import checked
from rigidpend.numbers.checked import ParameterError
from rigidpend.numbers.exact import PRECISIONS, Exact
from rigidpend.numbers.texts import named

ENGINES = ("taylor", "scipy")
DEFAULT_ENGINE = ENGINES[0]
DEFAULT_TOLERANCE = {"taylor": 3e-14, "scipy": 1e-13}
"""Local tolerance of each engine in double precision.

The truncation error of the Taylor series is then below round-off: with 2.2e-16, which takes three
orders and 12 % of time more, the errors of crossing times are the same."""
FINEST_TOLERANCE = {"taylor": 2.0**-52, "scipy": 2.5e-14}
"""The finest local tolerance of each engine in double precision."""

PAIRS = 106
"""Bits of pairs of doubles."""
LADDER = (53, PAIRS, 212, 424)
"""Bits of the numbers of engine `taylor`: one double, two, four, or eight.

A precision is computed in the first of these that has as many bits; its series are cut off at the
precision that was asked for. Beyond the last, integers serve, which have any number of bits."""
TRIPLES = 160
"""Bits up to which orbits are followed in sums of three doubles.

Three doubles keep 161 bits with their signs. Errors are some roundings, as those of pairs are at
106 bits, and the time is 0.65 of that of four doubles."""
INTEGERS = range(448, 10_000, 32)
"""Bits of integers where the precision falls along an orbit; a step is some 10 % of the time."""
COARSEST_TOLERANCE = 1e-2
"""Largest tolerance: above it a local error is no longer small beside the components themselves."""


class EngineError(RuntimeError):
    """Error: an engine that is not known."""


class Arithmetic(NamedTuple):
    """Engine, tolerance and precisions as they are used; made by :func:`resolve`."""

    engine: str
    """One of the `ENGINES`; empty for closed forms, which integrate nothing."""
    tolerance: float
    """Local tolerance in double precision, not finer than the engine can keep."""
    precisions: tuple[int, ...] = (53,)
    """Bits, ascending; what one precision cannot decide goes to the next."""


CLOSED_FORM = Arithmetic("", 0.0)
"""The arithmetic of computations without integration."""


def resolve(
    engine: str | None = None,
    tolerance: Exact | float | str | None = None,
    precisions: Sequence[int] = PRECISIONS,
) -> Arithmetic:
    """The arithmetic that a choice stands for, with defaults for what it leaves open.

    Resolving twice changes nothing. The default tolerance is the engine's own; a tolerance that is
    finer than the engine can keep becomes its finest. Precisions are those that
    `numbers.checked.precisions` takes; 64 is left out where integers would serve.

    EngineError is raised for an engine that is not known, ParameterError for a tolerance that is
    not in (0, 0.01], or precisions that cannot be used together.
    """
    own = check_engine(DEFAULT_ENGINE if engine is None else engine)
    ladder = checked.precisions(precisions)
    # Integers of 64 bits take as long as those of more.
    kept = tuple(bits for bits in ladder if bits != 64 or in_kernel(own, bits))
    return Arithmetic(own, _tolerance(own, tolerance), kept or ladder)


def _tolerance(engine: str, tolerance: Exact | float | str | None) -> float:
    if tolerance is None:
        return DEFAULT_TOLERANCE[engine]
    value = float(checked.number("tolerance", tolerance))
    if not 0 < value <= COARSEST_TOLERANCE:
        message = f"tolerance must be more than 0 and at most {COARSEST_TOLERANCE}, got {value}"
        raise ParameterError("tolerance", message)
    return max(value, FINEST_TOLERANCE[engine])


def check_engine(engine: str) -> str:
    """The engine's name if it is known, else an EngineError that lists the known ones."""
    if not isinstance(engine, str) or engine not in ENGINES:
        known = ", ".join(ENGINES)
        raise EngineError(f"engine {named(engine)} is not known; choose one of {known}")
    return engine


def in_kernel(engine: str, bits: int) -> bool:
    """True if the compiled kernels compute, which release the interpreter to other threads."""
    return engine == "taylor" and bits <= LADDER[-1]


def rung(bits: float) -> int:
    """The least precision of the `LADDER` and then the `INTEGERS` that has at least `bits` bits."""
    return next((one for one in (*LADDER, *INTEGERS) if one >= bits), math.ceil(bits))


def bits_of_numbers(bits: int) -> int:
    """Bits of the numbers in which the kernel follows orbits when `bits` are asked for."""
    # Three doubles are no rung: they count as 159 bits, yet serve up to `TRIPLES`.
    return 3 * PAIRS // 2 if PAIRS < bits <= TRIPLES else rung(bits)
