"""How far orbits swing near the hyperbolic periodic solutions."""

from __future__ import annotations

from typing import Any

from rigidpend.body import Angles


def Delta_1(p: Angles, h0: Any, epsilon: int, m: Any) -> Any:
    """Largest |theta1 - beta0 - epsilon alpha0| near T1 and T2, to first order in mu (eq. dt).

    Parameters
    ----------
    p : Angles
    h0 : number
        Energy constant, kappa J2_0^2/2.
    epsilon : {1, -1}
        1 beside separatrices 2 and 4, -1 beside 1 and 3.
    m : namespace of sqrt and sin

    Returns
    -------
    number
        Radians.
    """
    lean = m.sin((p.beta0 + epsilon * p.alpha0) / 2)
    both = m.sin((p.alpha0 + p.gamma0) / 2) * m.sin((p.alpha0 - p.gamma0) / 2)
    sin_alpha0 = m.sin(p.alpha0)
    return p.mu * sin_alpha0 * abs(lean) / (m.sqrt(sin_alpha0**2 + 16 * both**2) * h0)
