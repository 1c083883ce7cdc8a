"""Magnifications of Fig. 4 about a change of a symbol."""

from rigidpend.experiments.compare import ROUNDING, relative
from rigidpend.experiments.data import ANY, Layout, double, text, whole
from rigidpend.experiments.shared import MEANING, TIME_GAP, crossed

LEVEL = {
    **{name: field for name, field in MEANING.items() if name != "theta2_0"},
    "bits": MEANING["bits"]._replace(
        description="precision that decided the column, relative to its distance from the change"
    ),
    # Beside a doubly asymptotic orbit errors grow as fast as the zoom: only the bound that
    # certain symbols imply is left for times of crossings.
    "crossing_time": MEANING["crossing_time"]._replace(within=crossed(lambda crossings: TIME_GAP)),
    # Phases finer than doubles: the exact numbers that were used, and doubles for the drawing.
    "centre": text("rad", "theta2_0 of the middle, exact"),
    "theta2_0": text("rad", "initial phase of each column, exact", "columns", coordinate=True),
    "offset": double(
        "rad",
        "theta2_0 of each column less the centre, rounded to a double",
        "columns",
        within=relative(ROUNDING, to="step"),
        coordinate=True,
    ),
    "step": double("rad", "spacing of the columns, rounded to a double", within=relative(ROUNDING)),
}
LAYOUT: Layout = {
    "levels": {"<levels>": LEVEL},
    "repeats_after": double(
        "1", "zoom after which the rows repeat, exp(pi^2/nu)", within=10 * ROUNDING
    ),
    "symbol": whole("1", "the symbol that changes at the centre"),
    "reference_bits": whole(
        "bit", "precision of the reference orbit beside which columns were followed", within=ANY
    ),
}
