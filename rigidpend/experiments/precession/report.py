"""Increments of theta3 beside the first order, and the powers of mu of what is left."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from rigidpend.experiments.data.tree import Loaded
from rigidpend.machine.tables import Column, Table

CAPTION = (
    "What theta3 gains along a separatrix is close to the first order (tri1), in each of the"
    " regimes of (trieq): the filled marks lie in the open ones. What the first order leaves out"
    " falls as mu^2 along each orbit, and as mu^3 in the mean of the two."
)


def tables(result: Loaded) -> list[Table]:
    """Table of the drawn weight, and one of the slopes."""
    data = result["data"]
    bodies, drawn = data["bodies"], int(data["drawn"])
    name = Column("body", bodies["name"])
    # A zero is added, so that none bears a sign.
    gained = bodies["gained"].mean(axis=2)[:, drawn].T + 0.0
    pairs = list(zip(gained, bodies["first_order"][:, drawn].T + 0.0, strict=True))
    both = [[f"{x:.6f} ({y:.6f})" for x, y in zip(*pair, strict=True)] for pair in pairs]
    ordered = np.count_nonzero(bodies["ordered"]), bodies["ordered"].size
    return [
        Table.of(
            f"Increments of theta3 in radians at mu = {float(data['mu_over_h0'][drawn]):g} h0,"
            " mean of two orbits, with (tri1) in brackets",
            [name, *(Column(f"separatrix {k}", values) for k, values in enumerate(both, 1))],
        ),
        Table.of(
            "Powers of mu by which the rest falls",
            [
                name,
                Column("order of the separatrices by (trieq)", bodies["regime"]),
                Column("of an orbit", map(_range, bodies["slope"])),
                Column("of the mean", map(_range, bodies["mean_slope"])),
            ],
            f"The order is that of (trieq) in {ordered[0]} of {ordered[1]} cases of body and mu.",
        ),
    ]


def _range(slopes: NDArray[np.float64]) -> str:
    """Least and largest of some slopes; those of mere rounding are left out."""
    known = slopes[np.isfinite(slopes)]
    return f"{known.min():.3f} to {known.max():.3f}" if known.size else "rounding"
