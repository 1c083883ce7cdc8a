"""Finite-time Lyapunov exponents over a plane of initial phase and action."""

from functools import partial
from typing import Any

import numpy as np

from rigidpend.experiments.compare import ROUNDING, of_largest, stated, where
from rigidpend.experiments.data import Data, Layout, double, whole
from rigidpend.experiments.shared import CODES, MEANING

LOST = 1e-3
"""Allowed share of cells known in only one of two results, because rounding differs.

So many cells may move a quantile by the distance of neighbouring values: `QUANTILE`."""
QUANTILE = 1e-3
MARGIN = 2
"""Allowed difference of two results, in units of the bound of rounding in each."""


def _both(stored: Data, fresh: Data, name: str) -> Any:
    return np.isfinite(stored[name]) & np.isfinite(fresh[name])


# Symbols must be equal where both results know the exponent.
_KNOWN = where(lambda stored, fresh: _both(stored, fresh, "exponent"))


def _rounded(name: str, stored: Data, fresh: Data) -> Any:
    """Bound of exponents: where both are known, they differ by the stored bounds of rounding."""
    both = _both(stored, fresh, "exponent")
    lost = np.isfinite(stored["exponent"]) & ~both
    # Up to a share `LOST` of cells may cease to be known; if there are more, all are compared,
    # so that NaN against a number is reported.
    held = both | lost if lost.mean() > LOST else both
    return np.where(held, MARGIN * stored["allowed"], np.inf)


def _grown(name: str, stored: Data, fresh: Data) -> Any:
    """The stored bound for the growths by both methods; that of the map is a small part of it."""
    return np.where(_both(stored, fresh, "growth"), stored["allowed"], np.inf)


_cell = partial(double, "1", dimensions=("rows", "columns"), gaps=True, within=_rounded)
_checked = partial(double, "1", dimensions=("checked",), gaps=True)
_axis = partial(double, within=of_largest(ROUNDING))

LOG10_J1_0 = _axis(
    "1", "decadic logarithms of the rows' initial actions", "rows", symbol=r"$\log_{10} J_1^0$"
)
LAYOUT: Layout = {
    "codes": whole(
        "1",
        "symbols: 0 left, 1 right, 255 no return",
        "symbols",
        "rows",
        "columns",
        within=_KNOWN,
        among=CODES,
    ),
    "exponent": _cell(
        "ln of the growth of the deviation that grows most through all passages, a"
        " passage, on the section M3 = 0 at the orbit's energy, in the Euclidean norm of"
        " (M', gamma), where M' grows with the root of the energies; NaN where the code is not"
        " certain, return maps do not reach, or the bound of rounding is not less than the exponent"
    ),
    "allowed": _cell("bound of the exponent's rounding, a power of two; NaN as above"),
    "theta2_0": MEANING["theta2_0"]._replace(
        description="initial phases of the columns", within=of_largest(ROUNDING)
    ),
    "log10_J1_0": LOG10_J1_0,
    "marked": _axis("1", "log10 of the config's own J1_0"),
    "growth": {
        "passages": whole("1", "passages through which deviations have grown", "symbols"),
        "share": double("1", "shares of the cells whose exponents are below", "shares"),
        "exponent": double(
            "1",
            "quantiles of the cells' exponents",
            "shares",
            "symbols",
            gaps=True,
            within=QUANTILE,
        ),
    },
    "checked": {
        "row": whole("1", "row of the cell", "checked"),
        "column": whole("1", "column of the cell", "checked"),
        "growth": _checked("ln of the growth through all passages; NaN as above", within=_grown),
        # An error that one result states of itself: the difference of both methods within it.
        "difference": _checked(
            "that by the variational equations, integrated, less it",
            within=stated(_grown),
        ),
        "allowed": _checked("bound of the rounding of both growths", within=_grown),
    },
}
