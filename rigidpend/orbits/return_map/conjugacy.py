"""The normal form evaluated: rates on a torus, and (u, v) of a point beside the orbit.

`weights` are values (E, count) of the Chebyshev polynomials at energies: the points come in E
groups of one length, each with an energy in common.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from rigidpend.numbers.generic import Numbers, Scalar
from rigidpend.orbits.return_map.expansions import fourier_basis
from rigidpend.orbits.return_map.normal_form import MapError, NormalForm, powers
from rigidpend.orbits.return_map.precision import Precision

MOST_ITERATIONS = 40


class TorusRates(NamedTuple):
    """Lambda(I) and the mean dt'/dpsi with their derivatives in I, (N,) each."""

    exponent: Any
    exponent_slope: Any
    rotation: Any
    rotation_slope: Any


def torus_rates(exponent: Scalar, rotation: Scalar, I: Scalar) -> TorusRates:
    """The rates from their coefficients (E, K) at the invariants I, in E groups."""
    return TorusRates(*_polynomial(exponent, I), *_polynomial(rotation, I))


def _polynomial(c: Any, x: Scalar) -> tuple[Any, Any]:
    if 1 < len(c) < len(x):
        c = np.repeat(c, len(x) // len(c), axis=0)
    value, slope = c[:, -1] + 0 * x, 0 * x
    for k in range(c.shape[1] - 2, -1, -1):
        value, slope = value * x + c[:, k], slope * x + value
    return value, slope


class Beside(NamedTuple):
    """A point in the normal form, (N,) each."""

    u: Any
    v: Any
    tau: Any
    """Time less its mean, t'."""
    sigma: Any
    """theta3 less its mean (which is 0), radians."""


def placed(
    nf: NormalForm, weights: Numbers, psi: Scalar, u: Scalar, v: Scalar, a: Precision
) -> tuple[Any, Any, Any]:
    """Qp, Qm and the time less its mean of points in the normal form, (N,) each."""
    series = _TorusSeries(nf, weights, psi, a)
    (Qp, Qm, _), _, _ = series.values(u, v)
    return Qp, Qm, series.time(u, v)


def inverted(
    nf: NormalForm, weights: Numbers, psi: Scalar, Qp: Scalar, Qm: Scalar, a: Precision
) -> Beside:
    """u and v of points by Newton's method.

    Raises
    ------
    MapError
        A point lies outside of the range of the normal form.
    """
    series = _TorusSeries(nf, weights, psi, a)
    # In degree 1, v stands before u.
    (pv, pu), (mv, mu) = series.odd[:, :2, 0].T, series.odd[:, :2, 1].T
    determinant = pu * mv - pv * mu
    u, v = (Qp * mv - pv * Qm) / determinant, (pu * Qm - Qp * mu) / determinant
    for _ in range(MOST_ITERATIONS):
        (p, m, _), by_u, by_v = series.values(u, v)
        p, m = p - Qp, m - Qm
        determinant = by_u[0] * by_v[1] - by_v[0] * by_u[1]
        du = (p * by_v[1] - by_v[0] * m) / determinant
        dv = (by_u[0] * m - p * by_u[1]) / determinant
        u, v = u - du, v - dv
        size = np.abs(u) + np.abs(v)
        if a.largest(np.where(size == 0, 0, (np.abs(du) + np.abs(dv)) / (size + (size == 0)))) < (
            4 * a.epsilon
        ):
            break
    else:
        raise MapError("the normal form does not reach as far as the section's arcs")
    return Beside(u, v, series.time(u, v), series.values(u, v)[0][2])


def _levels(weights: Numbers, part: Any, n: int) -> Any:
    """Coefficients (E, n, terms) at E energies."""
    return (weights @ part.reshape(weights.shape[1], -1)).reshape(len(weights), n, -1)


class _TorusSeries:
    """The series at given phases: polynomials in u and v with coefficients of each point."""

    def __init__(self, nf: NormalForm, weights: Numbers, psi: Scalar, a: Precision) -> None:
        basis = fourier_basis(psi, nf.n, a)
        odd, even = nf.odd.reshape(len(nf.odd), -1), nf.even
        if len(weights) < len(psi):
            odd, even = (_levels(weights, part, nf.n) for part in (odd, even))
            basis = basis.reshape(len(weights), -1, nf.n)
        else:
            basis = (weights[:, :, None] * basis[:, None, :]).reshape(len(psi), -1)
        N = len(psi)
        self.odd = np.matmul(basis, odd).reshape(N, -1, 3)
        self.even = np.matmul(basis, even).reshape(N, -1)
        self.a, self.degree = a, nf.degree
        self.odd_powers, self.even_powers = powers(nf.degree, 1), powers(nf.degree, 0)

    def values(self, u: Scalar, v: Scalar) -> tuple[Any, Any, Any]:
        """Qp, Qm, sigma, (3, N), and their derivatives in u and in v."""
        (j, k), up, vp = self.odd_powers.T, self._powers(u), self._powers(v)
        of_u, of_v = up[:, j], vp[:, k]
        by_u, by_v = j * up[:, np.maximum(j - 1, 0)], k * vp[:, np.maximum(k - 1, 0)]
        return (
            (self.odd * (of_u * of_v)[:, :, None]).sum(axis=1).T,
            (self.odd * (by_u * of_v)[:, :, None]).sum(axis=1).T,
            (self.odd * (of_u * by_v)[:, :, None]).sum(axis=1).T,
        )

    def time(self, u: Scalar, v: Scalar) -> Any:
        """tau, (N,)."""
        j, k = self.even_powers.T
        return (self.even * self._powers(u)[:, j] * self._powers(v)[:, k]).sum(axis=1)

    def _powers(self, x: Scalar) -> Any:
        found = self.a.array(np.ones((len(x), self.degree + 1)))
        for k in range(1, self.degree + 1):
            found[:, k] = found[:, k - 1] * x
        return found
