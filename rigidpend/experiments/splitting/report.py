"""Distances of the surfaces beside Melnikov's, and the powers of mu of what he leaves out."""

from __future__ import annotations

import numpy as np

from rigidpend.experiments.data.tree import Loaded
from rigidpend.machine.tables import Column, Table

CAPTION = (
    "The surfaces S1- and S2+ part as a cosine of the phase, with the amplitude that Melnikov's"
    " formula gives, the more exactly the smaller the weight is. On the section J1 = J2/2 the"
    " formula's curve errs by O(mu), its amplitude by O(mu^2). Each distance has an error of its"
    " own; those that no precision resolved are crossed out."
)


def tables(result: Loaded) -> list[Table]:
    """Table of the bodies: nu, amplitude at the smallest weight, powers of mu, resolved ones."""
    data = result["data"]
    bodies, weight = data["bodies"], float(data["mu_over_h0"][0])
    resolved = [f"{np.count_nonzero(each)} of {each.size}" for each in bodies["resolved"]]
    table = Table.of(
        f"Largest distance in theta1 at mu = {weight:g} h0, and powers of mu of the rest",
        [
            Column("body", bodies["name"]),
            Column("nu", bodies["nu"], ".4f"),
            Column("Melnikov (rad)", bodies["amplitude"][:, 0], ".6g"),
            Column("computed", bodies["largest"][:, 0], ".6g"),
            Column("power, curve", bodies["slope_curve"], ".4f"),
            Column("amplitude", bodies["slope_amplitude"], ".4f"),
            Column("resolved", resolved),
        ],
        f"Decided in {', '.join(map(str, np.unique(bodies['bits'])))} bits.",
    )
    return [table]
