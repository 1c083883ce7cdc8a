"""Where the paper slips: the printed form fails, the one of this package holds.

What another file tests stands there:

=================================================== =========================================
place                                               test
=================================================== =========================================
h0 of (5:3) and (sol_3), which is the energy        tests/mechanics/test_pendulum.py
(tt), theta2 of T2                                  tests/mechanics/test_pendulum.py
the Riccati equation at J1 = J2                     tests/mechanics/test_pendulum.py
(gamma_dep), arcsin and arctan                      tests/mechanics/test_coordinates.py
Grioli's bounds, which are right                    tests/mechanics/test_in_space.py
"the nonzero increment" of alpha, in the Hess case  tests/surfaces/test_heteroclinic.py
A2 + A3 > A1, which body a of Table 1 has not       tests/mechanics/test_body.py
(Im), Legendre's integral, which is right           tests/surfaces/test_melnikov.py
(tri1), theta1 of separatrices 1 and 3              tests/mechanics/test_in_space.py
=================================================== =========================================
"""

import math
from typing import Any

import numpy as np
import pytest
from scipy.integrate import quad

from rigidpend import Body
from rigidpend.mechanics.coordinates import Canonical, aligned_from_canonical
from rigidpend.mechanics.equations import aligned, aligned_coefficients, theta3_rate
from rigidpend.mechanics.free_body import SeparatrixMotion, exponent, separatrix
from rigidpend.mechanics.in_space import increments
from rigidpend.orbits.integrate.states import states_at
from rigidpend.surfaces import melnikov
from tests.bodies import GENERIC
from tests.strategies import FINE
from tests.surfaces.bracket import bracket_on

J2_0 = 0.8
MIDDLE = SeparatrixMotion(2, J2_0 / 2, J2_0 / 2, 0.0)


def printed_Im(motion: SeparatrixMotion, phase: float) -> float:
    """The right end of (Im)."""
    p, v = GENERIC.angles(), math.log(motion.J2mJ1_0 / motion.J1_0)
    delta = (p.alpha0 + p.beta0) / 2 + p.kappa * v / math.sin(p.alpha0)
    lean = math.sin((p.alpha0 + p.beta0) / 2) / math.sin(p.alpha0)
    return 2 * math.pi / motion.J2_0 * lean * math.cos(delta + phase) / math.sinh(p.nu)


@pytest.mark.parametrize("phase", [0.0, 0.9, 2.5, 5.0])
def test_Im_has_the_opposite_sign_and_counts_theta2_0_twice(phase: float) -> None:
    """With theta2* = kappa J2_0 (t - t0) + theta2_0 as in (sol_2), delta lacks theta2_0."""
    motion, p = SeparatrixMotion(2, 0.3, 0.5, phase), GENERIC.angles()
    found, printed = melnikov.integral(motion, p), printed_Im(motion, phase)
    assert printed == pytest.approx(-found, abs=1e-11)
    assert abs(found) > 5e-4
    begun = motion._replace(theta2_0=phase + 3.0)
    assert abs(printed + melnikov.integral(begun, p)) > 1e-3


def test_Im_converges_absolutely() -> None:
    """Printed: "a divergent improper integral", of which a principal value is taken."""
    p, rate = GENERIC.angles(), exponent(MIDDLE.J2_0, GENERIC.angles(), math)
    sums = [
        2 * quad(lambda t: abs(bracket_on(MIDDLE, t, p, math)), 0, x / rate, limit=2000)[0]
        for x in (10, 20, 40)
    ]
    # At most |sigma_0|/u: the integral of J1 (J2 - J1)/J2^2 is 1/u.
    sigma = 2 * math.sin(p.alpha0) * math.sin((p.alpha0 + p.beta0) / 2) / p.kappa
    assert sums[0] < sums[-1] < sigma / rate
    tails = np.diff(sums)
    assert 0 < tails[0] < 3 * math.exp(-10) * sums[-1]
    assert abs(tails[1]) < 1e-7 * sums[-1]


