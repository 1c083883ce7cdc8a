"""Images in files: equal for equal results, whatever the reader's settings and the time of day."""

from __future__ import annotations

from pathlib import Path

import matplotlib
import pytest
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from rigidpend import render
from rigidpend.results import store
from tests.cli.calls import REFERENCE

FIG2 = REFERENCE / "fig2.h5"
STARTS = {"png": b"\x89PNG", "svg": b"<?xml", "pdf": b"%PDF"}


@pytest.mark.slow
@pytest.mark.parametrize("suffix", STARTS)
def test_equal_results_give_equal_images_whenever_and_wherever_drawn(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, suffix: str
) -> None:
    # What matplotlib takes for the time of day, and what a reader may have set.
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "0")
    render.render([FIG2], tmp_path / f"a.{suffix}")
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "1000000000")
    with matplotlib.rc_context({"font.size": 17, "savefig.dpi": 51, "savefig.bbox": "tight"}):
        before = dict(matplotlib.rcParams)
        render.render([FIG2], tmp_path / f"b.{suffix}")
        assert dict(matplotlib.rcParams) == before
    first, second = ((tmp_path / f"{name}.{suffix}").read_bytes() for name in "ab")
    assert first == second
    assert first.startswith(STARTS[suffix])
    assert first.endswith(render.ENDS[suffix])


def test_a_figure_that_cannot_be_written_is_named(tmp_path: Path) -> None:
    with pytest.raises(store.StoreError, match="cannot be written: No such file or directory"):
        render.render([FIG2], tmp_path / "none" / "a.png")


def test_legends_stay_where_they_are_above_a_foot_of_any_height() -> None:
    figure = Figure(figsize=(3, 2))
    legends = [
        figure.legend(handles=[Line2D([], [], label="a")], loc="upper right", **anchor)
        for anchor in ({}, {"bbox_to_anchor": (0.25, 0.5, 0, 0)})
    ]
    with matplotlib.rc_context({"savefig.dpi": 50}):
        render._image(figure, "png", {"experiment": "fig4"}, ["word " * 300])
    # Its lines are as long as the figure is wide.
    assert 55 < max(map(len, figure.texts[0].get_text().splitlines())) <= 65
    # A tenth of an inch from the left, half as much below.
    assert figure.texts[0].get_position() == pytest.approx((0.1 / 3, -0.05 / 2))
    whole, part = (one.get_bbox_to_anchor().bounds for one in legends)
    wide, high = figure.bbox.size
    assert whole == pytest.approx((0, 0, wide, high))
    assert part == pytest.approx((wide / 4, high / 2, 0, 0))
    assert legends[0].get_bbox_to_anchor() is not figure.bbox
