"""The first symbol is the sign of Melnikov's function (Im), up to O(mu)."""

from __future__ import annotations

import math
from fractions import Fraction

import numpy as np
import pytest

from rigidpend import Body, route_codes
from rigidpend.numbers.exact import exact
from rigidpend.routes.problem import RouteProblem
from rigidpend.surfaces.melnikov import zeros
from tests.orbits.integrate.problems import FIG4, GENERIC

H0, J1_0 = 1.3342, 1e-8


def phase(body: Body) -> float:
    """delta of (Im), where its argument is theta2_0: v = ln((J2_0 - J1_0)/J1_0)."""
    v = math.log((math.sqrt(2 * H0 / body.kappa) - J1_0) / J1_0)
    return (body.alpha0 + body.beta0) / 2 + body.kappa * v / math.sin(body.alpha0)


def first_symbols(body: Body, phases: list[float]) -> list[int]:
    found = route_codes(body, phases, h0="1.3342", J1_0="1e-8", n_symbols=1)
    assert found.certain.all()
    return [int(z) for z in found.codes[0]]


@pytest.mark.parametrize("mu", ["1e-3", "1e-4"])
def test_first_symbol_changes_at_the_zeros_up_to_the_second_order(mu: str) -> None:
    """It becomes 1 by 1.05 mu before the one zero, and 0 by 1.05 mu after the other."""
    body = Body(FIG4.A, FIG4.r, mu)
    rising, falling = zeros(RouteProblem(body, exact(H0), exact(J1_0), 1))
    # The published ones, which the weight does not move.
    assert (rising, falling) == pytest.approx((1.563050, 4.704643), abs=1e-6)
    near, far = 1.0 * float(mu), 1.1 * float(mu)
    phases = [rising - far, rising - near, falling + near, falling + far]
    assert first_symbols(body, phases) == [0, 1, 1, 0]


@pytest.mark.parametrize("mu", ["1e-3", "1e-4"])
@pytest.mark.parametrize("body", [FIG4, GENERIC], ids=["Fig. 4", "generic"])
def test_first_symbol_is_the_sign_everywhere_else(body: Body, mu: str) -> None:
    phases = [float(Fraction(2 * k + 1, 20)) for k in range(63)]
    melnikov = np.cos(phase(body) + np.array(phases))
    assert (np.abs(melnikov) > 10 * float(mu)).all(), "the grid keeps off the zeros"
    found = first_symbols(Body(body.A, body.r, mu), phases)
    assert set(found) == {0, 1}
    assert found == (melnikov > 0).tolist()
