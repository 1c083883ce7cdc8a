"""Exact maps between the descriptions of a state, vectorised over samples.

The descriptions are (M, gamma) in principal axes, Andoyer-Deprit variables, the canonical
(J, theta) and the separatrix-aligned components. The first axis counts components: M and gamma have
the shape (3, ...), the fields of a record the shape (...).

Small quantities are carried along and never formed as differences: an :class:`Andoyer` holds cos p
and cos q beside L and H, a :class:`Canonical` holds J2 - J1 beside J1. Round trips therefore keep
their relative precision down to J1/J2 = 1e-300, and down to (J2 - J1)/J2 = 1e-300.

At degenerate points values are chosen so that a round trip gives the same state of the body:

- M parallel to Oz (J1 = 0 or J1 = J2): l = 0, and g is the only angle.
- M parallel to gamma (|J3| = J2): g = 0.
- M = 0: M counts as pointing along Oz.

Angles are in radians. Maps hold in physical and in dimensionless units alike, which :func:`scale`
converts, unless their docstrings name the units.
"""

import functools
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from rigidpend.numbers import Array, Elementary, Numbers, Scalar
from rigidpend.numbers.exact import context

TURN = 2 * np.pi
"""A whole turn, radians. theta1 is defined modulo two turns, since l = (theta1 - beta0)/2."""
PARALLEL = 2 * np.finfo(float).eps
"""Sine of the angle between M and gamma below which they count as parallel: round-off."""


class Andoyer(NamedTuple):
    """Andoyer-Deprit variables; L = G sin p, H = G sin q, cosp and cosq >= 0."""

    G: Any
    L: Any
    H: Any
    g: Any
    l: Any
    h: Any
    cosp: Any
    cosq: Any


class Canonical(NamedTuple):
    """The paper's canonical variables, with J2 - J1 in the place of J2."""

    J1: Any
    J2mJ1: Any
    J3: Any
    theta1: Any
    theta2: Any
    theta3: Any
    cosq: Any

    @property
    def J2(self) -> Any:
        return self.J1 + self.J2mJ1


class Aligned(NamedTuple):
    """Separatrix-aligned components (dimensionless) with gamma in principal axes."""

    Qp: Any
    Qm: Any
    M3: Any
    gamma1: Any
    gamma2: Any
    gamma3: Any


def momentum(G: Scalar, sinp: Any, cosp: Any, sinl: Any, cosl: Any) -> tuple[Any, Any, Any]:
    """M in principal axes from Andoyer variables (eq. depri_G)."""
    return G * cosp * sinl, G * cosp * cosl, G * sinp


def vertical(p: Numbers, q: Numbers, g: Numbers, l: Numbers) -> tuple[Any, Any, Any]:
    """gamma in principal axes from (sin, cos) of Andoyer's p, q, g and l (eq. depri_g)."""
    (sinp, cosp), (sinq, cosq), (sing, cosg), (sinl, cosl) = p, q, g, l
    along = sinq * cosp + sinp * cosq * cosg
    return (
        along * sinl + cosq * sing * cosl,
        along * cosl - cosq * sing * sinl,
        sinq * sinp - cosp * cosq * cosg,
    )


def body_from_andoyer(a: Andoyer) -> tuple[Array, Array]:
    """M and gamma, each (3, ...), from Andoyer variables (depri_G, depri_g)."""
    G = np.asarray(a.G, dtype=float)
    # At rest L/G and H/G are 0/0. By convention sin p = 1, and H itself holds sin q.
    safe = np.where(G > 0, G, 1.0)
    sinp, sinq = np.where(G > 0, a.L / safe, 1.0), np.where(G > 0, a.H / safe, a.H)
    sinl, cosl, sing, cosg = np.sin(a.l), np.cos(a.l), np.sin(a.g), np.cos(a.g)
    M = momentum(G, sinp, a.cosp, sinl, cosl)
    gamma = vertical((sinp, a.cosp), (sinq, a.cosq), (sing, cosg), (sinl, cosl))
    return np.stack(np.broadcast_arrays(*M)), np.stack(np.broadcast_arrays(*gamma))


def andoyer_from_body(M: ArrayLike, gamma: ArrayLike, h: ArrayLike = 0.0) -> Andoyer:
    """Andoyer variables from M and gamma, (3, ...) each, right in every quadrant (eq. gamma_dep).

    M and gamma do not determine the precession angle h, which is passed through. The paper prints g
    as an arcsin and l as an arctan, which both lose the quadrant. Here l = atan2(M1, M2) and g =
    atan2(gamma . e2, gamma . e1), where e1 and e2 span the plane normal to M. Where M = 0, H holds
    sin q, so that gamma can be recovered.
    """
    M1, M2, M3 = np.asarray(M, dtype=float)
    gamma1, gamma2, gamma3 = np.asarray(gamma, dtype=float)
    # hypot, because the squares of components below 1e-154 underflow.
    across = np.hypot(M1, M2)
    G = np.hypot(across, M3)
    # If M is along the third axis, g and l are not separate: l = 0 is chosen; any choice maps back.
    upright = across == 0
    divisor = np.where(upright, 1.0, across)
    sinl, cosl = np.where(upright, 0.0, M1 / divisor), np.where(upright, 1.0, M2 / divisor)
    at_rest = G == 0
    modulus = np.where(at_rest, 1.0, G)
    sinp, cosp = np.where(at_rest, 1.0, M3 / modulus), across / modulus
    inward = gamma1 * sinl + gamma2 * cosl
    e1, e2 = sinp * inward - cosp * gamma3, gamma1 * cosl - gamma2 * sinl
    H = np.where(at_rest, gamma3, M1 * gamma1 + M2 * gamma2 + M3 * gamma3)
    # The length of gamma's part across M: sqrt(1 - (H/G)^2) would lose it if M is nearly vertical.
    cosq = np.hypot(e1, e2)
    # Where M is vertical the angle between e1 and gamma would be rounding noise.
    g = _wrap(np.where(cosq > PARALLEL, np.atan2(e2, e1), 0.0), TURN)
    l = _wrap(np.atan2(sinl, cosl), TURN)
    return Andoyer(G, M3, H, g, l, np.zeros_like(G) + h, cosp, cosq)


