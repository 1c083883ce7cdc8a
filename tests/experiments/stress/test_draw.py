"""The figure of trials: every claim is a point, and every curve is where its numbers are."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from matplotlib.figure import Figure

from rigidpend.experiments.stress.draw import CEILING, FLOOR, LOOKS, draw, tables
from tests.experiments.figures import panel, styled
from tests.results.loaded import loaded

TIMES = np.array([0.5, 10.0, 100.0])
WALK, POWER = np.array([1e-16, 3e-16, 9e-16]), np.array([0.5, 0.61, 0.47])
DRIFT = {"rotations": TIMES, "drift": np.arange(1.0, 10).reshape(3, 3), "power": POWER}
GROWTH: dict[str, Any] = {
    "crossing": np.arange(3),
    **{name: x * WALK for name, x in (("measured", 2), ("predicted", 3), ("floor", 4))},
    "scatter": np.outer(WALK, [5, 0]),
    "growth_measured": 2.5,
    "growth_predicted": 2.75,
}
DECIDED = {"bits": 64, "measured": np.array([30, 20]), "predicted": np.array([25, 35])}


def claims(curves: Any = None, **ratios: tuple[float, str]) -> dict[str, Any]:
    ratio, verdict = np.transpose([*ratios.values()])
    made = {"name": [*ratios], "ratio": ratio.astype(float), "verdict": verdict}
    notes = {key: [""] * len(ratios) for key in ("measured", "note", "limit")}
    return {"claims": made | notes, "curves": curves or {}}


def lines(figure: Figure, letter: str) -> list[Any]:
    """The points of all lines that are not of a legend alone."""
    found = [np.asarray(line.get_xydata()) for line in panel(figure, letter).lines]
    return [points for points in found if points.size]


@pytest.fixture(scope="module")
def result() -> Any:
    """One curve of each kind, and claims of three verdicts."""
    drifts = {"a": {**DRIFT, "name": "taylor at 2e-16", "walk": WALK}}
    passages = {"growth": GROWTH, "64_bits": DECIDED}
    data = {
        "upper_starts": claims(far=(np.inf, "FAILED"), none=(0.0, "passed")),
        "long_time": claims(drifts, known=(3.0, "limit"), fine=(0.25, "passed")),
        "passages": claims(passages, fine=(0.5, "passed")),
    }
    return loaded(data)


@pytest.fixture(scope="module")
def figure(result: Any) -> Figure:
    return styled(draw, result)


def test_trials_are_counted_by_kind_and_in_all(result: Any) -> None:
    counted = tables(result)[0]
    assert counted.rows[0] == ("upper starts", "1", "0", "1", "0")
    assert counted.rows[-1] == ("all", "3", "1", "1", "0.5")


def test_curves_are_where_their_numbers_are_by_the_names_of_their_axes(figure: Figure) -> None:
    walk, *engine = lines(figure, "a")
    np.testing.assert_array_equal(walk, np.transpose([TIMES, WALK]))
    for k in range(3):
        np.testing.assert_array_equal(engine[k], np.transpose([TIMES, DRIFT["drift"][k]]))
    legend = [x.get_text() for x in panel(figure, "a").get_legend().get_texts()]
    assert legend[-1] == "taylor 2e-16: 0.50, 0.61, 0.47"
    scattered, _, *grown = lines(figure, "c")
    for factor, points in zip((5, 2, 3, 4), (scattered, *grown), strict=True):
        np.testing.assert_allclose(points, np.transpose([[1, 2, 3], factor * WALK]))
    assert "2.50 measured,\n×2.75 predicted" in panel(figure, "c").texts[0].get_text()
    measured, predicted = lines(figure, "d")
    np.testing.assert_array_equal(measured, [[0, 1], [20, 0.5], [30, 0]])
    np.testing.assert_array_equal(predicted, [[0, 1], [25, 0.5], [35, 0]])
    assert panel(figure, "d").get_legend().get_texts()[0].get_text() == "64 bits"
    axes = {letter: panel(figure, letter) for letter in "abcd"}
    assert {k: (x.get_xlabel(), x.get_ylabel(), x.get_yscale()) for k, x in axes.items()} == {
        "a": ("rotations", "rms drift, relative", "log"),
        "b": ("value / bound", "", "linear"),
        "c": ("crossing", "phase error, rad", "log"),
        "d": ("symbols", "share of orbits with more", "linear"),
    }


def test_every_claim_is_a_point_at_its_ratio_and_what_is_beyond_is_named(figure: Figure) -> None:
    axes = panel(figure, "b")
    verdicts = {colour: verdict for verdict, (colour, *_) in LOOKS.items()}
    points = {
        (verdicts[line.get_color()], float(line.get_xdata()[0]), round(line.get_ydata()[0]))
        for line in axes.lines
        if line.get_color() in verdicts
    }
    expected = {("FAILED", CEILING, 0), ("passed", FLOOR, 0), ("limit", 3, 1), ("passed", 0.25, 1)}
    expected.add(("passed", 0.5, 2))
    assert points == expected
    assert [x.get_text() for x in axes.get_yticklabels()][:2] == ["upper starts", "long time"]
    assert {x.get_text() for x in axes.texts} == {"far", "known"}
    assert all(x.get_position()[0] > CEILING for x in axes.texts), "on the right of all marks"
    counts = [x.get_text().split()[0] for x in axes.get_legend().get_texts()]
    assert counts == ["3", "1", "1"]


def test_trials_that_refused_leave_their_panels_empty() -> None:
    beyond = {"taylor at 3.0e-14, gamma: power": (np.inf, "FAILED")}
    beyond["taylor at 3.0e-14, gamma: size"] = (np.inf, "FAILED")
    refused = {"passages": claims(**beyond), "bodies": claims(b=(0.5, "passed"))}
    made = styled(draw, loaded(refused), laid_out=True)
    [named], frame = panel(made, "b").texts, panel(made, "b").bbox
    assert named.get_window_extent().x1 < frame.x1
    assert len(panel(made, "a").lines) == 0
    assert len(panel(made, "b").lines) == 4
