"""The nome of motions without weight: the invariant in which the normal form's series shrink best.

A normal form leaves one choice: u and v may be multiplied by a function f of the invariant. It is
made here once and for all, because with f = 1 the invariant I = u v of motions without weight has a
largest value of either sign, at which all series in I end; layers of thin bodies come near to it.

Without weight, at the energy h and with Qp Qm > 0, Jacobi's functions of a t' give

    Qp = a (dn + k cn),    Qm = a (dn - k cn),

where dn and k cn are sums over all n of sech(lambda (t' - 2 n K/a)) times lambda/a, the latter with
alternating signs, and lambda = pi a/(2 K') = a/theta3(q)^2 for the nome q = exp(-pi K/K'). So Qp
has pulses at t' = 4 n K/a, Qm midway between them, and the orbit passes the upper periodic orbit
halfway from one of Qp, at t' = 0, to the next of Qm. In all pulses of Qp together exp(-lambda t')
has the coefficient 4 lambda/(1 - q^2), and this term is v with f = 1; in those of Qm exp(lambda t')
has 4 lambda q/(1 - q^2), and this term is u. Their product is 16 lambda^2 q/(1 - q^2)^2. With
f = lambda/(lambda_0 (1 - q^2)) instead of 1 the invariant is 16 lambda_0^2 q; lambda_0 belongs to
q = 0. Where Qp Qm < 0, dn and k cn change places, and -q takes the place of q in I and in f.

The normal form has the angle psi as time, and psi does not grow evenly with t'. This changes the
invariant by a share of order q^3 only, and no f makes a normal form wrong.
"""

import math
from typing import Any

import numpy as np

from rigidpend.orbits.return_map.reduced import Coefficients


def normalization(c: Coefficients, h: float, count: int) -> Any:
    """The coefficients of f as a power series in the invariant, (count,); the first one is 1.

    That of I^k is dimensionless as 1/M^(2 k). `h` is the energy.
    """
    # 1/(1 - q^2) adds every second coefficient.
    rate = free_rate(c, count)
    f = np.array([rate[k::-2].sum() for k in range(count)])
    rate_0 = float(c.aligned.half_sigma) * math.sqrt(2 * h / float(c.aligned.kappa))
    return f / (16 * rate_0**2) ** np.arange(count)


def free_rate(c: Coefficients, count: int) -> Any:
    """The coefficients of lambda/lambda_0 as a power series in q, (count,), at a given energy.

    With the parameter k'^2 = (theta2/theta3)^4 = Qp Qm/a^2 the energy, from M1 = a dn/cos(alpha0/2)
    and M2 = a k cn/sin(alpha0/2), gives (lambda_0/lambda)^2 = theta3^4 - C theta2^4 with C =
    cos(alpha0/2)^2 (1 + sin(alpha0/2)^2/kappa).
    """
    cos2 = 1 / (2 * float(c.to_M1)) ** 2
    bent = cos2 * (1 + (1 - cos2) / float(c.aligned.kappa))
    # theta3 = 1 + 2 q + 2 q^4 + ..., and theta2/(2 q^(1/4)) = 1 + q^2 + q^6 + ...
    theta3, theta2 = np.eye(1, count)[0], np.zeros(count)
    for k in range(count):
        theta3[k * k : k * k + 1] = 2 if k else 1
        theta2[k * (k + 1) : k * (k + 1) + 1] = 1
    square = _fourth(theta3) - 16 * bent * np.append(0, _fourth(theta2)[:-1])
    # g = s^(-1/2) obeys 2 s g' = -s' g, in every power of q.
    found, n = np.eye(1, count)[0], np.arange(count)
    for m in range(1, count):
        found[m] = ((n[1 : m + 1] / 2 - m) * square[1 : m + 1] * found[m - 1 :: -1]).sum() / m
    return found


def _fourth(x: Any) -> Any:
    """The fourth power of a power series, as far as it is known."""
    square = np.convolve(x, x)[: len(x)]
    return np.convolve(square, square)[: len(x)]
