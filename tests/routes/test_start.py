"""Initial phases stay exact, and states are on separatrix 2, on J3 = 0, the same in any scales."""

import itertools
import math
from decimal import Decimal
from fractions import Fraction
from importlib import import_module
from typing import Any

import numpy as np
import pytest

from rigidpend import Body
from rigidpend.mechanics.coordinates import Canonical, aligned_from_canonical
from rigidpend.mechanics.equations import aligned_coefficients
from rigidpend.numbers.exact import ExactError, context, exact
from rigidpend.orbits.precision import precision
from rigidpend.routes.certainty import FIRST_SCALES, SCALES, SECOND_SCALES
from rigidpend.routes.map_start import start_Qp
from rigidpend.routes.phases import FAR, Grid, Phases, turned
from rigidpend.routes.start import Scales, start, states_double, states_exact
from tests.bodies import FIG4, GENERIC, THIN, problem
from tests.strategies import FINE, fine_angles

TENTHS = [f"{k}/10" for k in range(63)]
HALVES, TWO = [Fraction(1, 2), Fraction(5, 4)], [Fraction(2)]
PI = Fraction("3.14159265358979323846264338327950288")
"""To 35 digits, from tables."""


@pytest.mark.parametrize(
    ("values", "expected"),
    [
        (TENTHS, [Fraction(k, 10) for k in range(63)]),
        (["31/10", 3.1], [Fraction(31, 10), Fraction(3.1)]),
        ("3*pi/40 + 1/100", [3 * PI / 40 + Fraction(1, 100)]),
        (np.array([0.5, 1.25]), HALVES),
        (np.array([0.5, 1.25], dtype=np.float32), HALVES),
        (np.array(["1/2", "5/4"], dtype=object), HALVES),
        # Labelled arrays, whose library takes longer to import than these tests.
        (lambda: import_module("xarray").DataArray([0.5, 1.25]), HALVES),
        (lambda: import_module("xarray").DataArray(["1/2", "5/4"]), HALVES),
        (lambda: import_module("xarray").DataArray(2.0), TWO),
        ((0.5, "1.25"), HALVES),
        ([Fraction(1, 2), Decimal("1.25")], HALVES),
        ((x / 4 for x in (2, 5)), HALVES),
        # A number alone is a sequence of one.
        *((value, TWO) for value in (2, 2.0, "4/2", np.float64(2), np.int64(2), np.array(2.0))),
        (np.array("4/2"), TWO),
    ],
)
def test_a_phase_is_a_double_with_its_rest(values: Any, expected: list[Fraction]) -> None:
    phases = Phases(values() if callable(values) else values)
    assert phases.high.tolist() == [float(x) for x in expected]
    assert phases.rest.tolist() == [float(x - Fraction(float(x))) for x in expected]
    exactly = [x.fraction for x in phases.exactly(range(len(phases)))]
    assert exactly in (expected, [None])


def test_phases_stay_as_they_are_given_when_the_caller_changes_his() -> None:
    assert [str(x) for x in Phases(TENTHS).exactly([31, 0, 5])] == ["31/10", "0/10", "5/10"]
    given = np.array([1.0, 2.0])
    phases = Phases(given)
    given[:] = 0.0
    assert phases.high.tolist() == [1.0, 2.0]


@pytest.mark.parametrize("turns", [10**5, 10**6, 10**17, -(10**40), 10**300])
def test_far_phases_are_computed_without_their_whole_turns(turns: int) -> None:
    far = f"1/3 + 2*pi*{turns}"
    phases, double = Phases([far, "1/3", float(10**30)]), Fraction(10**30 * 1.0)
    assert phases.high.tolist() == [float(exact(far)), 1 / 3, 1e30]
    m = context(400 + 1000)
    for k, phase in enumerate([m.mpf(1) / 3, m.mpf(1) / 3, m.mpf(int(double))]):
        missing = phase - m.mpf(phases.near[k]) - m.mpf(phases.rest[k])
        missing -= 2 * m.pi * m.nint(missing / (2 * m.pi))
        assert abs(missing) < 2.0**-85


