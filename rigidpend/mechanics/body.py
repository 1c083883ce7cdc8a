"""The heavy rigid body: its parameters, the angles of (phi), and the conditions on both."""

from __future__ import annotations

import functools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

from rigidpend.numbers import Elementary, Scalar, checked
from rigidpend.numbers.checked import ParameterError
from rigidpend.numbers.exact import GUARD_BITS, PI, Exact, ExactError, context, exact, function
from rigidpend.numbers.texts import named

SAME_WITHIN = 1e-15
"""Difference below which two angles count as equal, radians: the rounding of doubles."""

FARTHEST_ENERGY = 1e6
"""Largest energy, and the inverse of the least.

At larger energies series of high order overflow; at smaller ones the longest step is too short."""

LARGEST_MOMENT = 1e150
"""Largest moment of inertia, and the inverse of the least: products of two are still doubles."""

OUTSIDE = (
    "with the centre of gravity out of the plane of axes 1 and 2, those of the largest and the"
    " smallest moment, gravity turns the body out of every rotation about axis 3: there is no"
    " pendulum motion to start from, and no relabelling helps"
)
"""Reason for the condition r3 = 0, for messages."""


def check_units(name: str, energy: Exact) -> None:
    """Refuse an energy far from 1, which other units would bring closer to 1."""
    if not 1 / context(113).mpf(FARTHEST_ENERGY) <= energy.at(113) <= FARTHEST_ENERGY:
        raise ParameterError(
            name,
            f"{name} = {energy} is outside of {1 / FARTHEST_ENERGY} to {FARTHEST_ENERGY:g}: take"
            f" other units; {name} and mu times a number, actions times its root, are the same"
            " problem",
        )


class Angles(NamedTuple):
    """Parameters of a body in the dimensionless equations, in one precision.

    `alpha0`, `beta0` and `gamma0` are in radians; `kappa`, `nu` and the perturbation `mu` are pure
    numbers.
    """

    alpha0: Any
    beta0: Any
    gamma0: Any
    kappa: Any
    nu: Any
    mu: Any


