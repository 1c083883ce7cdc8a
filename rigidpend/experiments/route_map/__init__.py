"""Route codes over a plane of two parameters."""

from functools import partial
from typing import Any

import numpy as np

from rigidpend.experiments.compare import ROUNDING, of_largest, where
from rigidpend.experiments.data import ANY, Data, Layout, double, flag, text, whole
from rigidpend.experiments.shared import CODES

LOST = 1e-3
"""Allowed mean number of certain symbols lost per cell, because rounding differs."""


def _kept(name: str, stored: Data, fresh: Data) -> Any:
    """Bound of certainty: cells on the edge of a precision may lose a symbol, but only a few."""
    lost = np.clip(stored[name].astype(int) - fresh[name], 0, None)
    free = lost == 0 if lost.mean() > LOST else np.ones(lost.shape, dtype=bool)
    return np.where(free & (fresh[name] <= len(fresh["codes"])), np.inf, 0.0)


@where
def _known(stored: Data, fresh: Data) -> Any:
    """Mask of the symbols that are certain in both results, which must be equal."""
    both = np.minimum(stored["certain"], fresh["certain"])
    return np.arange(len(stored["codes"]))[:, None, None] < both


KINDS = "theta2_0 (rad), log10_J1_0, mu, h0 (physical units), beta0 or alpha0 (rad)"
_axis, _own = (partial(double, within=within) for within in (of_largest(ROUNDING), ROUNDING))

PLANE = {
    "codes": whole(
        "1",
        "symbols, layer 0 = symbol 1: 0 left, 1 right, 255 none (no return)",
        "symbols",
        "rows",
        "columns",
        within=_known,
        among=CODES,
    ),
    "certain": whole(
        "1", "how many of the first symbols are established", "rows", "columns", within=_kept
    ),
    "by_map": flag(
        "1", "whether return maps found the cell, not integration", "rows", "columns", within=ANY
    ),
    "x": _axis("rad, or see x_axis", "theta2_0 of the columns, or what x_axis says", "columns"),
    "y": _axis("see y_axis", "values of the rows", "rows"),
}
LAYOUT: Layout = {
    **PLANE,
    "y_axis": text("", f"what y is: {KINDS}"),
    "marked": _own("see y_axis", "the row of the config's own value"),
    "x_axis?": text("", f"what x is: {KINDS}"),
    "marked_x?": _own("see x_axis", "the column of the config's own value"),
    "nu": _own("1", "nu, by which a change of a symbol repeats: exp(pi^2/nu)"),
    "zooms?": {"<zooms>": PLANE},
}
