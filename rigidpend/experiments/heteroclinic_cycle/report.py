"""Vertices and edges of the heteroclinic cycle of Fig. 2."""

from __future__ import annotations

import numpy as np

from rigidpend.experiments.data.tree import Data, Loaded
from rigidpend.machine.tables import Column, Table

CAPTION = (
    "At the end of each separatrix, 1 to 4, a body with a weight turns to the left or to the"
    " right, symbol 0 or 1, and so on along the next: this graph is the alphabet of the route"
    " codes. Its vertices are the two rotations about the middle axis, in the plane of theta1 and"
    " J1/J2."
)


def tables(result: Loaded) -> list[Table]:
    """Table of the separatrices' places, and of the turns with their symbols."""
    vertices, edges = result["data"]["vertices"], result["data"]["edges"]
    once = ~vertices["again"]
    return [
        Table.of(
            "Vertices; starred ones on J1 = J2",
            [
                Column("vertex", vertices["label"][once]),
                Column("theta1 (rad)", vertices["theta1"][once], ".10f"),
                Column("J1/J2", vertices["J1"][once], "g"),
            ],
        ),
        Table(
            "Turns by their symbol",
            ("symbol", "turns"),
            [("0, left", _turns(edges, 0)), ("1, right", _turns(edges, 1))],
        ),
    ]


def _turns(edges: Data, symbol: int) -> str:
    """Edges of a symbol, each once."""
    chosen = np.flatnonzero((edges["symbol"] == symbol) & ~edges["again"])
    return ", ".join(f"{edges['from'][k]} to {edges['to'][k]}" for k in chosen)
