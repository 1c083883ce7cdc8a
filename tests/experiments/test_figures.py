"""What of a figure the rule of `test_drawings` cannot say.

The paper's conventions, which mark stands for what, and what is drawn where a result is smaller,
larger or less known than the references.
"""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise
from typing import Any

import matplotlib
import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.colors import to_hex
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle
from matplotlib.text import Annotation

from rigidpend import experiments
from rigidpend.experiments.data.tree import Loaded
from rigidpend.experiments.plots import BLUE, RED, SEPARATRIX
from rigidpend.experiments.splitting.draw import BITS, NONE
from tests.experiments.figures import styled
from tests.experiments.trees import reference


def drawn(result: Loaded, *, laid_out: bool = False) -> Figure:
    """The figure of a result."""
    drawing = experiments.drawing(result["attributes"]["experiment"])
    return styled(drawing.draw, result, laid_out=laid_out)


def lines(axes: Axes, label: str) -> list[Any]:
    return [line for line in axes.lines if line.get_label() == label]


def arrows(axes: Axes) -> list[Any]:
    """The arrows of a panel, each from `xyann` to `xy`."""
    return [x for x in axes.texts if isinstance(x, Annotation) and x.arrow_patch is not None]


def test_fig1_what_is_hidden_is_paler_thinner_and_below() -> None:
    def lightness(line: Any) -> float:
        return float(np.dot(matplotlib.colors.to_rgb(line.get_color()), (0.3, 0.6, 0.1)))

    result = reference("fig1")
    sphere = drawn(result).axes[0]
    for name in ("orbit", "separatrix 1", "separatrix 2"):
        pairs = zip(lines(sphere, name), lines(sphere, f"{name}, hidden"), strict=True)
        for front, back in pairs:
            assert lightness(back) > lightness(front) + 0.15
            assert back.get_linewidth() < front.get_linewidth()
            assert back.get_zorder() < front.get_zorder()
    visible = result["data"]["orbits"]["visible"]
    shown = np.concatenate([line.get_xdata() for line in lines(sphere, "orbit")])
    np.testing.assert_array_equal(np.isfinite(shown), visible)


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
    for text, i in (("separatrices 2, 4 (up)", 2), ("separatrices 1, 3 (down)", 3)):
        assert said[text].get_color() == lines(plane, f"separatrix {i}")[0].get_color()


def test_fig2_edges_are_arrows_to_their_ends_with_their_symbols_beside_them() -> None:
    result = reference("fig2")
    [axes] = drawn(result, laid_out=True).axes
    edges = result["data"]["edges"]
    looks = set()
    assert len(arrows(axes)) == len(edges["symbol"]) == 13
    for k, arrow in enumerate(arrows(axes)):
        assert arrow.xyann == (edges["theta1"][0, k], edges["J1"][0, k])
        assert arrow.xy == (edges["theta1"][1, k], edges["J1"][1, k])
        written = [x for x in axes.texts if getattr(x, "xycoords", None) is arrow.arrow_patch]
        symbol = int(edges["symbol"][k])
        assert [x.get_text() for x in written] == [str(symbol)] * (symbol != 255)
        assert all(abs(x.get_position()[1]) == 6 for x in written)
        if not edges["again"][k]:
            look = arrow.arrow_patch
            looks.add((symbol, to_hex(look.get_edgecolor()), str(look.get_linestyle())))
    assert len(looks) == 3
    shaded = {x.get_label(): to_hex(x.get_facecolor()) for x in axes.patches}
    assert len(set(shaded.values())) == 2


def test_fig3_S2_plus_is_above_S1_minus_and_bodies_stand_side_by_side() -> None:
    boxes = {axes.get_label(): axes.get_position() for axes in drawn(reference("fig3")).axes}
    names = "abcdefg"
    assert list(boxes) == [f"{name} {surface}" for name in names for surface in (UPPER, LOWER)]
    for name in names:
        assert boxes[f"{name} {LOWER}"].y1 < boxes[f"{name} {UPPER}"].y0
    row = [boxes[f"{name} {LOWER}"] for name in names]
    assert all(one.x1 < other.x0 for one, other in pairwise(row))


UPPER, LOWER = "S2_plus", "S1_minus"


