"""What a route problem refuses, and the scales of time that belong to it."""

import math
from fractions import Fraction
from typing import Any

import mpmath
import numpy as np
import pytest
from scipy.integrate import quad

from rigidpend import Body
from rigidpend.numbers.checked import ParameterError
from rigidpend.numbers.exact import exact
from rigidpend.routes.problem import (
    MOST_SYMBOLS,
    RouteProblem,
    narrower,
    narrowness,
    passage_limit,
    passage_rotations,
    phase_rate,
    rotation_period,
    whisker_growth,
)
from tests.bodies import FIG4, FREE, problem
from tests.routes.reference import fig4_left

SECTION = "sqrt(2*1.3342*3/4)/2"
"""J1_0 of a start on the section J1 = J2/2."""


@pytest.mark.parametrize(
    ("given", "told"),
    [
        *(
            ({"n_symbols": n}, f"n_symbols must be a whole number from 1 to 100000, got {n}")
            for n in (0, MOST_SYMBOLS + 1, 1.5)
        ),
        ({"h0": "0.001"}, "h0 > mu is broken: h0 = 0.001, mu = 0.001"),
        ({"h0": np.ma.masked}, "h0: masked is not a real number"),
        ({"h0": "1e6 + 1e-20"}, "is outside of 1e-06 to 1e+06: take other units"),
        ({"h0": "1e7"}, "h0 and mu times a number, actions times its root"),
        ({"h0": "1e-6 - 1e-20", "mu": 0}, "is outside of 1e-06"),
        ({"mu": "1e-330"}, "mu = 1e-330 is below 1e-100 h0"),
        ({"J1_0": 0}, "0 < J1_0 < J2_0 is broken: J1_0 = 0, J2_0 = 1.41467"),
        ({"J1_0": "-1e-9"}, "0 < J1_0 < J2_0 is broken"),
        ({"J1_0": "1.4147"}, "0 < J1_0 < J2_0 is broken: J1_0 = 1.4147, J2_0 = 1.41467"),
        ({"J1_0": "1e-500"}, "J1_0 = 1e-500 is below 1e-500 J2_0"),
        ({"J1_0": float("inf")}, "J1_0: inf is not finite"),
        # Closer than 2^-48, 3.55e-15 relative to J2: what doubles tell apart with room to spare.
        *(({"J1_0": f"{SECTION}*(1 {s} 3.4e-15)"}, "lies on the section") for s in "+-"),
        # At the edge of what is excluded.
        *(({"J1_0": f"{SECTION}*(1 {s} 3.7e-15)"}, "") for s in "+-"),
        ({"h0": "0.001 + 1e-20", "J1_0": "1e-3", "n_symbols": 1}, ""),
        *(({"h0": h0, "mu": 0}, "") for h0 in ("1e-6", "1e6")),
        ({"J1_0": "1.41467", "n_symbols": MOST_SYMBOLS}, ""),
        ({"J1_0": "1.5e-500"}, ""),
    ],
)
def test_refuses_what_the_problem_excludes(given: dict[str, Any], told: str) -> None:
    of = {"h0": "1.3342", "mu": "0.001", "J1_0": "1e-8", "n_symbols": 15, **given}
    values = Body(FIG4.A, FIG4.r, of["mu"]), of["h0"], of["J1_0"], of["n_symbols"]
    if not told:
        assert RouteProblem(*values).J2_0(53) > 0
        return
    with pytest.raises(ParameterError) as refused:
        RouteProblem(*values)
    assert told in str(refused.value)
    assert refused.value.field in given


def test_J2_0_has_the_energy_of_the_rotation_in_every_precision() -> None:
    """kappa J2_0^2/2 = h0, with kappa = 4/3: J2_0^2 = 2.0013."""
    for bits in (53, 64, 113, 300):
        J2 = problem().J2_0(bits)
        assert abs(float(J2 * J2 - exact("2.0013").at(bits))) <= 4 * 2.0 ** (1 - bits)


def test_phase_rate_is_the_faster_of_rotation_and_instability() -> None:
    J2 = math.sqrt(2.0013)
    assert phase_rate(problem()) == pytest.approx(4 / 3 * J2, rel=1e-15, abs=0)
    # A body with nu < pi leaves its periodic orbits faster than it turns.
    slow = Body((2, "0.2", "1.8"), (1, 1, 0), "0.001")
    assert slow.nu < math.pi
    u = float(problem(slow).J2_0(53)) * math.sin(slow.alpha0)
    assert phase_rate(problem(slow)) == pytest.approx(u, rel=1e-15, abs=0)


@pytest.mark.parametrize("bits", [53, 113])
@pytest.mark.parametrize(
    ("J1_0", "smaller"), [("1e-8", 1e-8), ("sqrt(2*1.3342*3/4) - 1e-20", 1e-20)]
)
def test_the_limit_is_twice_the_longest_passage(J1_0: str, smaller: float, bits: int) -> None:
    """To 20 bits below rounding; a rotation takes the root of the less action by exp(pi^2/nu)."""
    start = math.sqrt(smaller / math.sqrt(2.0013))
    distance = start * (0.001 / 1.3342) * 2.0 ** -(bits + 20)
    rotations = -math.log(distance) / (math.pi**2 / FIG4.nu)
    found = passage_limit(problem(J1_0=J1_0), bits) / rotation_period(problem())
    assert found == pytest.approx(2 * rotations + 4, rel=1e-9)


