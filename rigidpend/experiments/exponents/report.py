"""Finite-time exponents: their quantiles by the number of passages, and their check."""

from __future__ import annotations

import numpy as np

from rigidpend.experiments.data.tree import Data, Loaded
from rigidpend.machine.tables import Column, Table

CAPTION = (
    "Orbits that start side by side part fastest (bright) along the lines where a symbol of their"
    " route code changes. The exponent is the logarithm of the largest growth of a deviation"
    " through some passages, a passage, from the derivatives of the return map, in the Euclidean"
    " norm of (M', gamma), dimensionless, on the section at the orbit's energy. In some cells the"
    " variational equations are integrated as well."
)


def tables(result: Loaded) -> list[Table]:
    """Table of the quantiles, with the check below."""
    data = result["data"]
    growth = data["growth"]
    quantiles = zip(growth["share"], growth["exponent"], strict=True)
    below = [Column(f"{100 * share:.0f} % of cells below", x, ".4f") for share, x in quantiles]
    columns = [Column("passages", growth["passages"]), *below]
    return [Table.of("Finite-time exponents, a passage", columns, _note(data))]


def _note(data: Data) -> str:
    exponent, difference = data["exponent"], np.abs(data["checked"]["difference"])
    known, held = np.isfinite(exponent), difference[np.isfinite(difference)]
    found = f"{int(known.sum())} of {known.size} cells are known."
    if not held.size:
        return found
    return (
        f"{found} The variational equations differ by {np.median(held):.1g} in ln of the growth"
        f" (median of {held.size} cells), by {held.max():.1g} at most."
    )
