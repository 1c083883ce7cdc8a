"""What of a figure the rule of `test_drawings` cannot say.

The paper's conventions, which mark stands for what, and what is drawn where a result is smaller,
larger or less known than the references.
"""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.colors import to_hex, to_rgb
from matplotlib.figure import Figure
from matplotlib.text import Annotation

from rigidpend import experiments
from rigidpend.experiments.data import Loaded
from rigidpend.experiments.plots import SEPARATRIX
from rigidpend.experiments.splitting.draw import NONE
from tests.experiments.figures import styled
from tests.experiments.trees import reference


def drawn(result: Loaded, *, laid_out: bool = False) -> Figure:
    drawing = experiments.drawing(result["attributes"]["experiment"])
    return styled(drawing.draw, result, laid_out=laid_out)


def arrows(axes: Axes) -> list[Any]:
    """The arrows of a panel, each from `xyann` to `xy`."""
    return [x for x in axes.texts if isinstance(x, Annotation) and x.arrow_patch is not None]


def test_fig1_what_is_hidden_is_paler_thinner_and_below() -> None:
    result = reference("fig1")
    outline, *curves = drawn(result).axes[0].lines
    # Each curve is two lines, of which the one is broken where the other is not.
    for back, front in zip(curves[:-2:2], curves[1:-2:2], strict=True):
        lights = [np.dot(to_rgb(line.get_color()), (0.3, 0.6, 0.1)) for line in (back, front)]
        assert lights[0] > lights[1] + 0.15
        assert back.get_linewidth() < front.get_linewidth()
        assert back.get_zorder() < outline.get_zorder() < front.get_zorder()
    groups = [result["data"][name] for name in ("orbits", "separatrices")]
    for lines, seen in ((curves[1:-2:2], True), (curves[:-2:2], False)):
        shown = np.concatenate([np.isfinite(np.asarray(line.get_xdata())) for line in lines])
        visible = np.concatenate([group["visible"] for group in groups])
        np.testing.assert_array_equal(shown, visible == seen)


@pytest.mark.slow
def test_fig1_the_flow_goes_up_separatrices_2_and_4_and_forward_on_orbits() -> None:
    result = reference("fig1")
    sphere, plane = drawn(result).axes
    data = result["data"]
    found = [(np.array(x.xyann), np.array(x.xy) - x.xyann) for x in arrows(plane)]
    for x, i in zip(data["plane"]["separatrix_theta1"], data["plane"]["separatrix"], strict=True):
        own = [way for start, way in found if start[0] == x]
        assert [way[1] > 0 for way in own] == [i % 2 == 0] * 2
    orbits = data["orbits"]
    for k in orbits["arrows"]:
        at, then = (np.array([orbits["theta1"][j], orbits["J1"][j]]) for j in (k, k + 1))
        assert any(np.array_equal(x, at) and np.allclose(way, then - at) for x, way in found)
    starts = {tuple(x.xyann) for x in arrows(sphere)}
    for group in (orbits, data["separatrices"]):
        for k in group["arrows"]:
            assert (tuple(group["projected"][:2, k]) in starts) == group["visible"][k]
    [legend] = plane.figure.legends
    said = {t.get_text(): h for t, h in zip(legend.get_texts(), legend.get_lines(), strict=True)}
    colours = {text.get_text(): text.get_color() for text in plane.texts}
    assert said["separatrices 2, 4 (up)"].get_color() == colours["2"] == colours["4"]
    assert said["separatrices 1, 3 (down)"].get_color() == colours["1"] == colours["3"]


def test_fig2_edges_are_arrows_to_their_ends_with_their_symbols_beside_them() -> None:
    result = reference("fig2")
    [axes] = drawn(result, laid_out=True).axes
    edges = result["data"]["edges"]
    looks = set()
    for k, arrow in enumerate(arrows(axes)):
        assert arrow.xyann == (edges["theta1"][0, k], edges["J1"][0, k])
        assert arrow.xy == (edges["theta1"][1, k], edges["J1"][1, k])
        written = [x for x in axes.texts if getattr(x, "xycoords", None) is arrow.arrow_patch]
        symbol, look = int(edges["symbol"][k]), arrow.arrow_patch
        assert [x.get_text() for x in written] == [str(symbol)] * (symbol != 255)
        if not edges["again"][k]:
            looks.add((symbol, to_hex(look.get_edgecolor()), str(look.get_linestyle())))
    assert len(looks) == 3
    vertices = result["data"]["vertices"]
    rings: list[Any] = [x.get_bbox_patch() for x in axes.texts if x.get_bbox_patch()]
    # What is there again is grey.
    grey = [to_hex(ring.get_edgecolor()) == "#999999" for ring in rings]
    assert grey == vertices["again"].tolist()


