"""The swing near the periodic solutions, against the other printed form and against orbits."""

from __future__ import annotations

import math

import numpy as np
import pytest

from rigidpend import Body
from rigidpend.equations import eq1
from rigidpend.integrate import sample
from rigidpend.periodic import Delta_1

BODIES = [
    pytest.param((2, 1, "1.5"), (1, 1), id="Grioli"),
    pytest.param((2, "1.2", "1.7"), (1, 3), id="generic"),
    pytest.param((2, "0.2", "1.8"), (3, 1), id="flat"),
]
H0 = 1.2


@pytest.mark.parametrize("epsilon", [1, -1])
@pytest.mark.parametrize(("A", "r"), BODIES)
def test_eq_dt_the_two_printed_forms_are_equal(A: tuple, r: tuple, epsilon: int) -> None:  # type: ignore[type-arg]
    body = Body(A, (*r, 0), "0.01")
    A1, A2, A3 = map(float, A)
    r1, r2 = np.array(r) / math.hypot(*r)
    lean = r1 * A1 * math.sqrt(A2 * (A3 - A2)) + epsilon * r2 * A2 * math.sqrt(A1 * (A1 - A3))
    square = A3 * (A1 - A2) * (4 * A1 * A3 + 4 * A2 * A3 - 3 * A1 * A2 - 4 * A3**2)
    printed = 0.01 * abs(lean) / (math.sqrt(square) * H0)
    assert Delta_1(body.angles(), H0, epsilon, math) == pytest.approx(printed, rel=1e-12, abs=1e-17)


def excursion(body: Body, epsilon: int) -> float:
    """Largest |theta1 - beta0 - epsilon alpha0| of the limit cycle at J1 = 0.

    It attracts forward in time where epsilon = 1, backward where it is -1.
    """
    p = body.angles()
    J2, centre = math.sqrt(2 * H0 / p.kappa), p.beta0 + epsilon * p.alpha0
    settled = epsilon * 40 / (J2 * math.sin(p.alpha0))
    turn = epsilon * 8 / (p.kappa * J2)
    times = np.concatenate(([0.0], np.linspace(settled, settled + turn, 4000)))
    theta1 = sample(lambda x, m: eq1(x, p, m), [centre, 0.0, 0.3, J2], times)[0, 1:]
    return float(np.abs(theta1 - centre).max())


@pytest.mark.parametrize("epsilon", [1, -1])
@pytest.mark.parametrize(("A", "r"), BODIES[1:])
def test_eq_dt_is_the_largest_excursion_of_orbits_to_first_order(
    A: tuple,  # type: ignore[type-arg]
    r: tuple,  # type: ignore[type-arg]
    epsilon: int,
) -> None:
    gaps = []
    for mu in ("1e-2", "1e-3"):
        body = Body(A, (*r, 0), mu)
        formula = Delta_1(body.angles(), H0, epsilon, math)
        gaps.append(abs(excursion(body, epsilon) / formula - 1))
    assert gaps[0] < 0.05
    assert gaps[1] < gaps[0] / 5
