"""The figure of `herpolhodes`: what is drawn is what the file holds. Artists, never pixels."""

from __future__ import annotations

from typing import Any

import matplotlib
import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure

from rigidpend.experiments.herpolhodes.draw import draw
from rigidpend.experiments.plots.palette import SEPARATRIX
from rigidpend.render import STYLE
from tests.results.loaded import loaded

Data = dict[str, dict[str, Any]]


def case(theta2_0: float, separatrix: list[int], route: str) -> dict[str, Any]:
    """Numbers of no physics: every array is told from the next."""
    t = np.linspace(0, 70, 701)
    k = np.arange(t.size)
    return {
        "theta2_0": theta2_0,
        "t": t,
        "alpha": 0.1 * np.sin(t) + 0.01 * theta2_0,
        "theta3": 0.05 * np.cos(t / 3),
        "omega": np.stack((np.sin(t) * k, 0 * t - 1, np.cos(t) * k), axis=1) / 700,
        "separatrix": np.array(separatrix, dtype=np.uint8),
        "crossing_time": np.array([10.0, 30.0, 50.0, 60.0]),
        "plateaus": np.array([0, 0.05, 0.1, 0.02, -0.03]),
        "route": route,
        "wound": np.array([0, 560]),
    }


def cases() -> Data:
    return {
        "case1": case(1.02, [2, 1, 4, 3], "2-2*-1*-1-4-4*-3*-3"),
        "case2": case(1.83, [2, 3, 4, 1], "2-2*-3*-3-4-4*-1*-1"),
    }


@pytest.fixture
def data() -> Data:
    return cases()


@pytest.fixture(scope="module")
def figure() -> Figure:
    """The figure of the same numbers, drawn once for all tests that look at it."""
    with matplotlib.rc_context(fname=STYLE):
        made = draw(loaded(cases()))
        made.draw_without_rendering()
    return made


def lines(axes: Axes, name: str) -> dict[int, Any]:
    """The points of the lines labelled ``name i``, by i."""
    found = [line for line in axes.lines if str(line.get_label()).startswith(f"{name} ")]
    return {int(str(line.get_label()).split()[1]): np.array(line.get_xydata()) for line in found}


@pytest.mark.slow
def test_four_panels_are_lettered_and_named(figure: Figure) -> None:
    titles = [axes.get_title(loc="left") for axes in figure.axes]
    assert [title[:2] for title in titles] == ["a)", "b)", "c)", "d)"]
    for title, value in zip(titles, ("1.02", "1.02", "1.83", "1.83"), strict=True):
        assert value in title
    assert figure.get_figwidth() <= 7.2
    for angle, spiral in zip(figure.axes[::2], figure.axes[1::2], strict=True):
        assert angle.get_xlabel() == "$t'$ (dimensionless)"
        assert angle.get_ylabel() == r"$\alpha$ (rad)"
        assert spiral.get_xlabel() == r"$\omega_\zeta$ ($1/t$)"
        assert spiral.get_ylabel() == r"$\omega_\xi$ ($1/t$)"
        assert spiral.get_aspect() == 1


@pytest.mark.slow
def test_alpha_is_drawn_whole_each_part_in_its_separatrix_s_colour(
    figure: Figure, data: Data
) -> None:
    for axes, group in zip(figure.axes[::2], data.values(), strict=True):
        parts = lines(axes, "alpha")
        assert list(parts) == list(group["separatrix"])
        points = np.unique(np.concatenate(list(parts.values())), axis=0)
        np.testing.assert_array_equal(points, np.stack((group["t"], group["alpha"]), axis=1))
        for i, time in zip(group["separatrix"], group["crossing_time"], strict=True):
            assert parts[int(i)][0, 0] < time < parts[int(i)][-1, 0]
        colours = [line.get_color() for line in axes.lines if line.get_label() in names(parts)]
        assert colours == [SEPARATRIX[i] for i in parts]


def names(parts: dict[int, Any]) -> set[str]:
    return {f"alpha {i}" for i in parts}


@pytest.mark.slow
def test_theta3_is_drawn_whole(figure: Figure, data: Data) -> None:
    for axes, group in zip(figure.axes[::2], data.values(), strict=True):
        [line] = [line for line in axes.lines if line.get_label() == "theta3"]
        expected = np.stack((group["t"], group["theta3"]), axis=1)
        np.testing.assert_array_equal(line.get_xydata(), expected)


