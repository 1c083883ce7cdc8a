"""Cells of a plane of route codes: how many are established, and by what."""

from __future__ import annotations

import numpy as np

from rigidpend.experiments.data.tree import Data, Loaded
from rigidpend.machine.tables import Table

CAPTION = (
    "Each cell is an orbit, coloured by its route code: blue if it leaves on the left first, red if"
    " on the right, and shaded by what comes next. The closer to a line between two colours it"
    " starts, the longer it stays with a periodic orbit; one rotation longer, for a start or a"
    " weight exp(pi^2/nu) times smaller, and the same pattern comes again."
)


def tables(result: Loaded) -> list[Table]:
    """Table of the plane and of its zooms."""
    data = result["data"]
    planes = {"whole": data, **data.get("zooms", {})}
    header = ("plane", "columns", "rows", "symbols", "certain", "cells by return maps")
    axis, nu = str(data["y_axis"]), float(data["nu"])
    across = f"Across: {data['x_axis']}. " if "x_axis" in data else ""
    note = (
        f"{across}Upwards: {axis}. nu = {nu:.6f}: a zoom repeats after {np.exp(np.pi**2 / nu):.6g}."
    )
    return [Table("Planes", header, [_row(*pair) for pair in planes.items()], note)]


def _row(name: str, plane: Data) -> tuple[str, ...]:
    symbols, rows, columns = plane["codes"].shape
    certain = int(plane["certain"].sum())
    by_map = int(np.count_nonzero(plane["by_map"]))
    sizes = map(str, (columns, rows, symbols * rows * columns, certain, by_map))
    return (name, *sizes)
