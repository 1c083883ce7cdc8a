"""Sets that passages stretch across each other: a proof that every code occurs."""

from functools import partial
from typing import Any

from rigidpend.experiments.compare import of_largest, stated
from rigidpend.experiments.data import ANY, double, flag, held, whole
from rigidpend.experiments.shared import STEPS

COVERED = ("sets", "targets")
CLOSE = of_largest(1e-6)
"""Allowed difference of sets, over the largest: the map's error of 1e-16 in d is 1e-7 of a."""
MARGIN = 0.05
"""Allowed difference of a bound on |V|, which is less than 1 or nothing is proven."""
PHASE = 1e-13
"""Allowed difference of the middle of a line, whose phase the map tells to some 1e-14."""
SLOPES = 0.2
"""Allowed difference of a bound on V's slopes, also less than 1, to which every rounding adds."""
NEAR = stated(2.0**-12)
"""Allowed are all bounds on a distance that a proof admits: their digits depend on round-off."""


def _curve(*_: Any) -> Any:
    """Allowed differences of the coefficients of a curve, where |gamma3| is about a hundredth."""
    # Each makes a difference of about 1e-12 in d.
    return 1e-12, 1e-10, 1e-8, 1e-6, 1e-4


_number = partial(double, "1")

OF_SET = "the set of which a step is, counted from 0; then the line, and its approach"
OFF = "bound on the distance of the polynomials from the orbits"
QUADS = {
    "rising": flag("1", "whether it is on the section of upward crossings", "sets"),
    "p": _number("p: its curve U = 0 is d = sum of p_k gamma3^k", "sets", "curve", within=_curve),
    "a": _number("half of its width in d: U = (d - p(gamma3))/a", "sets"),
    "b": _number("V = (d - p(gamma3) - l0 - l1 gamma3)/b", "sets"),
    "l0": _number("see b", "sets"),
    "l1": _number("see b", "sets"),
    "symbol": whole("1", "symbol of the passage from it: 0 left, 1 right", "sets"),
    "bound": _number(OFF, "sets", within=NEAR),
    "late": double(
        "t'", "bound on the distance of the crossings from their ends", "sets", within=NEAR
    ),
    "shortest": double("t'", "least time of a passage from it", "sets"),
    "longest": double("t'", "largest time of a passage from it", "sets"),
}
RELATIONS = {
    "target": whole("1", "the sets that it covers, counted from 0", *COVERED),
    "orientation": whole("1", "1 or -1: end of the target beyond which u = 1 goes", *COVERED),
    "edge": _number("lower bound on |U| of the images of u = -1 and 1", *COVERED, within=ANY),
    "across": _number("upper bound on |V| of the whole image", *COVERED, within=MARGIN),
    "stretch": _number("lower bound on |dU/du| - |dU/dv| of the passage", *COVERED, within=ANY),
    "squeeze": _number("upper bound on |dV/du| + |dV/dv| of the passage", *COVERED, within=SLOPES),
}
LINE = {
    "e1": _number("e1 gamma1 + e2 gamma2 = centre + half u, u from -1 to 1"),
    "e2": _number("see e1"),
    "centre": _number("see e1", within=PHASE),
    "half": _number("see e1"),
    "wide": _number("Qm = wide v, v from -1 to 1, on a strip about it"),
    "theta2": double("rad", "theta2 at its ends, about", 2),
    "bound": _number(OFF, within=NEAR),
    "target": whole(
        "1", "the sets that it, or the last set of the approach, crosses, from 0", "targets"
    ),
    "edge": _number("lower bound on |U| at its ends", "targets", within=ANY),
    "across": _number("upper bound on |V| of all of it", "targets", within=MARGIN),
    "stretch": _number("lower bound on |dU/du| along it", "targets", within=ANY),
    "squeeze": _number("upper bound on |dV/du| along it", "targets", within=SLOPES),
}
APPROACH = {
    name: QUADS[name]._replace(dimensions=("passages",))
    for name in ("rising", "a", "b", "l0", "l1", "symbol")
} | {"p": QUADS["p"]._replace(dimensions=("passages", "coefficients"))}
"""Fields of the sets between the line of starts and the full shift; each covers the next."""
ENERGIES = {
    "shift": _number("energies are h or h0 + shift + spread w, w from -1 to 1", within=_curve),
    "spread": _number("see shift"),
    "moves": _number("what w, w^2 and so on add to p", "sets", "orders", "curve", within=ANY),
    "line": _number("what w, w^2 and so on add to centre", "line orders", within=ANY),
}
DRAWN = {
    "chi": double("rad", "chi around the sets", "sets", "outline"),
    "d": _number("d around the sets, less the stable surface's", "sets", "outline"),
    "image_chi": double("rad", "chi around their images", "sets", "outline"),
    "line_chi": double("rad", "chi along the image of the line of starts", "line"),
    "line_d": _number("d along it, less the stable surface's", "line"),
    "image_d": _number("d around them, less the stable surface's", "sets", "outline"),
}
PROOF = {**STEPS, "family": STEPS["family"]._replace(description=OF_SET)}
LAYOUT = held(
    CLOSE,
    {
        "sets": QUADS,
        "relations": RELATIONS,
        "line": LINE,
        "energies?": ENERGIES,
        "approach?": APPROACH,
        "proof": PROOF,
        "drawn": DRAWN,
    },
)