def canonical_from_andoyer(a: Andoyer, beta0: float) -> Canonical:
    """(J, theta) from Andoyer variables, theta1 in [0, 4 pi), theta2 in [0, 2 pi) (eq. canon).

    J1 = (G + L)/2 and J2 - J1 = (G - L)/2. The smaller of the two is computed from cos p.
    """
    G, L = np.asarray(a.G, dtype=float), np.asarray(a.L, dtype=float)
    # G^2 - L^2 = (G cos p)^2 = 4 J1 (J2 - J1): divided by the large action it gives the small one
    # without a difference. The division comes first, since the square of a tiny cos p underflows.
    large = (G + np.abs(L)) / 2
    small = np.where(large > 0, G * a.cosp * (G * a.cosp / np.where(large > 0, 4 * large, 1)), 0)
    J1, J2mJ1 = np.where(L > 0, large, small), np.where(L > 0, small, large)
    theta1 = _wrap(2 * a.l + beta0, 2 * TURN)
    return Canonical(J1, J2mJ1, a.H, theta1, _wrap(a.g - a.l - beta0 / 2, TURN), a.h, a.cosq)


def andoyer_from_canonical(c: Canonical, beta0: float) -> Andoyer:
    """Andoyer variables from (J, theta), the inverse of :func:`canonical_from_andoyer`."""
    J2 = np.asarray(c.J2, dtype=float)
    # Two roots, because the product of tiny actions would underflow.
    across = 2 * np.sqrt(c.J1) * np.sqrt(c.J2mJ1)
    cosp = np.where(J2 > 0, across / np.where(J2 > 0, J2, 1.0), 0.0)
    l = _wrap((c.theta1 - beta0) / 2, TURN)
    g = _wrap(c.theta1 / 2 + c.theta2, TURN)
    return Andoyer(J2, c.J1 - c.J2mJ1, c.J3, g, l, c.theta3, cosp, c.cosq)


def scale(A: Numbers, m: Elementary = np) -> Any:
    """Scale s = sqrt((A1 - A2)/(A1 A2)), which gives J' = J s and t' = t s (after eq. canon)."""
    return m.sqrt((A[0] - A[1]) / (A[0] * A[1]))


def aligned_from_canonical(
    c: Canonical, alpha0: Scalar, beta0: Scalar, m: Elementary = np
) -> Aligned:
    """Aligned components from dimensionless (J, theta), J2 > 0, over generic numbers.

    Qp, Qm = 2 sqrt(J1 (J2 - J1)) sin((theta1 - beta0 +- alpha0)/2), which is cos(alpha0/2) M1' +-
    sin(alpha0/2) M2' without cancellation.
    """
    J2, lean = c.J2, c.theta1 - beta0
    across = 2 * m.sqrt(c.J1) * m.sqrt(c.J2mJ1)
    # L of (canon). The difference cancels only at the section M3 = 0, where it has to.
    M3 = c.J1 - c.J2mJ1
    g = c.theta1 / 2 + c.theta2
    gamma = vertical(
        (M3 / J2, across / J2),
        (c.J3 / J2, c.cosq),
        (m.sin(g), m.cos(g)),
        (m.sin(lean / 2), m.cos(lean / 2)),
    )
    Qp, Qm = (across * m.sin((lean + side) / 2) for side in (alpha0, -alpha0))
    return Aligned(Qp, Qm, M3, *gamma)


@functools.lru_cache(maxsize=32)
def cos_sin_half(angle: Scalar) -> tuple[float, float]:
    """Cosine and sine of half an angle, correct to the last digit if the angle has 113 bits.

    Near pi the cosine of half a rounded angle is lost, as cos(alpha0/2) of a thin body.
    """
    m = context(113)
    cos, sin = m.cos_sin(m.mpf(angle) / 2)
    return float(cos), float(sin)


def body_from_aligned(a: Aligned, alpha0: Scalar, s: float) -> tuple[Array, Array]:
    """Physical M and gamma, (3, ...) each, from dimensionless aligned components; s is `scale`.

    M1 and M2 keep their digits if alpha0 has those that :func:`cos_sin_half` needs.
    """
    # Qp, Qm = cos(alpha0/2) M1' +- sin(alpha0/2) M2', solved for M1' and M2'.
    cos, sin = cos_sin_half(alpha0)
    M1, M2 = (a.Qp + a.Qm) / (2 * cos), (a.Qp - a.Qm) / (2 * sin)
    return np.stack((M1, M2, a.M3)) / s, np.stack((a.gamma1, a.gamma2, a.gamma3))


def canonical_from_aligned(a: Aligned, alpha0: Scalar, beta0: float) -> Canonical:
    """Dimensionless (J, theta) from aligned components; alpha0 as in :func:`body_from_aligned`."""
    return canonical_from_andoyer(andoyer_from_body(*body_from_aligned(a, alpha0, 1.0)), beta0)


def _wrap(angle: Any, period: float) -> Any:
    """Reduce an angle to [0, period); a tiny negative one becomes 0, not the period itself."""
    wrapped = np.mod(angle, period)
    return np.where(wrapped < period, wrapped, 0.0)
