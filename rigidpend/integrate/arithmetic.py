"""The arithmetic of a computation: engine, tolerance and precisions, resolved once."""

from __future__ import annotations

import operator
from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

from rigidpend.integrate.engines import (
    DEFAULT_TOLERANCE,
    FINEST_TOLERANCE,
    check_engine,
    default_engine,
    has_own_type,
)
from rigidpend.numbers.exact import PRECISIONS, Exact, ExactError, exact
from rigidpend.numbers.parameters import ParameterError

COARSEST_TOLERANCE = 1e-2
"""Above it a local error is no longer small beside the components themselves."""


class NumericsError(ParameterError):
    """A tolerance or precisions that cannot be used."""


class Arithmetic(NamedTuple):
    """Engine, tolerance and precisions as they are used; made by :func:`resolve`."""

    engine: str
    """One of the engines; empty for closed forms, which integrate nothing."""
    tolerance: float
    """Local tolerance in double precision, not finer than the engine can keep."""
    precisions: tuple[int, ...] = (53,)
    """Bits, ascending; what one cannot decide goes to the next."""


CLOSED_FORM = Arithmetic("", 0.0)
"""The arithmetic of what is computed without integration."""


def resolve(
    engine: str | None = None,
    tolerance: Exact | float | str | None = None,
    precisions: Sequence[int] = PRECISIONS,
) -> Arithmetic:
    """The arithmetic that a choice stands for, whatever was left open decided.

    Resolving what was resolved changes nothing.

    Parameters
    ----------
    engine : {"taylor", "scipy"}, optional
        `taylor` by default.
    tolerance : number, optional
        By default the engine's own; one finer than the engine can keep becomes its finest.
    precisions : sequence of int, optional
        Ascending, 53 or more. 64 is left out where the engine has no such type.

    Raises
    ------
    EngineError
        An engine that is not known or not installed.
    NumericsError
        A tolerance that is not in (0, 0.01], or precisions that do not ascend from 53.
    """
    checked = check_engine(engine or default_engine())
    return Arithmetic(checked, _tolerance(checked, tolerance), _ladder(checked, precisions))


def _tolerance(engine: str, tolerance: Exact | float | str | None) -> float:
    if tolerance is None:
        return DEFAULT_TOLERANCE[engine]
    try:
        value = float(exact(tolerance))
    except ExactError as error:
        raise NumericsError("tolerance", f"tolerance: {error}") from None
    if not 0 < value <= COARSEST_TOLERANCE:
        message = f"tolerance must be more than 0 and at most {COARSEST_TOLERANCE}, got {value}"
        raise NumericsError("tolerance", message)
    return max(value, FINEST_TOLERANCE[engine])


def _ladder(engine: str, precisions: Sequence[int]) -> tuple[int, ...]:
    """The precisions to try with an engine: 64 bits only where it has such a type."""
    try:
        ladder = tuple(operator.index(bits) for bits in precisions)
    except TypeError:
        ladder = ()
    if not ladder or ladder[0] < 53:
        message = f"precisions must be whole numbers from 53 bits on, got {precisions}"
        raise NumericsError("precisions", message)
    if not all(low < high for low, high in pairwise(ladder)):
        raise NumericsError("precisions", f"precisions must ascend, got {precisions}")
    return tuple(b for b in ladder if b != 64 or has_own_type(engine, b)) or ladder
