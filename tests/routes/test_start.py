"""The initial states: on separatrix 2, on J3 = 0, and the same orbit in any scales."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from rigidpend import Body
from rigidpend.mechanics.coordinates import (
    Aligned,
    Canonical,
    aligned_from_canonical,
    body_from_aligned,
    scale,
)
from rigidpend.mechanics.equations import energy, hamiltonian_J3_0
from rigidpend.numbers.exact import exact
from rigidpend.routes.certainty import FIRST, SECOND
from rigidpend.routes.phases import Phases
from rigidpend.routes.problem import RouteProblem
from rigidpend.routes.start import Scales, start, states_double, states_exact
from tests.bodies import FIG4, GENERIC, problem
from tests.strategies import FINE, fine_angles, floats_of

PHASES = Phases(["1/10", "31/10", "2*pi - 1/7", 5.5, "1e5"])
COARSE = Phases(["31/10", "100000 + 1/3"])
"""At 1e5 a double is 1e-11 coarse: its rest must count."""
J1_0S = ["1e-300", "1e-8", "1/2"]
BODIES = [pytest.param(FIG4, id="Fig. 4"), pytest.param(GENERIC, id="generic")]


def doubles(p: RouteProblem) -> Any:
    return states_double(start(p, 53, FIRST), PHASES.high, PHASES.rest)


@pytest.mark.parametrize("J1_0", J1_0S)
@pytest.mark.parametrize("body", BODIES)
def test_invariant_constraints_and_energy_of_the_start(body: Body, J1_0: str) -> None:
    states = doubles(problem(body, J1_0=J1_0))
    A, r, mu = floats_of(body)
    M, gamma = body_from_aligned(Aligned(*states), body.alpha0, scale(A))
    np.testing.assert_allclose((gamma * gamma).sum(axis=0), 1, rtol=0, atol=1e-15)
    np.testing.assert_allclose((M * gamma).sum(axis=0), 0, atol=1e-15)
    assert (states[1] == 0).all(), "exactly on separatrix 2"
    J1, J2 = float(exact(J1_0)), math.sqrt(2 * 1.3342 / body.kappa)
    theta = [body.alpha0 + body.beta0, PHASES.high]
    expected = hamiltonian_J3_0(J1, J2, theta, body.angles(), np)
    np.testing.assert_allclose(energy(M, gamma, A, r, mu), expected, rtol=1e-14)
    # h0 is the energy without the weight, which turns with theta2.
    assert 0 < np.abs(expected - 1.3342).max() <= mu


@pytest.mark.parametrize("bits", [64, 113, 160])
@pytest.mark.parametrize("J1_0", J1_0S)
@pytest.mark.parametrize("body", BODIES)
def test_agrees_exact_states_with_the_coordinates_to_their_last_bits(
    body: Body, J1_0: str, bits: int
) -> None:
    phases, p, J1 = PHASES.exactly(range(5)), fine_angles(body), exact(J1_0).in_context(FINE)
    J2mJ1, alpha0, beta0 = FINE.sqrt(2 * FINE.mpf("1.3342") / p.kappa) - J1, p.alpha0, p.beta0
    found = states_exact(start(problem(body, J1_0=J1_0), bits, FIRST), phases, bits)
    for state, phase in zip(found.T, phases, strict=True):
        c = Canonical(J1, J2mJ1, 0, alpha0 + beta0, phase.in_context(FINE), 0, 1)
        expected = aligned_from_canonical(c, alpha0, beta0, FINE)
        off = [
            FINE.mpf(x.numerator) / x.denominator - y for x, y in zip(state, expected, strict=True)
        ]
        assert max(abs(off[0]) / expected.Qp, *map(abs, off[2:])) < 2.0**-bits
        assert state[1] == 0


@pytest.mark.parametrize("scales", [FIRST, SECOND])
@pytest.mark.parametrize("J1_0", J1_0S)
def test_agrees_doubles_with_exact_states(J1_0: str, scales: Scales) -> None:
    rough = states_double(start(problem(J1_0=J1_0), 53, scales), COARSE.high, COARSE.rest)
    begin = start(problem(J1_0=J1_0), 200, scales)
    fine = states_exact(begin, COARSE.exactly(range(2)), 200).astype(float)
    # Qp, Qm and M3 are rounded once; gamma after a rotation by theta2.
    np.testing.assert_array_equal(rough[:3], fine[:3])
    np.testing.assert_allclose(rough[3:], fine[3:], rtol=0, atol=4e-16)


def test_scales_share_no_constant() -> None:
    """Every number that is rounded differs in more than a power of two."""
    numbers = [
        [*begin.coefficients, begin.Qp, begin.M3, *begin.gamma_cos, *begin.gamma_sin]
        for begin in (start(problem(GENERIC), 53, scales) for scales in (FIRST, SECOND))
    ]
    mantissas = [[math.frexp(x)[0] for x in column if x] for column in numbers]
    # What only turns a direction or a ratio into another is the same in all units.
    shared = sum(a == b for a, b in zip(*mantissas, strict=True))
    unscaled = ("half_sigma", "twist", "omega1", "omega2", "kappa")
    assert shared == len(unscaled)
