"""Bounds of fields: by how much two results may differ, where one number does not say it.

A layout declares them with its fields. Each comes from the stored result and from what is
declared; what a fresh result states of its own errors opens none.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from rigidpend.experiments.data import compare
from rigidpend.experiments.data.compare import Difference
from rigidpend.experiments.data.layout import Bound
from rigidpend.experiments.data.tree import Data

ROUNDING = 1e-14
"""Allowed difference of what only rounds: of angles in radians, of other numbers relative."""


def bound(allowed: Callable[[str, Data, Data], Any]) -> Bound:
    """A bound of each element, infinite where nothing is compared.

    Parameters
    ----------
    allowed : callable
        From the field's name and the two groups, stored and fresh, to what may be added to the
        stored values: a number, or an array to be broadcast to them.
    """

    def apart(name: str, stored: Data, fresh: Data) -> list[Difference]:
        return compare.arrays(name, stored[name], fresh[name], allowed(name, stored, fresh))

    return Bound(apart)


def where(compared: Callable[[Data, Data], Any]) -> Bound:
    """A bound of what must be the same where it is compared: from the groups, stored and fresh."""
    return bound(lambda name, stored, fresh: np.where(compared(stored, fresh), 0.0, np.inf))


def relative(share: float) -> Bound:
    """A bound of each element, relative to it."""
    return bound(lambda name, stored, fresh: share * np.abs(stored[name]))


def of_largest(share: float, least: float = 0.0) -> Bound:
    """A bound of all elements, relative to the largest, or to `least` if that is more."""
    return bound(lambda name, stored, fresh: share * max(least, np.abs(stored[name]).max()))


def of_field(other: str, share: float) -> Bound:
    """A bound of all elements, relative to another field."""
    return bound(lambda name, stored, fresh: share * np.abs(stored[other]))


def modulo(period: float, allowed: Callable[[str, Data, Data], Any]) -> Bound:
    """A bound of each element, as :func:`bound` takes it, of what has a period."""

    def apart(name: str, stored: Data, fresh: Data) -> list[Difference]:
        old, new = np.asarray(stored[name]), np.asarray(fresh[name])
        # At the cut rounding decides the side.
        new = old + np.remainder(new - old + period / 2, period) - period / 2
        return compare.arrays(name, old, new, allowed(name, stored, fresh))

    return Bound(apart)


def stated(most: float | Callable[[Data, Data], Any]) -> Bound:
    """A bound of errors that a result states of itself: the fresh ones are held to it.

    Gaps must be where they are in the stored result.

    Parameters
    ----------
    most : float or callable
        The largest size that is admitted of each, infinite for any; or a function to it from
        the two groups, stored and fresh.
    """

    def apart(name: str, stored: Data, fresh: Data) -> list[Difference]:
        limit = most(stored, fresh) if callable(most) else most
        known, free = np.isfinite(stored[name]), np.where(np.isinf(limit), np.inf, 0.0)
        held = compare.arrays(name, known, np.isfinite(fresh[name]), free)
        return held or compare.beyond(name, np.where(known, np.abs(fresh[name]), 0.0), limit)

    return Bound(apart)
