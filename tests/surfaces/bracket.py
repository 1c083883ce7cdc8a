"""The bracket that Melnikov's integral sums, from the equations of motion."""

from typing import Any

from rigidpend.mechanics.body import Angles
from rigidpend.mechanics.equations import eq1
from rigidpend.mechanics.free_body import SeparatrixMotion, separatrix, unperturbed


def bracket_on(motion: SeparatrixMotion, t: float, p: Angles, m: Any, phase: float = 0.0) -> Any:
    """{H0, H1/(kappa J2)} in (theta1, J1) on a separatrix, whatever mu `p` has.

    It is taken at theta2* + phase, theta2* holding the motion's theta2_0. H = H0 + mu H1 is linear
    in mu: H1 has the derivatives at mu = 1 less those at mu = 0.
    """
    c = separatrix(t, motion, p, m)
    state = c.theta1, c.J1, c.theta2 + phase, c.J2
    free, heavy = unperturbed(state, p, m), eq1(state, p._replace(mu=1), m)
    H0_J1, H0_theta1 = free[0], -free[1]
    H1_J1, H1_theta1 = heavy[0] - free[0], free[1] - heavy[1]
    return (H0_theta1 * H1_J1 - H0_J1 * H1_theta1) / (p.kappa * c.J2)