@pytest.mark.parametrize("number", [1, 3])
def test_tri1_is_at_beta0_minus_alpha0_not_at_alpha0_minus_beta0(number: int) -> None:
    """The increment is th3's at the one, which another test holds, and not at the other."""
    p, motion = GENERIC.angles(), MIDDLE._replace(number=number)
    printed = p.alpha0 - p.beta0 + (2 * math.pi if number == 3 else 0)

    def rate(t: float) -> float:
        return float(theta3_rate(separatrix(t, motion, p, math).J1, J2_0, printed, p.mu, math))

    # The second half is the first one in the mirror.
    half, _ = quad(rate, 0, 70 / exponent(J2_0, p, math), epsabs=1e-14, limit=200)
    found = increments(p, p.kappa * J2_0**2 / 2)[number - 1]
    assert 2 * half == pytest.approx(-found, abs=1e-12)
    assert abs(found) > 1e-3


def orbit(body: Body, J2: float, J1: float, theta2: float, times: Any) -> Any:
    """Aligned components of an orbit that starts beside the lower pendulum motion."""
    p = body.angles()
    start = aligned_from_canonical(
        Canonical(J1, J2 - J1, 0.0, p.beta0 + 1.0, theta2, 0.0, 1.0), p.alpha0, p.beta0
    )
    coefficients = aligned_coefficients(p, math)
    return states_at(lambda x: aligned(x, coefficients), start, times)


@pytest.mark.parametrize(("share", "rotates"), [(1.9, False), (2.1, True)])
def test_kappa_J2_0_2_over_2_above_mu_is_not_enough_to_rotate(share: float, rotates: bool) -> None:
    """Printed: h0 = kappa J2(t0)^2/2 > mu. From below, theta2_0 = 3 pi/2, it must be 2 mu."""
    body = Body(A=(2, 1, "1.5"), r=(1, 1, 0), mu="0.2")
    J2 = math.sqrt(2 * share * 0.2 / body.kappa)
    M3 = orbit(body, J2, 0.0, 1.5 * math.pi, np.linspace(0, 40, 401))[2]
    assert (M3 < 0).all() == rotates


@pytest.mark.parametrize(
    ("A2", "A3", "times_mu", "stable"),
    [
        ("1.4", "1.45", 2, True),
        ("1.4", "1.45", 40, False),
        ("1.6", "1.63", "3.5", True),
        ("1.6", "1.63", 40, False),
    ],
)
def test_rotations_are_not_unstable_at_every_energy_above_mu(
    A2: str, A3: str, times_mu: Any, stable: bool
) -> None:
    """Printed: they are unstable under (cond_P), with heteroclinic orbits at any h0 > mu.

    For A2 near A3 they are stable up to several mu; it takes h0 much larger than mu.
    """
    body = Body(A=(2, A2, A3), r=(1, 3, 0), mu="0.1")
    J2 = math.sqrt(2 * float(times_mu) * 0.1 / body.kappa)
    # Energy is kappa J2^2/2 where the centre of gravity is level with the fixed point.
    Qp, Qm, *_ = orbit(body, J2, 1e-20, 0.0, np.linspace(0, 600 / J2, 2001))
    across = np.hypot(Qp, Qm)
    begin = across[0]
    assert (across.max() < 100 * begin) == stable
    if not stable:
        assert across.max() > 1e4 * begin


def test_in_the_hess_case_S2_minus_and_S1_plus_are_one_surface() -> None:
    """Printed: countably many heteroclinic orbits in S2- with S1+, for any parameters."""
    p = Body.from_angles("1.2", "1.2", "0.9", "0.3").angles(200)
    coefficients = aligned_coefficients(p, FINE)
    rng = np.random.default_rng(3)
    for state in rng.uniform(-1, 1, (20, 6)):
        # Qp = 0, separatrices 1 and 3 with both periodic orbits, stays whatever the weight.
        assert abs(aligned([0, *map(FINE.mpf, state[1:])], coefficients)[0]) < 1e-55
    assert abs(coefficients.force_m) > 0.1
