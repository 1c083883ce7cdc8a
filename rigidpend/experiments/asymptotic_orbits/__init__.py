"""Doubly asymptotic orbits with short codes, and the gain of theta3 along them."""

from functools import partial

from rigidpend.experiments.compare import of_largest, stated
from rigidpend.experiments.data import Layout, double, flag, held, text, whole
from rigidpend.experiments.shared import CODES, MEANING, kept, known

DIGIT = 1e-29
"""A unit of the 30th digit of a phase, and the largest error that a result may state of one."""
SAMPLED = 1e-6
"""Allowed difference of drawn samples: passages before them amplify the rounding of doubles."""

_double, _whole = (partial(kind, dimensions=("orbits",)) for kind in (double, whole))
_symbols = partial(whole, "1", dimensions=("symbols", "orbits"))
_sample = partial(double, dimensions=("samples",))

ORBITS = {
    "word": _symbols("symbols: 0 left, 1 right"),
    "half_turns": _symbols("half rotations of each passage"),
    "first": _whole("1", "parity of the first crossing's cell: 0 is a, 1 is b"),
    "theta2_0": _double("rad", "theta2 where J1 = J1_0 on the unstable surface, ascending"),
    # A phase of 30 digits fixes its double; only the rest may differ, by the errors of two results.
    "theta2_0_rest": _double(
        "rad", "what theta2_0 leaves: their sum has 30 digits", within=2 * DIGIT
    ),
    # Times and angles err by some 1e-13 a crossing. Where surfaces are split little, the map's
    # orbit is displaced; but the time is integrated, and theta3 changes only in second order.
    "flight": _double("t'", "time from the first crossing to the last", within=1e-10),
    "theta3": _double("rad", "growth of theta3 from one end to the other", within=1e-12),
    "residual": _double(
        "1",
        "largest gap of the map where passages meet: rad, widths of tables",
        within=stated(1e-11),
    ),
    # Where surfaces are split little, the map in doubles errs by more than 1e-12.
    "moved": _double(
        "rad",
        "theta2_0 by integration less that by the map in doubles",
        within=stated(of_largest(10, least=1e-13)),
    ),
    "error": _double(
        "rad",
        "error of theta2_0 at most: its last correction, or what roundings do",
        within=stated(DIGIT),
    ),
    "arcs": whole("1", "arcs of the unstable surface on which the orbits were sought"),
    "ends": text("text", "homoclinic (to the lower orbit) or heteroclinic (to the upper)"),
}
PLANE = {
    "theta2_0": MEANING["theta2_0"]._replace(description="initial phases of Fig. 4's orbits"),
    "codes": whole(
        "1", "their symbols: 0, 1, 255 no return", "symbols+1", "columns", within=known, among=CODES
    ),
    "certain": flag("1", "whether the symbol is established", "symbols+1", "columns", within=kept),
}
DRAWN = {
    "orbit": whole("1", "place of the orbit among those with as many symbols"),
    "t": _sample("t'", "time, 0 at the first crossing", coordinate=True),
    "theta1": _sample("rad", "0 .. 4 pi"),
    "J1_over_J2": _sample("1", "0 at the lower periodic orbit, 1 at the upper", symbol="$J_1/J_2$"),
    "theta3": _sample("rad", "precession angle since the lower periodic orbit"),
    "omega": double("1/t", "omega_xi, omega_eta, omega_zeta, physical; xi is upward", "samples", 3),
}
LAYOUT: Layout = {
    "orbits": {"<lengths>": ORBITS},
    "plane": PLANE,
    "drawn": {"<drawn>": held(SAMPLED, DRAWN)},
}
