"""The pendulum motions: rotations about the horizontal axis Oz, exact at any mu < h0.

The constant h0 is the energy, which the exact motions need: J2 goes between
sqrt(2 (h0 - mu)/kappa) and sqrt(2 (h0 + mu)/kappa). It is kappa J2_0^2/2, the other meaning
that the paper gives it, where J2_0 is J2 while the centre of gravity is level with the fixed
point (r . gamma = 0); a J2_0 at another moment makes kappa J2_0^2/2 = h0 - mu r . gamma.

There are two, one for each sense of rotation: family 1 with J1 = 0 (M3 = -J2), family 2 with
J1 = J2 (M3 = J2). Times count from the passage of the lowest point. Functions take numbers or
arrays of the namespace `m`: numpy, math, an mpmath context.
"""

from __future__ import annotations

from typing import Any

from rigidpend.mechanics import jacobi
from rigidpend.mechanics.body import Angles
from rigidpend.numbers.generic import Elementary, Numbers, Scalar


def body_motion(
    t: Scalar, sign: int, A3: Scalar, r: Numbers, h0: Scalar, mu: Scalar, m: Elementary
) -> tuple[tuple[Any, Any, Any], tuple[Any, Any, Any]]:
    """Compute M and gamma of a pendulum motion in principal axes (eq. 5:3).

    Parameters
    ----------
    t : number or array
        Physical time.
    sign : {1, -1}
        Of M3: the paper's upper and lower sign, family 2 and 1.
    A3 : number
        The middle moment of inertia.
    r : 3 numbers
        The unit vector to the centre of gravity, r3 = 0.
    h0, mu : numbers
        Energy, and weight times distance.
    m : namespace of sqrt, sin and cos

    Returns
    -------
    M, gamma : 3 numbers or arrays each
        Physical.

    Raises
    ------
    ValueError
        h0 > mu is broken, or a sign that is none.
    """
    if sign not in (1, -1):
        raise ValueError(f"a sign is 1 or -1, not {sign!r}")
    up, ahead, dn = swing(t * m.sqrt((h0 + mu) / (2 * A3)), h0, mu, m)
    # 0 * dn is a zero of the kind and the shape of dn: number, array or mpmath number.
    M3, side, zero = sign * m.sqrt(2 * A3 * (h0 + mu)) * dn, sign * ahead, 0 * dn
    return (zero, zero, M3), (r[0] * up - r[1] * side, r[1] * up + r[0] * side, zero)


def canonical_motion(
    t: Scalar, p: Angles, h0: Scalar, family: int, m: Elementary
) -> tuple[Any, Any, Any]:
    """Compute J1, J2 and the phase of a pendulum motion (eq. sol_3).

    Parameters
    ----------
    t : number or array
        Dimensionless time t'.
    p : Angles
    h0 : number
        Energy.
    family : {1, 2}
        J1 = 0 or J1 = J2.
    m : namespace of sqrt, sin, cos and atan2

    Returns
    -------
    J1, J2, tau : numbers or arrays
        The actions, dimensionless; theta2 in family 1, theta1 + theta2 in family 2, radians
        in (-pi, pi]. It grows. theta1 itself is not defined on these motions.

    Raises
    ------
    ValueError
        h0 > mu is broken, or no such family.
    """
    upper = side_of(family) < 0
    up, ahead, dn = swing(t * rate(p, h0, m), h0, p.mu, m)
    # Both families have the same J2, for (h0_new) at J1 = 0 and at J1 = J2 is one pendulum.
    J2 = m.sqrt(2 * (h0 + p.mu) / p.kappa) * dn
    return (J2 if upper else 0 * J2), J2, m.atan2(up, ahead)


def period(p: Angles, h0: Scalar, m: Elementary) -> Any:
    """Period in t', 2 K(k)/rate; divided by `coordinates.scale` that in t.

    Raises ValueError where h0 > mu is broken.
    """
    return 2 * jacobi.K(*modulus(h0, p.mu, m), m) / rate(p, h0, m)


def rate(p: Angles, h0: Scalar, m: Elementary) -> Any:
    """Rate of the argument of sn, cn, dn, per t'."""
    return m.sqrt((h0 + p.mu) * p.kappa / 2)


def side_of(family: int) -> int:
    """Sign of a family: 1 for family 1, -1 for family 2; ValueError for others."""
    if family not in (1, 2):
        raise ValueError(f"a family is 1 (J1 = 0) or 2 (J1 = J2), not {family!r}")
    return 3 - 2 * family


def swing(u: Scalar, h0: Scalar, mu: Scalar, m: Elementary) -> tuple[Any, Any, Any]:
    """Sine and cosine of the phase, and its speed: 2 sn^2 - 1, 2 sn cn and dn of u."""
    sn, cn, dn = jacobi.sncndn(u, *modulus(h0, mu, m), m)
    # A product of sum and difference keeps the sine near its zeros.
    return (sn - cn) * (sn + cn), 2 * sn * cn, dn


def modulus(h0: Scalar, mu: Scalar, m: Elementary) -> tuple[Any, Any]:
    """Modulus k and its complement sqrt(1 - k^2), each to its last digit.

    Raises ValueError where h0 > mu is broken.
    """
    if not h0 > mu:
        raise ValueError(f"h0 > mu is broken: h0 = {h0}, mu = {mu}; the pendulum does not turn")
    # k' from h0 - mu itself: formed as sqrt(1 - k^2) it is lost where h0 is near mu.
    return m.sqrt(2 * mu / (h0 + mu)), m.sqrt((h0 - mu) / (h0 + mu))
