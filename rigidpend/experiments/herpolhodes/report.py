"""The published routes and the published increment, beside those computed."""

from __future__ import annotations

import numpy as np

from rigidpend.experiments.data.tree import Data, Loaded
from rigidpend.machine.tables import Table

CAPTION = (
    "The angle of precession stays at a plateau, swings as the orbit goes along a separatrix, and"
    " goes on to the next plateau, as (tri1) predicts. Beside it the curve of the angular velocity"
    " in a horizontal plane."
)

FIGURE = "5"
"""Figure of the paper to which the printed values belong."""
ROUTES = {
    1.02: "2-2*-1*-1-4-4*-3*-3-4-4*-1*-1",
    1.83: "2-2*-3*-3-4-4*-1*-1-2-2*-1*-1",
}
"""Routes that the paper prints, by theta2_0."""
INCREMENT = "0.057715"
"""Increment of theta3 along separatrices 1 and 2, as the paper prints it."""


def tables(result: Loaded) -> list[Table]:
    """Tables of routes and plateaus, from a loaded result."""
    cases = result["data"].values()
    published = result["attributes"].get("figure") == FIGURE
    return [
        Table(
            "Routes through the heteroclinic cycle",
            ("theta2_0", "printed", "computed", "certain", "bits"),
            [_route(case, published) for case in cases],
        ),
        Table(
            "Plateaus of theta3 by (tri1), in radians",
            ("theta2_0", "plateaus", "increment printed", "computed"),
            [_plateaus(case, published) for case in cases],
        ),
    ]


def _route(case: Data, published: bool) -> tuple[str, ...]:
    theta2_0 = float(case["theta2_0"])
    certain = "all symbols" if np.all(case["certain"]) else "not all symbols"
    # The keys are the paper's phases as doubles, and so are those of its config.
    printed = ROUTES.get(theta2_0, "") if published else ""
    return f"{theta2_0:g}", printed, str(case["route"]), certain, str(case["bits"])


def _plateaus(case: Data, published: bool) -> tuple[str, ...]:
    plateaus = case["plateaus"]
    # Rounded first, so that no zero bears a sign.
    shown = ", ".join(f"{round(x, 4) + 0.0:.4f}" for x in plateaus)
    printed = INCREMENT if published and float(case["theta2_0"]) in ROUTES else ""
    return f"{float(case['theta2_0']):g}", shown, printed, f"{plateaus[1] - plateaus[0]:.6f}"
