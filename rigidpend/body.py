"""The heavy rigid body: its parameters, the angles of (phi), and what the paper excludes."""

from __future__ import annotations

import functools
from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Any, NamedTuple

from rigidpend.exact import GUARD_BITS, Exact, context, exact, exacts, function

ROUNDING = 1e-15
"""Two angles closer than this are equal to within the rounding of doubles."""


class BodyError(ValueError):
    """A body that the paper's conditions exclude; the message names condition and values."""

    def __init__(self, field: str, message: str) -> None:
        self.field = field
        """The parameter that is wrong: A, r, mu or an angle."""
        super().__init__(message)


class Angles(NamedTuple):
    """The body as the dimensionless equations see it, in one precision.

    All of them are dimensionless: `alpha0`, `beta0`, `gamma0` in radians, `kappa`, `nu`
    and the perturbation `mu` pure numbers.
    """

    alpha0: Any
    beta0: Any
    gamma0: Any
    kappa: Any
    nu: Any
    mu: Any


@dataclass(frozen=True)
class Body:
    """A heavy rigid body under the conditions (cond_P).

    Parameters
    ----------
    A : sequence of 3 numbers
        Principal moments of inertia, A1 > A3 > A2 and A2 + A3 >= A1 (equality is a flat body).
    r : sequence of 3 numbers
        Direction from the fixed point to the centre of gravity, r1, r2 >= 0, r3 = 0.
        It is normalised.
    mu : number
        Weight times the distance of the centre of gravity, mu >= 0.

    Numbers may be int, float, Fraction, Decimal or text such as ``"1e-3"``; all are taken
    exactly, a float as the double that it is.

    Attributes
    ----------
    alpha0, beta0, gamma0, kappa, nu : float
        The parameters of (phi), (h_new) and (Im), correctly rounded; angles in radians.

    Raises
    ------
    BodyError
        A condition is broken.

    Examples
    --------
    >>> body = Body(A=(2, 1, 1.5), r=(1, 1, 0), mu="0.001")
    >>> body.alpha0, body.kappa
    (1.9106332362490186, 1.3333333333333333)
    """

    A: tuple[Exact, Exact, Exact]
    r: tuple[Exact, Exact, Exact]
    mu: Exact

    def __init__(self, A: Sequence[Any], r: Sequence[Any], mu: Any) -> None:
        object.__setattr__(self, "A", _triple("A", A))
        object.__setattr__(self, "r", _triple("r", r))
        object.__setattr__(self, "mu", exact(mu))
        _check(self)

    @classmethod
    def from_angles(cls, alpha0: Any, beta0: Any, gamma0: Any, mu: Any, *, A1: Any = 2) -> Body:
        """The body of given angles, by the relations that follow (phi).

        Parameters
        ----------
        alpha0, beta0, gamma0 : number
            Radians, pi > alpha0 > gamma0 > 0 and 0 <= beta0 <= pi.
        mu : number
            As for `Body`.
        A1 : number, optional
            The largest moment of inertia, which sets the scale.
        """
        alpha, beta, gamma = exacts((alpha0, beta0, gamma0))
        if not 0 < float(gamma) < float(alpha) < float(function("atan", exact(1))) * 4:
            values = f"alpha0 = {alpha}, gamma0 = {gamma}"
            raise BodyError("alpha0", f"pi > alpha0 > gamma0 > 0 is broken: {values}")
        half_alpha, half_beta, half_gamma = alpha / 2, beta / 2, gamma / 2
        a1 = exact(A1)
        a3 = a1 * (function("sin", half_gamma) / function("sin", half_alpha)) ** 2
        a2 = a3 * (function("cos", half_alpha) / function("cos", half_gamma)) ** 2
        return cls((a1, a2, a3), (function("cos", half_beta), function("sin", half_beta), 0), mu)

    def angles(self, bits: int = 53) -> Angles:
        """The parameters of the dimensionless equations, correctly rounded.

        Floats at 53 bits, mpmath numbers of `bits` bits above.
        """
        return _angles(self, bits)

    @property
    def alpha0(self) -> float:
        return float(self.angles().alpha0)

    @property
    def beta0(self) -> float:
        return float(self.angles().beta0)

    @property
    def gamma0(self) -> float:
        return float(self.angles().gamma0)

    @property
    def kappa(self) -> float:
        return float(self.angles().kappa)

    @property
    def nu(self) -> float:
        return float(self.angles().nu)

    @property
    def special_cases(self) -> tuple[str, ...]:
        """Which special cases the body satisfies, to within the rounding of doubles.

        Hess: alpha0 = beta0. Grioli: gamma0 = beta0. Flat: A2 + A3 = A1.
        """
        p = self.angles(113)
        a1, a2, a3 = (x.at(113) for x in self.A)
        cases = {
            "Hess": abs(p.alpha0 - p.beta0) <= ROUNDING,
            "Grioli": abs(p.gamma0 - p.beta0) <= ROUNDING,
            "flat": abs(a2 + a3 - a1) <= ROUNDING * a1,
        }
        return tuple(name for name, holds in cases.items() if holds)


