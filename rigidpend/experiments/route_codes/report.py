"""Precision that decided the symbols of each array, and their agreement with Melnikov's sign."""

from __future__ import annotations

import numpy as np

from rigidpend.experiments.data.tree import Data, Loaded
from rigidpend.machine.tables import Table

CAPTION = (
    "Orbits that start beside each other take the same turns at first and other ones later: the"
    " array is plain at the bottom and seems random at the top. A column is one initial phase"
    " theta2_0 on S1-; cell i, counted from below, says on which side the orbit leaves after its"
    " i-th passage: 0 black, 1 white."
)


def tables(result: Loaded) -> list[Table]:
    """Table of counts by precision, and of the first symbol against Melnikov's zeros."""
    arrays = result["data"].items()
    header = ("array", "columns", "symbols", "certain", "decided in", "Melnikov zeros")
    return [Table("Symbols and what decided them", header, [_row(*pair) for pair in arrays])]


def _row(name: str, array: Data) -> tuple[str, ...]:
    bits, counts = np.unique(array["bits"], return_counts=True)
    decided = ", ".join(f"{n} in {b} bits" for b, n in zip(bits, counts, strict=True))
    zeros = ", ".join(f"{x:.6f}" for x in array["melnikov_zeros"])
    codes = array["codes"]
    certain = int(np.count_nonzero(array["certain"]))
    return name, str(codes.shape[1]), str(codes.size), str(certain), decided, zeros
