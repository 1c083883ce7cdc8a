"""What is drawn where a result is smaller, larger or less known than those of the gallery."""

import math
from collections.abc import Callable
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from matplotlib.figure import Figure

from rigidpend.experiments import plots
from rigidpend.experiments.data import Loaded
from tests.experiments.pages import (
    assert_legible,
    drawn_with,
    laid_out,
    overlap,
    styled,
    tick_labels,
)
from tests.experiments.trees import reference


def legend(figure: Figure) -> list[str]:
    return [text.get_text() for text in figure.legends[0].get_texts()]


def points(axes: Any, colour: str) -> list[Any]:
    """Where the lines of a colour are."""
    return [line.get_xydata().tolist() for line in axes.lines if line.get_color() == colour]


DOUBTED: dict[str, tuple[Callable[[Any], Any], Callable[[Any], Any]]] = {
    "fig4_zoom": (
        lambda data: data["levels"]["level00"],
        lambda level: level["offset"] / level["step"],
    ),
    "fig4_intervals": (lambda data: data["columns"], lambda array: array["theta2_0"]),
    "route_map": (lambda data: data, lambda plane: plane["x"]),
}
"""By reference: what has symbols, and where its columns are drawn."""


@pytest.mark.parametrize("name", DOUBTED)
def test_what_is_uncertain_is_marked_where_it_is_and_told(name: str) -> None:
    result, (group_of, columns_of) = reference(name), DOUBTED[name]
    group = group_of(result["data"])
    group["certain"][3, 7] = 0
    made = styled(result)
    row = group["y"][3] if "y" in group else 4
    assert points(made.axes[0], plots.DOUBT) == [[[columns_of(group)[7], row]]]
    assert ("uncertain" in legend(made)) == (name != "fig4_zoom")


def test_proven_symbols_and_what_does_not_return_are_marked_and_told() -> None:
    result = reference("fig4")
    left = result["data"]["left"]
    left["proven"] = np.zeros_like(left["certain"])
    left["proven"][11, 7] = True
    left["codes"][5, 5] = 255
    left["certain"][3, 6] = False
    made = styled(result)
    assert points(made.axes[0], plots.PROVEN) == [[[left["theta2_0"][7], 12]]]
    assert points(made.axes[0], plots.DOUBT) == [[[left["theta2_0"][6], 4]]]
    assert legend(made)[-3:] == ["no return", "proven symbol", "uncertain"]


def arrays(*phases: Any, rows: int = 15, zeros: Any = ()) -> Loaded:
    """A result of arrays of certain codes at such phases."""
    made = [
        {
            "theta2_0": np.asarray(x, dtype=float),
            "codes": np.zeros((rows, len(x)), dtype=np.uint8),
            "certain": np.ones((rows, len(x)), dtype=bool),
            "melnikov_zeros": np.asarray(zeros, dtype=float),
        }
        for x in phases
    ]
    named = {f"a{k}": array for k, array in enumerate(made)}
    told = {"attributes": {"experiment": "route_codes"}, "config": {}, "provenance": {}}
    return Loaded(**told, data=named)  # type: ignore[typeddict-item]


TENTHS = np.arange(63) / 10


@pytest.mark.parametrize(
    ("whole", "part", "frames"),
    [
        (TENTHS[::-1], 1 + np.arange(9) / 100, 1),
        (TENTHS[:20], TENTHS[30:50], 0),
        # What ends where the whole does is inside it.
        (np.arange(8), 5.125 + np.arange(10) / 4, 1),
        # A single column has no step.
        ([0.25], 0.2 + np.arange(8) / 100, 0),
    ],
)
def test_a_finer_array_inside_of_another_is_framed(whole: Any, part: Any, frames: int) -> None:
    made = styled(arrays(whole, part))
    assert [len(axes.patches) for axes in made.axes] == [frames, 0]
    assert ("magnified part" in legend(made)) == bool(frames)


def test_zeros_are_marked_in_every_turn_of_the_phases() -> None:
    made = styled(arrays(np.arange(-7, 7, 0.1), zeros=[1, 4]))
    [marks] = made.axes[0].lines
    found = np.asarray(marks.get_xdata(), dtype=float)
    np.testing.assert_allclose(found, [1 - math.tau, 4 - math.tau, 1, 4])
    assert "zero of Melnikov's integral" in legend(made)
    # Between two zeros there is none, in no turn.
    between = styled(arrays(math.tau + np.arange(1.2, 3.8, 0.1), zeros=[1, 4]))
    assert "zero of Melnikov's integral" not in legend(between)


