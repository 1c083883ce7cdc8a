"""The published routes and the published increment, beside those computed."""

from __future__ import annotations

from rigidpend.experiments.data.tree import Loaded
from rigidpend.machine.tables import Column, Table

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
    """Tables of routes and plateaus, printed values where the paper has the case."""
    cases = list(result["data"].values())
    # The keys are the paper's phases as doubles, and so are those of its config.
    published = ROUTES if result["attributes"].get("figure") == FIGURE else {}
    phases = [float(case["theta2_0"]) for case in cases]
    phase = Column("theta2_0", phases, "g")
    told = ["all symbols" if case["certain"].all() else "not all symbols" for case in cases]
    # Rounded first, so that no zero bears a sign.
    levels = [", ".join(f"{round(x, 4) + 0.0:.4f}" for x in case["plateaus"]) for case in cases]
    gains = [case["plateaus"][1] - case["plateaus"][0] for case in cases]
    return [
        Table.of(
            "Routes through the heteroclinic cycle",
            [
                phase,
                Column("printed", [published.get(x, "") for x in phases]),
                Column("computed", [case["route"] for case in cases]),
                Column("certain", told),
                Column("bits", [int(case["bits"]) for case in cases]),
            ],
        ),
        Table.of(
            "Plateaus of theta3 by (tri1), in radians",
            [
                phase,
                Column("plateaus", levels),
                Column("increment printed", [INCREMENT * (x in published) for x in phases]),
                Column("computed", gains, ".6f"),
            ],
        ),
    ]