@pytest.mark.slow
def test_fig5_each_separatrix_has_its_colour_and_the_spiral_its_sense() -> None:
    result = reference("fig5")
    made = drawn(result)
    for angle, spiral, case in zip(
        made.axes[::2], made.axes[1::2], result["data"].values(), strict=True
    ):
        for i in case["separatrix"]:
            assert {x.get_color() for x in lines(angle, f"alpha {i}")} == {SEPARATRIX[int(i)]}
        parts: list[Any] = [x for x in angle.lines if str(x.get_label()).startswith("alpha")]
        points = np.unique(np.concatenate([x.get_xydata() for x in parts]), axis=0)
        np.testing.assert_array_equal(points, np.stack((case["t"], case["alpha"]), axis=1))
        omega = {tuple(point): k for k, point in enumerate(case["omega"][:, [2, 0]])}
        heads = [x for x in arrows(spiral) if not x.get_text()]
        assert len(heads) >= 3
        assert all(omega[tuple(x.xy)] == omega[tuple(x.xyann)] + 1 for x in heads)
        ends: list[Any] = [x for x in spiral.lines if str(x.get_label()).startswith("vertex")]
        at = [omega[tuple(x.get_xydata()[0])] for x in ends]
        assert at == list(case["wound"])
        # Plateaus are predicted: they last from one crossing to the next.
        [dashes] = [x for x in angle.collections if isinstance(x, LineCollection)]
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


def test_averages_are_drawn_by_their_distance_from_the_last() -> None:
    result = reference("closed_orbits")
    mean = result["data"]["averages"]["mean"]
    [line] = lines(drawn(result).axes[1], "mean over all words")
    np.testing.assert_allclose(line.get_ydata(), np.abs(mean[:-1] - mean[-1]))


def test_differences_are_drawn_by_their_size_beside_their_own_growth() -> None:
    result = reference("exponents")
    checked, axes = result["data"]["checked"], drawn(result).axes[3]
    for name in ("difference", "allowed"):
        [line] = lines(axes, name)
        expected = np.stack((checked["growth"], np.abs(checked[name])), axis=1)
        found = np.asarray(line.get_xydata())
        np.testing.assert_array_equal(found, expected[np.argsort(checked["growth"])])


def test_kinds_of_ends_have_their_colours_and_orbits_their_rows() -> None:
    result = reference("asymptotic_orbits")
    plane = drawn(result).axes[0]
    drawn_orbits: list[Any] = [*plane.collections[1:]]
    for marks, (name, orbits) in zip(drawn_orbits, result["data"]["orbits"].items(), strict=True):
        segments = np.array(marks.get_segments())
        np.testing.assert_allclose(segments[:, :, 1].mean(axis=1), int(name) + 1)
        colour = {"homoclinic": RED, "heteroclinic": BLUE}[str(orbits["ends"])]
        assert to_hex(marks.get_colors()[0]) == colour.lower()


def test_an_uncertain_cell_of_a_zoom_is_marked_there_and_in_its_own_level() -> None:
    result = reference("fig4_zoom")
    level = result["data"]["levels"]["level01"]
    level["certain"][3, 1] = False
    marks = [lines(axes, "uncertain") for axes in drawn(result).axes]
    assert [len(found) for found in marks[:3]] == [0, 1, 0]
    assert np.allclose(marks[1][0].get_xydata(), [[level["offset"][1] / level["step"], 4]])


@pytest.mark.slow
def test_increments_are_in_units_of_the_largest_and_beside_guides_of_their_order() -> None:
    result = reference("precession")
    data = result["data"]
    data["drawn"] = np.int64(1)
    made = drawn(result)
    bodies, k = data["bodies"], int(data["drawn"])
    for row, name in enumerate(bodies["name"]):
        for i in range(4):
            [first], [gained] = (
                lines(made.axes[0], f"{kind} {name} {i + 1}") for kind in ("first", "gained")
            )
            unit = bodies["unit"][row, k]
            np.testing.assert_allclose(first.get_ydata(), bodies["first_order"][row, k, i] / unit)
            np.testing.assert_allclose(gained.get_ydata(), bodies["gained"][row, k, :, i] / unit)
            assert gained.get_color() == SEPARATRIX[i + 1]
    ratios = data["mu_over_h0"]
    for axes, order in zip(made.axes[1:], (2, 2, 3), strict=True):
        [guide] = lines(axes, "guide")
        low, high = guide.get_ydata()
        assert np.log(high / low) / np.log(ratios[-1] / ratios[0]) == pytest.approx(order)
        assert axes.texts[0].get_text() == f"slope {order}"
    gone = [", ".join(bodies["name"][~np.isfinite(bodies["slope"][:, i])]) for i in (1, 0)]
    for axes, names in zip(made.axes[1:3], gone, strict=True):
        noted = [text.get_text() for text in axes.texts[1:]]
        assert noted == [f"{names}) no increment: rounding"] * bool(names)


