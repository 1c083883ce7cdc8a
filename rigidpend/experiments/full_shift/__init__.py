"""Sets that passages stretch across each other: a proof that every code occurs.

Here is the layout of a result: what it consists of, with unit and bound.
"""

from __future__ import annotations

from rigidpend.experiments.compare import bound, of_largest, stated
from rigidpend.experiments.data import ANY, FLAG, FLOAT, WHOLE, Field, Layout, held
from rigidpend.experiments.shared import STEPS

SETS, COVERED, CROSSED = ("sets",), ("sets", "targets"), ("targets",)
CLOSE = of_largest(1e-6)
"""Allowed difference of sets, of the largest: the map errs by 1e-16 in d, which is 1e-7 of a."""
CURVE = bound(lambda *_: [1e-12, 1e-10, 1e-8, 1e-6, 1e-4])
"""Allowed difference of the coefficients of a curve, over |gamma3| of a hundredth."""
MARGIN = 0.05
"""Allowed difference of a bound on |V|, which is less than 1 or nothing is proven."""
PHASE = 1e-13
"""Allowed difference of the middle of a line, of which the map tells the phase to some 1e-14."""
SLOPES = 0.2
"""Allowed difference of a bound on its slopes, less than 1 too, to which all roundings add."""
NEAR = stated(2.0**-12)
"""The bound on a distance, as large as a proof admits; its digits hang on roundings."""

QUADS = {
    "rising": Field(FLAG, SETS, "1", "whether it is on the section of upward crossings"),
    "p": Field(
        FLOAT, ("sets", "curve"), "1", "p: its curve U = 0 is d = sum of p_k gamma3^k", within=CURVE
    ),
    "a": Field(FLOAT, SETS, "1", "half of its width in d: U = (d - p(gamma3))/a"),
    "b": Field(FLOAT, SETS, "1", "V = (d - p(gamma3) - l0 - l1 gamma3)/b"),
    "l0": Field(FLOAT, SETS, "1", "see b"),
    "l1": Field(FLOAT, SETS, "1", "see b"),
    "symbol": Field(WHOLE, SETS, "1", "symbol of the passage from it: 0 left, 1 right"),
    "bound": Field(
        FLOAT, SETS, "1", "bound on the distance of the polynomials from the orbits", within=NEAR
    ),
    "late": Field(
        FLOAT, SETS, "t'", "bound on the distance of the crossings from their ends", within=NEAR
    ),
    "shortest": Field(FLOAT, SETS, "t'", "least time of a passage from it"),
    "longest": Field(FLOAT, SETS, "t'", "largest time of a passage from it"),
}
RELATIONS = {
    "target": Field(WHOLE, COVERED, "1", "the sets that it covers, counted from 0"),
    "orientation": Field(WHOLE, COVERED, "1", "1 or -1: end of the target beyond which u = 1 goes"),
    "edge": Field(
        FLOAT, COVERED, "1", "lower bound on |U| of the images of u = -1 and 1", within=ANY
    ),
    "across": Field(FLOAT, COVERED, "1", "upper bound on |V| of the whole image", within=MARGIN),
    "stretch": Field(
        FLOAT, COVERED, "1", "lower bound on |dU/du| - |dU/dv| of the passage", within=ANY
    ),
    "squeeze": Field(
        FLOAT, COVERED, "1", "upper bound on |dV/du| + |dV/dv| of the passage", within=SLOPES
    ),
}
LINE = {
    "e1": Field(FLOAT, (), "1", "e1 gamma1 + e2 gamma2 = centre + half u, u from -1 to 1"),
    "e2": Field(FLOAT, (), "1", "see e1"),
    "centre": Field(FLOAT, (), "1", "see e1", within=PHASE),
    "half": Field(FLOAT, (), "1", "see e1"),
    "wide": Field(FLOAT, (), "1", "Qm = wide v, v from -1 to 1, on a strip about it"),
    "theta2": Field(FLOAT, (2,), "rad", "theta2 at its ends, about"),
    "bound": Field(
        FLOAT, (), "1", "bound on the distance of the polynomials from the orbits", within=NEAR
    ),
    "target": Field(
        WHOLE, CROSSED, "1", "the sets that it, or the last set of the approach, crosses, from 0"
    ),
    "edge": Field(FLOAT, CROSSED, "1", "lower bound on |U| at its ends", within=ANY),
    "across": Field(FLOAT, CROSSED, "1", "upper bound on |V| of all of it", within=MARGIN),
    "stretch": Field(FLOAT, CROSSED, "1", "lower bound on |dU/du| along it", within=ANY),
    "squeeze": Field(FLOAT, CROSSED, "1", "upper bound on |dV/du| along it", within=SLOPES),
}
APPROACH = {
    name: QUADS[name]._replace(dimensions=dimensions)
    for name, dimensions in {
        **dict.fromkeys(("rising", "a", "b", "l0", "l1", "symbol"), ("passages",)),
        "p": ("passages", "coefficients"),
    }.items()
}
"""Sets between the line of starts and those of the full shift, of which each covers the next."""
ENERGIES = {
    "shift": Field(
        FLOAT, (), "1", "energies are h or h0 + shift + spread w, w from -1 to 1", within=CURVE
    ),
    "spread": Field(FLOAT, (), "1", "see shift"),
    "moves": Field(
        FLOAT,
        ("sets", "orders", "curve"),
        "1",
        "what w, w^2 and so on add to p",
        within=ANY,
    ),
    "line": Field(FLOAT, ("line orders",), "1", "what w, w^2 and so on add to centre", within=ANY),
}
DRAWN = {
    "chi": Field(FLOAT, ("sets", "outline"), "rad", "chi around the sets"),
    "d": Field(FLOAT, ("sets", "outline"), "1", "d around the sets, less the stable surface's"),
    "image_chi": Field(FLOAT, ("sets", "outline"), "rad", "chi around their images"),
    "line_chi": Field(FLOAT, ("line",), "rad", "chi along the image of the line of starts"),
    "line_d": Field(FLOAT, ("line",), "1", "d along it, less the stable surface's"),
    "image_d": Field(FLOAT, ("sets", "outline"), "1", "d around them, less the stable surface's"),
}
PROOF = {
    **STEPS,
    "family": STEPS["family"]._replace(
        description="the set of which a step is, counted from 0; then the line, and its approach"
    ),
}
LAYOUT: Layout = {
    "sets": held(CLOSE, QUADS),
    "relations": RELATIONS,
    "line": held(CLOSE, LINE),
    "energies?": held(CLOSE, ENERGIES),
    "approach?": held(CLOSE, APPROACH),
    "proof": PROOF,
    "drawn": held(CLOSE, DRAWN),
}
