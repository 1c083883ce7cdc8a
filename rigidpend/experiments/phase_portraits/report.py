"""Energies of the orbits of Fig. 1, and how well the separatrices close."""

from __future__ import annotations

import numpy as np

from rigidpend.experiments.data.tree import Loaded
from rigidpend.machine.tables import Table

CAPTION = (
    "Without weight the angular momentum goes around two of the body's axes on closed curves;"
    " between these lie the separatrices 1 to 4, which join the two rotations about the middle"
    " axis. On the left on the sphere of the angular momentum, on the right in the plane of theta1"
    " and J1/J2. Closed forms; nothing is integrated."
)


def tables(result: Loaded) -> list[Table]:
    """Table of the orbits by height, and one of the separatrices."""
    orbits, separatrices = result["data"]["orbits"], result["data"]["separatrices"]
    keys = sorted(set(zip(orbits["around"].tolist(), orbits["height"].tolist(), strict=True)))
    rows = []
    for around, height in keys:
        [*same] = np.flatnonzero((orbits["around"] == around) & (orbits["height"] == height))
        energy = float(orbits["energy"][same[0]])
        rows.append((f"M{around}", f"{height:g}", str(len(same)), f"{energy:.10f}"))
    spread = float(np.abs(separatrices["level"]).max())
    first = separatrices["offsets"][:-1]
    lines = [
        (str(number), f"{separatrices['theta1'][start]:.10f}", f"{energy:.10f}")
        for number, start, energy in zip(
            separatrices["number"], first, separatrices["energy"], strict=True
        )
    ]
    return [
        Table(
            "Orbits, with their dimensionless energy H/J2^2 at J3 = 0",
            ("around", "largest |M3|/|M|", "orbits", "H/J2^2"),
            rows,
        ),
        Table(
            "Separatrices",
            ("number", "theta1 (rad)", "H/J2^2"),
            lines,
            f"The integral that is 0 on a separatrix is at most {spread:.1g} J2^2 along them.",
        ),
    ]
