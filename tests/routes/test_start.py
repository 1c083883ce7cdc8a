"""The initial states: on separatrix 2, on J3 = 0, and the same orbit in any scales."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest

from rigidpend import Body
from rigidpend.mechanics.coordinates import Canonical, aligned_from_canonical
from rigidpend.numbers.exact import exact
from rigidpend.routes.certainty import FIRST, SECOND, THIRD
from rigidpend.routes.phases import Phases
from rigidpend.routes.start import Scales, start, states_double, states_exact
from tests.bodies import FIG4, GENERIC, problem
from tests.strategies import FINE, fine_angles

J1_0S = pytest.mark.parametrize("J1_0", ["1e-300", "1e-8", "1/2"])
BODIES = pytest.mark.parametrize("body", [FIG4, GENERIC], ids=["Fig. 4", "generic"])


@pytest.mark.parametrize("bits", [64, 113, 160])
@J1_0S
@BODIES
def test_agrees_exact_states_with_the_coordinates_to_their_last_bits(
    body: Body, J1_0: str, bits: int
) -> None:
    """h0 is the energy without the weight, which turns with theta2."""
    phases = [exact(x) for x in ("1/10", "31/10", "2*pi - 1/7", 5.5, "1e5")]
    p, J1 = fine_angles(body), exact(J1_0).in_context(FINE)
    J2mJ1, alpha0, beta0 = FINE.sqrt(2 * FINE.mpf("1.3342") / p.kappa) - J1, p.alpha0, p.beta0
    found = states_exact(start(problem(body, J1_0=J1_0), bits, FIRST), phases, bits)
    for state, phase in zip(found.T, phases, strict=True):
        c = Canonical(J1, J2mJ1, 0, alpha0 + beta0, phase.in_context(FINE), 0, 1)
        expected = aligned_from_canonical(c, alpha0, beta0, FINE)
        exactly = (FINE.mpf(x.numerator) / x.denominator for x in state)
        off = [x - y for x, y in zip(exactly, expected, strict=True)]
        assert max(abs(off[0]) / expected.Qp, *map(abs, off[2:])) < 2.0**-bits
        assert state[1] == 0, "exactly on separatrix 2"


@pytest.mark.parametrize("scales", [FIRST, SECOND])
@J1_0S
@BODIES
def test_agrees_doubles_with_exact_states(body: Body, J1_0: str, scales: Scales) -> None:
    """At 1e5 a double is 1e-11 coarse: its rest must count."""
    phases, one = Phases(["31/10", "100000 + 1/3"]), problem(body, J1_0=J1_0)
    rough = states_double(start(one, 53, scales), phases.high, phases.rest)
    fine = states_exact(start(one, 200, scales), phases.exactly(range(2)), 200).astype(float)
    # Qp, Qm and M3 are rounded once; gamma after a rotation by theta2.
    np.testing.assert_array_equal(rough[:3], fine[:3])
    np.testing.assert_allclose(rough[3:], fine[3:], rtol=0, atol=4e-16)


@pytest.mark.parametrize("pair", list(itertools.combinations((FIRST, SECOND, THIRD), 2)))
def test_scales_share_no_constant(pair: tuple[Scales, Scales]) -> None:
    """Every number that is rounded differs in more than a power of two."""
    numbers = [
        [*begin.coefficients, begin.Qp, begin.M3, *begin.gamma_cos, *begin.gamma_sin]
        for begin in (start(problem(GENERIC), 53, scales) for scales in pair)
    ]
    mantissas = [[math.frexp(x)[0] for x in column if x] for column in numbers]
    # What only turns a direction or a ratio into another is the same in all units.
    shared = sum(a == b for a, b in zip(*mantissas, strict=True))
    unscaled = ("half_sigma", "twist", "omega1", "omega2", "kappa")
    assert shared == len(unscaled)
