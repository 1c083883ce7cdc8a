"""Layout of a result of `herpolhodes`."""

from __future__ import annotations

from rigidpend.experiments.data.layout import (
    FLAG,
    FLOAT,
    TEXT,
    WHOLE,
    Field,
    Layout,
)

SAMPLES, SYMBOLS, CROSSINGS = ("samples",), ("symbols",), ("symbols+1",)

SAMPLED = {
    "t": Field(FLOAT, SAMPLES, "t' = t s", "times of the samples, s = sqrt((A1 - A2)/(A1 A2))"),
    "theta1": Field(FLOAT, SAMPLES, "rad", "0 .. 4 pi"),
    "J1_over_J2": Field(FLOAT, SAMPLES, "1", "0 at the lower periodic orbit, 1 at the upper one"),
    "theta3": Field(FLOAT, SAMPLES, "rad", "precession angle of M, by (th3)"),
    "alpha": Field(FLOAT, SAMPLES, "rad", "angle of omega's horizontal part from eta, by (th_al)"),
    "omega": Field(
        FLOAT,
        ("samples", 3),
        "1/t",
        "(n, 3): omega_xi, omega_eta, omega_zeta in physical units; xi is upward",
    ),
}
"""Fields of the samples along the orbit, in doubles."""
OF_ROUTE = {
    "theta2_0": Field(FLOAT, (), "rad", "initial phase"),
    "codes": Field(
        WHOLE, SYMBOLS, "1", "symbols of the route: 0 left, 1 right, 255 none (no return)"
    ),
    "certain": Field(
        FLAG, SYMBOLS, "1", "whether two independent computations establish the symbol"
    ),
    "bits": Field(WHOLE, (), "bit", "precision that decided the route"),
    "separatrix": Field(WHOLE, CROSSINGS, "1", "separatrices of the route, 1..4"),
    "crossing_time": Field(
        FLOAT, CROSSINGS, "t' = t s", "when the route crosses J1 = J2/2 beside each separatrix"
    ),
    "crossing_error": Field(
        FLOAT,
        CROSSINGS,
        "t' = t s",
        "how much later the sampled orbit crosses than the route",
    ),
    "route": Field(TEXT, (), "text", "vertices of the heteroclinic cycle in their order"),
    "plateaus": Field(
        FLOAT,
        ("symbols+2",),
        "rad",
        "theta3 near each periodic orbit, predicted by (tri1) to first order",
    ),
    "wound": Field(
        WHOLE, (2,), "1", "first and last sample between the first vertex and that of n_wound"
    ),
}
"""Fields of the route that it is to follow, decided beforehand, and of how well it does."""

LAYOUT: Layout = {"<cases>": {**SAMPLED, **OF_ROUTE}}
