"""The bodies of the paper's figures, one that is special in nothing, and orbits of them."""

from typing import Any

from rigidpend import Body
from rigidpend.numbers.exact import exact
from rigidpend.routes.problem import RouteProblem

FREE = Body(A=(2, 1, "1.5"), r=(1, 1, 0), mu=0)
"""Of Fig. 1."""
FIG4 = Body(A=(2, 1, "1.5"), r=(1, 1, 0), mu="0.001")
FIG5 = Body(A=(2, "1.5", "1.8"), r=(0, 1, 0), mu="0.01")
GENERIC = Body(A=(2, "1.2", "1.7"), r=(1, 3, 0), mu="0.004")

THIN = Body(A=(1, "1e-8", "1 - 1e-8"), r=(1, 1, 0), mu="1e-12")
"""A thin flat body: cos(alpha0/2) is 1e-8, and of a rounded alpha0 it has eight digits."""


def problem(
    body: Body = FIG4, n_symbols: Any = 15, h0: Any = "1.3342", J1_0: Any = "1e-8"
) -> RouteProblem:
    """Orbits of a body, by default those of Fig. 4's left array."""
    return RouteProblem(body, exact(h0), exact(J1_0), n_symbols)
