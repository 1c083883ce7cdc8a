"""The experiment `precession`: orders of the regimes, slopes, and results told apart."""

import copy
from typing import Any

import mpmath
import numpy as np
import pytest

from rigidpend.experiments.precession import SLOPE
from rigidpend.experiments.precession.compute import in_order, uncertainty, unit_of
from rigidpend.experiments.precession.draw import draw, tables
from rigidpend.mechanics.body import Body
from rigidpend.numbers.exact import exact
from rigidpend.orbits.integrate.arithmetic import resolve
from rigidpend.surfaces.heteroclinic import Increments, increments
from tests.experiments.pages import drawn_with, laid_out, overlap, tick_labels
from tests.experiments.trees import asked, computed, differences, shared_reference, unlike_stored

SMALL = "problem.mu=[1e-4, 1e-3, 1e-2, 0.1]", "problem.drawn=1/100"
HEAVY = "problem.mu=[0.6, 0.7]", "problem.drawn=0.6"
BODIES = ("i", "ii", "iii", "iv", "v")


@pytest.fixture(scope="module")
def ran() -> tuple[Any, list[str]]:
    """What a few weights give, and the lines that are told on the way."""
    parts, told = list[str](), list[str]()
    found = computed(asked("precession", *SMALL), parts, report=told.append)
    assert parts == list(BODIES)
    return found, told


@pytest.fixture
def data(ran: tuple[Any, list[str]]) -> Any:
    return ran[0]


def test_all_is_as_it_is_stored_of_these_weights(data: Any) -> None:
    """But slopes, which are fitted to fewer of them."""
    found = unlike_stored("precession", data, {"mu": [2, 4, 6, 8]})
    assert found == {"drawn", "bodies/slope"}
    assert data["drawn"] == 2


@pytest.mark.parametrize(("mu", "fitted"), [("[2e-5, 2e-4]", False), ("[2e-4, 4e-4]", True)])
def test_slopes_are_those_of_remainders_that_are_known_to_so_many_digits(
    mu: str, fitted: bool
) -> None:
    """Of the mean over all starts, of the third order: of 40 errors at 2e-5, of 4,000 at 2e-4."""
    body = "problem.bodies={iv: {A: [2, 1, 1.5], r: [2, 1, 0]}}"
    bodies = computed(asked("precession", body, f"problem.mu={mu}", "problem.drawn=2e-4"))["bodies"]
    assert bodies["slope"][0, 0] == pytest.approx(2, abs=SLOPE)
    expected = 3 if fitted else np.nan
    assert bodies["mean_slope"][0, 0] == pytest.approx(expected, abs=SLOPE, nan_ok=True)


def test_weights_without_such_orbits_are_named_and_crossed_out_and_the_others_computed() -> None:
    given = (
        "problem.bodies={x: {A: [2, 0.2, 1.8], r: [1, 0, 0]}, y: {A: [2, 1, 1.5], r: [2, 1, 0]}}",
        "problem.mu=[0.001, 0.01, 0.6]",
    )
    said = list[str]()
    data = computed(asked("precession", *given, "problem.drawn=0.6"), report=said.append)
    assert said[0].startswith("body x, mu = 0.6: no orbit of S1- was found ")
    assert said[0].endswith("; take less weight")
    bodies = data["bodies"]
    lost = [[False, False, True], [False] * 3]
    for name in ("gained", "error", "remainder", "mean_remainder"):
        values = bodies[name].reshape(2, 3, -1)
        assert (np.isnan(values) == np.array(lost)[..., None]).all(), name
    assert not bodies["ordered"][0, 2]
    np.testing.assert_allclose(bodies["slope"], 2, atol=0.05)
    assert differences("precession", data, copy.deepcopy(data)) == []
    loaded: Any = {"data": data}
    orders, *remainders = draw(loaded).axes
    crosses = [text for text in orders.texts if text.get_text() == "\N{MULTIPLICATION SIGN}"]
    assert [cross.get_position() for cross in crosses] == [(0, 0)]
    # The guide is above the last remainder of each body.
    for axes in remainders:
        one, other, guide = (np.log(np.array(line.get_xydata())) for line in axes.lines[:3])
        for at, rest in (one[1], other[2]):
            assert np.interp(at, *guide.T) > rest + 1
    increments, slopes = tables(loaded)
    assert [row[1].startswith("not found (") for row in increments.rows] == [True, False]
    assert slopes.note.endswith(" of 5 cases of body and mu; in 1 no orbits were found.")


def test_names_of_as_many_bodies_as_a_config_may_have_stand_apart() -> None:
    def change(data: Any) -> None:
        bodies = data["bodies"].items()
        data["bodies"] = {k: np.resize(x, (26, *x.shape[1:])) for k, x in bodies}

    axes = laid_out(drawn_with("precession", change)).axes[0]
    names = [x.get_window_extent() for x in tick_labels(axes.xaxis)]
    assert len(names) == 26
    assert not overlap(names)


