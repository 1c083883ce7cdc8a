"""Bodies under the paper's conditions, states, derivatives and comparisons that tests share."""

import math
from collections.abc import Callable, Sequence
from fractions import Fraction
from typing import Any

import numpy as np
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from mpmath import MPContext

from rigidpend.mechanics.body import Angles, Body
from rigidpend.mechanics.coordinates import Aligned, Canonical, body_from_aligned, scale
from rigidpend.mechanics.in_space import angular_velocity, field, hodograph

FINE = MPContext()
"""A context of the tests' own, 60 digits, apart from those that the package shares."""
FINE.prec = 200

ROUNDING = 4e-15
"""A dozen or so roundings of doubles."""

STEP = FINE.mpf(2) ** -66
DERIVATIVE = 1e-30
"""What :func:`along` errs at most, for the functions and states below."""


def repeatable(examples: int) -> settings:
    """The same examples on every run, however slow the machine."""
    return settings(
        max_examples=examples,
        deadline=None,
        derandomize=True,
        database=None,
        suppress_health_check=[HealthCheck.too_slow],
    )


def examples(count: int, *of: Any, **named: Any) -> Callable[[Any], Any]:
    """A property of so many random examples."""
    drawn: Any = given(*of, **named)
    repeated: Any = repeatable(count)
    return lambda test: repeated(drawn(test))


def numbers(least: float, most: float) -> st.SearchStrategy[float]:
    """Floats of ordinary size, both ends included."""
    return st.floats(least, most, allow_nan=False, allow_subnormal=False)


@st.composite
def bodies(draw: st.DrawFn, mu: str = "1/2") -> Body:
    """Bodies from flat to nearly symmetric, r anywhere in its quadrant, up to the given mu."""
    A1 = draw(st.fractions("1/2", 4, max_denominator=20))
    share = draw(st.fractions("0.52", "0.98", max_denominator=50))
    thickness = draw(st.fractions(0, "0.95", max_denominator=20))
    # Nothing is a flat body, all of it the symmetric one.
    A = (A1, A1 * (1 - share + thickness * (2 * share - 1)), A1 * share)
    r = draw(st.sampled_from([(1, 0, 0), (0, 1, 0), (1, 1, 0), (1, 3, 0), (2, "0.3", 0)]))
    return Body(A, r, Fraction(mu) * draw(st.fractions(0, 1, max_denominator=30)))


def canonical(J1: Any, J2: Any, J3: Any, theta1: Any, theta2: Any, theta3: Any) -> Canonical:
    """Canonical variables from the six alone."""
    cosq = np.sqrt((J2 - J3) * (J2 + J3)) / J2
    return Canonical(J1, J2 - J1, J3, theta1, theta2, theta3, cosq)


@st.composite
def canonicals(draw: st.DrawFn) -> Canonical:
    """Ordinary dimensionless states, M inclined to gamma and to Oz."""
    J2 = draw(numbers(0.5, 3))
    J1, J3 = J2 * draw(numbers(0.01, 0.99)), J2 * draw(numbers(-0.95, 0.95))
    theta1, theta2, theta3 = (draw(numbers(0, top * math.pi)) for top in (3.999, 1.999, 1.999))
    return canonical(J1, J2, J3, theta1, theta2, theta3)


@st.composite
def slight(draw: st.DrawFn) -> Canonical:
    """States beside a pendulum motion: J1/J2 or (J2 - J1)/J2 down to 1e-300."""
    c = draw(canonicals())
    tiny = c.J2 * 10.0 ** draw(numbers(-300, -0.5))
    pair = {"J1": c.J2 - tiny, "J2mJ1": tiny}
    return c._replace(**pair if draw(st.booleans()) else {"J1": tiny, "J2mJ1": c.J2 - tiny})


@st.composite
def verticals(draw: st.DrawFn) -> Any:
    """Unit vectors, those with zeros among them."""
    z, turn = draw(numbers(-1, 1)), draw(numbers(-math.pi, math.pi))
    return np.array([math.hypot(1, z) ** -1 * x for x in (math.cos(turn), math.sin(turn), z)])


def momenta() -> st.SearchStrategy[Any]:
    """Angular momenta in any direction, with components from tiny to ordinary and zeros."""
    sizes = st.one_of(numbers(-3, 3), st.sampled_from([0.0, 1e-9, -1e-150, 1e-200]))
    return st.tuples(sizes, sizes, sizes).map(np.array)


def rational_vectors() -> st.SearchStrategy[tuple[Fraction, ...]]:
    sizes = st.fractions(-5, 5, max_denominator=12)
    return st.tuples(sizes, sizes, sizes)