def angles_from_moments(A: Sequence[Any], r: Sequence[Any], mu: Any, m: Any) -> Angles:
    """alpha0, beta0, gamma0, kappa of a body (eq. phi), with nu of (Im).

    Parameters
    ----------
    A, r : 3 numbers each
        Moments of inertia and the direction to the centre of gravity, of any length.
    mu : number
    m : namespace
        Where sqrt, atan2, sin and pi come from (an mpmath context, numpy).
    """
    A1, A2, A3 = A
    alpha0 = 2 * m.atan2(m.sqrt(A1 * (A3 - A2)), m.sqrt(A2 * (A1 - A3)))
    beta0 = 2 * m.atan2(r[1], r[0])
    gamma0 = 2 * m.atan2(m.sqrt(A3 - A2), m.sqrt(A1 - A3))
    kappa = A1 * A2 / (A3 * (A1 - A2))
    return Angles(alpha0, beta0, gamma0, kappa, m.pi * kappa / m.sin(alpha0), mu)


@functools.lru_cache(maxsize=256)
def _angles(body: Body, bits: int) -> Angles:
    guard = context(bits + GUARD_BITS)
    A, r = ([x.in_context(guard) for x in triple] for triple in (body.A, body.r))
    made = angles_from_moments(A, r, body.mu.in_context(guard), guard)
    rounded = float if bits == 53 else context(bits).mpf
    return Angles(*map(rounded, made))


def _triple(name: str, values: Sequence[Any]) -> tuple[Exact, Exact, Exact]:
    try:
        x, y, z = exacts(values)
    except TypeError:
        raise BodyError(name, f"{name} needs three numbers, got {values!r}") from None
    except ValueError as error:
        raise BodyError(name, f"{name} needs three numbers: {error}") from None
    return x, y, z


def _check(body: Body) -> None:
    A1, A2, A3 = body.A
    shown = f"A = {_shown(body.A)}"
    if not _sign(A2) > 0:
        raise BodyError("A", f"A2 > 0 is broken: {shown}")
    if not (_sign(A1 - A3) > 0 and _sign(A3 - A2) > 0):
        raise BodyError("A", f"A1 > A3 > A2 is broken: {shown}")
    if _sign(A2 + A3 - A1) < 0:
        raise BodyError("A", f"A2 + A3 >= A1 (the triangle inequality) is broken: {shown}")
    r1, r2, r3 = body.r
    shown = f"r = {_shown(body.r)}"
    if r3.fraction != 0:
        raise BodyError("r", f"r3 = 0 is broken: {shown}")
    if _sign(r1) < 0 or _sign(r2) < 0:
        raise BodyError("r", f"r1, r2 >= 0 is broken: {shown}")
    if _sign(r1) == 0 and _sign(r2) == 0:
        raise BodyError("r", f"r must have a direction: {shown}")
    if _sign(body.mu) < 0:
        raise BodyError("mu", f"mu >= 0 is broken: mu = {body.mu}")


def _shown(values: Sequence[Exact]) -> str:
    texts = (str(x) if x.fraction is not None else f"{float(x):.17g}" for x in values)
    return f"({', '.join(texts)})"


def _sign(x: Exact) -> int:
    """-1, 0 or 1; an irrational number within 1e-15 of zero counts as zero."""
    value: Fraction | Any = x.fraction if x.fraction is not None else x.at(113)
    if x.fraction is None and abs(value) <= ROUNDING:
        return 0
    return (value > 0) - (value < 0)
