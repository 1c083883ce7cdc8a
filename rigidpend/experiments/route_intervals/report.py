"""Shares of the line of starts whose first symbols are proven."""

from __future__ import annotations

from fractions import Fraction

from rigidpend.experiments.data.tree import Loaded
from rigidpend.machine.tables import Table

CAPTION = (
    "All orbits that start on an interval of the line are proven to have the symbols in it: i = 1"
    " at the bottom, 0 black, 1 white; grey is what intervals so long do not prove. Beside each"
    " row is the share of the line on which so many symbols are proven. The line is that of the"
    " left array of Fig. 4, which has columns of single starts."
)


def tables(result: Loaded) -> list[Table]:
    """Table of the shares."""
    data = result["data"]
    count = data["intervals"]["place"].size
    rows = [
        (str(n), str(Fraction(float(share))), f"{float(share):.6g}")
        for n, share in enumerate(data["shares"], 1)
    ]
    header = ("symbols", "share of the line", "about")
    return [Table("Starts whose first symbols are proven", header, rows, f"{count} intervals.")]
