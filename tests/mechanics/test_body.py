"""The body's angles against the paper's own numbers and relations, and what is refused."""

import math
import pickle
import re
from fractions import Fraction
from itertools import permutations
from typing import Any

import mpmath
import pytest
from hypothesis import strategies as st

from rigidpend import Body
from rigidpend.mechanics.body import angles_from_moments
from rigidpend.numbers.checked import ParameterError
from rigidpend.numbers.exact import exact
from tests.bodies import FIG4
from tests.strategies import FINE, bodies, examples, fine_angles, largest_difference, numbers


@examples(8, bodies())
def test_eq_phi_gives_the_moments_by_the_relations_after_it(body: Body) -> None:
    A, r = ([x.at(FINE.prec) for x in triple] for triple in (body.A, body.r))
    p = fine_angles(body)
    half = [x / 2 for x in (p.alpha0, p.gamma0, p.beta0)]
    (sin_a, sin_g, sin_b), (cos_a, cos_g, cos_b) = (
        list(map(f, half)) for f in (FINE.sin, FINE.cos)
    )
    length = FINE.hypot(r[0], r[1])
    found = (A[2] * (sin_a / sin_g) ** 2, A[2] * (cos_a / cos_g) ** 2, cos_b, sin_b)
    assert largest_difference(found, (A[0], A[1], r[0] / length, r[1] / length)) < 1e-50
    # The second form of kappa below (h_new), and nu.
    kappa = FINE.sin(p.alpha0) ** 2 / (2 * (FINE.cos(p.gamma0) - FINE.cos(p.alpha0)))
    nu = FINE.pi * kappa / FINE.sin(p.alpha0)
    assert largest_difference((p.kappa, p.nu), (kappa, nu)) < 1e-50 * max(1, nu)


def test_eq_phi_of_moments_in_doubles_is_that_of_the_body() -> None:
    r = (math.sqrt(0.5), math.sqrt(0.5), 0.0)
    found = angles_from_moments((2.0, 1.0, 1.5), (1.0, 0.5, 0.5), r, 0.001, math)
    assert tuple(found) == pytest.approx(tuple(FIG4.angles()), rel=4e-16, abs=0)


@examples(8, numbers(0.1, 3), numbers(0.02, 0.98), numbers(0, math.pi), st.fractions("1/9", 9))
def test_agrees_from_angles_with_the_angles_given(
    gamma0: float, place: float, beta0: float, A1: Fraction
) -> None:
    # alpha0 between gamma0 and the flat body.
    alpha0 = gamma0 + place * (2 * math.acos(math.cos(gamma0 / 2) ** 2) - gamma0)
    body = Body.from_angles(alpha0, beta0, gamma0, "0.01", A1=A1)
    assert (body.alpha0, body.beta0, body.gamma0) == (alpha0, beta0, gamma0)
    assert body.A[0].fraction == A1
    assert body.mu.fraction == Fraction(1, 100)


