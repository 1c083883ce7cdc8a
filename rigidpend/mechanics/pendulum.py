"""The pendulum motions: rotations about the horizontal axis Oz, exact at any mu < h0.

The constant h0 is the energy, on which the exact motions depend: J2 oscillates between
sqrt(2 (h0 - mu)/kappa) and sqrt(2 (h0 + mu)/kappa). The paper also defines h0 as kappa J2_0^2/2.
Both agree if J2_0 is J2 at the moment when the centre of gravity is level with the fixed point
(r . gamma = 0). With J2_0 at another moment kappa J2_0^2/2 = h0 - mu r . gamma.

There are two motions, one for each sense of rotation: family 1 with J1 = 0 (M3 = -J2), family 2
with J1 = J2 (M3 = J2). Times count from the passage of the lowest point. Functions take numbers or
arrays of the namespace `m`: numpy, math, an mpmath context.

Near a pendulum motion the phase tau, which is theta2 where J1 = 0 and theta1 + theta2 where J1 =
J2, grows at the rate kappa J2, and J2 is known from the energy. Of (eq1) there remains one equation
for theta1. It comes from a linear system, of which y = cot(theta1/2) is the quotient of two
components. The periodic solutions near the pendulum motions are given here to first order in mu,
and in `floquet` to round-off.
"""

from typing import Any

from rigidpend.mechanics import jacobi
from rigidpend.mechanics.body import Angles
from rigidpend.numbers import Elementary, Numbers, Scalar