@pytest.mark.parametrize("phases", [np.arange(9) / 5, [np.pi / 7]])
def test_a_few_columns_beside_a_thousand_have_their_words_on_the_page(phases: Any) -> None:
    assert_legible(styled(arrays(np.arange(1000) / 100, phases, rows=2)))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("names", "columns"),
    [
        (["left", "twelve_lettr"], [63, 10]),
        (["m" * 40], [3]),
        ([f"eleventh_{k}_" for k in range(6)], [3] * 6),
        ([f"eleventh_{k}_" for k in range(6)], [63] * 6),
    ],
)
def test_names_of_arrays_are_on_the_page_and_apart(names: list[str], columns: list[int]) -> None:
    result = arrays(*(np.arange(count) / 100 for count in columns))
    result["data"] = dict(zip(names, result["data"].values(), strict=True))
    figure = styled(result)
    assert_legible(figure)
    # Each is told as far as there is room.
    said = [axes.get_title(side) for axes in figure.axes for side in ("left", "right")]
    assert [x[0] for x in said if x] == [x[0] for x in names]


@pytest.mark.parametrize(("columns", "rows", "lined"), [(300, 30, True), (1000, 2, False)])
def test_lines_between_cells_do_not_cover_them(columns: int, rows: int, lined: bool) -> None:
    [axes] = styled(arrays(np.arange(columns) / 100, rows=rows)).axes
    [cells] = axes.collections
    assert bool(len(cells.get_edgecolor())) == lined


@pytest.mark.slow
@pytest.mark.parametrize("start", [0.0, 3 * np.pi / 40, 1.0])
@pytest.mark.parametrize(
    ("columns", "rows"), [(1, 15), (2, 1), (3, 15), (8, 1), (63, 30), (1000, 15), (40, 300)]
)
def test_any_number_of_cells_is_drawn_inside_the_figure_with_their_phases(
    columns: int, rows: int, start: float
) -> None:
    figure = styled(arrays(start + np.arange(columns) / 10, rows=rows))
    assert_legible(figure)
    [axes] = figure.axes
    ticks = tick_labels(axes.xaxis)
    assert all(abs(float(x.get_text()) - x.get_position()[0]) < 1e-5 for x in ticks)
    box, (wide, high) = axes.get_position(), figure.get_size_inches()
    assert figure.legends[0].get_window_extent().y1 <= axes.get_window_extent().y0
    width, height = box.width * wide / columns, box.height * high / rows
    assert wide >= 3.4 - 1e-9
    # Cells are square but where rows would be lower than can be seen.
    assert height == pytest.approx(max(width, 0.06))
    assert width <= 0.12 + 1e-9
    if columns >= 63:
        assert wide == pytest.approx(7.2) or width == pytest.approx(0.12)


def plane(columns: slice = slice(None), rows: slice = slice(None), **given: Any) -> Any:
    """A part of the stored plane."""
    data = reference("route_map")["data"]
    parts = {"x": columns, "y": rows, "certain": (rows, columns), "codes": (..., rows, columns)}
    return {name: data[name][part] for name, part in parts.items()} | given


def map_of(data: Any) -> Figure:
    """The figure of a plane over theta2_0 and mu, unless its axes are others."""
    own = {"y_axis": "mu", "marked": 1e-3}
    return styled({**reference("route_map"), "data": own | data})


@pytest.mark.parametrize(
    ("symbols", "shades", "lines"),
    [(1, "", "changes of symbol 1"), (2, "; shades: later symbols", "changes of symbols 1, 2")],
)
def test_the_legend_of_a_plane_tells_of_the_symbols_that_there_are(
    symbols: int, shades: str, lines: str
) -> None:
    data = plane()
    figure = map_of({**data, "codes": data["codes"][:symbols]})
    said = [f"$z_1 = {k}${shades}" for k in (0, 1)]
    assert legend(figure) == [*said, lines, r"$\mu$ = 0.001"]


