"""Where the paper slips, or leaves a value open, and what is computed here instead."""

from __future__ import annotations

from typing import NamedTuple


class Departure(NamedTuple):
    """One place of the paper."""

    place: str
    """A label of its TeX source, or a figure."""
    printed: str
    here: str

    @property
    def row(self) -> tuple[str, str, str]:
        return self.place, self.printed, self.here


DEPARTURES = (
    Departure(
        "(gamma_dep)", "arcsin and arctan, which lose the quadrant", "atan2 forms, right everywhere"
    ),
    Departure(
        "(eq_Ric1) at J1 = J2",
        '"the similar Riccati equation", coefficients not printed',
        "its own coefficients: a1 and a2 change signs inside",
    ),
    Departure(
        "(tt), theta2 of T2",
        "mu/(kappa J2^2) cos(theta2*)",
        "cos(beta0 + epsilon alpha0 + theta2*)",
    ),
    Departure("(Im)", "the closed form's sign", "opposite, as its bracket says; its zeros stand"),
    Departure("(Im)", "a divergent improper integral", "converges absolutely, like sech^2"),
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
