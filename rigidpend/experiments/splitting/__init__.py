"""Splitting of the asymptotic surfaces: full dynamics beside Melnikov's integral."""

from functools import partial
from typing import Any

import numpy as np

from rigidpend.experiments.compare import relative, stated
from rigidpend.experiments.data import ANY, Data, double, flag, held, text, whole
from rigidpend.experiments.shared import EACH, MU_OVER_H0, NAME, slope_weights

SHARE = 4e-3
"""Admitted error of the excess, relative to Melnikov's amplitude, in units of (mu/h0)^2.

The correction to Melnikov's amplitude is 3.4 (mu/h0)^2 with the body of Fig. 4: a thousandth of
it is resolved."""
COARSEST = 1e-9
"""Largest admitted error for any mu."""
RELATIVE = 1e-13
"""Allowed relative difference of numbers in closed form."""
MARGIN = 2
"""Allowed difference of two results, in units of the admitted error of each."""


def admitted(mu_over_h0: Any) -> Any:
    """The largest error of `excess` that counts as resolved, at each weight over energy."""
    return np.minimum(COARSEST, SHARE * np.square(mu_over_h0))


def _error(stored: Data) -> Any:
    """The admitted error; infinite for an unresolved excess, of which nothing is claimed."""
    return np.where(stored["resolved"], admitted(stored["mu_over_h0"]), np.inf)


def _of_sum(stored: Data) -> Any:
    """Allowed difference of a sum of all harmonics."""
    return stored["excess"].shape[-1] * MARGIN * _error(stored)


def slope_change(ratio: Any, values: Any, error: Any) -> float:
    """Largest change of a slope, fitted to values of one body, that their errors can cause.

    Each logarithm errs by -ln(1 - error/value) at most, and the slope is a sum of these with
    weights. Infinite where the error of a fitted value is as large as itself.
    """
    weights = np.abs(slope_weights(ratio, values))
    fitted = weights > 0
    with np.errstate(divide="ignore"):
        logarithms = -np.log1p(-np.minimum(error[fitted] / values[fitted], 1.0))
    return float(weights[fitted] @ logarithms) + RELATIVE


def _slopes(stored: Data, values: Any, error: Any) -> Any:
    """The same of every body; values and errors (bodies, mu)."""
    ratio = stored["mu_over_h0"]
    return np.array([slope_change(ratio, *one) for one in zip(values, error, strict=True)])


def _largest(name: str, stored: Data, fresh: Data) -> Any:
    rounding = RELATIVE * np.nan_to_num(np.abs(stored[name]))
    return _of_sum(stored) * stored["amplitude"] + rounding


_body = partial(double, dimensions=("bodies",))
_fitted = partial(_body, "1", gaps=True)
_each = partial(double, dimensions=EACH, gaps=True)
_closed = relative(RELATIVE)

BODIES = {
    "name": NAME,
    "alpha0": _body("rad", "(bodies,): angle of each body"),
    "beta0": _body("rad", "(bodies,): angle of the centre of gravity"),
    "nu": _body("1", "(bodies,): pi kappa/sin(alpha0)", within=_closed),
    "slope_amplitude": _fitted(
        "(bodies,): of |excess[0]| in mu, both logarithmic, mu <= 0.01 h0",
        within=lambda name, stored, fresh: _slopes(
            stored, np.abs(stored["excess"][..., 0]), MARGIN * _error(stored)
        ),
    ),
    "slope_curve": _fitted(
        "(bodies,): of curve_excess in mu, as well",
        within=lambda name, stored, fresh: _slopes(stored, stored["curve_excess"], _of_sum(stored)),
    ),
    "amplitude": double(
        "rad", "(bodies, mu): Melnikov's amplitude of the distance in theta1", *EACH, within=_closed
    ),
    "largest": _each(
        "rad", "(bodies, mu): largest distance in theta1 over all phases", within=_largest
    ),
    "reduced": _each(
        "1",
        "(bodies, mu): cos g part of the distance over what Melnikov's would be at nu = 0",
        within=lambda name, stored, fresh: MARGIN * _error(stored) + RELATIVE,
    ),
    "curve_excess": _each(
        "1",
        "(bodies, mu): largest |distance - Melnikov's| over all phases, in Melnikov's amplitude",
        within=lambda name, stored, fresh: _of_sum(stored),
    ),
    "error": _each(
        "1",
        "(bodies, mu): what is uncertain of `excess`, from two computations, before its numbers"
        " are rounded to doubles",
        within=stated(lambda name, stored, fresh: _error(stored)),
    ),
    "resolved": flag("1", "(bodies, mu): whether the error is small beside (mu/h0)^2", *EACH),
    "bits": whole("bit", "(bodies, mu): precision that decided", *EACH, within=ANY),
    "orbits": whole("1", "(bodies, mu): orbits in each of the two computations", *EACH, within=ANY),
    "excess": double(
        "1",
        "(bodies, mu, harmonics): distance less Melnikov's, in Melnikov's amplitude, of cos g,"
        " sin 2g, cos 3g, ...; NaN where S1- turns back in g or is not there, or where the"
        " amplitude is far below all rounding",
        *EACH,
        "harmonics",
        gaps=True,
        within=lambda name, stored, fresh: MARGIN * _error(stored)[..., None],
    ),
}
_phases, _line = (partial(double, dimensions=(name,)) for name in ("phases", "line"))
CURVE = {
    "body": text("text", "whose distance it is"),
    "g": _phases("rad", "phase theta1/2 + theta2 on the section", coordinate=True),
    "melnikov": _phases("1", "distance by Melnikov, in its amplitude"),
    "measured": double(
        "1",
        "(mu, phases): distance, in that amplitude; NaN where not resolved",
        "mu",
        "phases",
        gaps=True,
        within=lambda name, stored, fresh: MARGIN * COARSEST * stored["bodies"]["excess"].shape[-1],
    ),
}
CLOSED_FORM = {"nu": _line("1", "pi kappa/sin(alpha0)"), "decay": _line("1", "nu/sinh(nu)")}
LAYOUT = held(
    RELATIVE,
    {"mu_over_h0": MU_OVER_H0, "bodies": BODIES, "curve": CURVE, "closed_form": CLOSED_FORM},
)
