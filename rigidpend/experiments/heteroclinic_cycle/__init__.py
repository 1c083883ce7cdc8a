"""The heteroclinic cycle of separatrices and pendulum motions: Fig. 2."""

from rigidpend.experiments.compare import ROUNDING
from rigidpend.experiments.data import double, flag, held, text, whole

START = 2
"""Separatrix at the start; the rectangles on its two sides are called left and right."""

EDGES = {
    "from": text("1", "label of the vertex where the edge begins", "edges"),
    "to": text("1", "label of the vertex where the edge ends", "edges"),
    "theta1": double("rad", "of both ends as drawn, first the start", 2, "edges"),
    "J1": double("J2", "J1/J2 of both ends, first the start", 2, "edges"),
    "symbol": whole("1", "0 left, 1 right, 255 none (a separatrix)", "edges"),
    "again": flag("1", "whether it repeats another edge, 4 pi further", "edges"),
}
LAYOUT = held(
    ROUNDING,
    {
        "vertices": {
            "label": text(
                "1", "number of the separatrix, starred on J1 = J2", "vertices", coordinate=True
            ),
            "theta1": double("rad", "place of the vertex", "vertices"),
            "J1": double("J2", "J1/J2 of the vertex", "vertices"),
            "again": flag("1", "whether it repeats another vertex, 4 pi further", "vertices"),
        },
        "edges": EDGES,
        "rectangles": {
            "name": text("1", f"side of separatrix {START}: symbol 0, symbol 1", 2),
            "theta1": double("rad", "lower and upper bound of each", 2, 2),
        },
    },
)
