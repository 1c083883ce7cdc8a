"""The figure of trials: every claim is a point, and each curve moves what is drawn."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.figure import Figure

from rigidpend.experiments.stress.draw import CEILING, FLOOR, LOOKS, draw
from rigidpend.results.store import load
from tests.experiments.figures import check_on_page, styled
from tests.results.loaded import loaded


@pytest.fixture(scope="module")
def data() -> Any:
    return load(Path("results/measured/stress.h5"))["data"]


def claims(**ratios: tuple[float, str]) -> dict[str, Any]:
    made = {name: {"ratio": ratio, "verdict": verdict} for name, (ratio, verdict) in ratios.items()}
    return {"claims": made, "curves": {}}


def panel(figure: Figure, letter: str) -> Any:
    [found] = [x for x in figure.axes if x.get_title(loc="left").startswith(f"{letter})")]
    return found


def drawn(figure: Figure) -> list[Any]:
    """All that is drawn: points of lines, words and their places."""
    lines = [np.asarray(line.get_xydata()).tolist() for x in figure.axes for line in x.lines]
    words = [(word.get_text(), word.get_position()) for x in figure.axes for word in x.texts]
    legends = [legend for x in figure.axes if (legend := x.get_legend())]
    return [lines, words, [text.get_text() for each in legends for text in each.get_texts()]]


OTHER: dict[str, Any] = {"bits": 53, "name": "another"}
PASSAGES = "growth", "64_bits"
UNDRAWN = ("growth_whisker", "asked")
"""Numbers that the figure leaves to the tables."""


@pytest.mark.slow
def test_panels_have_the_axes_of_what_they_show(data: Any) -> None:
    axes = {x.get_title(loc="left")[0]: x for x in styled(draw, loaded(data)).axes}
    assert {k: (x.get_xlabel(), x.get_ylabel(), x.get_yscale()) for k, x in axes.items()} == {
        **dict.fromkeys("ab", ("rotations", "rms drift, relative", "log")),
        "c": ("value / bound", "", "linear"),
        "d": ("crossing", "phase error, rad", "log"),
        "e": ("symbols", "share of orbits with more", "linear"),
    }


def test_each_number_of_a_curve_moves_what_is_drawn(data: Any) -> None:
    """One curve of each kind; the claims, but for one, are points of a panel of their own."""
    seen = 0
    for kind, curve in (("long_time", "taylor_2.2e-16"), *(("passages", x) for x in PASSAGES)):
        group = data[kind]["curves"][curve]
        alone = loaded({kind: {**claims(one=(0.5, "passed")), "curves": {curve: group}}})
        before = drawn(styled(draw, alone))
        for name in set(group) - {*UNDRAWN}:
            group[name], kept = OTHER[name] if name in OTHER else 3.0 * group[name], group[name]
            assert drawn(styled(draw, alone)) != before, (curve, name)
            group[name] = kept
            seen += 1
    assert seen == 5 + 7 + 3


def test_the_stored_trials_do_not_leave_their_page(data: Any) -> None:
    made = styled(draw, loaded(data), laid_out=True)
    check_on_page(made)
    said = " ".join(x.get_text() for x in panel(made, "a").get_legend().get_texts())
    powers = ", ".join(f"{x:.2f}" for x in data["long_time"]["curves"]["taylor_2.2e-16"]["power"])
    assert f"taylor 2.2e-16: {powers}" in said
    assert len(panel(made, "b").lines) == 3 * 4, "splittings have their own panel"
    assert min(line.get_xdata()[0] for line in panel(made, "d").lines) == 1, "the first crossing"


def test_every_claim_is_a_point_at_its_ratio_and_what_is_beyond_is_named() -> None:
    made = styled(
        draw,
        loaded(
            {
                "upper_starts": claims(far=(np.inf, "FAILED"), none=(0.0, "passed")),
                "long_time": claims(known=(3.0, "limit"), fine=(0.25, "passed")),
            }
        ),
    )
    axes = panel(made, "c")
    verdicts = {colour: verdict for verdict, (colour, *_) in LOOKS.items()}
    points = {
        (verdicts[line.get_color()], float(line.get_xdata()[0]), round(line.get_ydata()[0]))
        for line in axes.lines
        if line.get_color() in verdicts
    }
    expected = {("FAILED", CEILING, 0), ("passed", FLOOR, 0), ("limit", 3, 1), ("passed", 0.25, 1)}
    assert points == expected
    assert [x.get_text() for x in axes.get_yticklabels()] == ["upper starts", "long time"]
    assert {x.get_text() for x in axes.texts} == {"far", "known"}
    assert all(x.get_position()[0] > CEILING for x in axes.texts), "on the right of all marks"
    counts = [x.get_text().split()[0] for x in axes.get_legend().get_texts()]
    assert counts == ["2", "1", "1"]


def test_trials_that_refused_leave_their_panels_empty() -> None:
    refused = {"passages": claims(p=(np.inf, "FAILED")), "bodies": claims(b=(0.5, "passed"))}
    made = draw(loaded(refused))
    assert [len(panel(made, letter).lines) for letter in "ab"] == [0, 0]
    assert len(panel(made, "c").lines) == 3
