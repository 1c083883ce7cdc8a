"""The table of a body: every quantity is there, as a number too, and fits the full dynamics."""

import json
from typing import Any

import mpmath
import numpy as np
import pytest

from rigidpend.config.theory import rows as theory_rows
from rigidpend.mechanics.body import Body
from rigidpend.numbers.checked import ParameterError
from rigidpend.numbers.exact import exact
from tests.bodies import FIG4

NAMES = (
    *("A", "r", "mu", "alpha0", "beta0", "gamma0", "kappa", "nu", "separatrices"),
    *("special cases", "h0", "J2_0"),
    *("Delta_1(+1)", "Delta_1(-1)", "Melnikov amplitude", "J1_0", "Melnikov zeros"),
    *("regime", "Delta theta3", "period", "multipliers", "multiplier, mu = 0"),
)


def numbers(body: Body, h0: Any, J1_0: Any = None) -> dict[str, Any]:
    return {row.name: row.number for row in theory_rows(body, h0, J1_0)}


def test_the_table_holds_every_quantity_once_with_a_meaning_and_as_a_number() -> None:
    rows = theory_rows(FIG4, "1.3342", "1e-8")
    assert tuple(row.name for row in rows) == NAMES
    assert all(row.value and row.meaning for row in rows)
    for row in rows:
        if row.number is not None:
            shown = [float(exact(x)) for x in row.value.split(", ")]
            assert shown == np.atleast_1d(row.number).tolist()
            assert json.loads(json.dumps(row.number)) == row.number
    assert set(NAMES) - set(numbers(FIG4, "1.3342")) == {"J1_0", "Melnikov zeros"}


def test_agrees_with_the_expected_values_and_an_invariant_of_fig4_and_fig5() -> None:
    fig4 = numbers(FIG4, "1.3342", "1e-8")
    assert fig4["alpha0"] == 1.9106332362490186
    assert fig4["nu"] == pytest.approx(4.442882938158366, rel=1e-15, abs=0)
    # The motion without weight is approached with the square of mu.
    leaving, approaching = fig4["multipliers"]
    assert leaving * approaching == pytest.approx(1, rel=1e-13, abs=0)
    assert abs(leaving / fig4["multiplier, mu = 0"] - 1) < (0.001 / 1.3342) ** 2
    light = numbers(Body(FIG4.A, FIG4.r, "1e-12"), "1.3342")["multipliers"][0]
    assert fig4["multiplier, mu = 0"] == pytest.approx(light, rel=1e-13, abs=0)
    assert fig4["Melnikov zeros"] == pytest.approx([1.563050, 4.704643], abs=5e-7)
    fig5 = numbers(Body((2, "1.5", "1.8"), (0, 1, 0), "0.01"), "10/9")
    assert fig5["Delta theta3"] == pytest.approx(
        [0.057715, 0.057715, -0.057715, -0.057715], abs=6e-7
    )


@pytest.mark.parametrize(
    ("A", "J1_0", "said"),
    [
        ((2, 1, "1.5"), "1e-8", "to O(mu) and 4e-08"),
        ((2, 1, "1.5"), "0.001", "to O(mu) and 0.004"),
        ((2, 1, "1.5"), "0.5", "little of the first symbol"),
        # Of a splitting so small nearly all is missed by a start that is close to S1- elsewhere.
        (("1.718", "1.484", "1.658"), "1e-8", "little of the first symbol"),
    ],
)
def test_zeros_are_told_with_their_distance_from_changes_of_the_first_symbol(
    A: Any, J1_0: str, said: str
) -> None:
    [row] = [x for x in theory_rows(Body(A, (1, 1, 0), "1e-4"), "1.3342", J1_0) if "zer" in x.name]
    assert said in row.meaning


def test_the_direction_is_written_in_numbers() -> None:
    [row] = [x for x in theory_rows(Body((2, 1, "1.5"), (3, 4, 0), "0.01"), "1.3") if x.name == "r"]
    assert (row.value, row.number) == ("0.6, 0.8, 0.0", [0.6, 0.8, 0.0])


