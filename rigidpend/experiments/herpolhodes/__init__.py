"""Perturbed herpolhodes along published routes: Fig. 5."""

from functools import partial
from typing import Any

import numpy as np

from rigidpend.experiments.compare import ROUNDING, modulo, of_largest
from rigidpend.experiments.data import ANY, Data, double, held, text, whole
from rigidpend.experiments.shared import CODES, MEANING, crossing_tolerance

GROWTH = 10.0
"""Allowed growth of the distance of two orbits from one crossing to the next.

Between builds and engines orbits were, in t', up to 6e-15 and 4e-10 apart at the first two
crossings and 1e-6 at the sixth."""


def _apart(stored: Data) -> Any:
    """Allowed time difference of two orbits: little at first, more after each passage."""
    return crossing_tolerance(stored["crossing_time"].size + 1, GROWTH)[:, 0]


def _moved(name: str, stored: Data, fresh: Data) -> Any:
    """Bound of a sampled field: its largest slope times the allowed time difference."""
    values, t = np.asarray(stored[name]), stored["t"]
    # A sample may differ as much as the next crossing; one more crossing follows the last samples.
    of_sample = _apart(stored)[np.searchsorted(stored["crossing_time"], t)]
    # The samples are evenly spaced by t[1]: the largest difference over it is the largest slope.
    allowed = 1e-12 + of_sample * np.abs(np.diff(values, axis=0)).max() / t[1]
    return allowed.reshape(-1, *(1,) * (values.ndim - 1))


_CLOSED = of_largest(ROUNDING, least=1.0)

_sample = partial(double, dimensions=("samples",))
_crossing = partial(
    double,
    "t' = t s",
    dimensions=("symbols+1",),
    within=lambda name, stored, fresh: _apart(stored)[:-1],
)

ALPHA = _sample("rad", "angle of omega's horizontal part from eta, by (th_al)", symbol=r"$\alpha$")
CASE = {
    # Samples along the orbit, in doubles.
    "t": _sample(
        "t' = t s",
        "times of the samples, s = sqrt((A1 - A2)/(A1 A2))",
        within=_CLOSED,
        coordinate=True,
    ),
    "theta1": _sample("rad", "0 .. 4 pi", within=modulo(4 * np.pi, _moved)),
    "J1_over_J2": _sample("1", "0 at the lower periodic orbit, 1 at the upper one"),
    "theta3": _sample("rad", "precession angle of M, by (th3)"),
    "alpha": ALPHA,
    "omega": double(
        "1/t",
        "(n, 3): omega_xi, omega_eta, omega_zeta in physical units; xi is upward",
        "samples",
        3,
    ),
    # The route, decided before the samples are made, and their agreement with it.
    "theta2_0": double("rad", "initial phase", within=_CLOSED),
    "codes": whole(
        "1", "symbols of the route: 0 left, 1 right, 255 none (no return)", "symbols", among=CODES
    ),
    "certain": MEANING["certain"]._replace(dimensions=("symbols",), within=0.0),
    "bits": whole("bit", "precision that decided the route", within=ANY),
    "separatrix": whole("1", "separatrices of the route, 1..4", "symbols+1"),
    "crossing_time": _crossing("when the route crosses J1 = J2/2 beside each separatrix"),
    "crossing_error": _crossing("how much later the sampled orbit crosses than the route"),
    "route": text("text", "vertices of the heteroclinic cycle in their order"),
    "plateaus": double(
        "rad",
        "theta3 near each periodic orbit, predicted by (tri1) to first order",
        "symbols+2",
        within=_CLOSED,
    ),
    "wound": whole("1", "first and last sample between the first vertex and that of n_wound", 2),
}
LAYOUT = held(_moved, {"<cases>": CASE})