def test_fig3_S2_plus_is_above_S1_minus_and_bodies_stand_side_by_side() -> None:
    boxes = {axes.get_label(): axes.get_position() for axes in drawn(reference("fig3")).axes}
    lower = [boxes[f"{name} S1_minus"] for name in "abcdefg"]
    upper = [boxes[f"{name} S2_plus"] for name in "abcdefg"]
    assert all(below.y1 < above.y0 for below, above in zip(lower, upper, strict=True))
    assert all(one.x1 < other.x0 for one, other in pairwise(lower))


@pytest.mark.slow
def test_fig5_each_separatrix_has_its_colour_and_the_spiral_its_sense() -> None:
    result = reference("fig5")
    made = drawn(result)
    for angle, spiral, case in zip(
        made.axes[::2], made.axes[1::2], result["data"].values(), strict=True
    ):
        parts = angle.lines[: len(case["separatrix"])]
        assert [x.get_color() for x in parts] == [SEPARATRIX[i] for i in case["separatrix"]]
        points = np.unique(np.concatenate([np.asarray(x.get_xydata()) for x in parts]), axis=0)
        np.testing.assert_array_equal(points, np.stack((case["t"], case["alpha"]), axis=1))
        omega = {tuple(point): k for k, point in enumerate(case["omega"][:, [2, 0]])}
        heads = [x for x in arrows(spiral) if not x.get_text()]
        assert len(heads) >= 3
        assert all(omega[tuple(x.xy)] == omega[tuple(x.xyann)] + 1 for x in heads)
        ends: list[Any] = [x for x in spiral.lines if x.get_marker() in ("o", "s")]
        assert [omega[tuple(x.get_xydata()[0])] for x in ends] == list(case["wound"])
        # Plateaus are predicted: they last from one crossing to the next.
        dashes: Any = angle.collections[-1]
        times = np.concatenate((case["t"][:1], case["crossing_time"], case["t"][-1:]))
        np.testing.assert_array_equal(
            np.array(dashes.get_segments())[:, :, 0], np.stack((times[:-1], times[1:]), axis=1)
        )


def test_closed_orbits_are_told_apart() -> None:
    """A place is one mark wide, and its length's tick is nearer than any other's marks are."""
    result = reference("closed_orbits")
    orbits, axes = result["data"]["orbits"], drawn(result).axes[0]
    marks = np.concatenate([np.asarray(line.get_xydata()) for line in axes.lines])
    marks = marks[marks[:, 0].argsort()]
    assert np.diff(marks[:, 0]).min() > 1 - 1e-9
    begins = np.append(0, np.flatnonzero(np.diff(marks[:, 0]) > 1.5) + 1)
    length = (orbits["word"] < 2).sum(axis=1)
    for n, group in enumerate(np.split(marks, begins[1:]), start=1):
        np.testing.assert_allclose(group[:, 0].mean(), axes.get_xticks()[n - 1])
        np.testing.assert_allclose(np.sort(group[:, 1]), np.sort(orbits["exponent"][length == n]))
    named: list[Any] = list(axes.texts)
    first = {text.get_text(): text.xy for text in named}
    assert first.keys() == {"0", "1", "01", "10"}
    np.testing.assert_allclose(first["10"][1], orbits["exponent"][3])


def test_orbits_stand_in_the_row_above_their_symbols() -> None:
    result = reference("asymptotic_orbits")
    drawn_orbits: list[Any] = [*drawn(result).axes[0].collections[1:]]
    for marks, name in zip(drawn_orbits, result["data"]["orbits"], strict=True):
        middles = np.array(marks.get_segments())[:, :, 1].mean(axis=1)
        np.testing.assert_allclose(middles, int(name) + 1)


def test_a_level_of_a_zoom_tells_what_share_is_as_before() -> None:
    result = reference("fig4_zoom")
    first(result["data"]["levels"], 3)
    codes = [level["codes"] for level in result["data"]["levels"].values()]
    shares = [np.count_nonzero(a == b) / a.size for a, b in pairwise(codes)]
    said = [axes.get_title(loc="right") for axes in drawn(result).axes]
    assert said == ["", *(f"{round(100 * share)} % as before" for share in shares)]


