"""The figure of `phase_portraits`: its curves are the file's. Artists, never pixels."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from rigidpend.experiments.contract import Means
from rigidpend.experiments.phase_portraits import compute as phase_portraits
from rigidpend.experiments.phase_portraits.draw import draw
from rigidpend.experiments.phase_portraits.schema import Config
from tests.config.samples import content as typed
from tests.experiments.figures import styled
from tests.experiments.trees import from_file

FIG1 = Path(__file__).resolve().parents[3] / "configs" / "fig1.yaml"


@pytest.fixture(scope="module")
def result(tmp_path_factory: pytest.TempPathFactory) -> Any:
    tree = phase_portraits.compute(typed(Config, FIG1), Means())
    return from_file(tmp_path_factory.mktemp("result"), "phase_portraits", tree)


@pytest.fixture(scope="module")
def figure(result: Any) -> Figure:
    return styled(draw, result, laid_out=True)


def lines(axes: Axes, label: str) -> list[Line2D]:
    return [line for line in axes.lines if line.get_label() == label]


def curves(group: Any, field: str) -> list[Any]:
    return [group[field][..., a:b] for a, b in pairwise(group["offsets"])]


def heads(axes: Axes) -> list[Any]:
    """The arrows of the flow: where from, and which way."""
    found = [t for t in axes.texts if getattr(t, "arrow_patch", None) and t.get_text() == ""]
    return [(np.array(t.xyann), np.array(t.xy) - t.xyann) for t in found]  # type: ignore[attr-defined]


@pytest.mark.slow
def test_the_orbits_in_the_plane_are_the_file_s(figure: Figure, result: Any) -> None:
    orbits, drawn = result["data"]["orbits"], lines(figure.axes[1], "orbit")
    for line, x, y in zip(drawn, curves(orbits, "theta1"), curves(orbits, "J1"), strict=True):
        np.testing.assert_array_equal(line.get_xydata(), np.stack((x, y), axis=1))


def test_on_the_sphere_seen_and_hidden_parts_are_the_file_s(figure: Figure, result: Any) -> None:
    for name in ("orbit", "separatrix 1", "separatrix 2", "separatrix 3", "separatrix 4"):
        group = result["data"]["orbits" if name == "orbit" else "separatrices"]
        chosen = slice(None) if name == "orbit" else slice(int(name[-1]) - 1, int(name[-1]))
        expected = [curves(group, field)[chosen] for field in ("projected", "visible")]
        seen, hidden = lines(figure.axes[0], name), lines(figure.axes[0], f"{name}, hidden")
        for front, back, xy, visible in zip(seen, hidden, *expected, strict=True):
            for line, mask in ((front, visible), (back, ~visible)):
                x, y = np.asarray(line.get_xydata()).T
                np.testing.assert_array_equal(np.isfinite(x), mask)
                np.testing.assert_array_equal(x[mask], xy[0, mask])
                np.testing.assert_array_equal(y[mask], xy[1, mask])


def lightness(line: Line2D) -> float:
    return float(np.dot(matplotlib.colors.to_rgb(line.get_color()), (0.3, 0.6, 0.1)))


def test_hidden_parts_are_lighter_and_thinner(figure: Figure) -> None:
    axes = figure.axes[0]
    for name in ("orbit", "separatrix 1", "separatrix 2"):
        for front, back in zip(lines(axes, name), lines(axes, f"{name}, hidden"), strict=True):
            assert lightness(back) > lightness(front) + 0.15
            assert back.get_linewidth() < front.get_linewidth()
            assert back.get_zorder() < front.get_zorder()


@pytest.mark.parametrize("panel", [0, 1])
def test_both_circles_of_the_separatrix_stand_out_and_differ(figure: Figure, panel: int) -> None:
    axes = figure.axes[panel]
    orbit = lines(axes, "orbit")
    look = [
        (lines(axes, f"separatrix {i}")[0].get_color(), lines(axes, f"separatrix {i}")[0])
        for i in (1, 2, 3, 4)
    ]
    assert look[0][0] == look[2][0] != look[1][0] == look[3][0]
    assert not {colour for colour, _ in look} & {line.get_color() for line in orbit}
    widest = max(line.get_linewidth() for line in orbit)
    assert all(line.get_linewidth() > 1.5 * widest for _, line in look)
    assert look[0][1].get_linewidth() != look[1][1].get_linewidth()
    assert look[0][1].get_linestyle() != look[1][1].get_linestyle()


def test_the_separatrices_in_the_plane_are_vertical_and_numbered(
    figure: Figure, result: Any
) -> None:
    axes, plane = figure.axes[1], result["data"]["plane"]
    drawn = [line for line in axes.lines if str(line.get_label()).startswith("separatrix")]
    for line, x, i in zip(drawn, plane["separatrix_theta1"], plane["separatrix"], strict=True):
        assert line.get_label() == f"separatrix {i}"
        points = np.asarray(line.get_xydata())
        assert (points[:, 0] == x).all()
        assert sorted(points[[0, -1], 1]) == [0, 1]
    named = [(t.xy[0], t.get_text()) for t in axes.texts if t.get_text()]  # type: ignore[attr-defined]
    numbers = map(str, plane["separatrix"])
    assert named == list(zip(plane["separatrix_theta1"], numbers, strict=True))


def test_arrows_go_along_their_curves_up_on_2_and_4_down_on_1_and_3(
    figure: Figure, result: Any
) -> None:
    plane, arrows = result["data"]["plane"], heads(figure.axes[1])
    for x, i in zip(plane["separatrix_theta1"], plane["separatrix"], strict=True):
        own = [way for start, way in arrows if start[0] == x]
        assert len(own) == 2
        assert all((way[1] > 0) == (i % 2 == 0) for way in own)
    marked = result["data"]["orbits"]["arrows"]
    orbits = result["data"]["orbits"]
    expected = {(orbits["theta1"][k], orbits["J1"][k]) for k in marked}
    assert expected <= {tuple(start) for start, _ in arrows}
    assert len(arrows) == len(expected) + 10


def test_no_arrow_stands_on_a_hidden_point(figure: Figure, result: Any) -> None:
    found = {tuple(start) for start, _ in heads(figure.axes[0])}
    for name in ("orbits", "separatrices"):
        group = result["data"][name]
        for k in group["arrows"]:
            assert (tuple(group["projected"][:2, k]) in found) == group["visible"][k]


def test_the_axes_of_the_plane_are_named_and_a_whole_period_long(
    figure: Figure, result: Any
) -> None:
    axes = figure.axes[1]
    assert axes.get_xlabel() == r"$\theta_1$ (rad, modulo $4\pi$)"
    assert axes.get_ylabel() == "$J_1/J_2$"
    assert axes.get_xlim() == tuple(result["data"]["plane"]["window"])
    assert axes.get_ylim() == (0, 1)
    ticks = [label.get_text() for label in axes.get_xticklabels()]
    assert [text.splitlines()[-1] for text in ticks] == [
        f"${x:.3f}$" for x in result["data"]["plane"]["separatrix_theta1"]
    ]


def test_the_axes_on_the_sphere_are_named_at_their_tips(figure: Figure, result: Any) -> None:
    axes, tips = figure.axes[0], result["data"]["sphere"]["axis_tips"]
    names = {t.get_text(): t.get_position() for t in axes.texts}
    for i in range(3):
        assert names[f"$M_{i + 1}$"] == tuple(tips[:2, i])
    starts = [tuple(start) for start, _ in heads(axes)]
    assert all(tuple(x) in starts for x in result["data"]["sphere"]["axis_feet"][:2].T)
    assert axes.get_aspect() == 1


def test_everything_is_on_a_page(figure: Figure) -> None:
    assert figure.get_size_inches()[0] <= 7.2
    frame = figure.bbox.padded(1)
    box = figure.get_tightbbox()
    scaled = box.transformed(figure.dpi_scale_trans)
    assert frame.contains(scaled.x0, scaled.y0)
    assert frame.contains(scaled.x1, scaled.y1)


def test_the_legend_says_what_the_colours_are(figure: Figure) -> None:
    [legend] = figure.legends
    said = {t.get_text(): h for t, h in zip(legend.get_texts(), legend.get_lines(), strict=True)}
    shown = lines(figure.axes[1], "separatrix 2")[0]
    assert said["separatrices 2, 4 (up)"].get_color() == shown.get_color()
    shown = lines(figure.axes[1], "separatrix 3")[0]
    assert said["separatrices 1, 3 (down)"].get_color() == shown.get_color()
    colours = [line.get_color() for line in lines(figure.axes[1], "orbit")]
    assert said[r"orbits around $\pm M_2$"].get_color() == colours[0]
    assert said[r"orbits around $\pm M_1$"].get_color() == colours[-1]


def test_the_names_of_the_axes_stand_beyond_their_tips(figure: Figure, result: Any) -> None:
    """The arrow ends before the name: on the side of the tip that is away from the centre."""
    axes, sphere = figure.axes[0], result["data"]["sphere"]
    for i in range(3):
        [text] = [t for t in axes.texts if t.get_text() == f"$M_{i + 1}$"]
        box = text.get_window_extent()
        tip, foot = (
            axes.transData.transform(sphere[name][:2, i]) for name in ("axis_tips", "axis_feet")
        )
        middle = np.array([(box.x0 + box.x1) / 2, (box.y0 + box.y1) / 2])
        assert ((middle - tip) * (tip - foot) >= 0).all()
        assert (middle - tip) @ (tip - foot) > 0


def test_the_numbers_of_the_separatrices_stand_above_the_plane(figure: Figure) -> None:
    axes = figure.axes[1]
    for text in (t for t in axes.texts if t.get_text()):
        assert text.get_window_extent().y0 > axes.bbox.y1
