"""Departures from the paper: its slips and open values, with what is computed here instead."""

from __future__ import annotations

from typing import NamedTuple


class Departure(NamedTuple):
    """One departure: its place in the paper, what is printed there and what is computed here."""

    place: str
    """Label in the paper's TeX source, or a figure."""
    printed: str
    here: str


DEPARTURES = (
    Departure("section 1, (cond_P)", "A2 + A3 > A1", "equality admitted: body a of Table 1 has it"),
    Departure("(gamma_dep)", "arcsin and arctan, which lose the quadrant", "atan2 forms"),
    Departure(
        "section 3",
        "h0 is the energy, and also kappa J2_0^2/2",
        "they differ by mu sin(theta2_0); which is meant is said at each place",
    ),
    Departure(
        "section 3",
        "kappa J2_0^2/2 > mu is enough for rotation",
        "only where sin(theta2_0) >= 0; at every phase 2 mu is",
    ),
    Departure(
        "sections 1 and 5",
        "pendulum motions unstable at any h0 > mu",
        "elliptic for some bodies, such as that of Fig. 5 for mu/h0 from 0.589 to 0.868",
    ),
    Departure(
        "(eq_Ric1) at J1 = J2",
        '"the similar Riccati equation", coefficients not printed',
        "its own coefficients: -a0, -a1, -a2 at pi - tau",
    ),
    Departure(
        "(tt), theta2 of T2",
        "ends with cos(theta2*)",
        "ends with cos(beta0 + epsilon alpha0 + theta2*)",
    ),
    Departure("(Im)", "the closed form's sign", "opposite, as its bracket says; its zeros stand"),
    Departure("(Im)", "a divergent improper integral", "converges absolutely, like sech^2"),
    Departure(
        "(Im)",
        "the phase is added to theta2*, which holds theta2_0 already",
        "the phase is theta2_0 itself",
    ),
    Departure(
        "section 5, Hess case",
        "a countable set of orbits in which S2- and S1+ meet",
        "the two are one surface there",
    ),
    Departure(
        "section 6, Hess case",
        "alpha gains along each separatrix",
        "nothing along 1 and 3, as (trieq) has it",
    ),
    Departure(
        "(tri1), items 1 and 3",
        "theta1_0 = alpha0 - beta0 (+ 2 pi)",
        "beta0 - alpha0 (+ 2 pi), as in (sol_1), (sol_12)",
    ),
    Departure("Fig. 4", 'J1_0 "approximately 0"', "1e-8"),
    Departure(
        "Fig. 5",
        "h0 = 1.1111, no J1_0",
        "10/9 and 2.39205e-9, at which both published routes come out",
    ),
)
"""All departures, in the paper's order; `test_departures.py` has a test for each."""