@pytest.mark.slow
def test_remainders_are_beside_guides_of_their_order() -> None:
    result = reference("precession")
    bodies, ratios = result["data"]["bodies"], result["data"]["mu_over_h0"]
    _, *panels = drawn(result).axes
    gone = [", ".join(bodies["name"][~np.isfinite(bodies["slope"][:, i])]) for i in (1, 0, 1)]
    for axes, order, names in zip(panels, (2, 2, 3), gone, strict=True):
        low, high = np.asarray(axes.lines[-1].get_ydata())
        assert np.log(high / low) / np.log(ratios[-1] / ratios[0]) == pytest.approx(order)
        # Above all curves, so that nothing but its slope is read.
        assert high > max(np.asarray(line.get_ydata())[-1] for line in axes.lines[:-1])
        noted = [f"{names}) no increment: rounding"] * bool(names)
        assert [text.get_text() for text in axes.texts] == [f"slope {order}", *noted]


@pytest.mark.slow
def test_splitting_is_drawn_where_it_is_resolved_and_crossed_out_where_not() -> None:
    result = reference("splitting")
    bodies, ratios = result["data"]["bodies"], result["data"]["mu_over_h0"]
    bodies["resolved"][0, 3:] = False
    result["data"]["curve"]["measured"][-1] = np.nan
    curve, error, _, table = drawn(result).axes
    labels = [str(x.get_label()) for x in curve.lines]
    assert (f"${ratios[-2]:g}$" in labels, f"${ratios[-1]:g}$" in labels) == (True, False)
    for line, known in zip(error.lines, [*bodies["resolved"]] * 2, strict=False):
        np.testing.assert_array_equal(np.asarray(line.get_xdata()), ratios[known])
    colours = [to_hex(x.get_facecolor()).upper() for x in table.patches]
    crossed = [text.get_text() == "\N{MULTIPLICATION SIGN}" for text in table.texts]
    for told in (crossed, [colour == NONE for colour in colours]):
        np.testing.assert_array_equal(told, ~bodies["resolved"].ravel())
    # The whole curve's errors are the larger: their slope's label is on the upper left.
    upper, lower = (x.get_position() for x in error.texts if "slope" in x.get_text())
    assert upper[1] > lower[1] + 0.2
    assert upper[0] < lower[0]


@pytest.mark.slow
def test_a_full_shift_has_its_sets_and_images_and_magnified_both_sides_of_each() -> None:
    result = reference("full_shift")
    outlined, sets = result["data"]["drawn"], result["data"]["sets"]
    figure = drawn(result, laid_out=True)
    for k, axes in enumerate(figure.axes):
        rising = k % 2 == 0
        outlines = [
            patch.get_path().vertices for patch in axes.patches if len(patch.get_path()) > 9
        ]
        expected = [
            np.column_stack((outlined[f"{prefix}chi"][i], outlined[f"{prefix}d"][i]))
            for i, of in enumerate(sets["rising"])
            for prefix in ["" if of == rising else "image_"]
        ]
        assert len(outlines) == 4
        for found, outline in zip(outlines, expected, strict=True):
            np.testing.assert_array_equal(np.asarray(found)[: len(outline)], outline)
        if k >= 2:
            target = int(np.flatnonzero(sets["rising"] == rising)[-1])
            low, high = axes.get_ylim()
            here = np.abs(outlined["chi"][target]).argmin()
            assert low < outlined["d"][target][here] < high
            assert 1 < (high - low) / np.ptp(outlined["d"][target]) < 5


def first(group: Any, members: int = 1) -> None:
    """Leave only the first members of a group."""
    for member in list(group)[members:]:
        del group[member]


def forget(data: Any) -> None:
    for values in (data["exponent"], data["checked"]["growth"]):
        values[:] = np.nan


def leave_one(data: Any) -> None:
    """Of all bodies only the drawn one is left."""
    row = list(data["bodies"]["name"]).index(data["curve"]["body"])
    data["bodies"] = {key: x[row : row + 1] for key, x in data["bodies"].items()}


@pytest.mark.parametrize(
    ("name", "change", "panels"),
    [
        ("exponents", forget, 4),
        ("asymptotic_orbits", lambda data: data["drawn"].clear(), 1),
        ("splitting", leave_one, 4),
        ("fig5", first, 2),
        ("fig4_zoom", lambda data: first(data["levels"]), 3),
        ("route_map", lambda data: first(data["zooms"]), 2),
    ],
)
def test_a_result_of_less_is_drawn(name: str, change: Callable[[Any], object], panels: int) -> None:
    result = reference(name)
    change(result["data"])
    assert len(drawn(result).axes) == panels
