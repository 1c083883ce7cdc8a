"""Layout of a result of `precession`."""

from __future__ import annotations

from typing import Any

from rigidpend.experiments.data.bounds import bound, stated
from rigidpend.experiments.data.layout import FLAG, FLOAT, TEXT, WHOLE, Field, Layout, held
from rigidpend.experiments.data.tree import Data
from rigidpend.experiments.weight_series import BODIES, EACH, MU_OVER_H0, NAME

UNCERTAINTY = 1e-13
"""Allowed uncertainty of an increment, relative to the largest of its body.

It is the integration's rounding over some hundred steps."""
DECLARED = 1e-12
"""The largest error of an increment, relative to the largest of its body.

It is `UNCERTAINTY`, and what the quadrature adds where mu is a tenth of h0, 3e-13 as measured."""
SLOPE = 1e-3
"""Allowed difference of fitted slopes."""


@bound
def _increments(name: str, stored: Data, fresh: Data) -> Any:
    """Increments differ by the error that the stored result states and the one declared of any."""
    error = stored["error"] + DECLARED * stored["unit"]
    return error.reshape(*error.shape, *(1,) * (stored[name].ndim - error.ndim))


OF_BODY = {
    "alpha0": Field(FLOAT, BODIES, "rad", "(bodies,): angle of each body"),
    "beta0": Field(FLOAT, BODIES, "rad", "(bodies,): angle of the centre of gravity"),
    "regime": Field(
        TEXT, BODIES, "text", "(bodies,): order of the increments by (trieq); 0 is no increment"
    ),
    "unit": Field(
        FLOAT,
        EACH,
        "rad",
        "(bodies, mu): mu pi kappa/(h0 sin(alpha0)), the largest increment there is",
    ),
    "first_order": Field(
        FLOAT, (*EACH, 4), "rad", "(bodies, mu, separatrices): increment of theta3 by (tri1)"
    ),
    "gained": Field(
        FLOAT,
        (*EACH, 2, 4),
        "rad",
        "(bodies, mu, orbits, separatrices): increment along the heteroclinic orbits that meet"
        " the section at theta1/2 + theta2 = pi/2 and -pi/2 (turned or reflected with 1, 3, 4)",
        within=_increments,
    ),
    "error": Field(
        FLOAT,
        EACH,
        "rad",
        "(bodies, mu): what is uncertain of the increments",
        within=stated(lambda stored, fresh: DECLARED * stored["unit"]),
    ),
    "remainder": Field(
        FLOAT,
        (*EACH, 4),
        "rad",
        "(bodies, mu, separatrices): largest |gained - first_order|",
        within=_increments,
    ),
    "mean_remainder": Field(
        FLOAT,
        (*EACH, 4),
        "rad",
        "(bodies, mu, separatrices): |mean of the two orbits - first_order|",
        within=_increments,
    ),
    "slope": Field(
        FLOAT,
        (*BODIES, 4),
        "1",
        "(bodies, separatrices): of remainder in mu; NaN where it is rounding",
        gaps=True,
        within=SLOPE,
    ),
    "mean_slope": Field(
        FLOAT,
        (*BODIES, 4),
        "1",
        "(bodies, separatrices): of mean_remainder in mu, as well",
        gaps=True,
        within=SLOPE,
    ),
    "ordered": Field(
        FLAG, EACH, "1", "(bodies, mu): whether the means of the two orbits are in that order"
    ),
}
"""Fields of all bodies; separatrices are 1, 2, 3, 4."""
DRAWN = Field(WHOLE, (), "1", "place of the mu whose increments are shown")

LAYOUT: Layout = {
    "mu_over_h0": MU_OVER_H0,
    "drawn": DRAWN,
    "bodies": held(UNCERTAINTY, {"name": NAME, **OF_BODY}),
}