@pytest.mark.parametrize(
    ("A", "r", "cases"),
    [
        ((2, 1, "1.5"), (1, 1, 0), ("Grioli",)),
        # The perpendicular to the circular section of the gyration ellipsoid.
        ((2, 1, "1.5"), (1, "sqrt(2)", 0), ("Hess",)),
        ((2, "0.2", "1.8"), (1, 2, 0), ("flat",)),
        # By the rounding of doubles of any size.
        (("2e9", "0.2e9 + 1e-7", "1.8e9"), (1, 2, 0), ("flat",)),
        (("2e-9", "0.2e-9 + 1e-20", "1.8e-9"), (1, 2, 0), ()),
        ((2, "0.2", "1.8"), ("sqrt(0.04)", "sqrt(3.2)", 0), ("Hess", "flat")),
        ((2, 1, "1.5"), (1, "1 + 1e-14", 0), ()),
    ],
)
def test_agrees_special_cases_with_their_definitions(A: Any, r: Any, cases: Any) -> None:
    assert Body(A, r, 0).special_cases == cases


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"A": (2, 0, 1.5)}, r"A2 > 0 is broken: A = \(2, 0, 1.5\)"),
        ({"A": (-3, 1.5, 2)}, r"A1 > 0 is broken: A = \(-3, 1.5, 2\)$"),
        ({"A": (2, 1, 0)}, r"A3 > 0 is broken: A = \(2, 1, 0\)$"),
        ({"A": (2, "0.4999", "1.5")}, r"A2 \+ A3 >= A1 .* is broken: A = \(2, 0.4999, 1.5\);"),
        ({"A": (1, 30, 2)}, r"A1 \+ A3 >= A2 \(the triangle inequality\) is broken: A = \(1, 30"),
        ({"A": (2, 1, 2)}, r"A1 > A3 > A2 is broken: A = \(2, 1, 2\); a body with two equal mom"),
        ({"A": (2, "sqrt(2)", "sqrt(2)")}, r"A1 > A3 > A2 is broken: A = \(2, 1.4142135\d*, "),
        ({"r": (1, 1, "0.1")}, r"r3 = 0 is broken: r = \(1, 1, 0.1\)"),
        ({"r": ("-1e-9", 1, 0)}, r"r1, r2 >= 0 is broken: r = \(-1e-9, 1, 0\)"),
        ({"r": (0, 0, 0)}, r"r must have a direction: r = \(0, 0, 0\)"),
        ({"mu": "-1e-9"}, r"mu >= 0 is broken: mu = -1e-9"),
        ({"A": (2, 1)}, r"A needs three numbers"),
        ({"r": (1, True, 0)}, r"r needs three numbers: True is not a real number"),
        ({"A": None}, r"A needs three numbers, got None"),
        ({"A": "423"}, r"A needs three numbers, got '423'$"),
        ({"mu": math.inf}, "mu: inf is not finite"),
    ],
)
def test_eq_cond_P_is_refused_where_broken_with_condition_and_values(
    change: dict[str, Any], message: str
) -> None:
    allowed: dict[str, Any] = {"A": (2, 1, 1.5), "r": (1, 1, 0), "mu": 0}
    with pytest.raises(ParameterError, match=f"^{message}") as caught:
        Body(**(allowed | change))
    assert [caught.value.field] == list(change)


def test_directions_that_doubles_put_beyond_their_ends_are_those_of_the_ends() -> None:
    beta0 = math.nextafter(math.pi, 4)
    assert Body.from_angles(2, beta0, "1.5", 0).beta0 == pytest.approx(math.pi, abs=1e-15)
    assert Body((2, 1, "1.5"), (f"cos({beta0!r}/2)", 1, 0), 0).beta0 == pytest.approx(math.pi)


@pytest.mark.parametrize(
    ("angles", "message"),
    [
        ((1.5, 1, 1.5), "pi > alpha0 > gamma0 > 0 is broken: alpha0 = 1.5, gamma0 = 1.5"),
        (("pi", 1, 2), "pi > alpha0 > gamma0 > 0 is broken: alpha0 = pi, gamma0 = 2"),
        ((1.5, 1, 0), "pi > alpha0 > gamma0 > 0 is broken: alpha0 = 1.5, gamma0 = 0"),
        ((1.5, "3.2", 1.4), "0 <= beta0 <= pi is broken: beta0 = 3.2"),
        ((1.5, "-0.1", 1.4), "0 <= beta0 <= pi is broken: beta0 = -0.1"),
        ((2.5, 1, 1), "A2 [+] A3 >= A1"),
        ((1.5, math.nan, 1.4), "^beta0: "),
    ],
)
def test_refused_angles_name_the_condition(angles: Any, message: str) -> None:
    alpha0, beta0, gamma0 = angles
    with pytest.raises(ParameterError, match=message) as caught:
        Body.from_angles(alpha0, beta0, gamma0, 0)
    assert (caught.value.field == "beta0") == ("beta0" in message)


def test_invariant_a_body_is_a_value() -> None:
    for r in ([1, 1.0, Fraction(0)], ["1.0", "1.0", "0.0"], ["2/2", "2/2", 0]):
        same = Body([2, "2/2", Fraction(3, 2)], r, 1 / Fraction(1000))
        assert same == FIG4
        assert hash(same) == hash(FIG4)
    assert Body((2, 1, "1.5"), (1, 1, 0), 0.001) != FIG4


@pytest.mark.parametrize(
    ("r", "unit"),
    [
        ((3, 4, 0), ("3/5", "4/5", 0)),
        ((0.5, 0, 0), (1, 0, 0)),
        ((1, 1, 0), ("sqrt(1/2)", "sqrt(1/2)", 0)),
        (("sqrt(2)*1e-20", 0, 0), (1, 0, 0)),
        ((0, "1e300", 0), (0, 1, 0)),
        # Nearly of length one.
        ((0, "1 + 1e-25", 0), (0, 1, 0)),
    ],
)
def test_agrees_r_with_the_unit_vector_at_any_precision(r: Any, unit: Any) -> None:
    body = Body((2, 1, "1.5"), r, 0)
    for bits in (53, 113, 1000):
        found, expected = ([x.at(bits) for x in each] for each in (body.r, map(exact, unit)))
        assert largest_difference(found, expected) <= 2.0 ** (1 - bits)


