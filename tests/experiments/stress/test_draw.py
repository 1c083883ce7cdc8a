"""The figure of trials: every case is a point, what is beyond its bound is named."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from rigidpend.experiments.stress.draw import CEILING, FLOOR, LOOKS, draw
from tests.experiments.figures import styled
from tests.results.loaded import loaded

ROTATIONS = np.geomspace(0.1, 1e4, 21)


def drift(name: str, power: float) -> dict[str, Any]:
    row = 1e-16 * ROTATIONS**power
    return {
        "name": name,
        "rotations": ROTATIONS,
        "drift": np.stack((row, 2 * row, 3 * row)),
        "walk": 1e-16 * np.sqrt(ROTATIONS),
        "power": np.full(3, power),
    }


def group(*claims: tuple[str, float, str], **curves: Any) -> dict[str, Any]:
    made = {name: {"ratio": ratio, "verdict": verdict} for name, ratio, verdict in claims}
    return {"claims": made, "curves": curves}


@pytest.fixture
def figure() -> Any:
    crossing = np.arange(4)
    growth = {
        "crossing": crossing,
        "measured": 1e-14 * 3.0**crossing,
        "predicted": 1.1e-14 * 3.0**crossing,
        "floor": np.full(4, 1e-15),
        "scatter": np.full((4, 2), 1e-13),
        "growth_measured": 2.51,
        "growth_predicted": 2.49,
        "growth_whisker": 3.0,
    }
    bits = {"bits": 64, "measured": np.array([30, 20, 40]), "predicted": np.array([25, 35])}
    data = {
        "upper_starts": group(("far", np.inf, "FAILED"), ("none", 0.0, "passed")),
        "long_time": group(
            ("known one", 3.0, "limit"),
            ("fine", 0.25, "passed"),
            t=drift("taylor at 2.2e-16", 0.5),
            s=drift("splitting 4", 0.25),
        ),
        "passages": group(("p", 0.5, "passed"), growth=growth, b64=bits, b106=bits | {"bits": 106}),
    }
    return styled(draw, loaded(data))


def test_trials_that_refused_leave_their_panels_empty() -> None:
    refused = {"passages": group(("p", np.inf, "FAILED")), "bodies": group(("b", 0.5, "passed"))}
    drawn = draw(loaded(refused))
    assert [len(panel(drawn, letter).lines) for letter in "ab"] == [0, 0]
    assert len(panel(drawn, "c").lines) == 3


def panel(figure: Any, letter: str) -> Any:
    [found] = [x for x in figure.axes if x.get_title(loc="left").startswith(f"{letter})")]
    return found


def test_every_case_is_a_point_at_its_ratio(figure: Any) -> None:
    axes = panel(figure, "c")
    looks = {look.colour: verdict for verdict, look in LOOKS.items()}
    points = {
        (looks[line.get_color()], float(line.get_xdata()[0]))
        for line in axes.lines
        if line.get_color() in looks and len(line.get_xdata()) == 1
    }
    assert points == {
        ("FAILED", CEILING),
        ("passed", FLOOR),
        ("limit", 3.0),
        ("passed", 0.25),
        ("passed", 0.5),
    }
    assert [x.get_text() for x in axes.get_yticklabels()] == [
        "upper starts",
        "long time",
        "passages",
    ]


def test_only_what_is_beyond_its_bound_is_named(figure: Any) -> None:
    assert {x.get_text() for x in panel(figure, "c").texts} == {"far", "known one"}
    said = [x.get_text() for x in panel(figure, "c").get_legend().get_texts()]
    assert [x.split()[0] for x in said] == ["3", "1", "1"]


def test_fitted_powers_are_told(figure: Any) -> None:
    said = " ".join(x.get_text() for x in panel(figure, "a").get_legend().get_texts())
    assert "taylor 2.2e-16: 0.50, 0.50, 0.50" in said
    assert "splitting" not in said


def test_splittings_have_their_own_panel(figure: Any) -> None:
    drawn = panel(figure, "b").lines
    assert len(drawn) == 3
    assert all(line.get_xdata().min() >= 1 for line in drawn)


def test_measured_and_predicted_growth_are_told(figure: Any) -> None:
    [text] = panel(figure, "d").texts
    assert "2.51 measured" in text.get_text()
    assert "2.49 predicted" in text.get_text()


def test_shares_fall_from_one_to_zero(figure: Any) -> None:
    steps = [line for line in panel(figure, "e").lines if len(line.get_xdata()) > 1]
    assert len(steps) == 4, "two precisions"
    for line in steps:
        assert line.get_ydata()[[0, -1]].tolist() == [1, 0]
    assert steps[0].get_xdata().tolist() == [0, 20, 30, 40]


def test_the_labels_of_the_splittings_stand_beside_their_own_curves(figure: Any) -> None:
    """Errors of the energy are the larger, so their label is the upper one, both on the right."""
    places = {x.get_text(): x.get_position() for x in panel(figure, "b").texts}
    energy, casimirs = places["energy"], places[r"$|\gamma|,\ M\cdot\gamma$"]
    assert energy[1] > 0.5 > casimirs[1]
    assert min(energy[0], casimirs[0]) > 0.9


def test_what_is_beyond_its_bound_is_named_on_the_right_of_all_marks(figure: Any) -> None:
    axes = panel(figure, "c")
    for text in axes.texts:
        assert text.get_position()[0] > CEILING
        assert text.get_horizontalalignment() == "left"
