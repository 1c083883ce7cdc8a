"""Increments of theta3 along the separatrices: full dynamics beside the first order."""

from functools import partial
from typing import Any

from rigidpend.experiments.compare import relative, stated
from rigidpend.experiments.data import Data, double, flag, held, text, whole
from rigidpend.experiments.shared import EACH, MU_OVER_H0, NAME

UNCERTAINTY = 1e-13
"""Error of an increment by the rounding of integration, relative to the largest of its body.

It comes from some hundred steps; beyond `CALM` it grows with nu, as their number does."""
CALM = 150.0
"""Largest nu up to which it is no larger: two computations differ by 4e-13 at nu = 570."""
UPRIGHT = 4e-15
"""Least error of an increment, relative to the same, times (h0 - mu)/h0.

Near h0 the body almost rests at its highest point, with so little energy that roundings of the
whole change it: two computations differ by up to 1.4e-15 there."""
DECLARED = 1e-12
"""The largest admitted error of an increment, relative to the largest of its body.

It covers `UNCERTAINTY` and the error of the quadrature, measured as 3e-13 at mu = h0/10."""
SLOPE = 1e-3
"""Allowed difference of fitted slopes."""


def _increments(name: str, stored: Data, fresh: Data) -> Any:
    """Bound of increments: the error that the stored result states, plus the declared one."""
    error = stored["error"] + DECLARED * stored["unit"]
    return error.reshape(*error.shape, *(1,) * (stored[name].ndim - error.ndim))


_angle = partial(double, "rad", dimensions=("bodies",))
_each, _separatrices = (partial(double, "rad", dimensions=sizes) for sizes in (EACH, (*EACH, 4)))
_found = partial(_separatrices, gaps=True, within=_increments)
_slope = partial(double, "1", dimensions=("bodies", 4), gaps=True, within=SLOPE)

# The dimension of 4 stands for the separatrices 1, 2, 3, 4.
BODIES = {
    "name": NAME,
    "alpha0": _angle("(bodies,): angle of each body"),
    "beta0": _angle("(bodies,): angle of the centre of gravity"),
    "regime": text(
        "text", "(bodies,): order of the increments by (trieq); 0 is no increment", "bodies"
    ),
    "unit": _each("(bodies, mu): mu pi kappa/(h0 sin(alpha0)), the largest increment there is"),
    "first_order": _separatrices("(bodies, mu, separatrices): increment of theta3 by (tri1)"),
    "gained": double(
        "rad",
        "(bodies, mu, orbits, separatrices): increment along the heteroclinic orbits that meet"
        " the section at theta1/2 + theta2 = pi/2 and -pi/2 (turned or reflected with 1, 3, 4)",
        *EACH,
        2,
        4,
        gaps=True,
        within=_increments,
    ),
    "error": _each(
        "(bodies, mu): what is uncertain of the increments; NaN where no such orbits were found",
        gaps=True,
        within=stated(relative(DECLARED, to="unit")),
    ),
    "remainder": _found("(bodies, mu, separatrices): largest |gained - first_order|"),
    "mean_remainder": _found("(bodies, mu, separatrices): |mean of the two orbits - first_order|"),
    "slope": _slope(
        "(bodies, separatrices): of remainder in mu, both logarithmic, mu <= 0.01 h0; NaN where it"
        " is rounding for all weights but one"
    ),
    "mean_slope": _slope("(bodies, separatrices): of mean_remainder in mu, as well"),
    "ordered": flag(
        "1", "(bodies, mu): whether the means of the two orbits are in that order", *EACH
    ),
}
LAYOUT = held(
    UNCERTAINTY,
    {
        "mu_over_h0": MU_OVER_H0,
        "drawn": whole("1", "place of the mu whose increments are shown"),
        "bodies": BODIES,
    },
)
