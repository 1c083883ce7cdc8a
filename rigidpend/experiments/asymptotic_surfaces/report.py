"""Table 1 beside the angles computed, and the initial width of each surface."""

from __future__ import annotations

from typing import Any

from rigidpend.experiments.data.tree import Loaded
from rigidpend.machine.tables import Table

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
    """Table 1 and the widths Delta_1, from a loaded result."""
    data = result["data"]
    table, bodies = data["table"], data["bodies"]
    published = result["attributes"].get("figure") == FIGURE
    header = ("body", "alpha0 printed", "computed", "gamma0 printed", "computed", "nu", "Delta_1")
    rows = [
        (
            name,
            *_pair("alpha0", table, k, published),
            *_pair("gamma0", table, k, published),
            f"{table['nu'][k]:.4f}",
            f"{bodies[name]['Delta_1']:.5f}",
        )
        for k, name in enumerate(bodies)
    ]
    return [Table("Table 1, in radians, with nu and Delta_1 (dt)", header, rows)]


def _pair(name: str, table: Any, k: int, published: bool) -> tuple[str, str]:
    """Printed value, where the paper has the body, beside the computed one."""
    same = published and len(table[name]) == len(PRINTED[name])
    printed = PRINTED[name][k] if same else ""
    return printed, f"{table[name][k]:.7f}"
