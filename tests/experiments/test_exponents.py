"""The experiment `exponents`: cells, their check, and results told apart."""

from typing import Any

import numpy as np
import pytest

from rigidpend import Body
from rigidpend.experiments import compare
from rigidpend.experiments.exponents import LAYOUT
from rigidpend.experiments.exponents import compute as exponents
from rigidpend.numbers.exact import exact
from rigidpend.orbits.return_map import MapError
from rigidpend.routes.cells import Cells, cells_of_starts
from rigidpend.routes.problem import RouteProblem
from rigidpend.routes.symbolic.levels import orbits_of
from rigidpend.routes.symbolic.stretching import (
    BENDING,
    ROUNDINGS,
    Stretched,
    integrated,
    rounding,
    stretched,
)
from tests.cli.calls import REFERENCE
from tests.experiments.trees import asked, computed, reference
from tests.routes.symbolic.fig4 import BODY, H

SMALL = [
    "problem.theta2_0.count=6",
    "problem.log10_J1_0.count=4",
    "problem.checked=5",
    "problem.n_symbols=3",
    "numerics.precisions=[53]",
]


NEARLY = ["problem.A=[1.6,1.42,1.5]", "problem.r=[0.3,0.7,0]", "problem.mu=0.004"]
"""A nearly symmetric body."""
PAGE = (REFERENCE.parents[1] / "docs" / "addresses.md").read_text(encoding="utf-8")


@pytest.fixture(scope="module")
def data() -> Any:
    return computed(asked("exponents", *SMALL))


def test_every_cell_is_the_orbit_of_its_middle_and_quantiles_are_those_of_the_cells(
    data: Any,
) -> None:
    assert data["exponent"].shape == (4, 6)
    problem = RouteProblem(BODY, H, exact("1e-7"), 3)
    for row, y in enumerate(data["log10_J1_0"]):
        seen = stretched(orbits_of(problem), data["theta2_0"], np.full(6, 10.0**y), 3)
        known = np.isfinite(data["exponent"][row])
        assert known.sum() >= 5
        np.testing.assert_allclose(
            data["exponent"][row][known], seen.growth[-1][known] / 3, rtol=1e-7
        )
        np.testing.assert_array_equal(data["codes"][:, row][:, known], seen.symbols[:, known])
        # Rounded up to a power of two, for it is a bound.
        share = data["allowed"][row][known] / (seen.allowed[known] / 3)
        assert 1 - 1e-6 < share.min() <= share.max() < 2
    quantiles = data["growth"]["exponent"]
    assert quantiles[2, -1] == pytest.approx(float(np.nanmedian(data["exponent"])))
    assert (np.diff(quantiles, axis=0) >= 0).all()


def test_cells_that_are_checked_agree_with_the_variational_equations(data: Any) -> None:
    checked = data["checked"]
    assert np.isfinite(checked["growth"]).sum() >= 4
    known = np.isfinite(checked["growth"])
    assert (np.abs(checked["difference"]) < checked["allowed"])[known].all()
    at = checked["row"][known], checked["column"][known]
    np.testing.assert_allclose(data["exponent"][at], checked["growth"][known] / 3, rtol=1e-12)


@pytest.mark.parametrize(
    ("setting", "cells"), [("problem.checked=0", 0), ("problem.log10_J1_0.ends=[-2,-1.9]", 5)]
)
def test_cells_are_computed_where_none_is_checked_or_none_is_known(
    setting: str, cells: int
) -> None:
    found = computed(asked("exponents", *SMALL, setting))
    assert found["checked"]["difference"].shape == (cells,)
    assert np.isnan(found["checked"]["difference"]).all()
    assert found["exponent"].shape == (4, 6)


def test_a_body_without_a_map_is_told_what_the_map_is_for() -> None:
    with pytest.raises(ArithmeticError, match=r"the ends of .* arcs.*: .* no return map, of which"):
        computed(asked("exponents", *SMALL, "problem.A=[2.3,1.5,1.9]", "problem.mu=0.3"))