def test_passages_take_as_many_rotations_as_is_foretold() -> None:
    """The mean over the crossings of reference orbits, against the estimate from nu and mu/h0."""
    mean = float(np.mean(np.diff(fig4_left().crossing_time, axis=0))) / rotation_period(problem())
    assert passage_rotations(problem()) == pytest.approx(mean, rel=0.05)
    # By the splitting it were 46 and 277, but starts are farther off than that.
    for A3, J1_0, rotations in (("1.7", "1e-4", 34.3), ("1.9", "1e-8", 162.0)):
        A = 2, A3, (2 + Fraction(A3)) / 2
        assert passage_rotations(problem(Body(A, FIG4.r, FIG4.mu), J1_0=J1_0)) == pytest.approx(
            rotations, rel=0.06
        )
    # Without weight none ends; with a heavy body of small exponents it would be a share of one.
    assert passage_rotations(problem(FREE, h0="1")) == math.inf
    heavy = Body((2, "0.25", "1.8"), (1, 1, 0), "0.99")
    assert passage_rotations(problem(heavy, h0="1", J1_0="1e-2")) == 1.0


@pytest.mark.parametrize("nu", [0.5, 4.4, 12.0, 1e4])
def test_narrowness_is_the_logarithm_at_any_shape(nu: float) -> None:
    true = mpmath.log(mpmath.sinh(nu) / nu)
    assert narrowness(nu) == pytest.approx(float(true), rel=1e-13, abs=0)


LONG = (2, "1.9", "1.95")
"""Moments of a body with nu = 61, whose surfaces are split by 2^-82 of their displacement."""


@pytest.mark.parametrize(
    ("mu", "share", "bits"),
    [
        # The start's |I|, 4 J1/J2, over 16 nu: from 6 bits on they pay, or from 3 with more weight.
        *(("0.0025", 2.0**-6 * (1 + x), bits) for x, bits in ((-1e-9, 6), (1e-9, 0))),
        *(("0.0025", 2.0**-7 * (1 + x), bits) for x, bits in ((-1e-9, 7), (1e-9, 6))),
        *(("0.0101", 2.0**-3 * (1 + x), bits) for x, bits in ((-1e-9, 3), (1e-9, 0))),
        *((mu, 2.0**-5.5, bits) for mu, bits in (("0.0101", 5), ("0.01", 0), ("0.0099", 0))),
        *(
            ("0.0025", 2.0**-40 * (1 + x), bits)
            for x, bits in ((1e-9, 39), (-1e-9, 40), (-0.6, 40))
        ),
        # Its |v|, 8 J1/J2 h0/mu, where mu is less.
        *(("0.001", x, bits) for x, bits in ((0.999 * 2.0**-6, 0), (0.48 * 2.0**-6, 6))),
        ("0", 2.0**-20, 0),
    ],
)
def test_a_layer_is_narrower_than_its_displacement_by_what_its_starts_allow(
    mu: str, share: float, bits: int
) -> None:
    own = problem(Body(LONG, FIG4.r, mu), h0=1)
    J1_0 = share * float(own.J2_0(53)) / (4 * 16 * own.body.nu)
    assert narrower(problem(own.body, h0=1, J1_0=J1_0)) == bits


@pytest.mark.parametrize("share", [2.0**-6, 2.0**-9])
@pytest.mark.parametrize("unit", [1, 2.0**-12])
def test_starts_lie_within_the_range_of_a_narrower_layer_s_normal_form(
    share: float, unit: float
) -> None:
    """|v| of a start over that at arcs' ends is 8 J1/J2 h0/mu times two to the bits."""
    body, h0 = Body(LONG, FIG4.r, 0.0004 * unit), 2 * unit
    bits, J2 = round(-math.log2(share)), float(problem(body, h0=h0).J2_0(53))
    for off, expected in ((-1e-9, bits), (1e-9, bits - 1 if bits > 6 else 0)):
        J1_0 = share * (1 + off) * 0.0002 / 8 * J2
        assert narrower(problem(body, h0=h0, J1_0=J1_0)) == expected


@pytest.mark.parametrize("A", [("1.534", "1.296", "1.44"), (2, "1.7", "1.85"), FIG4.A])
def test_a_layer_is_narrower_by_its_splitting_where_starts_are_close(A: Any) -> None:
    body = Body(A, FIG4.r, FIG4.mu)
    true = mpmath.log(mpmath.sinh(body.nu) / body.nu / (16 * body.nu), 2)
    assert narrower(problem(body, J1_0="1e-30")) == max(0, math.floor(true))


def test_whisker_growth_is_the_mean_over_random_phases() -> None:
    a = 2 * 4.4 / math.pi

    def logarithm(x: float) -> float:
        return math.log(abs(1 - a / math.tan(x)))

    total, _ = quad(logarithm, 0, math.pi, points=[math.atan(a)], limit=500, epsabs=1e-9)
    assert math.log(whisker_growth(4.4)) == pytest.approx(total / math.pi, abs=1e-6)