def floats_of(body: Body) -> tuple[Any, Any, float]:
    A, r = (np.array([float(x) for x in triple]) for triple in (body.A, body.r))
    return A, r / np.linalg.norm(r), float(body.mu)


def in_units(c: Canonical, factor: Any) -> Canonical:
    return c._replace(J1=c.J1 * factor, J2mJ1=c.J2mJ1 * factor, J3=c.J3 * factor)


def fine_angles(body: Body) -> Angles:
    return Angles(*map(FINE.mpf, body.angles(FINE.prec)))


def along(f: Callable[[Any], Sequence[Any]], x: Sequence[Any], v: Sequence[Any]) -> list[Any]:
    """The derivative of f at x in the direction v, by a central difference in 60 digits."""
    ahead, behind = (f([a + step * b for a, b in zip(x, v, strict=True)]) for step in (STEP, -STEP))
    return [(p - q) / (2 * STEP) for p, q in zip(ahead, behind, strict=True)]


def jacobian(f: Callable[[Any], Sequence[Any]], x: Sequence[Any]) -> Any:
    """Derivatives of f at x: the function first, the variable after."""
    units = np.eye(len(x), dtype=int)
    return np.array([along(f, x, [int(e) for e in unit]) for unit in units]).T


def gradient(f: Callable[[Any], Any], x: Sequence[Any]) -> list[Any]:
    return list(jacobian(lambda y: [f(y)], x)[0])


def apart(a: Any, b: Any, period: float) -> float:
    """How far two angles are from each other, around the circle."""
    return float(np.max(np.abs((np.asarray(a) - b + period / 2) % period - period / 2)))


def largest_difference(found: Any, expected: Any) -> float:
    """The largest component of a difference, over any kind of numbers."""
    pairs = zip(np.ravel(found), np.ravel(expected), strict=True)
    return max(float(abs(a - b)) for a, b in pairs)


def relative(found: Any, expected: Any) -> float:
    return float(np.max(np.abs(np.asarray(found) - expected) / np.abs(expected)))


def aligned_from_body(M: Any, gamma: Any, alpha0: float, s: float) -> Aligned:
    """Aligned components from physical M and gamma, with s of `coordinates.scale`."""
    M1, M2, M3 = s * np.asarray(M, dtype=float)
    x, y = np.cos(alpha0 / 2) * M1, np.sin(alpha0 / 2) * M2
    return Aligned(x + y, x - y, M3, *np.asarray(gamma, dtype=float))


def field_with_alpha(body: Body) -> Callable[[Any], tuple[Any, ...]]:
    """The aligned equations with quadratures of theta3, by (th3), and alpha, by (eqPV), in t'."""
    (A, _, _), without = body.floats(), field(body)
    alpha0, s = body.alpha0, scale(A, math)

    def rates(state: Any) -> tuple[Any, ...]:
        found = without(state[:7])
        M, gamma = body_from_aligned(Aligned(*state[:6]), alpha0, s)
        # M is linear in the aligned components, so the same map takes their rates to its own.
        dM, _ = body_from_aligned(Aligned(*found[:6]), alpha0, s)
        omega, domega = angular_velocity(M, A), angular_velocity(dM, A)
        return (*found, hodograph(omega, gamma, domega)[2])

    return rates


def assert_same_state(found: tuple[Any, Any], M: Any, gamma: Any) -> None:
    """The same body state: M's length, its height and its lean each relative to itself."""
    across = np.hypot(M[0], M[1])
    assert np.abs(found[0][:2] - M[:2]).max() <= ROUNDING * across
    assert abs(np.hypot(*found[0][:2]) - across) <= ROUNDING * across
    assert abs(found[0][2] - M[2]) <= ROUNDING * abs(M[2])
    assert np.abs(found[1] - gamma).max() <= ROUNDING


def assert_same_canonical(found: Canonical, c: Canonical, spread: float = 1.0) -> None:
    assert relative(found.J1, c.J1) <= ROUNDING * spread
    assert relative(found.J2mJ1, c.J2mJ1) <= ROUNDING * spread
    assert abs(found.J3 - c.J3) <= ROUNDING * c.J2 * spread
    assert abs(found.cosq - c.cosq) <= ROUNDING * spread
    assert apart(found.theta1, c.theta1, 4 * np.pi) <= 2 * ROUNDING * spread
    # theta2 is known from gamma, as well as gamma leans on M.
    assert apart(found.theta2, c.theta2, 2 * np.pi) <= 2 * ROUNDING * spread / c.cosq