MOMENTS: dict[str, Any] = {
    f"{which}, {gap}": tuple(text.format(gap) for text in A)
    for gap in ("0.05", "1e-20", "1e-40")
    for which, A in {
        "A2 to A3": ("2", "1.5 - {}", "1.5"),
        "A3 to A1": ("2", "1", "2 - {}"),
        "all": ("1.5 + {}", "1.5 - {}", "1.5"),
    }.items()
}


@pytest.mark.parametrize("A", MOMENTS.values(), ids=MOMENTS)
def test_agrees_the_angles_in_every_precision_with_200_digits(A: Any) -> None:
    body = Body(A, (1, 3, 0), "1e-3")
    with mpmath.workdps(200):
        a1, a2, a3 = (exact(x).at(mpmath.mp.prec) for x in A)
        alpha0 = 2 * mpmath.atan(mpmath.sqrt(a1 * (a3 - a2) / (a2 * (a1 - a3))))
        gamma0 = 2 * mpmath.atan(mpmath.sqrt((a3 - a2) / (a1 - a3)))
        kappa = a1 * a2 / (a3 * (a1 - a2))
        nu = mpmath.pi * kappa / mpmath.sin(alpha0)
        expected = [alpha0, 2 * mpmath.atan(3), gamma0, kappa, nu, mpmath.mpf(1) / 1000]
        for bits in (53, 64, 113, 300):
            for found, true in zip(body.angles(bits), expected, strict=True):
                assert abs(found - true) <= true / 2**bits
    assert list(body.angles()) == [float(x) for x in expected]
    assert (body.alpha0, body.beta0, body.gamma0, body.kappa, body.nu) == body.angles()[:5]


def test_agrees_what_is_pickled_with_itself() -> None:
    for body in (FIG4, Body.from_angles("1.5", "pi/3", "1.4", 0.1)):
        again = pickle.loads(pickle.dumps(body))
        assert again == body
        assert again.angles(113) == body.angles(113)
    told = pickle.loads(pickle.dumps(ParameterError("A", "is broken")))
    assert (type(told), told.field, str(told)) == (ParameterError, "A", "is broken")


@pytest.mark.parametrize("A", sorted({*permutations((1, 2, 1.5))} - {(2, 1, 1.5)}))
def test_the_advice_to_relabel_axes_leads_to_the_same_body(A: tuple[float, ...]) -> None:
    """The moment of inertia about the centre of gravity's axis is no matter of labels."""
    with pytest.raises(ParameterError, match="relabel the axes") as refused:
        Body(A, (1, 0, 0), 0)
    asked = re.fullmatch(
        r".*A = \[(.*)\], r = \[(.*)\] of your r; that needs your (r\d) = 0", str(refused.value)
    )
    assert asked is not None
    moments, components, zero = asked.groups()
    r = {"r1": 0.5, "r2": 0.25, "r3": 0.125, zero: 0}
    given = [r[name] for name in components.split(", ")]
    body = Body([float(x) for x in moments.split(", ")], given, 0)
    square = sum(x * x for x in r.values())
    before = sum(a * x * x for a, x in zip(A, r.values(), strict=True)) / square
    after = sum(float(a) * float(x) ** 2 for a, x in zip(body.A, body.r, strict=True))
    assert after == pytest.approx(before, rel=1e-14, abs=0)


@pytest.mark.parametrize("size", ["1e150", "2e-150"])
def test_moments_up_to_the_squares_of_doubles_are_taken(size: str) -> None:
    A = [Fraction(size) * share for share in (Fraction(1), Fraction(1, 2), Fraction(3, 4))]
    assert Body(A, (1, 1, 0), 0).kappa == Body((4, 2, 3), (1, 1, 0), 0).kappa
    beyond = [x * (Fraction(101, 100) if A[0] > 1 else Fraction(99, 100)) for x in A]
    with pytest.raises(ParameterError, match=r"is outside of 1e-150 to 1e\+150"):
        Body(beyond, (1, 1, 0), 0)