def test_zooms_are_framed_in_the_smallest_plane_around_them() -> None:
    parts = {
        "outer": plane(slice(100, 300), slice(40, 120)),
        "inner": plane(slice(150, 250), slice(60, 100)),
        "to the end": plane(slice(250, None), slice(90, None)),
    }
    figure = map_of({**plane(), "zooms": parts})
    framed = [[patch.get_label() for patch in axes.patches] for axes in figure.axes]
    assert framed == [["outer", "to the end"], ["inner"], [], []]


def test_values_of_the_config_are_marked_where_they_are_shown() -> None:
    figure = map_of(plane(x_axis="h0", marked_x=1.5))
    [axes] = figure.axes
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("$h_0$", r"$\mu$")
    assert points(axes, plots.ZOOM) == [[[0, 1e-3], [1, 1e-3]], [[1.5, 0], [1.5, 1]]]
    assert legend(figure)[-1] == r"$\mu$ = 0.001, $h_0$ = 1.5"
    assert points(map_of(plane(marked=1.0)).axes[0], plots.ZOOM) == []


@pytest.mark.slow
@pytest.mark.parametrize("alpha0", [0.05, 0.3, 0.8, 1.2, np.pi / 2, 1.9, 2.4, 2.8, 3.1])
def test_no_two_ticks_of_separatrices_overlap_for_any_body(alpha0: float) -> None:
    """On the narrowest axis that has them, 3.1 inches."""
    figure = Figure(figsize=(7.2, 3))
    axes = figure.add_axes((0.1, 0.4, 3.1 / 7.2, 0.5))
    places = 1 + alpha0 * np.array([-1, 1, -1, 1, -1]) + 2 * np.pi * np.array([0, 0, 1, 1, 2])
    plots.separatrix_ticks(axes, places, digits=3)
    assert_legible(figure)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("middle", "share"), [(1e-3, 1e-13), (1e-3, 6e-3), (-17.7, 1e-3), (1.3342, 2e-7)]
)
def test_ticks_of_a_tiny_plane_leave_room_for_each_other_and_for_its_labels(
    middle: float, share: float
) -> None:
    """Ends that agree in 2 to 13 digits: what they share is told once."""
    result = reference("route_map")
    del result["data"]["zooms"]
    for axis, where, wide in (("x", 1.5, 1e-13), ("y", middle, share)):
        values = result["data"][axis]
        values[:] = where + abs(where) * wide * np.linspace(0, 1, len(values))
    figure = laid_out(styled(result))
    [axes] = figure.axes
    across, upwards = (
        [text.get_window_extent() for text in tick_labels(axis)]
        for axis in (axes.xaxis, axes.yaxis)
    )
    assert all(left.x1 < right.x0 for left, right in pairwise(across))
    label = axes.yaxis.label.get_window_extent()
    assert min(box.x0 for box in upwards) > label.x1 > label.x0 >= 0
    assert axes.xaxis.get_offset_text().get_text()


@pytest.mark.slow
@pytest.mark.parametrize("later", [0.0, 900.0])
def test_the_angle_is_drawn_from_where_an_orbit_leaves_its_first_plateau(later: float) -> None:
    """From a J1_0 of 1e-300 that is after five sixths of the time."""
    t = {"*/t": lambda x: np.append(x[:1], x[1:] + later)}
    figure = drawn_with("fig5", t | {"*/crossing_time": lambda x: x + later})
    assert_legible(figure)
    for axes in figure.axes[::2]:
        number: Any = axes.texts[0]
        (low, high), first = axes.get_xlim(), number.xy[0]
        assert (low == 0) == (later == 0)
        assert 0.1 < (first - low) / (high - low) < 0.3
        rings = [ring.get_window_extent() for x in axes.texts if (ring := x.get_bbox_patch())]
        assert len(rings) == 6
        assert not overlap(rings)


def copies(group: Any, name: str, count: int) -> None:
    """Leave so many of a member; what follows an underscore in a name must not be lowered."""
    member = group[name]
    group.clear()
    group.update({f"b_{k}_": member for k in range(count)})


def bodies(data: Any, count: int) -> None:
    copies(data["bodies"], "a", count)
    data["table"] = {name: np.resize(x, count) for name, x in data["table"].items()}


def lost(x: Any) -> Any:
    return np.full_like(x, np.nan)


