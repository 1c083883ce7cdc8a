"""Closed orbits by their codes, with multipliers and actions."""

from functools import partial

from rigidpend.experiments.compare import relative, stated
from rigidpend.experiments.data import double, flag, held, whole

CLOSE = 1e-9
"""Allowed difference of places and averages: the map's error of 1e-13 times its growth."""

_double, _flag = (partial(kind, dimensions=("words",)) for kind in (double, flag))
_gap = partial(_double, "1", gaps=True, within=stated(1e-15))

ORBITS = {
    "word": whole(
        "1",
        "symbols, read from a passage past the upper orbit on; 255 behind the end",
        "words",
        "longest",
    ),
    # `scripts.stated` measures the errors of period and action: 3e-13 and 1e-13 at most.
    "period": _double("t'", "time of the word's passages, twice for odd words", within=1e-12),
    "action": _double("1", "integral of J1 dtheta1 + J2 dtheta2 over that time", within=1e-12),
    "mirrored": _flag("1", "whether it is at its mirror image after these passages"),
    "positive": _flag("1", "whether the Floquet multiplier of these is positive"),
    "exponent": _double(
        "1",
        "ln of the Floquet multiplier's modulus, per passage",
        within=relative(2, to="exponent_error"),
    ),
    "exponent_error": _double(
        "1",
        "bound of its rounding, the larger the less surfaces are split",
        within=relative(0.01),
    ),
    "stable": _flag("1", "whether the orbit is elliptic"),
    "residual": _double("rad", "largest gap where passages meet, by the map", within=stated(1e-10)),
    # In doubles, whose roundings of 1e-16 grow by a factor of some 1e5 in (d, chi).
    "alone": _double(
        "t'",
        "largest error of a passage's time, each integrated alone in doubles",
        within=stated(relative(6e-12, to="period")),
    ),
    "closing": _gap("gap in d and chi after one period in 113 bits; NaN if not verified"),
    "closing_expected": _gap("what roundings leave of that gap, grown for a period"),
}
AVERAGES = {
    "length": whole("1", "symbols of the words that are averaged over", "lengths"),
    "points": whole("1", "upward crossings of the orbits that repeat such a word", "lengths"),
    "mean": double("1", "Lyapunov exponent per passage, all these words alike", "lengths"),
    "long_orbit": double("1", "that of a long orbit of random symbols, per passage"),
    "long_orbit_error": double("1", "its standard error, from ten parts of the orbit"),
}
PLACES = {
    "chi": double("rad", "chi of all upward crossings, from -pi to pi", "points"),
    "d": double("1", "d of all upward crossings", "points"),
    "of": whole("1", "place of the orbit in the list", "points"),
}
LAYOUT = held(CLOSE, {"orbits": ORBITS, "averages": AVERAGES, "places": PLACES})
