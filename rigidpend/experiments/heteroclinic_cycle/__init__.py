"""The heteroclinic cycle of separatrices and pendulum motions: Fig. 2."""

from __future__ import annotations

from rigidpend.experiments.compare import ROUNDING
from rigidpend.experiments.data import FLAG, FLOAT, TEXT, WHOLE, Field, Layout, held

START = 2
"""Separatrix of the start; the rectangles on its two sides are called left and right."""

GROUPS = {
    "vertices": {
        "label": Field(
            TEXT,
            ("vertices",),
            "1",
            "number of the separatrix, starred on J1 = J2",
            coordinate=True,
        ),
        "theta1": Field(FLOAT, ("vertices",), "rad", "place of the vertex"),
        "J1": Field(FLOAT, ("vertices",), "J2", "J1/J2 of the vertex"),
        "again": Field(FLAG, ("vertices",), "1", "whether it repeats another vertex, 4 pi further"),
    },
    "edges": {
        "from": Field(TEXT, ("edges",), "1", "label of the vertex where the edge begins"),
        "to": Field(TEXT, ("edges",), "1", "label of the vertex where the edge ends"),
        "theta1": Field(FLOAT, (2, "edges"), "rad", "of both ends as drawn, first the start"),
        "J1": Field(FLOAT, (2, "edges"), "J2", "J1/J2 of both ends, first the start"),
        "symbol": Field(WHOLE, ("edges",), "1", "0 left, 1 right, 255 none (a separatrix)"),
        "again": Field(FLAG, ("edges",), "1", "whether it repeats another edge, 4 pi further"),
    },
    "rectangles": {
        "name": Field(TEXT, (2,), "1", f"side of separatrix {START}: symbol 0, symbol 1"),
        "theta1": Field(FLOAT, (2, 2), "rad", "lower and upper bound of each"),
    },
}
LAYOUT: Layout = {name: held(ROUNDING, fields) for name, fields in GROUPS.items()}
