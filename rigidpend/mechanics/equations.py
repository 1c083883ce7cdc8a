"""Equations of motion and Hamiltonians, each once, over generic numbers.

Every function uses ``+ - * /`` and, if needed, the `sqrt`, `sin`, `cos` of a namespace `m` (numpy,
an mpmath context, heyoka, sympy-like symbols). The same lines serve symbols for the kernels and the
integers, arrays of NumPy, and numbers of high precision.

Units: :func:`euler_poisson`, :func:`energy` and :func:`hamiltonian_andoyer` are in physical time t
and moments. All others are dimensionless, with time t' and J' = J s (see `coordinates.scale`).
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

from rigidpend.mechanics.body import Angles
from rigidpend.numbers import Elementary, Numbers, Scalar
from rigidpend.numbers.exact import context


def cross(a: Numbers, b: Numbers) -> tuple[Any, Any, Any]:
    """Vector product a x b of two triples."""
    return (
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    )


def euler_poisson(
    M: Numbers, gamma: Numbers, A: Numbers, r: Numbers, mu: Scalar
) -> tuple[Any, ...]:
    """The six rates of M and gamma by Euler and Poisson, principal axes, physical t (eq. eq).

    M . gamma need not vanish. r is the unit vector to the centre of gravity, mu its distance from
    the fixed point times the weight.
    """
    omega = tuple(M[i] / A[i] for i in range(3))
    turn, torque, dgamma = cross(M, omega), cross(gamma, r), cross(gamma, omega)
    return (*(turn[i] + mu * torque[i] for i in range(3)), *dgamma)


def energy(M: Numbers, gamma: Numbers, A: Numbers, r: Numbers, mu: Scalar) -> Any:
    """Energy M . omega/2 + mu r . gamma, an integral of :func:`euler_poisson`, physical units."""
    kinetic = sum(M[i] * M[i] / A[i] for i in range(3)) / 2
    return kinetic + mu * sum(r[i] * gamma[i] for i in range(3))


class AlignedCoefficients(NamedTuple):
    """Coefficients of the aligned equations: all that integration needs to know of a body."""

    half_sigma: Any
    """Rate sin(alpha0)/2: the exponent of Qp and Qm per unit of M3."""
    force_p: Any
    """Force mu sin((alpha0-beta0)/2), which drives Qp."""
    force_m: Any
    """Force mu sin((alpha0+beta0)/2), which drives -Qm."""
    twist: Any
    """Factor 1/(2 sin(alpha0)), from (Qp^2 - Qm^2) to M3'."""
    mu_r1: Any
    mu_r2: Any
    omega1: Any
    """Factor (kappa - cos^2(alpha0/2))/(2 cos(alpha0/2)), from Qp + Qm to omega_1."""
    omega2: Any
    """Factor (kappa + sin^2(alpha0/2))/(2 sin(alpha0/2)), from Qp - Qm to omega_2."""
    kappa: Any


def aligned_coefficients(p: Angles, m: Elementary) -> AlignedCoefficients:
    """Coefficients of :func:`aligned` from the body's angles, in the namespace `m`."""
    ca, sa = m.cos(p.alpha0 / 2), m.sin(p.alpha0 / 2)
    return AlignedCoefficients(
        half_sigma=m.sin(p.alpha0) / 2,
        # The sines are sin(theta1/2) on separatrices 1 and 2, up to a sign. Where one vanishes (in
        # the Hess case) the plane Qp = 0 or Qm = 0 is invariant, and its separatrix does not split.
        force_p=p.mu * m.sin((p.alpha0 - p.beta0) / 2),
        force_m=p.mu * m.sin((p.alpha0 + p.beta0) / 2),
        twist=1 / (2 * m.sin(p.alpha0)),
        mu_r1=p.mu * m.cos(p.beta0 / 2),
        mu_r2=p.mu * m.sin(p.beta0 / 2),
        # 1/(A1 s^2) = kappa - cos^2(alpha0/2) and 1/(A2 s^2) = kappa + sin^2(alpha0/2), divided by
        # the factors from M1' to Qp + Qm and from M2' to Qp - Qm.
        omega1=(p.kappa - ca * ca) / (2 * ca),
        omega2=(p.kappa + sa * sa) / (2 * sa),
        kappa=p.kappa,
    )