def body_motion(
    t: Scalar, sign: int, A3: Scalar, r: Numbers, h0: Scalar, mu: Scalar, m: Elementary
) -> tuple[tuple[Any, Any, Any], tuple[Any, Any, Any]]:
    """Compute M and gamma of a pendulum motion in principal axes, physical, at times t (eq. 5:3).

    The sign is that of M3: 1, the paper's upper sign, for family 2, and -1 for family 1. A3, r, h0
    and mu are physical. ValueError is raised for another sign, or where h0 > mu is broken.
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
    """Compute J1, J2 and the phase of a pendulum motion at times t' (eq. sol_3).

    The phase, radians in (-pi, pi], is theta2 in family 1 and theta1 + theta2 in family 2. It grows
    with time. theta1 itself is not defined on these motions.
    """
    upper = side_of(family) < 0
    up, ahead, dn = swing(t * rate(p, h0, m), h0, p.mu, m)
    # Both families have the same J2: (h0_new) at J1 = 0 and at J1 = J2 is the same pendulum.
    J2 = m.sqrt(2 * (h0 + p.mu) / p.kappa) * dn
    return (J2 if upper else 0 * J2), J2, m.atan2(up, ahead)


def period(p: Angles, h0: Scalar, m: Elementary) -> Any:
    """Period in t', 2 K(k)/rate; divided by `coordinates.scale` it is the period in t.

    ValueError is raised where h0 > mu is broken.
    """
    return 2 * jacobi.K(complement(h0, p.mu, m), m) / rate(p, h0, m)


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
    sn, cn, dn = jacobi.sncndn(u, complement(h0, mu, m), m)
    # A product of sum and difference keeps the sine near its zeros.
    return (sn - cn) * (sn + cn), 2 * sn * cn, dn


def complement(h0: Scalar, mu: Scalar, m: Elementary) -> Any:
    """Complement k' = sqrt(1 - k^2) of the modulus, where k^2 = 2 mu/(h0 + mu), to its last digit.

    ValueError is raised where h0 > mu is broken.
    """
    if not h0 > mu:
        raise ValueError(f"h0 > mu is broken: h0 = {h0}, mu = {mu}; the pendulum does not turn")
    # Formed as sqrt(1 - k^2) it would be lost where h0 is near mu.
    return m.sqrt((h0 - mu) / (h0 + mu))


def riccati_coefficients(
    tau: Scalar, p: Angles, h: Scalar, family: int, m: Elementary
) -> tuple[Any, Any, Any]:
    """Coefficients a0, a1, a2 of y' + a0 y^2 + a1 y + a2 = 0, y = cot(theta1/2) (eq. eq_Ric1).

    ' is d/dtau, h the energy. The paper gives the coefficients at J1 = 0 (family 1) and calls the
    equation at J1 = J2 similar, but its coefficients differ. By the reversal, which replaces M3,
    gamma3 and t by their negatives, they are -a0(pi - tau), -a1(pi - tau), -a2(pi - tau).
    """
    side = side_of(family)
    # cos(beta0) -+ cos(alpha0) as products, because the difference cancels near the Hess case.
    mean, half = (p.alpha0 + p.beta0) / 2, (p.alpha0 - p.beta0) / 2
    # h - mu sin(tau) without cancellation at the top, where it is small if h is near mu.
    kinetic = (h - p.mu) + 2 * p.mu * m.sin(m.pi / 4 - tau / 2) ** 2
    pull = p.mu / (2 * kinetic)
    # 0 * pull gives the constant a0 the shape of the other two.
    return (
        side * m.sin(mean) * m.sin(half) / p.kappa + 0 * pull,
        side * m.sin(p.beta0) / p.kappa + pull * m.cos(tau),
        -side * (m.cos(mean) * m.cos(half) / p.kappa + pull * m.sin(tau)),
    )


def periodic_solution(
    theta2: Scalar, p: Angles, h0: Scalar, family: int, epsilon: int, m: Elementary
) -> tuple[Any, Any, Any, Any]:
    """Family T1 or T2 of periodic solutions of (eq1), to first order in mu (eq. tt).

    The result is theta1, J1, theta2, J2, in the order of (eq1). The argument `theta2` is the
    unperturbed phase theta2*, which grows at the rate kappa J2_0 in t'; h0 is kappa J2_0^2/2. T1 is
    at J1 = 0, T2 at J1 = J2; epsilon is 1 beside separatrices 2 and 4, -1 beside 1 and 3. theta1 +
    2 pi gives a solution as well.

    The paper prints the last term of theta2 in T2 as mu/(kappa J2_0^2) cos(theta2*), which leaves a
    residual of order mu. Here it is mu/(kappa J2_0^2) cos(beta0 + epsilon alpha0 + theta2*).
    """
    upper, centre, J2_0 = side_of(family) < 0, _centre(p, epsilon), m.sqrt(2 * h0 / p.kappa)
    by_sin, by_cos = swing_coefficients(p, h0, family, epsilon, m)
    lean = p.mu * (by_sin * m.sin(theta2) + by_cos * m.cos(theta2))
    phase = theta2 + centre if upper else theta2
    J2 = J2_0 - p.mu / (p.kappa * J2_0) * m.sin(phase)
    # kappa J2_0^2 is 2 h0. In T2 the phase is theta2* + centre, where (tt) prints theta2* alone.
    ahead = p.mu / (2 * h0) * m.cos(phase)
    # In T2 the pendulum's phase is theta1 + theta2, so that theta2 loses what theta1 gains.
    return centre + lean, J2 if upper else 0 * J2, theta2 + ahead - (lean if upper else 0), J2


def swing_coefficients(
    p: Angles, h0: Scalar, family: int, epsilon: int, m: Elementary
) -> tuple[Any, Any]:
    """Coefficients d_i1 and d_i2 of (tt), per mu; arguments of :func:`periodic_solution`."""
    half = _centre(p, epsilon) / 2
    # 2 sin(half) is factored out, since 1 - cos(centre) of (tt) cancels for a centre near 0.
    lean, turn = m.sin(half), side_of(family) * epsilon * m.sin(p.alpha0)
    size = 2 * lean / (2 * h0 / p.kappa * (p.kappa**2 + m.sin(p.alpha0) ** 2))
    return (
        size * (p.kappa * m.cos(half) - turn * lean),
        size * (p.kappa * lean + turn * m.cos(half)),
    )


def Delta_1(p: Angles, h0: Scalar, epsilon: int, m: Elementary) -> Any:
    """Largest |theta1 - beta0 - epsilon alpha0| near T1 and T2, to first order in mu (eq. dt).

    h0 is kappa J2_0^2/2, epsilon as in :func:`periodic_solution`.
    """
    lean = m.sin((p.beta0 + epsilon * p.alpha0) / 2)
    # Half of cos(gamma0) - cos(alpha0) as a product; the difference cancels where A1 is near A2.
    both = m.sin((p.alpha0 + p.gamma0) / 2) * m.sin((p.alpha0 - p.gamma0) / 2)
    sin_alpha0 = m.sin(p.alpha0)
    return p.mu * sin_alpha0 * abs(lean) / (m.sqrt(sin_alpha0**2 + 16 * both**2) * h0)


def _centre(p: Angles, epsilon: int) -> Any:
    """Angle theta1 of the separatrices, beta0 + epsilon alpha0."""
    if epsilon not in (1, -1):
        raise ValueError(f"epsilon is 1 or -1, not {epsilon!r}")
    return p.beta0 + epsilon * p.alpha0