def test_an_angle_is_turned_by_a_rest_to_the_roundings_of_pairs_of_doubles() -> None:
    """The largest rest is that of a phase just below those that are far."""
    m = context(200)
    a, rest = m.mpf("1.3"), m.mpf(FAR) * 2.0**-53
    found = turned(m.cos(a), m.sin(a), rest)
    for near, true in zip(found, (m.cos(a + rest), m.sin(a + rest)), strict=True):
        assert abs(near - true) < 2.0**-98


def test_grid_is_exact_where_sums_of_doubles_are_not() -> None:
    grid = Grid(exact(0), exact("1/10"), 63)
    assert [x.fraction for x in grid] == [Fraction(k, 10) for k in range(len(grid))]
    for outside in (-1, 63):
        with pytest.raises(IndexError):
            grid[outside]


@pytest.mark.parametrize(
    ("values", "told"),
    [
        (np.array([1.0, np.nan]), "theta2_0 must be finite.*nan"),
        (np.array([np.inf]), "theta2_0 must be finite.*inf"),
        ([1.0, float("inf")], "inf is not finite"),
        (["1", "-1e400"], "theta2_0 must be finite doubles, got -inf"),
        (np.zeros((2, 2)), "got 2 dimensions"),
        (np.ma.masked_array([0.1, 0.2], mask=[False, True]), "masked"),
        (["1", "one"], "'one'"),
        (None, "None is not a real number"),
        (range(10**9), "theta2_0 has 1000000000 phases; 10000000 are the most"),
        (itertools.repeat(0), "theta2_0 has 10000001 phases; 10000000 are the most"),
        (np.array(True), "np.True_ is not a real number"),
        ([1, [2]], r"^theta2_0: \[2\] is not a real number"),
        (b"12", "b'12' is not a real number"),
    ],
)
def test_refuses_what_is_no_finite_number(values: Any, told: str) -> None:
    with pytest.raises(ExactError, match=told):
        Phases(values)


J1_0S = pytest.mark.parametrize("J1_0", ["1e-300", "1e-8", "1/2"])
BODIES = pytest.mark.parametrize("body", [FIG4, GENERIC], ids=["Fig. 4", "generic"])


@pytest.mark.parametrize("bits", [64, 113, 160])
@J1_0S
@BODIES
def test_exact_states_are_those_of_the_coordinates(body: Body, J1_0: str, bits: int) -> None:
    """h0 is the energy without the weight, which turns with theta2."""
    phases = [exact(x) for x in ("1/10", "31/10", "2*pi - 1/7", 5.5, "1e5")]
    p, J1 = fine_angles(body), exact(J1_0).at(FINE.prec)
    J2mJ1, alpha0, beta0 = FINE.sqrt(2 * FINE.mpf("1.3342") / p.kappa) - J1, p.alpha0, p.beta0
    found = states_exact(start(problem(body, J1_0=J1_0), bits, FIRST_SCALES), phases, bits)
    for state, phase in zip(found.T, phases, strict=True):
        c = Canonical(J1, J2mJ1, 0, alpha0 + beta0, phase.at(FINE.prec), 0, 1)
        expected = aligned_from_canonical(c, alpha0, beta0, FINE)
        exactly = (FINE.mpf(x.numerator) / x.denominator for x in state)
        off = [x - y for x, y in zip(exactly, expected, strict=True)]
        assert max(abs(off[0]) / expected.Qp, *map(abs, off[2:])) < 2.0**-bits
        assert state[1] == 0, "exactly on separatrix 2"


