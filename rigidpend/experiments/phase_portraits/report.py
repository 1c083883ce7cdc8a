"""Energies of the orbits of Fig. 1, and how well the separatrices close."""

from __future__ import annotations

import numpy as np

from rigidpend.experiments.data.tree import Loaded
from rigidpend.machine.tables import Column, Table

CAPTION = (
    "Without weight the angular momentum goes around two of the body's axes on closed curves;"
    " between these lie the separatrices 1 to 4, which join the two rotations about the middle"
    " axis. On the left on the sphere of the angular momentum, on the right in the plane of theta1"
    " and J1/J2. Closed forms; nothing is integrated."
)


def tables(result: Loaded) -> list[Table]:
    """Table of the orbits by height, and one of the separatrices."""
    orbits, separatrices = result["data"]["orbits"], result["data"]["separatrices"]
    kinds = np.stack((orbits["around"], orbits["height"]))
    (around, heights), first, counts = np.unique(
        kinds, axis=1, return_index=True, return_counts=True
    )
    begins = separatrices["offsets"][:-1]
    spread = float(np.abs(separatrices["level"]).max())
    return [
        Table.of(
            "Orbits, with their dimensionless energy H/J2^2 at J3 = 0",
            [
                Column("around", [f"M{axis:.0f}" for axis in around]),
                Column("largest |M3|/|M|", heights, "g"),
                Column("orbits", counts),
                Column("H/J2^2", orbits["energy"][first], ".10f"),
            ],
        ),
        Table.of(
            "Separatrices",
            [
                Column("number", separatrices["number"]),
                Column("theta1 (rad)", separatrices["theta1"][begins], ".10f"),
                Column("H/J2^2", separatrices["energy"], ".10f"),
            ],
            f"The integral that is 0 on a separatrix is at most {spread:.1g} J2^2 along them.",
        ),
    ]