def test_deviations_that_grow_beyond_all_digits_of_a_double_are_checked_too() -> None:
    """Three passages of a nearly symmetric body multiply them by up to e^31 in these cells."""
    problem = asked("exponents", *SMALL, *NEARLY, "problem.h0=1.1").problem.routes
    theta2, J1 = np.array([3.8, 1.4, 6.2, 3.8, 1.4]), 10.0 ** np.array([-9, -8, -8, -7, -6])
    found = stretched(orbits_of(problem), theta2, J1, 3)
    assert found.growth[-1].max() > 31
    # Roundings have grown to radians, and with them the bounds: a lost orbit would be off by more.
    allowed = np.minimum(4, found.allowed + found.allowed_integrated)
    assert (np.abs(integrated(found) - found.growth[-1]) < allowed).all()


def test_a_cell_whose_exponent_may_err_by_as_much_as_itself_is_not_known() -> None:
    """Of this nearly symmetric body nearly all cells are, if the least actions are left out."""
    more = ["problem.h0=1", "problem.log10_J1_0.ends=[-9,-5]", "numerics.precisions=[53,106,160]"]
    data = computed(asked("exponents", *SMALL, *NEARLY, *more))
    known = np.isfinite(data["exponent"])
    assert not known[0].all()
    assert known[-1].all()
    assert (data["allowed"][known] < data["exponent"][known]).all()
    np.testing.assert_array_equal(np.isfinite(data["allowed"]), known)


def test_the_variational_equations_err_by_a_small_part_of_their_bound() -> None:
    """Two passages of the body of Fig. 5 multiply deviations by e^18."""
    body = ["problem.A=[2,1.5,1.8]", "problem.r=[0,1,0]", "problem.mu=0.01", "problem.h0=10/9"]
    ends = ["problem.theta2_0.ends=[0.9,2]", "problem.log10_J1_0.ends=[-10,-8]"]
    more = ["problem.checked=24", "problem.n_symbols=2"]
    checked = computed(asked("exponents", *SMALL, *body, *ends, *more))["checked"]
    assert np.nanmax(checked["growth"]) > 16
    assert np.nanmax(np.abs(checked["difference"]) / checked["allowed"]) < 0.05


@pytest.mark.parametrize(("lost", "told"), [(999, 0), (1001, 1)])
def test_hardly_any_cell_may_be_lost(lost: int, told: int) -> None:
    """A thousandth of them."""
    stored = {"exponent": np.ones(10**6), "allowed": np.ones(10**6)}
    fresh = {**stored, "exponent": np.where(np.arange(10**6) < lost, np.nan, 1.0)}
    layout = {name: LAYOUT[name] for name in stored}
    assert len(compare.differences(layout, stored, fresh)) == told


@pytest.mark.parametrize("group", ["", "checked"])
@pytest.mark.parametrize(("factor", "told"), [(0.5, 0), (2, 0), (0.25, 1), (4, 1)])
def test_a_stored_bound_of_rounding_is_not_any_number(
    data: Any, group: str, factor: float, told: int
) -> None:
    """It bounds the exponents; as a power of two it may be the next one."""
    layout: Any = LAYOUT[group] if group else LAYOUT
    fresh = data[group] if group else data
    stored = {**fresh, "allowed": factor * fresh["allowed"]}
    found = compare.differences(layout, stored, fresh)
    assert [x.place.partition("[")[0] for x in found] == told * ["allowed"]


def doubted(*given: Any) -> Cells:
    """Cells of which one is not certain, and another has a code that no map finds."""
    found = cells_of_starts(*given)
    found.certain[7] -= 1
    found.codes[0, 9] ^= 1
    return found


def left(*given: Any) -> Stretched:
    """Orbits of which one leaves the tables, where its symbols mean nothing, right as they are."""
    found = stretched(*given)
    if found.inside.size == 23:
        found.inside[4] = False
    return found


