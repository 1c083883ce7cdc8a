"""Shares of the line of starts whose first symbols are proven."""

from __future__ import annotations

from fractions import Fraction

from rigidpend.experiments.data.tree import Loaded
from rigidpend.machine.tables import Table

CAPTION = (
    "Single starts with their symbols by integration, and below them intervals of the line, all of"
    " whose orbits are proven to have the symbols there: i = 1 at the bottom, 0 black, 1 white;"
    " grey is what intervals so long do not prove. Beside each row is the share of the line on"
    " which so many symbols are proven."
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
