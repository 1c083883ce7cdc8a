"""Layout of a result of `asymptotic_orbits`."""

from __future__ import annotations

from rigidpend.experiments.data.layout import (
    FLAG,
    FLOAT,
    TEXT,
    WHOLE,
    Field,
    Layout,
)

ORBITS_ = ("orbits",)

ORBITS = {
    "word": Field(WHOLE, ("symbols", "orbits"), "1", "symbols: 0 left, 1 right"),
    "half_turns": Field(WHOLE, ("symbols", "orbits"), "1", "half rotations of each passage"),
    "first": Field(WHOLE, ORBITS_, "1", "parity of the first crossing's cell: 0 is a, 1 is b"),
    "theta2_0": Field(
        FLOAT, ORBITS_, "rad", "theta2 where J1 = J1_0 on the unstable surface, ascending"
    ),
    "theta2_0_rest": Field(FLOAT, ORBITS_, "rad", "what theta2_0 leaves: their sum has 30 digits"),
    "flight": Field(FLOAT, ORBITS_, "t'", "time from the first crossing to the last"),
    "theta3": Field(FLOAT, ORBITS_, "rad", "growth of theta3 from one end to the other"),
    "residual": Field(
        FLOAT, ORBITS_, "1", "largest gap of the map where passages meet: rad, widths of tables"
    ),
    "moved": Field(FLOAT, ORBITS_, "rad", "theta2_0 in 106 bits less that by the map in doubles"),
    "error": Field(FLOAT, ORBITS_, "rad", "last correction of theta2_0 in 106 bits"),
}
COUNTED = {
    "arcs": Field(WHOLE, (), "1", "arcs of the unstable surface on which the orbits were sought"),
    "ends": Field(
        TEXT, (), "text", "homoclinic (to the lower orbit) or heteroclinic (to the upper)"
    ),
}
PLANE = {
    "theta2_0": Field(FLOAT, ("columns",), "rad", "initial phases of Fig. 4's orbits"),
    "codes": Field(WHOLE, ("symbols+1", "columns"), "1", "their symbols: 0, 1, 255 no return"),
    "certain": Field(FLAG, ("symbols+1", "columns"), "1", "whether the symbol is established"),
}
DRAWN = {
    "orbit": Field(WHOLE, (), "1", "place of the orbit among those with as many symbols"),
    "t": Field(FLOAT, ("samples",), "t'", "time, 0 at the first crossing"),
    "theta1": Field(FLOAT, ("samples",), "rad", "0 .. 4 pi"),
    "J1_over_J2": Field(FLOAT, ("samples",), "1", "0 at the lower periodic orbit, 1 at the upper"),
    "theta3": Field(FLOAT, ("samples",), "rad", "precession angle since the lower periodic orbit"),
    "omega": Field(
        FLOAT, ("samples", 3), "1/t", "omega_xi, omega_eta, omega_zeta, physical; xi is upward"
    ),
}
LAYOUT: Layout = {
    "orbits": {"<lengths>": {**ORBITS, **COUNTED}},
    "plane": PLANE,
    "drawn": {"<drawn>": DRAWN},
}