@pytest.mark.slow
def test_splitting_is_drawn_where_it_is_resolved_and_told_cell_by_cell() -> None:
    result = reference("splitting")
    bodies, ratios = result["data"]["bodies"], result["data"]["mu_over_h0"]
    bodies["resolved"][0, 3:] = False
    result["data"]["curve"]["measured"][-1] = np.nan
    curve, error, _, table = drawn(result).axes
    assert f"${ratios[-2]:g}$" in [x.get_label() for x in curve.lines]
    assert f"${ratios[-1]:g}$" not in [x.get_label() for x in curve.lines]
    for row, name in enumerate(bodies["name"]):
        known = bodies["resolved"][row]
        [whole], [cosine] = (
            lines(error, f"{field} {name}") for field in ("curve_excess", "excess")
        )
        np.testing.assert_array_equal(whole.get_xdata(), ratios[known])
        np.testing.assert_array_equal(whole.get_ydata(), bodies["curve_excess"][row][known])
        np.testing.assert_array_equal(cosine.get_ydata(), np.abs(bodies["excess"][row, known, 0]))
    cells = [x for x in table.patches if isinstance(x, Rectangle)]
    known = bodies["resolved"].ravel()
    expected = np.where(known, [BITS[int(x)] for x in bodies["bits"].ravel()], NONE)
    assert [to_hex(x.get_facecolor()).upper() for x in cells] == expected.tolist()
    digits = np.ceil(np.log10(np.where(known, bodies["error"].ravel(), 1)))
    said = [
        f"{x:.0f}".replace("-", "\N{MINUS SIGN}") if there else "\N{MULTIPLICATION SIGN}"
        for x, there in zip(digits, known, strict=True)
    ]
    assert [text.get_text() for text in table.texts] == said
    # The whole curve's errors are the larger: their slope's label is on the upper left.
    whole, cosine = (x.get_position() for x in error.texts if "slope" in x.get_text())
    assert whole[1] > cosine[1] + 0.2
    assert whole[0] < cosine[0]


def first_of(name: str, *path: str) -> Loaded:
    """A reference of which a group has only its first member."""
    result = reference(name)
    group = result["data"]
    for step in path:
        group = group[step]
    for member in list(group)[1:]:
        del group[member]
    return result


def unknown() -> Loaded:
    """Exponents of which none is known."""
    result = reference("exponents")
    for values in (result["data"]["exponent"], result["data"]["checked"]["growth"]):
        values[:] = np.nan
    return result


def unsampled() -> Loaded:
    """Orbits of which none is sampled."""
    result = reference("asymptotic_orbits")
    result["data"]["drawn"] = {}
    return result


def one_body() -> Loaded:
    """The splitting of the drawn body alone."""
    result = reference("splitting")
    bodies = result["data"]["bodies"]
    row = list(bodies["name"]).index(result["data"]["curve"]["body"])
    result["data"]["bodies"] = {key: x[row : row + 1] for key, x in bodies.items()}
    return result


@pytest.mark.parametrize(
    ("less", "panels"),
    [
        (unknown, 4),
        (unsampled, 1),
        (one_body, 4),
        (lambda: first_of("fig5"), 2),
        (lambda: first_of("fig4_zoom", "levels"), 3),
        (lambda: first_of("route_map", "zooms"), 2),
    ],
    ids=["unknown", "unsampled", "one body", "one case", "one level", "one zoom"],
)
def test_a_result_of_less_is_drawn(less: Callable[[], Loaded], panels: int) -> None:
    assert len(drawn(less()).axes) == panels
