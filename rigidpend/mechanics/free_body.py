"""Curves of the Euler case (mu = 0) on the sphere |M| = 1, in closed form.

On the sphere 2 J1 (J2 - J1) [cos(theta1 - beta0) - cos(alpha0)] is the quadratic form
sin^2(alpha0/2) M2^2 - cos^2(alpha0/2) M1^2. It is positive on the orbits around the axes +-M2,
negative around +-M1, zero on the separatrix. An orbit is given by its largest |M3|, its height.

M is in units of |M|; components come first, samples after.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rigidpend.mechanics.coordinates import TURN, andoyer_from_body, canonical_from_andoyer

SEPARATRICES = (1, 2, 3, 4)
"""Numbers of the separatrices; 2 and 4 are the halves of one circle, 1 and 3 of the other."""


def around_M2(alpha0: float, height: float, side: int, phi: ArrayLike) -> NDArray[np.float64]:
    """An orbit around the axis of the smallest moment of inertia.

    Parameters
    ----------
    alpha0 : float
    height : float
        Largest |M3|, 0 < height < 1.
    side : {1, -1}
        The sign of M2.
    phi : (n,) array
        The angle along the orbit in radians, 0 where M3 = 0 < M1. It grows in time, in t' by
        phi' = sin(alpha0/2) J2 |M2|.

    Returns
    -------
    (3, n) array
    """
    sin, cos = np.sin(alpha0 / 2), np.cos(alpha0 / 2)
    x, y = height * np.cos(phi), height * np.sin(phi)
    # 1 - height^2 as a product keeps its precision beside the separatrix.
    M2 = side * np.sqrt((1 - height) * (1 + height) + (cos * x) ** 2)
    return np.stack((sin * x, M2, side * y))


def around_M1(alpha0: float, height: float, side: int, phi: ArrayLike) -> NDArray[np.float64]:
    """An orbit around the axis of the largest moment of inertia.

    Exchanging M1 with M2 and alpha0 with pi - alpha0 leaves M3' = M1 M2 as it is, and turns
    the form into its negative: see :func:`around_M2` for the parameters.
    """
    M2, M1, M3 = around_M2(np.pi - alpha0, height, side, phi)
    return np.stack((M1, M2, M3))


def separatrix(alpha0: float, number: int, phi: ArrayLike) -> NDArray[np.float64]:
    """A separatrix of (sol_1)-(sol_22) on the sphere: half of a great circle.

    Parameters
    ----------
    alpha0 : float
    number : int
        1 to 4.
    phi : (n,) array
        From -pi/2 to pi/2 in the sense of the flow: M3 rises on 2 and 4, falls on 1 and 3.

    Returns
    -------
    (3, n) array
    """
    l = _separatrix_l(alpha0, number)
    rising = 1 if number % 2 == 0 else -1
    return np.stack((np.sin(l) * np.cos(phi), np.cos(l) * np.cos(phi), rising * np.sin(phi)))


def separatrix_theta1(alpha0: float, beta0: float) -> NDArray[np.float64]:
    """Angle theta1 of the separatrices 1..4, radians, as in (sol_1)-(sol_22): all within 4 pi."""
    return np.array([2 * _separatrix_l(alpha0, number) + beta0 for number in SEPARATRICES])


def in_plane(M: ArrayLike, beta0: float, start: float) -> tuple[Any, Any]:
    """Map points M to theta1 and J1/J2, with start <= theta1 < start + 4 pi.

    Parameters
    ----------
    M : (3, n) array
        Of length 1, not on the axis of M3, where theta1 is not defined.
    beta0, start : float
        Radians.

    Returns
    -------
    theta1, J1/J2 : (n,) arrays
    """
    # gamma has no part in theta1 and J1; any will do.
    c = canonical_from_andoyer(andoyer_from_body(M, np.ones_like(M) / np.sqrt(3)), beta0)
    return start + np.mod(c.theta1 - start, 2 * TURN), c.J1 / c.J2


def _separatrix_l(alpha0: float, number: int) -> float:
    """Angle l = (theta1 - beta0)/2 of a separatrix."""
    # cos(2 l) = cos(alpha0) at l = -+alpha0/2; half a turn further lie the circles' other halves.
    side = 1 if number % 2 == 0 else -1
    return side * alpha0 / 2 + (TURN / 2 if number > 2 else 0.0)