def test_numbers_of_separatrices_stand_beyond_the_marks_of_both_orbits() -> None:
    data = copy.deepcopy(dict(shared_reference("precession")["data"]))
    bodies, drawn = data["bodies"], int(data["drawn"])
    # Far from the first order, as where the weight acts strongly.
    bodies["gained"][0, drawn, :, 1] = np.array([0.2, 1.2]) * bodies["unit"][0, drawn]
    loaded: Any = {"data": data}
    axes: Any = draw(loaded).axes[0]
    written = {text.get_text(): text.xy for text in axes.texts[:4]}
    assert written["2"][1] == pytest.approx(1.2)


@pytest.mark.parametrize(
    ("bodies", "weights", "said"),
    [
        ("{x: {A: [2, 0.2, 1.8], r: [1, 0, 0]}}", HEAVY, [[], *[["no orbits are found"]] * 3]),
        # Only the Hess case has none, along separatrices 1 and 3.
        (
            "{ii: {A: [2, 1, 1.5], r: [1, 3, 0]}, iii: {A: [2, 1, 1.5], r: [1, sqrt(2), 0]}}",
            ("problem.mu=[0.01, 0.1]", "problem.drawn=0.1"),
            [[], [], ["iii) no increment: rounding"], []],
        ),
    ],
)
def test_a_figure_says_what_is_not_found_and_a_table_that_no_slope_is_fitted(
    bodies: str, weights: tuple[str, ...], said: list[list[str]]
) -> None:
    """Increments are not called none where weights are too few for a slope."""
    data = computed(asked("precession", f"problem.bodies={bodies}", *weights))
    assert np.isnan(data["bodies"]["slope"]).all()
    loaded: Any = {"data": data}
    texts = [[text.get_text() for text in axes.texts] for axes in draw(loaded).axes]
    assert [[text for text in each if "no " in text] for each in texts] == said
    assert tables(loaded)[1].rows[0][2:] == ("not fitted", "not fitted")


def test_the_largest_error_of_the_quadrature_and_rounding_of_ever_more_steps_count() -> None:
    none = np.zeros((2, 4))
    found = Increments(none, np.arange(8.0).reshape(2, 4))
    assert 7 < uncertainty(found, 1.0, 1.0, 1.0) < 7 + 1e-9
    stated = [uncertainty(Increments(none, none), 2.0, nu, 1.0) for nu in (4.0, 1500.0)]
    assert stated == pytest.approx([2e-13, 2e-12], abs=0)


def test_rounding_of_a_body_that_almost_rests_at_its_highest_point_counts() -> None:
    """With the centre of gravity on axis 1 the increments along 1 and 2 are opposite."""
    body = Body((2, "0.5", "1.5"), (1, "1e-15", 0), "0.999999")
    found = increments(body, exact(1), resolve("taylor", None))
    apart = np.abs(np.sort(found.gained[:, 1]) - np.sort(-found.gained[:, 0])).max()
    stated = [uncertainty(found, unit_of(body, 1.0), body.nu, least) for least in (1.0, 1e-6)]
    assert stated[0] < apart < stated[1] < 100 * apart


STRICT, PAIRS = ((2,), (1,), (0,), (3,), (4,)), ((1, 2), (0,), (3, 4))


@pytest.mark.parametrize(
    ("groups", "gained", "error", "holds"),
    [
        (STRICT, [1, 2, -1, -2], 0.1, True),
        (STRICT, [2, 1, -2, -1], 0.1, False),
        (STRICT, [2, 2, -2, -2], 0.1, False),
        (STRICT, [1, 2, 1, -2], 0.1, False),
        (STRICT, [np.nan, 2, -1, -2], 0.1, False),
        # Equal ones are equal within their errors.
        (PAIRS, [1, 1.05, -1, -1], 0.03, True),
        (PAIRS, [1, 1.05, -1, -1], 0.02, False),
        # The least of a group is beyond the largest of the next by two errors.
        (((1, 2), (3, 4)), [1, 0.85, 0.75, 0.75], 0.08, False),
    ],
)
def test_an_order_holds_or_does_not(
    groups: Any, gained: list[float], error: float, holds: bool
) -> None:
    assert in_order(np.array(gained, dtype=float), error, groups) is holds


def test_a_slope_that_is_not_fitted_is_told_in_words(ran: tuple[Any, list[str]]) -> None:
    _, told = ran
    slopes = [line.partition("remainder ")[2].split(", ") for line in told]
    assert [[slope == "not fitted" for slope in each] for each in slopes] == [
        [False] * 4,
        [False] * 4,
        # The Hess case has no remainder along 1 and 3.
        [True, False, True, False],
        [False] * 4,
        [False] * 4,
    ]
    assert "nan" not in " ".join(told)


def test_the_first_order_of_a_thin_body_keeps_its_digits() -> None:
    """Its alpha0 is so near pi that a double loses half of the digits of the difference."""
    body = "problem.bodies={thin: {A: [1, 3e-8, 0.99999998], r: [0, 1, 0]}}"
    given = asked("precession", body, "problem.mu=[1e-11, 1e-10]", "problem.drawn=1e-10")
    p = Body((1, "3e-8", "0.99999998"), (0, 1, 0), "1e-10").angles(200)
    true = float(p.mu * p.nu * mpmath.sin((p.beta0 - p.alpha0) / 2) / given.problem.h0.at(200))
    found = computed(given)["bodies"]["first_order"]
    assert found.ravel()[np.abs(found.ravel() - true).argmin()] == pytest.approx(
        true, rel=1e-14, abs=0
    )
