"""Intervals of initial phases on which all orbits are proven to have the same first symbols."""

from rigidpend.experiments.data import Layout, double, whole
from rigidpend.experiments.shared import CODES, MEANING, STEPS

INTERVALS = {
    "place": whole(
        "1", "theta2_0 is from 2 pi place/2^depth to 2 pi (place + 1)/2^depth", "intervals"
    ),
    "depth": whole("1", "see place", "intervals"),
    "codes": whole(
        "1",
        "symbols of all orbits that start there: 0 left, 1 right, 255 not proven",
        "symbols",
        "intervals",
        among=CODES,
    ),
}
SHARES = double("1", "share of the line on which so many symbols are proven, exact", "symbols")
COLUMNS = {
    "theta2_0": MEANING["theta2_0"],
    # Columns have more symbols than are proven for intervals, so the dimension is another.
    **{
        name: MEANING[name]._replace(dimensions=("rows", "columns"))
        for name in ("codes", "certain")
    },
}
PROOF = {
    **STEPS,
    "family": STEPS["family"]._replace(
        description="the interval of which a step is, counted from 0; what is finer counts on"
    ),
}
LAYOUT: Layout = {"intervals": INTERVALS, "shares": SHARES, "columns": COLUMNS, "proof": PROOF}