def test_melnikov_s_amplitude_is_zero_in_the_hess_case_alone() -> None:
    """On separatrices 1 and 3; amplitudes below all doubles are written, and not as zeros."""

    def written(body: Body) -> list[str]:
        [row] = [x for x in theory_rows(body, "1.3") if x.name == "Melnikov amplitude"]
        return row.value.split(", ")

    hess = written(Body((2, 1, "1.5"), (1, exact("sqrt(2)"), 0), "0.01"))
    assert hess[::2] == ["0.0", "0.0"]
    assert [x.removeprefix("-") for x in hess[1::2]] == [hess[3]] * 2
    nearly_round = written(Body((2, "1.999999", "1.9999995"), (1, 1, 0), "0.001"))
    assert nearly_round == ["-1.3e-2728755", "-1.04e-2728748", "1.3e-2728755", "1.04e-2728748"]


def test_figures_of_the_first_order_are_those_of_long_numbers_rounded_once() -> None:
    """Those of a nearly symmetric body: the rounding of its large nu grows in the amplitudes."""
    found = numbers(Body((2, "1.38", "1.41"), ("0.05", 1, 0), "0.012"), "2.91")
    with mpmath.workdps(40):
        A2, A3, mu, h0 = map(mpmath.mpf, ("1.38", "1.41", "0.012", "2.91"))
        alpha0 = 2 * mpmath.atan(mpmath.sqrt(2 * (A3 - A2) / (A2 * (2 - A3))))
        beta0, kappa = 2 * mpmath.atan(20), 2 * A2 / (A3 * (2 - A2))
        nu, J2_0 = mpmath.pi * kappa / mpmath.sin(alpha0), mpmath.sqrt(2 * h0 / kappa)
        lean = [mpmath.sin((beta0 + sign * alpha0) / 2) for sign in (-1, 1)]
        first, second = (2 / (kappa * J2_0) * nu / mpmath.sinh(nu) * x for x in lean)
        # A forced swing of the decay u = J2_0 sin(alpha0) and the frequency kappa J2_0.
        speed = J2_0**2 * mpmath.hypot(mpmath.sin(alpha0), kappa)
        swings = [float(2 * mu * abs(x) / speed) for x in lean[::-1]]
        expected = [float(x) for x in (first, -second, -first, second)]
    assert found["Melnikov amplitude"] == expected
    assert [found["Delta_1(+1)"], found["Delta_1(-1)"]] == swings


def test_what_is_not_hyperbolic_or_not_resolved_is_said_to_be_so() -> None:
    elliptic = Body.from_angles(0.3, 3.0, 0.25, 0.5), 1
    edge = Body((2, 1, "1.5"), (1, 1, 0), 1), "1 + 1e-20"
    found = [x for case in (elliptic, edge) for x in theory_rows(*case) if x.name == "multipliers"]
    assert [(row.value, row.number) for row in found] == [
        ("on the unit circle", None),
        ("not resolved", None),
    ]
    assert "not hyperbolic" in found[0].meaning
    with pytest.raises(ParameterError, match="h0 > mu is broken"):
        theory_rows(FIG4, "0.001")


def test_a_thin_body_has_its_multiplier_and_increments_to_the_last_digits() -> None:
    """Its alpha0 is so near pi that a double has lost half of the digits of their sines."""
    thin = Body((1, "1e-8", "0.99999999"), (0, 1, 0), "1e-20")
    found = numbers(thin, 1)
    leaving, _ = found["multipliers"]
    assert leaving == pytest.approx(found["multiplier, mu = 0"], rel=1e-12, abs=0)
    p = thin.angles(200)
    unit = p.mu * p.nu
    true = [float(unit * mpmath.sin((p.beta0 + side * p.alpha0) / 2)) for side in (-1, 1)]
    assert found["Delta theta3"][:2] == pytest.approx(true, rel=1e-14, abs=0)
