"""Orbits of the free body: their parameters, from a height, an energy or a state."""

from __future__ import annotations

import math
from typing import NamedTuple

from rigidpend.mechanics.body import Body
from rigidpend.mechanics.coordinates import Aligned
from rigidpend.mechanics.jacobi import Modulus, modulus


class FreeBodyShape(NamedTuple):
    """Numbers on which the motion of a free body depends, correctly rounded but for a root."""

    A: tuple[float, float, float]
    s2: float
    """Square of `coordinates.scale`, 1/A2 - 1/A1."""
    sin: float
    """Sine of alpha0/2, without cancellation for any body."""
    cos: float
    """Cosine of alpha0/2, without cancellation for any body."""


class Orbit(NamedTuple):
    """An orbit of the free body; at t = 0 its M3 vanishes and rises on side 1, falls on -1."""

    shape: FreeBodyShape
    G: float
    """Length of the angular momentum, |M|, physical."""
    axis: int
    """Axis that the orbit encircles, 1 or 2."""
    side: int
    """Sign of M on that axis."""
    height: float
    """Largest |M3|/G."""
    coheight: float
    """Distance from the separatrix, sqrt(1 - height^2)."""
    p: float
    """Factor sin(alpha0/2) around axis 2, cos(alpha0/2) around axis 1."""
    reach: float
    """Largest |M_axis|/G."""
    rate: float
    """Rate du/dt of the argument of Jacobi's functions."""
    modulus: Modulus

    @property
    def sigma(self) -> int:
        """Sign of 2 A3 h0 - G^2: 1 around axis 2, -1 around axis 1."""
        return 1 if self.axis == 2 else -1

    @property
    def period(self) -> float:
        """Period of M, in t."""
        return 4 * self.modulus.K / self.rate

    @property
    def energy_excess(self) -> float:
        """Energy excess 2 h0/G^2 - 1/A3, with relative precision: sigma s^2 (p coheight)^2."""
        return self.sigma * self.shape.s2 * (self.p * self.coheight) ** 2

    @property
    def h0(self) -> float:
        """Energy, physical."""
        return self.G**2 * (1 / self.shape.A[2] + self.energy_excess) / 2


def shape(body: Body) -> FreeBodyShape:
    """Compute the numbers of a body, whatever its r and mu."""
    A1, A2, A3 = body.A
    # Exact numbers, rounded once: of nearly equal moments rounded differences are noise.
    whole = A3 * (A1 - A2)
    sin2, cos2 = float(A1 * (A3 - A2) / whole), float(A2 * (A1 - A3) / whole)
    s2 = float((A1 - A2) / (A1 * A2))
    return FreeBodyShape((float(A1), float(A2), float(A3)), s2, math.sqrt(sin2), math.sqrt(cos2))


def encircling(
    body: Body,
    axis: int,
    side: int = 1,
    *,
    G: float = 1.0,
    height: float | None = None,
    coheight: float | None = None,
) -> Orbit:
    """Make the orbit of given height or coheight, whichever is small.

    Parameters
    ----------
    body : Body
        Its moments count; r and mu do not.
    axis : {1, 2}
        The axis that the orbit encircles.
    side : {1, -1}
        The sign of M on that axis.
    G : float, optional
        |M|, physical.
    height : float
        The largest |M3|/G, 0 <= height < 1.
    coheight : float
        Instead: sqrt(1 - height^2), 0 < coheight <= 1.

    Raises
    ------
    ValueError
        No such orbit; on the separatrix (coheight 0) see `spiral`.
    """
    if (height is None) == (coheight is None):
        raise ValueError("give height or coheight, one of the two")
    if height is not None:
        coheight = math.sqrt((1 - height) * (1 + height)) if 0 <= height <= 1 else math.nan
    assert coheight is not None
    if not 0 < coheight <= 1:
        raise ValueError("an orbit has 0 <= height < 1, which is 0 < coheight <= 1")
    if height is None:
        height = math.sqrt((1 - coheight) * (1 + coheight))
    return _orbit(shape(body), axis, side, G, height, coheight)


def through(body: Body, a: Aligned) -> tuple[Orbit, float]:
    """Find the orbit through a state, and the state's time t on it.

    Parameters
    ----------
    body : Body
    a : Aligned
        Dimensionless numbers (`coordinates.aligned_from_body`), of which Qp and Qm tell the
        distance from the separatrix with relative precision; gamma does not matter.

    Raises
    ------
    ValueError
        M = 0, or M on a separatrix.
    """
    number = shape(body)
    Qp, Qm, M3 = (float(x) for x in a[:3])
    M1, M2 = (Qp + Qm) / (2 * number.cos), (Qp - Qm) / (2 * number.sin)
    G = math.hypot(M1, M2, M3)
    # Roots apart: the product of tiny Qp and Qm would underflow.
    form = math.sqrt(abs(Qp)) * math.sqrt(abs(Qm))
    if not form > 0:
        raise ValueError("M is zero or on a separatrix")
    # The planes Qp = 0 and Qm = 0 hold the separatrices; they part the orbits around both axes.
    sides = Qp > 0, Qm > 0
    axis, p, along, across = (
        (1, number.cos, M1, M2) if sides[0] == sides[1] else (2, number.sin, M2, M1)
    )
    side = 1 if along > 0 else -1
    # Both may pass 1 by a rounding.
    height, coheight = min(math.hypot(across / p, M3) / G, 1.0), min(form / (p * G), 1.0)
    found = _orbit(number, axis, side, G / math.sqrt(number.s2), height, coheight)
    if height == 0:
        return found, 0.0
    sn, cn, dn = side * M3 / (G * height), across / (p * G * height), abs(along) / (G * found.reach)
    return found, _argument(sn, cn, dn, found.modulus) / found.rate


def _orbit(
    number: FreeBodyShape, axis: int, side: int, G: float, height: float, coheight: float
) -> Orbit:
    if axis not in (1, 2) or side not in (1, -1) or not G > 0:
        raise ValueError(f"axis {axis} is not 1 or 2, side {side} not 1 or -1, or G = {G} not > 0")
    p, q = (number.cos, number.sin) if axis == 1 else (number.sin, number.cos)
    reach = math.hypot(q, p * coheight)
    rate = p * G * number.s2 * reach
    made = modulus(min(coheight / reach, 1.0))
    return Orbit(number, G, axis, side, height, coheight, p, reach, rate, made)


def _argument(sn: float, cn: float, dn: float, modulus: Modulus) -> float:
    """Argument u, |u| <= 2 K, of given sn, cn and dn."""
    from scipy.special import elliprf

    # Carlson's form of F, DLMF 19.25.5; beyond K it is mirrored there, which cn < 0 tells.
    first = float(sn * elliprf(cn * cn, dn * dn, 1.0))
    return first if cn >= 0 else math.copysign(2 * modulus.K, sn) - first
