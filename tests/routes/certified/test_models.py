"""Families of functions, and the norm by which orbits part: what they contain, by how much."""

import math
import random
from fractions import Fraction
from typing import Any, TypeAlias

import numpy as np
import pytest
from flint import arb, ctx
from numpy.polynomial import chebyshev

from rigidpend import Body
from rigidpend.mechanics.equations import AlignedCoefficients, aligned_coefficients
from rigidpend.routes.certified.approximation import jacobian, rule
from rigidpend.routes.certified.balls import LogarithmicNorm, momentum_unit
from rigidpend.routes.certified.models import Family, Path, on_parts
from scripts import check_certificate

Terms: TypeAlias = dict[tuple[int, ...], int]

UNIT = 40
"""Bits of the paths here."""
POINTS = [Fraction(k, 7) for k in range(-7, 8)]


def random_series(seed: int, n: int) -> list[int]:
    drawn = random.Random(seed)
    return [drawn.randrange(-(1 << UNIT), 1 << UNIT) >> k for k in range(n)]


def value(path: Path, x: Fraction) -> Fraction:
    """P(x) in units, without the error."""
    first, *others = map(Fraction, path.series)
    found: Any = chebyshev.chebval(x, [first / 2, *others])
    return found


def family(series: list[int]) -> Family:
    """The same series as a family that hangs on no parameter."""
    return Family.of({(j, 0, 0): c for j, c in enumerate(series)}, UNIT)


@pytest.mark.parametrize("kind", [lambda series: Path.of_series(series, UNIT), family])
@pytest.mark.parametrize(("n", "m"), [(1, 1), (1, 6), (5, 5), (9, 3)])
def test_results_contain_those_of_every_function(n: int, m: int, kind: Any) -> None:
    a, b = kind(random_series(1, n)), kind(random_series(2, m))
    a.error, b.error = 1000, 50
    for x in POINTS:
        for da, db in ((0, 0), (1000, 50), (-1000, 50), (-1000, -50)):
            f, g = value(a.middle(), x) + da, value(b.middle(), x) + db
            for made, true in ((a + b, f + g), (a - b, f - g), (a * b, f * g / 2**UNIT)):
                units = true * 2 ** (made.bits - UNIT)
                assert abs(value(made.middle(), x) - units) <= made.error
                assert abs(units) <= made.size


def test_the_second_checker_has_the_same_products_and_values_exactly() -> None:
    a, b = random_series(1, 9), random_series(2, 9)
    packed = [check_certificate.packed(w, 16) for w in (a, b)]
    product = Path.of_series(check_certificate.unpacked(packed[0] * packed[1], 16, 16), 0)
    f, g = (Path.of_series(w, UNIT) for w in (a, b))
    assert all(value(product, x) == 2 * value(f, x) * value(g, x) for x in POINTS)
    middles = check_certificate.values(a, UNIT, 8)
    for k, found in enumerate(middles):
        true = value(f, Fraction(2 * k - 7, 8)) * 2 ** (check_certificate.FINE - UNIT)
        assert found <= true < found + 1
    assert all(abs(value(f, x)) <= check_certificate.most(a) for x in POINTS)
    ends = [value(f, Fraction(x)) for x in (-1, 1)]
    assert ends == [Fraction(check_certificate.at_end(a, x), 2) for x in (-1, 1)]
    on_part = check_certificate.on_parts(a, UNIT, 8)
    for k in range(8):
        for t in range(9):
            x = Fraction(2 * k - 8, 8) + Fraction(2 * t, 64)
            true = value(f, x) * 2 ** (check_certificate.FINE - UNIT)
            assert on_part(k)[0] <= true <= on_part(k)[1]


def test_a_product_is_rounded_by_little_to_the_finer_unit() -> None:
    a, b, finer = (Path.of_series(random_series(3, 30), UNIT + k) for k in (0, 0, 9))
    assert (a * b).error == (a * finer).error == (finer * a).error == 59
    assert ((a * b).bits, (a * finer).bits, (finer * a).bits) == (UNIT, UNIT + 9, UNIT + 9)