def test_without_an_established_code_a_cell_stays_blank(
    data: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(exponents, "cells_of_starts", doubted)
    monkeypatch.setattr(exponents, "stretched", left)
    monkeypatch.setattr(exponents, "integrated", lambda found: found.growth[-1] + 1)
    # The last cell is a tile of its own.
    monkeypatch.setattr(exponents, "TILE", 23)
    other = computed(asked("exponents", *SMALL))
    blank = np.isnan(other["exponent"]) & np.isfinite(data["exponent"])
    np.testing.assert_array_equal(np.flatnonzero(blank), [4, 7, 9])
    shares = np.nanquantile(other["exponent"], other["growth"]["share"])
    np.testing.assert_allclose(other["growth"]["exponent"][:, -1], shares, rtol=1e-12)
    # The seventh is one of those that are checked.
    checked, gap = other["checked"], np.array([0, np.nan, 0, 0, 0])
    np.testing.assert_allclose(checked["difference"], 1 + gap, rtol=1e-12)
    np.testing.assert_allclose(checked["growth"], data["checked"]["growth"] + gap, rtol=1e-12)


def test_the_page_says_by_how_much_passages_multiply() -> None:
    growth = reference("exponents")["data"]["growth"]
    first, second, third = np.exp(np.diff(growth["exponent"][2] * growth["passages"], prepend=0))
    numbers = f"by {first / 1000:.0f},000, the second by {second:.1f} and the third by {third:.1f}"
    assert numbers in PAGE


def test_other_units_change_a_growth_by_as_much_as_the_page_says() -> None:
    """Energies a hundred times as large, and momenta ten times: the symbols are the same."""
    assert "the logarithm of a growth changes by $\\ln s$ at most" in PAGE
    theta2, found = np.linspace(4.5, 4.9, 7), []
    for s in (1, 10):
        body = Body(A=BODY.A, r=BODY.r, mu=s * s * BODY.mu)
        problem = RouteProblem(body, s * s * H, exact("1e-7") * s, 3)
        found.append(stretched(orbits_of(problem), theta2, np.full(7, 1e-7 * s), 3))
    own, other = found
    np.testing.assert_array_equal(own.symbols, other.symbols)
    assert 0.9 * np.log(10) < np.abs(other.growth - own.growth).max() < np.log(10)


def test_a_plane_that_reaches_beyond_the_section_is_refused() -> None:
    with pytest.raises(MapError, match=r"^J1_0 = 0\.743\d{13} is above J2_0/2"):
        computed(asked("exponents", *SMALL, "problem.log10_J1_0.ends=[-0.4,-0.09]"))


@pytest.mark.parametrize("turned", [(0.0, 0.0, 0.0), (8.0, 16.0, 24.0)])
def test_the_bound_of_a_growth_sums_what_roundings_grow_to(turned: tuple[float, ...]) -> None:
    """Changes of d grow to 3 in chi, and these to 2 in d; surfaces are split by 1/4 of a width.

    A growth beside an inner crossing is that in units of the splitting, four times as many.
    """
    slopes = [
        np.array([[[0.0], [0.0]], [[3.0], [0.0]]]),
        np.array([[[0.0], [2.0]], [[0.0], [0.0]]]),
    ]
    found = rounding(slopes, np.array(turned)[:, None], 1.0, 0.25, np.log([6.0]))
    # An angle of eight radians is rounded by as much again.
    one, two, three = 1 + turned[0] / 8, 4 * (1 + turned[1] / 8), 1 + turned[2] / 8
    # Errors at the three crossings, each with the whole growth of 6 before and behind it.
    places = one + (3 * one + two) + (6 * one + 2 * two + three)
    # The two derivatives' own.
    expected = ROUNDINGS * 2.0**-53 * (BENDING * places + 2)
    assert found == pytest.approx(expected, rel=1e-12, abs=0)
