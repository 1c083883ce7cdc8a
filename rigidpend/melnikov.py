"""Melnikov's integral along separatrix 2 and its zeros."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from rigidpend.exact import GUARD_BITS, context

if TYPE_CHECKING:
    from rigidpend.routes.problem import RouteProblem


def zeros(problem: RouteProblem) -> tuple[float, ...]:
    """The phases theta2_0 in [0, 2 pi) at which Melnikov's integral vanishes (eq. Im).

    They are +-k pi/2 - delta, k = 1, 3, ..., with
    delta = (alpha0 + beta0)/2 + kappa v/sin(alpha0) and v = ln((J2_0 - J1_0)/J1_0).

    Parameters
    ----------
    problem : RouteProblem

    Returns
    -------
    tuple of 2 floats
        Ascending, in radians, correctly rounded.

    Notes
    -----
    The printed closed form of the integral has the wrong sign; its zeros stand. Between them
    the first symbol is 1 where cos(delta + theta2_0) > 0, up to O(mu).
    """
    bits = 113 + GUARD_BITS
    m, p = context(bits), problem.body.angles(bits)
    J1, J2 = problem.J1_0.in_context(m), problem.J2_0(bits)
    delta = (p.alpha0 + p.beta0) / 2 + p.kappa * m.log((J2 - J1) / J1) / m.sin(p.alpha0)
    turn = 2 * m.pi
    found = sorted(float((quarter * m.pi / 2 - delta) % turn) for quarter in (1, 3))
    return tuple(x if x < math.tau else 0.0 for x in found)