def lost_in(of: Family, found: Family, unit: int) -> list[Fraction]:
    """What the stored coefficients lost where they were rounded to a unit."""
    near = {at: int(c) for at, c in found.doubled.to_dict().items()}
    return [abs(Fraction(int(c), unit) - near.get(at, 0)) for at, c in of.doubled.to_dict().items()]


@pytest.mark.parametrize("bits", [20, UNIT + 100])
@pytest.mark.parametrize(("terms", "extra"), [(1, 0), (2, -1), (400, 0)])
def test_what_is_rounded_is_in_the_error(bits: int, terms: int, extra: int) -> None:
    """Of coefficients that lose almost a unit of twice the polynomial, with an error that does."""
    unit = 1 << bits
    column: Terms = {(0, k % 20, k // 20): unit * (k + 2) - 1 for k in range(terms)}
    of = Family.of(column, bits + 9)
    of.error = 5 * unit + extra
    found = of.rounded(9)
    lost = sum(lost_in(of, found, unit)) / 2 + Fraction(of.error, unit)
    assert (found.bits, found.degree, found.orders) == (9, of.degree, of.orders)
    assert lost <= found.error < lost + 1
    assert of.rounded(bits + 9) is of.rounded(bits + 10) is of


@pytest.mark.parametrize("size", [1 << 30, 1 << 61, 1 << 200])
def test_coefficients_of_either_sign_are_rounded_by_less_than_a_unit(size: int) -> None:
    """Also those that are less than one, of which some vanish."""
    drawn, unit = random.Random(size), size >> 10
    column: Terms = {
        (j, k, 0): drawn.randrange(-size, size) >> j for j in range(20) for k in range(9)
    }
    of = Family.of(column, 999)
    found = of.rounded(999 - unit.bit_length() + 1)
    left = lost_in(of, found, unit)
    assert max(left) < 1
    assert sum(left) / 2 <= found.error
    assert len(found.doubled.to_dict()) < len(left)


def of_bits(n: int, drawn: random.Random) -> Terms:
    """Coefficients of one word, at both limits, of more, and of less beside them."""
    return {
        (j, k, 0): drawn.choice((-1, 1)) * (2**n - drawn.choice((0, 1, 99))) >> 9 * (j + k)
        for j in range(12)
        for k in range(6)
    }


@pytest.mark.parametrize("bits", [(60, 60), (61, 62), (62, 200), (130, 90)])
def test_coefficients_of_all_sizes_and_signs_are_in_products(bits: tuple[int, int]) -> None:
    drawn = random.Random(bits[0])
    a, b = (Family.of(of_bits(n, drawn), UNIT + 100) for n in bits)
    assert (a * b).doubled == a.doubled * b.doubled
    # Those with a common factor too.
    common: Terms = {(j, 2, k): 3**50 * (7 * j + k + 1) for j in (0, 4) for k in (0, 1)}
    for signs in ((1, 1), (-1, 1), (-1, -1), (0, 1)):
        a, b = (Family.of({at: sign * c for at, c in common.items()}, UNIT) for sign in signs)
        assert (a * b).doubled == a.doubled * b.doubled


@pytest.mark.parametrize(("first", "size"), [(1, 1), (2, 1), (5, 4), (0, 3)])
def test_the_series_in_the_middle_is_within_its_error_of_all_others(first: int, size: int) -> None:
    """At u = v = 1, where all terms beside it add up; to a unit."""
    terms: Terms = {(0, 0, 0): first, (0, 1, 0): size, (0, 0, 1): size + 1, (3, 1, 1): -size}
    of = Family.of(terms, 0)
    of.error = 7
    beside = Fraction(2 * size + 1, 2) + size
    assert beside + 7 <= of.middle().error <= beside + 9
    assert value(of.middle(), Fraction(1)) == Fraction(first, 2)


def test_the_derivative_is_that_of_fractions_and_needs_a_path_without_error() -> None:
    a = Path.of_series(random_series(5, 12), UNIT)
    assert a.derivative().series == check_certificate.slope(a.series)
    far, near = Fraction(1, 1 << 200), POINTS[5]
    apart = (value(a, near + far) - value(a, near - far)) / (2 * far)
    assert abs(value(a.derivative(), near) - apart) < Fraction(1, 1 << 200)
    with pytest.raises(ValueError, match="no derivative"):
        _ = (a * a).derivative()


@pytest.mark.parametrize("number", ["1/3", "-2/7", "0", "5"])
@pytest.mark.parametrize("radius", [0.0, 0.25])
def test_a_constant_contains_its_ball(number: str, radius: float) -> None:
    p, _, q = number.partition("/")
    path = Path.of_ball(arb(int(p)) / int(q or 1) + arb(0, radius), UNIT)
    away, units = abs(value(path, Fraction(0)) - Fraction(number) * 2**UNIT), radius * 2**UNIT
    assert away + units <= path.error <= 1.01 * units + 4
    near = Family.of_fraction(Fraction(number), UNIT)
    off = abs(value(near.middle(), Fraction(0)) - Fraction(number) * 2**UNIT)
    assert off <= near.error == (off > 0)
    assert near.widened(arb(radius)).error == near.error + units


def test_a_value_is_a_ball_around_the_exact_one() -> None:
    a = Path.of_series(random_series(6, 25), UNIT)
    true = value(a, Fraction(1, 4))
    with ctx.workprec(300):
        found = a.value(arb(1) / 4) * 2**UNIT - arb(true.numerator) / true.denominator
        assert found.contains(0)
        assert found.abs_upper() < 1


@pytest.mark.parametrize(
    ("series", "offset", "parts"),
    [
        *((random_series(7, 10), offset, parts) for offset in (0, 3 << UNIT) for parts in (4, 32)),
        # T_8 is 1 at all ends of 4 parts, and 0 between them.
        ([0] * 8 + [1 << UNIT], 0, 4),
        # A line is at the ends of a part as far from its mean as its slope says.
        ([0, 1 << UNIT], 0, 4),
        # Only the error tells values of these functions from zero.
        ([0], 0, 4),
    ],
)
def test_bounds_hold_between_ends_of_parts(series: list[int], offset: int, parts: int) -> None:
    series = [series[0] + 2 * offset, *series[1:]]
    of = Path.of_series(series, UNIT)
    of.error = 1000
    found = on_parts(of, parts)
    for k in range(parts):
        for t in range(9):
            x = Fraction(2 * k - parts, parts) + Fraction(2 * t, 8 * parts)
            for off in (-1000, 0, 1000):
                true = value(of, x) + off
                assert found[k].contains(arb(true.numerator) / (true.denominator << UNIT))
    assert all(x > 0 for x in found) == (offset > 0)


def test_a_rule_is_exact_for_polynomials() -> None:
    """At its nodes, halfway between them in angle, and of the integral from -1."""
    of, p = rule(9), np.polynomial.Polynomial([3, -1, 4, 1, -5, 9, 2, -6])
    values, halfway = p(of.nodes), -np.cos(np.pi * (np.arange(8) + 0.5) / 8)
    np.testing.assert_allclose(of.middles @ values, p(halfway), rtol=1e-13)
    np.testing.assert_allclose(of.integral @ values, p.integ(lbnd=-1)(of.nodes), atol=1e-13)
    doubled = np.polynomial.chebyshev.poly2cheb(p.coef) * [2, *[1] * 7]
    np.testing.assert_allclose(of.series @ values, [*doubled, 0], atol=1e-13)
    np.testing.assert_allclose(of.values @ [*doubled, 0], values, rtol=1e-13)


BODIES = {
    "fig4": Body((2, 1, "3/2"), (1, 1, 0), "0.001"),
    "heavy": Body((3, 1, "5/2"), (1, "1/5", 0), "0.2"),
    "light": Body((2, "3/2", "9/5"), (0, 1, 0), "1e-9"),
    "free": Body((2, 1, "3/2"), (1, 0, 0), 0),
}


def of(name: str) -> tuple[AlignedCoefficients, LogarithmicNorm]:
    c = aligned_coefficients(BODIES[name].angles(), math)
    return c, LogarithmicNorm.of(AlignedCoefficients(*map(arb, c)), arb(1))


def weights(growth: LogarithmicNorm) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
    return np.array([1, 1, float(growth.upright)] + [1 / float(growth.weight)] * 3)


@pytest.mark.parametrize("name", BODIES)
@pytest.mark.parametrize("distance", [0.0, 0.3])
def test_the_rate_bounds_how_fast_orbits_part(name: str, distance: float) -> None:
    """The field is quadratic: its difference between two points is its derivative in the middle."""
    c, growth = of(name)
    D, drawn, nearest = weights(growth), np.random.default_rng(1), 0.0
    for _ in range(300):
        state, off = drawn.normal(size=(2, 6))
        state[:3] *= 10 ** drawn.uniform(-2, 1)
        state[3:] /= np.linalg.norm(state[3:])
        middle = state + off * distance / (2 * np.linalg.norm(D * off))
        scaled = D[:, None] * jacobian(middle[:, None], c)[0] / D
        top = np.linalg.eigvalsh((scaled + scaled.T) / 2)[-1]
        rate = float(growth.rate(arb(abs(middle[2])), arb(distance)))
        assert top <= rate * (1 + 1e-12)
        nearest = max(nearest, top / rate)
    # And it is no loose bound: the saddle is met.
    assert nearest > (0.98 if distance == 0 else 0.9)


@pytest.mark.parametrize("name", BODIES)
def test_derivatives_of_the_field_are_bounded(name: str) -> None:
    """The second one over random pairs, of which the best meets most of it, and the first one."""
    c, growth = of(name)
    D, drawn, shape = weights(growth), np.random.default_rng(3), (3, 2000, 6)
    e, z, y = drawn.normal(size=shape) * 10 ** drawn.uniform(-2, 2, size=shape) / D
    e, z = (x / np.linalg.norm(D * x, axis=1)[:, None] for x in (e, z))
    second = (jacobian(e.T, c) - jacobian(0 * e.T, c)) @ z[..., None]
    most = np.linalg.norm(D * second[..., 0], axis=1).max() / float(growth.bending)
    assert 0.5 < most <= 1 + 1e-12
    steep = np.linalg.norm(D[:, None] * jacobian(y.T, c) / D, 2, axis=(1, 2))
    bounds = [float(growth.steepness(arb(x))) for x in np.linalg.norm(D * y, axis=1)]
    assert (steep <= np.array(bounds) * (1 + 1e-12)).all()


FIRST: Terms = {(0, 0, 0, 0): 3**21, (2, 3, 1, 1): 3**20}
SECOND: Terms = {(1, 0, 2, 0): 3**19, (0, 1, 0, 2): 3**18}


@pytest.mark.parametrize("n", [1, 2, 9])
def test_the_derivative_of_a_family_is_that_of_each_of_its_series(n: int) -> None:
    rows = {k: random_series(k, n) for k in (0, 3)}
    terms: Terms = {(j, k, 0): c for k, row in rows.items() for j, c in enumerate(row)}
    sloped = Family.of(terms, UNIT).derivative()
    assert sloped.orders == (3, 0, 0)
    found = sloped.doubled.to_dict()
    for k, row in rows.items():
        # A term of T_0 counts half.
        true = chebyshev.chebder([Fraction(row[0], 2), *map(Fraction, row[1:])])
        for j, c in enumerate(true):
            both = {int(found.get((sloped.degree + side * j, k, 0, 0), 0)) for side in (-1, 1)}
            assert both == {c * (2 if j == 0 else 1)}


def test_degrees_are_the_largest_of_all_terms_and_add_up_in_products() -> None:
    """A derivative errs by as many times more: by its degree."""
    one, other = Family.of(FIRST, UNIT), Family.of(SECOND, UNIT)
    assert (one.orders, other.orders, (one * other).orders) == ((3, 1, 1), (1, 2, 2), (4, 3, 3))
    one.error = 10
    assert [one.partial(name).error for name in "uvw"] == [30, 10, 10]
    assert Family.of({}, UNIT).orders == Family.of({(1, 2, 3, 4): 0}, UNIT).orders == (0, 0, 0)


def test_the_unit_of_a_momentum_hardly_below_a_power_of_two_is_that_power() -> None:
    """As of one that is rounded upward to it."""
    for power in (arb(2) ** k for k in (-3, 0, 3)):
        assert momentum_unit(power * (1 - arb(2) ** -40)) == momentum_unit(power) == power
        assert momentum_unit(power * (1 - arb(2) ** -10)) == power / 2