@dataclass(frozen=True)
class Body:
    """A heavy rigid body, checked for the conditions of the paper (eq. cond_P).

    Numbers may be int, float, Fraction, Decimal or text such as ``"1e-3"``; all are taken
    exactly, a float as the double that it is.

    Parameters
    ----------
    A : sequence of 3 numbers
        Principal moments of inertia, A1 > A3 > A2 and A2 + A3 >= A1 (equality is a flat body),
        each from 1e-150 to 1e150.
    r : sequence of 3 numbers
        Direction from the fixed point to the centre of gravity, r1, r2 >= 0, r3 = 0.
        It is normalised.
    mu : number
        Weight times the distance of the centre of gravity, mu >= 0.

    Attributes
    ----------
    alpha0, beta0, gamma0, kappa, nu : float
        The parameters of (phi), (h_new) and (Im), correctly rounded; angles in radians.

    Raises
    ------
    ParameterError
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

    def __init__(self, A: Sequence[Any], r: Sequence[Any], mu: Scalar) -> None:
        # The class is frozen, so that bodies are keys of caches; this way the fields can be set.
        object.__setattr__(self, "A", _triple("A", A))
        object.__setattr__(self, "mu", checked.number("mu", mu))
        _check_moments(self.A)
        _check_weight(self.mu)
        object.__setattr__(self, "r", _unit(_triple("r", r)))

    @classmethod
    def from_angles(
        cls, alpha0: Scalar, beta0: Scalar, gamma0: Scalar, mu: Scalar, *, A1: Scalar = 2
    ) -> Body:
        """Make the body of given angles, by the relations that follow (phi).

        Parameters
        ----------
        alpha0, beta0, gamma0 : number
            Radians, pi > alpha0 > gamma0 > 0 and 0 <= beta0 <= pi.
        mu : number
            As for `Body`.
        A1 : number, optional
            The largest moment of inertia, which sets the scale.
        """
        alpha, beta, gamma = (
            checked.number(name, value)
            for name, value in (("alpha0", alpha0), ("beta0", beta0), ("gamma0", gamma0))
        )
        # In 113 bits, since an angle may be closer to pi than doubles can tell.
        if not 0 < gamma.at(113) < alpha.at(113) < PI.at(113):
            values = f"alpha0 = {alpha}, gamma0 = {gamma}"
            raise ParameterError("alpha0", f"pi > alpha0 > gamma0 > 0 is broken: {values}")
        half_alpha, half_gamma = alpha / 2, gamma / 2
        a1 = checked.number("A1", A1)
        a3 = a1 * (function("sin", half_gamma) / function("sin", half_alpha)) ** 2
        a2 = a3 * (function("cos", half_alpha) / function("cos", half_gamma)) ** 2
        return cls((a1, a2, a3), direction(beta), mu)

    def angles(self, bits: int = 53) -> Angles:
        """Parameters of the dimensionless equations, correctly rounded.

        Floats at 53 bits, mpmath numbers of `bits` bits above.
        """
        return _angles(self, bits)

    def floats(self) -> tuple[tuple[float, ...], tuple[float, ...], float]:
        """A, r and mu in double precision."""
        return _floats(self)

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
        """Names of the special cases that hold to within the rounding of doubles.

        Hess: alpha0 = beta0. Grioli: gamma0 = beta0. Flat: A2 + A3 = A1.
        """
        # In 113 bits, so that the given numbers decide, and not the rounding of their evaluation.
        p = self.angles(113)
        a1, a2, a3 = (x.at(113) for x in self.A)
        cases = {
            "Hess": abs(p.alpha0 - p.beta0) <= SAME_WITHIN,
            "Grioli": abs(p.gamma0 - p.beta0) <= SAME_WITHIN,
            "flat": abs(a2 + a3 - a1) <= SAME_WITHIN * a1,
        }
        return tuple(name for name, holds in cases.items() if holds)


def direction(beta0: Exact) -> tuple[Exact, Exact, Exact]:
    """Direction r of the centre of gravity by (phi), of beta0 in radians from 0 to pi."""
    # beta0 = 0 and pi are cases of (trieq): a double that is meant as one of them must not fail by
    # its rounding.
    if not -SAME_WITHIN <= beta0.at(113) <= PI.at(113) + SAME_WITHIN:
        raise ParameterError("beta0", f"0 <= beta0 <= pi is broken: beta0 = {_written(beta0)}")
    return function("cos", beta0 / 2), function("sin", beta0 / 2), exact(0)


def angles_from_moments(
    A: Sequence[Any], differences: Sequence[Any], r: Sequence[Any], mu: Scalar, m: Elementary
) -> Angles:
    """Compute alpha0, beta0, gamma0, kappa of a body, with nu of (Im) (eq. phi).

    `differences` are A1 - A2, A1 - A3, A3 - A2, which the caller forms without cancellation. `m`
    provides sqrt, atan2 and pi.
    """
    A1, A2, A3 = A
    A12, A13, A32 = differences
    alpha0 = 2 * m.atan2(m.sqrt(A1 * A32), m.sqrt(A2 * A13))
    beta0 = 2 * m.atan2(r[1], r[0])
    gamma0 = 2 * m.atan2(m.sqrt(A32), m.sqrt(A13))
    kappa = A1 * A2 / (A3 * A12)
    # sin(alpha0) from the moments: near alpha0 = pi the sine of a rounded angle is lost.
    sin_alpha0 = 2 * m.sqrt(A1 * A2 * A32 * A13) / (A3 * A12)
    return Angles(alpha0, beta0, gamma0, kappa, m.pi * kappa / sin_alpha0, mu)


@functools.lru_cache(maxsize=256)
def _angles(body: Body, bits: int) -> Angles:
    guard = context(bits + GUARD_BITS)
    A1, A2, A3 = body.A
    # Differences of the exact numbers: for a nearly symmetric body rounded ones would cancel.
    differences = [x.at(guard.prec) for x in (A1 - A2, A1 - A3, A3 - A2)]
    A, r = ([x.at(guard.prec) for x in triple] for triple in (body.A, body.r))
    made = angles_from_moments(A, differences, r, body.mu.at(guard.prec), guard)
    rounded = float if bits == 53 else context(bits).mpf
    return Angles(*map(rounded, made))


@functools.lru_cache(maxsize=256)
def _floats(body: Body) -> tuple[tuple[float, ...], tuple[float, ...], float]:
    return tuple(map(float, body.A)), tuple(map(float, body.r)), float(body.mu)


def _triple(name: str, values: Sequence[Any]) -> tuple[Exact, Exact, Exact]:
    message = f"{name} needs three numbers"
    try:
        # A text of three characters would unpack too.
        x, y, z = () if isinstance(values, str | bytes) else values
    except (TypeError, ValueError):
        raise ParameterError(name, f"{message}, got {named(values)}") from None
    try:
        return exact(x), exact(y), exact(z)
    except ExactError as error:
        raise ParameterError(name, f"{message}: {error}") from None


# These checks are kept, since the members of a sweep share most of their bodies.
@functools.lru_cache(maxsize=256)
def _unit(r: tuple[Exact, Exact, Exact]) -> tuple[Exact, Exact, Exact]:
    """Check r and scale it to length one."""
    # Rationals take their shortest text, so that bodies are equal however their r was written.
    r1, r2, r3 = (x.shortest for x in r)
    square = r1 * r1 + r2 * r2
    _check_direction(r, square)
    r = (r1, r2, r3)
    # An r of length one, such as (cos, sin), is left as it is: there is no root to evaluate.
    if abs(square.at(113) - 1) < context(113).mpf(2) ** -110:
        return r
    length = function("sqrt", square.shortest)
    # An exact zero stays exact: divided by a root it could be told from a tiny number only by
    # thousands of bits.
    x, y = (r_i if r_i.fraction == 0 else r_i / length for r_i in r[:2])
    return x, y, r[2]


@functools.lru_cache(maxsize=256)
def _check_moments(A: tuple[Exact, Exact, Exact]) -> None:
    for number, moment in enumerate(A, 1):
        if not moment.at(113) > 0:
            raise ParameterError("A", f"A{number} > 0 is broken: {_shown('A', A)}")
        if abs(context(113).log10(moment.at(113))) > math.log10(LARGEST_MOMENT):
            raise ParameterError(
                "A",
                f"A{number} is outside of {1 / LARGEST_MOMENT:g} to {LARGEST_MOMENT:g}:"
                f" {_shown('A', A)}; take other units: A times a number only changes that of time",
            )
    # Of any order: relabelled axes would not mend it.
    most = max(range(3), key=lambda i: A[i].at(113))
    i, k = (place for place in range(3) if place != most)
    if _negative(A[i] + A[k] - A[most], A[most]):
        said = f"A{i + 1} + A{k + 1} >= A{most + 1} (the triangle inequality)"
        raise ParameterError("A", f"{said} is broken: {_shown('A', A)}; no body has such moments")
    A1, A2, A3 = A
    if not ((A1 - A3).at(113) > 0 and (A3 - A2).at(113) > 0):
        raise ParameterError("A", f"A1 > A3 > A2 is broken: {_shown('A', A)}; {_relabelled(A)}")


def _relabelled(A: Sequence[Exact]) -> str:
    """Advice for moments in the wrong order: the relabelled axes, or the reason against any."""
    order = sorted(range(3), key=lambda i: A[i].at(113))
    least, middle, most = (A[i] for i in order)
    if not most.at(113) > middle.at(113) > least.at(113):
        return "a body with two equal moments is symmetric and has no separatrices"
    # The middle moment is the third in the paper: A1 > A3 > A2.
    places = order[2], order[0], order[1]
    mended = ", ".join(_written(A[i]) for i in places)
    direction = ", ".join(f"r{i + 1}" for i in places)
    needed = f"that needs your r{places[2] + 1} = 0"
    return f"relabel the axes: A = [{mended}], r = [{direction}] of your r; {needed}"


def _check_direction(r: tuple[Exact, Exact, Exact], square: Exact) -> None:
    if r[2].fraction != 0:
        raise ParameterError("r", f"r3 = 0 is broken: {_shown('r', r)}; {OUTSIDE}")
    if not square.at(113) > 0:
        raise ParameterError("r", f"r must have a direction: {_shown('r', r)}")
    if any(_negative(x, function("sqrt", square)) for x in r[:2]):
        turned = ", ".join(_written(x).removeprefix("-") for x in r)
        broken = f"r1, r2 >= 0 is broken: {_shown('r', r)}"
        raise ParameterError("r", f"{broken}; turn the axes by pi: r = [{turned}]")


def _check_weight(mu: Exact) -> None:
    if mu.at(113) < 0:
        size = _written(mu).removeprefix("-")
        message = f"mu >= 0 is broken: mu = {_written(mu)}; turn r round and take {size}"
        raise ParameterError("mu", message)


def _negative(x: Exact, scale: Exact) -> bool:
    """True if x < 0; an irrational x may be below zero by a double's rounding of `scale`."""
    if x.fraction is not None:
        return x.fraction < 0
    return bool(x.at(113) < -SAME_WITHIN * scale.at(113))


def _shown(name: str, values: Sequence[Exact]) -> str:
    """Three numbers with their name, for a message.

    This is slow for a zero that is not known as one, so that only failing checks call it.
    """
    return f"{name} = ({', '.join(map(_written, values))})"


def _written(x: Exact) -> str:
    """Format a value for a message: as written if that is short, else as the nearest double."""
    return x.text if x.fraction is not None and len(x.text) < 18 else repr(float(x))