def rounded_coefficients(p: Angles) -> AlignedCoefficients:
    """Coefficients of :func:`aligned` as doubles, each correct to its last digit if p has 113 bits.

    From angles in doubles they are not: near alpha0 = pi, as in a thin body, cos(alpha0/2) is lost.
    """
    return AlignedCoefficients(*map(float, aligned_coefficients(p, context(113))))


def aligned(state: Numbers, c: AlignedCoefficients) -> tuple[Any, ...]:
    """Euler-Poisson (eq) in separatrix-aligned components, dimensionless time t'.

    With Qp, Qm = cos(alpha0/2) M1' +- sin(alpha0/2) M2' the four unperturbed separatrices are the
    half planes Qm = 0 (2 if Qp > 0, 4 if Qp < 0) and Qp = 0 (1 if Qm < 0, 3 if Qm > 0). Thus the
    distance from a separatrix is a coordinate, and keeps its relative precision. The field is
    quadratic, without singularity at J1 = 0 or J1 = J2.

    In the dimensionless units s^2 = 1/A2 - 1/A1 leaves 1/A2 - 1/A3 = s^2 sin^2(alpha0/2) and
    1/A3 - 1/A1 = s^2 cos^2(alpha0/2).
    """
    Qp, Qm, M3, gamma1, gamma2, gamma3 = state
    both, difference = Qp + Qm, Qp - Qm
    omega = (c.omega1 * both, c.omega2 * difference, c.kappa * M3)
    return (
        c.force_p * gamma3 - c.half_sigma * M3 * Qp,
        c.half_sigma * M3 * Qm - c.force_m * gamma3,
        c.twist * both * difference + c.mu_r2 * gamma1 - c.mu_r1 * gamma2,
        *cross((gamma1, gamma2, gamma3), omega),
    )


class _Changing:
    """A number or an array, with its change to first order."""

    # Numbers of NumPy leave products with this one to it.
    __array_ufunc__ = None

    def __init__(self, value: Any, change: Any) -> None:
        self.value, self.change = value, change

    def __add__(self, other: _Changing) -> _Changing:
        return _Changing(self.value + other.value, self.change + other.change)

    def __sub__(self, other: _Changing) -> _Changing:
        return _Changing(self.value - other.value, self.change - other.change)

    def __mul__(self, other: _Changing) -> _Changing:
        along = self.value * other.change + self.change * other.value
        return _Changing(self.value * other.value, along)

    def __rmul__(self, factor: Any) -> _Changing:
        return _Changing(factor * self.value, factor * self.change)


def aligned_along(state: Numbers, change: Numbers, c: AlignedCoefficients) -> tuple[Any, ...]:
    """Derivative of :func:`aligned` along a change of the state, however small or large it is."""
    return tuple(x.change for x in aligned(list(map(_Changing, state, change)), c))


def variational(c: AlignedCoefficients) -> Callable[[Any], tuple[Any, ...]]:
    """The rates in t' of the aligned components and of a deviation from them, 12 numbers."""
    return lambda y: (*aligned(y[:6], c), *aligned_along(y[:6], y[6:], c))


def on_section(state: Numbers, c: AlignedCoefficients) -> tuple[list[Any], Any]:
    """The state at which an orbit near M3 = 0 crosses it, and t' until then, of either sign.

    Both are those of Taylor's series of the orbit to second order in this time.
    """
    rates = aligned(state, c)
    bends = [x / 2 for x in aligned_along(state, rates, c)]
    late = -state[2] / rates[2]
    late = late - bends[2] * late * late / rates[2]
    terms = zip(state, rates, bends, strict=True)
    end = [x + late * (rate + late * bend) for x, rate, bend in terms]
    # M3 vanishes but for the third order.
    end[2] = 0 * late
    return end, late