def leave_one(data: Any) -> None:
    """Of all bodies only the drawn one is left."""
    row = list(data["bodies"]["name"]).index(data["curve"]["body"])
    data["bodies"] = {key: x[row : row + 1] for key, x in data["bodies"].items()}


def refuse(data: Any) -> None:
    """Kinds of trials that refused have no curves."""
    data["passages"]["curves"].clear()
    curves = data["long_time"]["curves"]
    for kind in [next(reversed(curves)), *list(curves)[1:-1]]:
        del curves[kind]


def lengthen(data: Any) -> None:
    """Of one body, with a long name; between two powers of ten ticks have factors too."""
    data["bodies"] = {key: values[:1] for key, values in data["bodies"].items()}
    data["bodies"]["name"] = np.array(["long_name"])
    data["curve"]["body"] = "long_name"
    near = data["closed_form"]["nu"] < 4
    data["closed_form"] = {key: values[near] for key, values in data["closed_form"].items()}


def name_at_length(data: Any) -> None:
    """Each body with a name of 40 letters."""
    names = [f"{'Wide_name_of_a_body' * 2}{k:02}" for k in range(len(data["bodies"]["nu"]))]
    data["bodies"]["name"], data["curve"]["body"] = np.array(names), names[0]


def rename(data: Any) -> None:
    bodies = enumerate(data["bodies"].values())
    data["bodies"] = {f"Wide_name_of_the_body_number_{k}": body for k, body in bodies}


def from_to(low: float, high: float) -> dict[str, Any]:
    """Weights in another range."""
    return {"mu_over_h0": lambda x: np.geomspace(low, high, len(x))}


CHANGES: list[tuple[str, Any, int]] = [
    ("fig4", lambda data: copies(data, "left", 7), 7),
    ("fig4", lambda data: copies(data, "left", 20), 20),
    ("fig3", lambda data: bodies(data, 1), 2),
    ("fig3", lambda data: bodies(data, 8), 16),
    ("fig3", rename, 14),
    ("route_map", lambda data: copies(data["zooms"], "lower", 4), 5),
    ("route_map", lambda data: copies(data["zooms"], "lower", 1), 2),
    ("fig5", lambda data: copies(data, "case1", 1), 2),
    ("fig4_zoom", lambda data: copies(data["levels"], "level00", 1), 3),
    ("asymptotic_orbits", lambda data: data["drawn"].clear(), 1),
    ("exponents", dict.fromkeys(("exponent", "checked/growth"), lost), 4),
    ("splitting", leave_one, 4),
    ("splitting", lengthen, 4),
    ("splitting", name_at_length, 4),
    ("../measured/stress", refuse, 3),
    # The energy of another body makes quotients of many digits.
    *((x, {"mu_over_h0": lambda x: x / 1500.7}, 4) for x in ("precession", "splitting")),
    # Both label their weights by one function; the panels of the first have less room.
    *(("precession", from_to(*x), 4) for x in ((2e-4, 3e-3), (0.045, 0.5), (1e-8, 0.3))),
    *((name, from_to(1e-3, 1.1e-3), 4) for name in ("precession", "splitting")),
    ("precession", lambda data: data.update(drawn=list(data["mu_over_h0"]).index(1e-3)), 4),
]
"""By result: what is more, less or other than stored, and the panels of its figure."""


@pytest.mark.slow
@pytest.mark.parametrize(("name", "change", "panels"), CHANGES)
def test_what_is_drawn_of_other_data_can_be_read(name: str, change: Any, panels: int) -> None:
    figure = drawn_with(name, change)
    assert len(figure.axes) == panels
    assert_legible(figure)


def test_every_body_and_what_is_known_has_its_curve() -> None:
    """Also of more bodies than there are looks: these come again."""
    result = reference("precession")
    group = result["data"]["bodies"]
    result["data"]["bodies"] = {name: np.concatenate([x] * 3) for name, x in group.items()}
    # Beside a guide.
    assert [len(panel.lines) for panel in styled(result).axes[1:]] == [16] * 3
    result = reference("splitting")
    result["data"]["curve"]["measured"][-1, 3] = np.nan
    labels = [str(x.get_label()) for x in styled(result).axes[0].lines]
    ratios = result["data"]["mu_over_h0"]
    assert (f"${ratios[-2]:g}$" in labels, f"${ratios[-1]:g}$" in labels) == (True, False)
