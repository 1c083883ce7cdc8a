"""Comparison of two arrays of route codes (itineraries).

Shared by the experiments that store routes: `route_codes`, `route_zoom`, `herpolhodes`.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from rigidpend.experiments.data import compare
from rigidpend.experiments.data.compare import Difference
from rigidpend.experiments.data.tree import Data

AT_FIRST, AT_SECOND, GROWTH = 1e-12, 1e-8, 3.5
"""Allowed difference of the times of crossings 1 and 2, t', and its growth from there on."""
APART = 0.02
"""Allowed difference of the times of certain crossings, t'.

Of two results each may err by a hundredth, far from the radian of the phase at which a symbol
turns over."""


def array_differences(
    stored: Data,
    fresh: Data,
    rounding: Mapping[str, float],
    times: float | NDArray[np.float64] | None = None,
) -> list[Difference]:
    """Find where two arrays of routes differ.

    Parameters
    ----------
    stored, fresh : dict
        Groups, loaded.
    rounding : dict
        The fields that only round, with how much.
    times : float or (n_symbols + 1, 1) array, optional
        By how much crossing times may differ; by default `crossing_tolerance`.
    """
    found = compare.keys(stored, fresh)
    if found or stored["codes"].shape != fresh["codes"].shape:
        return found or compare.arrays("codes", stored["codes"], fresh["codes"])
    for field, limit in rounding.items():
        found += compare.arrays(field, stored[field], fresh[field], limit)
    found += symbol_differences(stored, fresh)
    certain = stored["certain"] & fresh["certain"]
    # A crossing is as certain as the symbol that it ends; the first, which ends
    # none, as the symbol that it begins.
    after = np.vstack((certain[:1], certain))
    within = crossing_tolerance(len(after)) if times is None else times
    for field, most in (("separatrix", 0.0), ("crossing_time", within)):
        allowed = np.where(after, most, np.inf)
        found += compare.arrays(field, stored[field], fresh[field], allowed)
    return found


def symbol_differences(stored: Data, fresh: Data) -> list[Difference]:
    """Find where symbols differ that both know, and those that are not certain any more."""
    # A symbol that has become certain is no loss.
    held = np.where(stored["certain"], 0.0, np.inf)
    known = np.where(stored["certain"] & fresh["certain"], 0.0, np.inf)
    return [
        *compare.arrays("certain", stored["certain"], fresh["certain"], held),
        *compare.arrays("codes", stored["codes"], fresh["codes"], known),
    ]


def crossing_tolerance(crossings: int, growth: float = GROWTH) -> NDArray[np.float64]:
    """Allowed difference of the times of each of so many crossings, t', (crossings, 1).

    Notes
    -----
    On the way to the first crossing an error stays relative. On a passage at a distance d it
    grows by 1/d, as exp(u T/2) with the time T that the passage takes, and T by its logarithm.
    Between scalar and batched, full and compact builds the largest difference of 4,000 random
    phases (body of Fig. 4) was 4e-15 at the first crossing, 2e-11 at the second, and then grew
    by 3.4 a crossing, to 5e-4 at the sixteenth; DOP853 is ten times as far off. More than
    `APART` no certain symbol leaves room for.
    """
    # In logarithms, for of a thousand crossings the power itself has no double.
    exponent = np.log(AT_SECOND) + np.log(growth) * np.arange(crossings - 1.0)
    grown = np.minimum(np.exp(np.minimum(exponent, 0.0)), APART)
    return np.concatenate(([AT_FIRST], grown))[:, None]
