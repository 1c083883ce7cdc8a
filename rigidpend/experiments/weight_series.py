"""Series of several bodies over the weight mu, in `precession` and `splitting`: fields, slopes."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from rigidpend.experiments.data.bounds import relative
from rigidpend.experiments.data.layout import FLOAT, TEXT, Field
from rigidpend.numbers.generic import Array

if TYPE_CHECKING:
    from rigidpend.config.bodies import WeightedBodies

BODIES, EACH = ("bodies",), ("bodies", "mu")
"""Dimensions of what each body has, and of what it has at each weight."""
NAME = Field(TEXT, BODIES, "text", "(bodies,): as in the config", coordinate=True)
RATIO = 1e-13
"""Allowed relative difference of a quotient."""
MU_OVER_H0 = Field(
    FLOAT,
    ("mu",),
    "1",
    "weight over energy",
    within=relative(RATIO),
    symbol=r"$\mu/h_0$",
    coordinate=True,
)
SMALL = 1e-2
"""Largest mu/h0 at which slopes are fitted: above it the next order in mu shows."""


def joined(found: Mapping[str, Any]) -> dict[str, Any]:
    """Join the fields of all bodies, given by name, one after the other; with their names."""
    first, *_ = found.values()
    each = {key: [body[key].values for body in found.values()] for key in first}
    return {"name": list(found), **{key: np.array(values) for key, values in each.items()}}


def mu_over_h0(problem: WeightedBodies) -> Array:
    """Ratio of weight and energy, the small parameter of the series, for every weight."""
    return np.array([float(mu / problem.h0) for mu in problem.mu])


def slope(ratio: Array, values: Array, floor: Array | float = 0.0) -> float:
    """Fit the slope of values in mu, both logarithmic; NaN for less than two points.

    Parameters
    ----------
    ratio : (n,) array
        mu/h0; points above `SMALL` are left out.
    values : (n,) array
    floor : (n,) array or float, optional
        Values that are not above it are left out: they are rounding.
    """
    kept = (ratio <= SMALL) & (values > floor)
    if kept.sum() < 2:
        return float("nan")
    return float(np.polyfit(np.log(ratio[kept]), np.log(values[kept]), 1)[0])