@pytest.mark.parametrize("scales", [FIRST_SCALES, SECOND_SCALES])
@J1_0S
@BODIES
def test_agrees_doubles_with_exact_states(body: Body, J1_0: str, scales: Scales) -> None:
    """At 1e5 a double is 1e-11 coarse: its rest must count."""
    phases, one = Phases(["31/10", "100000 + 1/3"]), problem(body, J1_0=J1_0)
    rough = states_double(start(one, 53, scales), phases.high, phases.rest)
    fine = states_exact(start(one, 200, scales), phases.exactly(range(2)), 200).astype(float)
    # Qp, Qm and M3 are rounded once; gamma after a rotation by theta2.
    np.testing.assert_array_equal(rough[:3], fine[:3])
    np.testing.assert_allclose(rough[3:], fine[3:], rtol=0, atol=4e-16)


@pytest.mark.parametrize("pair", list(itertools.combinations(SCALES, 2)))
def test_scales_share_no_constant(pair: tuple[Scales, Scales]) -> None:
    """Every number that is rounded differs in more than a power of two."""
    numbers = [
        [*begin.coefficients, begin.Qp, begin.M3, *begin.gamma_cos, *begin.gamma_sin]
        for begin in (start(problem(GENERIC), 53, scales) for scales in pair)
    ]
    mantissas = [[math.frexp(x)[0] for x in column if x] for column in numbers]
    # What only turns a direction or a ratio into another is the same in all units.
    shared = sum(a == b for a, b in zip(*mantissas, strict=True))
    unscaled = ("half_sigma", "twist", "omega1", "omega2", "kappa")
    assert shared == len(unscaled)


@pytest.mark.parametrize("scales", SCALES[1:])
def test_the_weight_is_in_units_of_momentum_and_vertical(scales: Scales) -> None:
    """mu gamma is of the order of M^2."""
    one, other = (start(problem(GENERIC), 53, x).coefficients for x in (FIRST_SCALES, scales))
    unit = float(scales.momentum) ** 2 / float(scales.vertical)
    for name in ("mu_r1", "mu_r2"):
        assert getattr(other, name) == pytest.approx(getattr(one, name) * unit, rel=1e-14, abs=0)


@pytest.mark.parametrize("bits", [53, 106])
@pytest.mark.parametrize(
    "body",
    [
        Body(A=(1, "1e-14", "1 - 1e-14"), r=(1, 1, 0), mu="1e-20"),
        Body.from_angles("1.2", "1.2 + 1e-14", "1", "0.001"),
    ],
    ids=["thin", "near Hess"],
)
def test_a_start_is_rounded_once_where_sines_are_small(body: Body, bits: int) -> None:
    """Both computations of a precision share it: an error in common is not seen by comparison."""
    case, p = problem(body), body.angles(300)
    m = context(300)
    J1, J2 = case.J1_0.at(300), case.J2_0(300)
    exactly = [2 * m.sqrt(J1 * (J2 - J1)) * m.sin(p.alpha0), *aligned_coefficients(p, m)]
    begin = start(case, bits, FIRST_SCALES)
    for x, y in zip((begin.Qp, *begin.coefficients), exactly, strict=True):
        near = Fraction(x)
        assert abs(m.mpf(near.numerator) / near.denominator / y - 1) < m.mpf(2) ** -bits


@pytest.mark.parametrize("bits", [53, 90])
def test_a_start_of_a_map_keeps_the_digits_of_a_thin_body(bits: int) -> None:
    """Maps share it too; by a rounded alpha0 it would err by 1e8 roundings, alike in all maps."""
    case, m = problem(THIN, J1_0="1e-4"), context(300)
    J1, J2 = case.J1_0.at(300), case.J2_0(300)
    exactly = 2 * m.sqrt(J1 * (J2 - J1)) * m.sin(THIN.angles(300).alpha0)
    found = precision(bits).array([start_Qp(case, "1", bits)])
    near = Fraction(found[0]) if bits == 53 else found.exactly()[0]
    assert abs(m.mpf(near.numerator) / near.denominator / exactly - 1) < 8 * m.mpf(2) ** -bits