def hamiltonian_andoyer(a: Scalar, A: Numbers, beta0: Scalar, mu: Scalar, m: Elementary) -> Any:
    """Hamiltonian in Andoyer-Deprit variables, with cos p and cos q, physical units (eq. h_d)."""
    sinp, sinq, tilt = a.L / a.G, a.H / a.G, a.l + beta0 / 2
    across = (a.G * a.cosp) ** 2
    spin = across * (m.sin(a.l) ** 2 / A[0] + m.cos(a.l) ** 2 / A[1]) + a.L**2 / A[2]
    height = sinq * a.cosp + a.cosq * sinp * m.cos(a.g)
    return spin / 2 + mu * (height * m.sin(tilt) + a.cosq * m.cos(tilt) * m.sin(a.g))


def hamiltonian(J: Numbers, theta: Numbers, p: Angles, m: Elementary) -> Any:
    """Hamiltonian in J1, J2, J3 and theta1, theta2, dimensionless; theta3 is cyclic (eq. h_new)."""
    J1, J2, J3 = J
    # cos q from a product, because J2^2 - J3^2 cancels where M is nearly vertical. (h_new) divides
    # by J2 twice, the second time within `height`.
    root = m.sqrt((J2 - J3) * (J2 + J3)) / J2
    leaning = 2 * p.mu * J3 * m.sqrt(J1 * (J2 - J1)) / J2**2 * m.sin(theta[0] / 2)
    return _free_part(J1, J2, theta[0], p, m) + p.mu * height(J1, J2, theta, m) * root + leaning


def hamiltonian_J3_0(J1: Scalar, J2: Scalar, theta: Numbers, p: Angles, m: Elementary) -> Any:
    """Hamiltonian at J3 = 0, dimensionless (eq. h0_new)."""
    return _free_part(J1, J2, theta[0], p, m) + p.mu * height(J1, J2, theta, m)


def _free_part(J1: Scalar, J2: Scalar, theta1: Scalar, p: Angles, m: Elementary) -> Any:
    return p.kappa / 2 * J2**2 + J1 * (J2 - J1) * (m.cos(theta1 - p.beta0) - m.cos(p.alpha0))


def height(J1: Scalar, J2: Scalar, theta: Numbers, m: Elementary) -> Any:
    """Height of the centre of gravity, r . gamma, at J3 = 0."""
    return (J1 * m.sin(theta[0] + theta[1]) + (J2 - J1) * m.sin(theta[1])) / J2


def eq1(state: Numbers, p: Angles, m: Elementary) -> tuple[Any, Any, Any, Any]:
    """Hamilton's equations at J3 = 0: rates in t' of theta1, J1, theta2, J2 (eq. eq1)."""
    theta1, J1, theta2, J2 = state
    bend = m.cos(theta1 - p.beta0) - m.cos(p.alpha0)
    pull = p.mu / J2
    swing = m.sin(theta1 + theta2) - m.sin(theta2)
    upper, lower = m.cos(theta1 + theta2), m.cos(theta2)
    return (
        (J2 - 2 * J1) * bend + pull * swing,
        J1 * (J2 - J1) * m.sin(theta1 - p.beta0) - pull * J1 * upper,
        p.kappa * J2 + J1 * bend - pull * J1 / J2 * swing,
        -pull * (J1 * upper + (J2 - J1) * lower),
    )


def theta3_rate(J1: Scalar, J2: Scalar, theta1: Scalar, mu: Scalar, m: Elementary) -> Any:
    """Rate of the precession angle theta3 at J3 = 0, dimensionless time t' (eq. th3)."""
    return 2 * mu * m.sqrt(J1 * (J2 - J1)) / J2**2 * m.sin(theta1 / 2)
