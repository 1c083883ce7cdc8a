"""Fields of the polynomials that prove what a result says of families of orbits."""

from __future__ import annotations

from rigidpend.experiments.data.layout import ANY, WHOLE, Field

# What polynomials prove is compared, not these: their last digits differ between processors.
STEPS = {
    "family": Field(
        WHOLE,
        ("steps",),
        "1",
        "the family of orbits of which a step is, counted from 0",
        within=ANY,
    ),
    "bits": Field(WHOLE, ("steps",), "1", "its coefficients are in units of 2^-bits", within=ANY),
    "terms": Field(WHOLE, ("steps",), "1", "number of its terms", within=ANY),
    "powers": Field(
        WHOLE,
        ("terms", "powers"),
        "1",
        "j, k, l of T_j(x) u^k v^l; or j, k, l, m of T_j(x) u^k v^l w^m",
        within=ANY,
    ),
    "coefficients": Field(
        WHOLE,
        ("terms", 7),
        "1",
        "of Qp, Qm, M3, gamma1, gamma2, gamma3, and of half of the length in time in 2^-50 t';"
        " twice as large where j = 0",
        within=ANY,
    ),
}
