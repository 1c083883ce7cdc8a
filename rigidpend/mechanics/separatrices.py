"""Unperturbed separatrices as motions in time, and the vertices that they join.

Everything is dimensionless, over generic numbers: `m` is numpy, math or an mpmath context.
Separatrices 2 and 4 rise from J1 = 0 to J1 = J2, 1 and 3 fall.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from rigidpend.mechanics.body import Angles
from rigidpend.mechanics.coordinates import Canonical
from rigidpend.mechanics.equations import eq1
from rigidpend.mechanics.free_body import SEPARATRICES, separatrix_theta1
from rigidpend.numbers.generic import Elementary, Numbers, Scalar


class SeparatrixMotion(NamedTuple):
    """A motion on an unperturbed separatrix, given by its place at t' = t0."""

    number: int
    """Number of the separatrix, 1 to 4."""
    J1_0: Any
    J2mJ1_0: Any
    """Action J2_0 - J1_0, held beside J1_0 so that the smaller of both keeps its digits."""
    theta2_0: Any

    @property
    def J2_0(self) -> Any:
        return self.J1_0 + self.J2mJ1_0


class Vertex(NamedTuple):
    """A corner of the heteroclinic cycle of Fig. 2: a periodic orbit beside a separatrix."""

    theta1: Any
    J1_over_J2: int


def unperturbed(state: Numbers, p: Angles, m: Elementary) -> tuple[Any, Any, Any, Any]:
    """Hamilton's equations of the body without weight, dimensionless time t' (eq. eq1_0).

    State and result are those of :func:`rigidpend.mechanics.equations.eq1`, of which this is mu =
    0.
    """
    return eq1(state, p._replace(mu=0), m)


def separatrix(t: Scalar, motion: SeparatrixMotion, p: Angles, m: Elementary = np) -> Canonical:
    """The unperturbed separatrices 1 to 4 (eq. sol_1, sol_2, sol_12, sol_22).

    Parameters
    ----------
    t : number or (...) array
        t' - t0, dimensionless, \\|u t\\| < 1400 in double precision.
    motion : SeparatrixMotion
    p : Angles
    m : namespace of exp and pi

    Returns
    -------
    Canonical
        J3 = 0 and theta3 = 0, the former exactly, the latter to O(mu). J1 and J2 - J1 both
        keep their relative precision, but for the rounding of u t.
    """
    # Half of the exponent each: neither overflows before the smaller action is lost.
    rise = m.exp(direction(motion.number) * u(motion, p, m) * t / 2)
    lower, upper = motion.J2mJ1_0 / rise, motion.J1_0 * rise
    J2 = motion.J2_0
    J1, J2mJ1 = J2 * (upper / (upper + lower)), J2 * (lower / (upper + lower))
    theta2 = p.kappa * J2 * t + motion.theta2_0
    return Canonical(J1, J2mJ1, 0, theta1(motion.number, p, m), theta2, 0, 1)


def theta1(number: int, p: Angles, m: Elementary = np) -> Any:
    """Angle theta1 on separatrix `number`, radians, in the precision of `p` and `m`.

    Raises
    ------
    ValueError
        There is no such separatrix.
    """
    if number not in SEPARATRICES:
        raise ValueError(f"separatrices are numbered 1 to 4, got {number!r}")
    # 3 and 4 lie a turn beside 1 and 2; only `m` knows a turn to all digits.
    side = separatrix_theta1(p.alpha0, p.beta0)[(number - 1) % 2]
    return side + 2 * m.pi if number > 2 else side


def direction(number: int) -> int:
    """Sign: 1 where J1 rises along the separatrix, the paper's epsilon there; -1 where it falls."""
    return 1 if number % 2 == 0 else -1


def u(motion: SeparatrixMotion, p: Angles, m: Elementary = np) -> Any:
    """Rate u of a separatrix motion, per t'."""
    return exponent(motion.J2_0, p, m)


def exponent(J2: Scalar, p: Angles, m: Elementary = np) -> Any:
    """Rate u = J2 sin(alpha0) at which orbits leave and approach the pendulum rotation, per t'."""
    return J2 * m.sin(p.alpha0)


def fastest_rate(J2: Scalar, p: Angles, m: Elementary = np) -> Any:
    """The faster of an orbit's rates, radians per t': rotation kappa J2 or exponent u."""
    return max(p.kappa * J2, exponent(J2, p, m))


def v(motion: SeparatrixMotion, m: Elementary = np) -> Any:
    """Logarithm v = ln((J2_0 - J1_0)/J1_0); J1 = J2/2 is passed at u t = v rising, -v falling."""
    return m.log(motion.J2mJ1_0 / motion.J1_0)


def vertices(p: Angles, m: Elementary = np) -> dict[str, Vertex]:
    """Limits of the separatrices for t' to -+ infinity: vertices 1 to 4 and 1* to 4*.

    A separatrix n rises from the vertex n to n*, or falls from n* to n.
    """
    # The ends of a separatrix differ in J1 alone, for theta1 is constant along it.
    at = {number: theta1(number, p, m) for number in SEPARATRICES}
    lower = {f"{number}": Vertex(x, 0) for number, x in at.items()}
    return lower | {f"{number}*": Vertex(x, 1) for number, x in at.items()}


def separatrix_beside(rising: bool, Qp: Scalar, Qm: Scalar) -> int:
    """The separatrix beside which an orbit crosses M3 = 0.

    The flow rises on 2 (Qp > 0) and 4 (Qp < 0) and sinks on 1 (Qm < 0) and 3 (Qm > 0); the
    other Q is small there.
    """
    if rising:
        return 2 if Qp > 0 else 4
    return 1 if Qm < 0 else 3