@pytest.mark.slow
def test_plateaus_are_dashed_between_the_crossings(figure: Figure, data: Data) -> None:
    for axes, group in zip(figure.axes[::2], data.values(), strict=True):
        [dashes] = [c for c in axes.collections if isinstance(c, LineCollection)]
        ends = [0, *group["crossing_time"], 70]
        expected = [
            [[start, y], [end, y]]
            for start, end, y in zip(ends[:-1], ends[1:], group["plateaus"], strict=True)
        ]
        np.testing.assert_array_equal(dashes.get_segments(), expected)
        patterns: Any = dashes.get_linestyle()
        assert patterns[0][1] is not None


@pytest.mark.slow
def test_separatrices_are_numbered_at_their_crossings(figure: Figure, data: Data) -> None:
    for axes, group in zip(figure.axes[::2], data.values(), strict=True):
        found = [(text.get_text(), text.xy[0]) for text in axes.texts]  # type: ignore[attr-defined]
        expected = zip(map(str, group["separatrix"]), group["crossing_time"], strict=True)
        assert found == list(expected)


@pytest.mark.slow
def test_the_numbers_stand_above_the_curve(figure: Figure, data: Data) -> None:
    for axes, group in zip(figure.axes[::2], data.values(), strict=True):
        lowest = min(text.get_window_extent().y0 for text in axes.texts)
        top = axes.transData.transform((0, group["alpha"].max()))[1]
        assert lowest > top


@pytest.mark.slow
def test_the_curve_is_omega_between_its_ends_with_arrows(figure: Figure, data: Data) -> None:
    for axes, group in zip(figure.axes[1::2], data.values(), strict=True):
        first, last = group["wound"]
        parts = lines(axes, "omega")
        assert list(parts) == list(group["separatrix"][:4])[: len(parts)]
        points = np.unique(np.concatenate(list(parts.values())), axis=0)
        drawn = group["omega"][first : last + 1][:, [2, 0]]
        np.testing.assert_array_equal(points, np.unique(drawn, axis=0))
        heads = [text for text in axes.texts if not text.get_text()]
        assert len(heads) >= 3
        place = {tuple(point): k for k, point in enumerate(drawn)}
        for head in heads:
            start = place[tuple(head.get_position())]
            assert place[tuple(head.xy)] == start + 1  # type: ignore[attr-defined]


@pytest.mark.slow
def test_the_ends_are_marked_with_their_vertices(figure: Figure, data: Data) -> None:
    for axes, group in zip(figure.axes[1::2], data.values(), strict=True):
        marked = {
            line.get_label(): np.array(line.get_xydata())[0]
            for line in axes.lines
            if str(line.get_label()).startswith("vertex")
        }
        passed = int((group["crossing_time"] < group["t"][560]).sum())
        assert passed == 3
        assert list(marked) == ["vertex 2", "vertex 4*"]
        for k, point in zip((0, 560), marked.values(), strict=True):
            np.testing.assert_array_equal(point, group["omega"][k, [2, 0]])
        assert [text.get_text() for text in axes.texts if text.get_text()] == ["$2$", "$4^*$"]


@pytest.mark.slow
def test_the_legend_names_what_is_drawn(figure: Figure) -> None:
    [legend] = figure.legends
    assert [text.get_text() for text in legend.get_texts()] == [
        *(f"separatrix {i}" for i in (1, 2, 3, 4)),
        r"$\theta_3$",
        "predicted plateau",
        "start",
        "end",
    ]


def test_one_case_is_a_figure_too(data: Data) -> None:
    del data["case2"]
    assert len(draw(loaded(data)).axes) == 2


@pytest.mark.slow
def test_the_names_of_the_ends_stand_outside_and_below(figure: Figure, data: Data) -> None:
    """Away from the curve, which runs between the ends: the left one's name is on the left."""
    for axes, group in zip(figure.axes[1::2], data.values(), strict=True):
        named = [text for text in axes.texts if text.get_text()]
        ends = group["omega"][group["wound"]][:, [2, 0]]
        order = np.argsort(ends[:, 0])
        for k, outward in zip(order, (-1, 1), strict=True):
            box, end = named[k].get_window_extent(), axes.transData.transform(ends[k])
            middle = (box.x0 + box.x1) / 2, (box.y0 + box.y1) / 2
            assert outward * (middle[0] - end[0]) > 5
            assert middle[1] < end[1] - 5


@pytest.mark.slow
def test_the_numbers_of_the_separatrices_stand_inside_at_the_top(figure: Figure) -> None:
    for axes in figure.axes[::2]:
        for text in axes.texts:
            box = text.get_window_extent()
            assert axes.bbox.y0 < box.y0 < box.y1 <= axes.bbox.y1 + 1
