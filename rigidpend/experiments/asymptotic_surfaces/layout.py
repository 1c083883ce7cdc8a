"""Layout of a result of `asymptotic_surfaces`."""

from __future__ import annotations

from rigidpend.experiments.data.layout import (
    FLOAT,
    WHOLE,
    Field,
    Layout,
)

BODIES = ("bodies",)

ANGLES = {
    "alpha0": Field(FLOAT, BODIES, "rad", "alpha0 of each body, in the order of the bodies"),
    "gamma0": Field(FLOAT, BODIES, "rad", "gamma0 of each body"),
    "nu": Field(FLOAT, BODIES, "1", "pi kappa/sin(alpha0) of each body"),
}
"""Columns of Table 1, with nu by which the paper orders its panels."""
WINDOW = {
    "centre": Field(FLOAT, (), "rad", "alpha0 + beta0, theta1 on separatrix 2"),
    "Delta_1": Field(
        FLOAT, (), "rad", "largest |theta1 - alpha0 - beta0| near T1 and T2, eq. (dt)"
    ),
    "born": Field(FLOAT, (2,), "rad", "centre -+ Delta_1"),
    "window": Field(FLOAT, (2,), "rad", "centre -+ half_width Delta_1"),
    "time_step": Field(FLOAT, (), "t' = t s", "step between samples"),
}
"""The window of a body's two panels."""


def _curves(name: str) -> dict[str, Field]:
    """The curves of one surface, with dimensions of their own."""
    points, orbits = f"points of {name}", f"orbits of {name}"
    return {
        "theta1": Field(FLOAT, (points,), "rad", "all curves, one after the other"),
        "J1_over_J2": Field(FLOAT, (points,), "1", "all curves, one after the other"),
        "sample": Field(
            WHOLE,
            (points,),
            "1",
            "time of each point in time_step, from the start; S2+ runs backward",
        ),
        "offsets": Field(WHOLE, (f"{orbits}+1",), "1", "curve k is offsets[k]:offsets[k + 1]"),
        "theta2_0": Field(FLOAT, (orbits,), "rad", "theta2 at the start of each orbit"),
    }


CURVES = {name: _curves(name) for name in ("S1_minus", "S2_plus")}
"""Fields of each surface, whose dimensions are its own: the two differ in their points."""

LAYOUT: Layout = {"table": ANGLES, "bodies": {"<bodies>": {**WINDOW, **CURVES}}}
