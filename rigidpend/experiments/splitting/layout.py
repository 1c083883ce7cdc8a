"""Layout of a result of `splitting`."""

from __future__ import annotations

from rigidpend.experiments.data.layout import (
    FLAG,
    FLOAT,
    TEXT,
    WHOLE,
    Field,
    Layout,
)
from rigidpend.experiments.weight_layout import BODIES, EACH, MU_OVER_H0, NAME

OF_BODY = {
    "alpha0": Field(FLOAT, BODIES, "rad", "(bodies,): angle of each body"),
    "beta0": Field(FLOAT, BODIES, "rad", "(bodies,): angle of the centre of gravity"),
    "nu": Field(FLOAT, BODIES, "1", "(bodies,): pi kappa/sin(alpha0)"),
    "slope_amplitude": Field(
        FLOAT,
        BODIES,
        "1",
        "(bodies,): of |excess[0]| in mu, both logarithmic, mu <= 0.01 h0",
        gaps=True,
    ),
    "slope_curve": Field(
        FLOAT, BODIES, "1", "(bodies,): of curve_excess in mu, as well", gaps=True
    ),
    "amplitude": Field(
        FLOAT, EACH, "rad", "(bodies, mu): Melnikov's amplitude of the distance in theta1"
    ),
    "largest": Field(
        FLOAT,
        EACH,
        "rad",
        "(bodies, mu): largest distance in theta1 over all phases",
        gaps=True,
    ),
    "reduced": Field(
        FLOAT,
        EACH,
        "1",
        "(bodies, mu): cos g part of the distance over what Melnikov's would be at nu = 0",
        gaps=True,
    ),
    "curve_excess": Field(
        FLOAT,
        EACH,
        "1",
        "(bodies, mu): largest |distance - Melnikov's| over all phases, in Melnikov's amplitude",
        gaps=True,
    ),
    "error": Field(
        FLOAT,
        EACH,
        "1",
        "(bodies, mu): what is uncertain of `excess`, from two computations",
        gaps=True,
    ),
    "resolved": Field(FLAG, EACH, "1", "(bodies, mu): whether the error is small beside (mu/h0)^2"),
    "bits": Field(WHOLE, EACH, "bit", "(bodies, mu): precision that decided"),
    "orbits": Field(WHOLE, EACH, "1", "(bodies, mu): orbits in each of the two computations"),
    "excess": Field(
        FLOAT,
        (*EACH, "harmonics"),
        "1",
        "(bodies, mu, harmonics): distance less Melnikov's, in Melnikov's amplitude, of cos g,"
        " sin 2g, cos 3g, ...; NaN where S1- turns back in g",
        gaps=True,
    ),
}
"""Fields of all bodies."""
CURVE = {
    "body": Field(TEXT, (), "text", "whose distance it is"),
    "g": Field(FLOAT, ("phases",), "rad", "phase theta1/2 + theta2 on the section"),
    "melnikov": Field(FLOAT, ("phases",), "1", "distance by Melnikov, in its amplitude"),
    "measured": Field(
        FLOAT,
        ("mu", "phases"),
        "1",
        "(mu, phases): distance, in that amplitude; NaN where not resolved",
        gaps=True,
    ),
}
CLOSED_FORM = {
    "nu": Field(FLOAT, ("line",), "1", "pi kappa/sin(alpha0)"),
    "decay": Field(FLOAT, ("line",), "1", "nu/sinh(nu)"),
}

LAYOUT: Layout = {
    "mu_over_h0": MU_OVER_H0,
    "bodies": {"name": NAME, **OF_BODY},
    "curve": CURVE,
    "closed_form": CLOSED_FORM,
}
