"""Rows that descriptions of several experiments share."""

from __future__ import annotations

from rigidpend.body import Body
from rigidpend.experiments import Row


def body_rows(body: Body) -> list[Row]:
    """A body's parameters and what follows from them."""
    special = ", ".join(body.special_cases) or "none"
    return [
        Row("A", ", ".join(map(str, body.A)), "principal moments of inertia A1, A2, A3"),
        Row("r", ", ".join(map(str, body.r)), "direction to the centre of gravity"),
        Row("mu", str(body.mu), "weight times distance of the centre of gravity"),
        Row("alpha0", f"{body.alpha0:.16g}", "rad"),
        Row("beta0", f"{body.beta0:.16g}", "rad"),
        Row("gamma0", f"{body.gamma0:.16g}", "rad"),
        Row("kappa", f"{body.kappa:.16g}", "A1 A2/(A3 (A1 - A2))"),
        Row("nu", f"{body.nu:.16g}", "pi kappa/sin(alpha0)"),
        Row("special cases", special, "Hess: alpha0 = beta0; Grioli: gamma0 = beta0"),
    ]
