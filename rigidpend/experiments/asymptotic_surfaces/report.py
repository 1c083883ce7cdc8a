"""Table 1 beside the angles computed, and the initial width of each surface."""

from __future__ import annotations

from rigidpend.experiments.data.tree import Loaded
from rigidpend.machine.tables import Column, Table

CAPTION = (
    "With a weight the orbits that leave one rotation (S1-, below) and those that approach the"
    " other (S2+, above) no longer lie on separatrix 2 but sway on both sides of it, for each body"
    " in its own way. In units of Delta_1. Dashed: how far the formula (dt) lets them swing beside"
    " their own orbit."
)

FIGURE = "3"
"""Figure of the paper to which the printed values belong."""
PRINTED = {
    "alpha0": ("2.91891", "2.23654", "1.23096", "1.61146", "1.97724", "0.79020", "0.56207"),
    "gamma0": ("2.46192", "1.95519", "0.92730", "1.34948", "1.77215", "0.57351", "0.40272"),
}
"""Table 1 of the paper, bodies a to g."""


def tables(result: Loaded) -> list[Table]:
    """Table 1, printed values where the paper has the bodies, and the widths Delta_1."""
    table, bodies = result["data"]["table"], result["data"]["bodies"]
    published = result["attributes"].get("figure") == FIGURE
    columns = [Column("body", bodies)]
    for name, printed in PRINTED.items():
        same = published and len(bodies) == len(printed)
        columns += [
            Column(f"{name} printed", printed if same else [""] * len(bodies)),
            Column("computed", table[name], ".7f"),
        ]
    widths = [body["Delta_1"] for body in bodies.values()]
    columns += [Column("nu", table["nu"], ".4f"), Column("Delta_1", widths, ".5f")]
    return [Table.of("Table 1, in radians, with nu and Delta_1 (dt)", columns)]
