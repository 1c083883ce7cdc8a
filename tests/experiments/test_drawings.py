"""Figures are those of the gallery, and no word of them is upon another: one rule for all.

The gallery is drawn of the references, and looked at. A column or an axis that is taken for
another, a mark, a colour or a word of something else, what is left out: all of it is noticed.
"""

import itertools
from collections.abc import Iterator
from importlib import metadata
from pathlib import Path
from typing import Any, NamedTuple

import h5py
import numpy as np
import pytest
from matplotlib.figure import Figure
from PIL import Image, ImageChops

from rigidpend import experiments, render
from rigidpend.experiments import plots
from rigidpend.results import store
from tests.cli.calls import REFERENCE
from tests.experiments.pages import assert_legible, drawn_with, laid_out, overlap, put, styled
from tests.experiments.trees import asked, computed, reference

RESULTS = REFERENCE.parent


def stored() -> Iterator[tuple[str, Path]]:
    """Each experiment with its result: the references, and what no config of a figure has."""
    for path in sorted([*REFERENCE.glob("*.h5"), *(RESULTS / "measured").glob("*.h5")]):
        with h5py.File(path) as file:
            yield str(file.attrs["experiment"]), path


STORED = dict(stored())
SHADES, TICK = 8, 30
"""By how many shades of 256 roundings may move a pixel; pixels of a tick, which may fall on the
other side of one."""


class Drawn(NamedTuple):
    """The figure of a stored result, and its pixels with all that is beneath it."""

    name: str
    figure: Figure
    image: bytes


@pytest.fixture(scope="module", params=STORED)
def drawn(request: pytest.FixtureRequest) -> Drawn:
    """Each stored result, drawn once for all tests."""
    drawing, made = experiments.drawing(request.param), list[Figure]()

    def kept(result: Any, draw: Any = drawing.draw) -> Figure:
        made.append(draw(result))
        return made[0]

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(drawing, "draw", kept)
        # Pixels that are compared here are neither packed nor unpacked.
        plain = {"format": "rgba", "metadata": None}
        save = Figure.savefig
        patch.setattr(Figure, "savefig", lambda figure, to, **how: save(figure, to, **how | plain))
        image = render.image(store.load(STORED[request.param]), "png")
    return Drawn(STORED[request.param].stem, made[0], image)


VERSION = f"matplotlib=={metadata.version('matplotlib')}\n"


@pytest.mark.slow
@pytest.mark.skipif(
    VERSION not in (RESULTS.parent / "constraints.txt").read_text(),
    reason="the gallery is drawn by another matplotlib",
)
def test_a_figure_is_that_of_the_gallery(drawn: Drawn) -> None:
    """`make gallery` draws it again; what has changed there is looked at."""
    known = Image.open(RESULTS / "gallery" / f"{drawn.name}.png").convert("RGBA")
    assert len(drawn.image) == 4 * known.width * known.height
    found = Image.frombytes("RGBA", known.size, drawn.image)
    apart = np.asarray(ImageChops.difference(found, known))
    # Whatever the colours in which a pixel differs, it is one: its four bytes are read as a number.
    other = np.argwhere((apart > SHADES).view(np.uint32)[..., 0])
    assert len(other) < TICK, f"rows and columns {other.min(axis=0)} to {other.max(axis=0)}"


def test_every_experiment_is_drawn() -> None:
    assert sorted(STORED) == sorted(experiments.names())


@pytest.mark.slow
def test_a_figure_can_be_read_and_nothing_is_off_its_page(drawn: Drawn) -> None:
    made = drawn.figure
    assert_legible(made)
    assert made.get_figheight() < 9.1
    # Pixels; of two figures a frame is broad.
    edge = 3 if drawn.name in ("asymptotic_orbits", "fig4") else 1
    for axes in made.axes:
        box = axes.get_tightbbox()
        assert box is not None
        assert min(box.x0, box.y0) > -edge
        assert box.x1 < made.bbox.width + edge
        assert box.y1 < made.bbox.height + edge


def test_small_numbers_are_written_with_their_power_of_ten() -> None:
    assert plots.power(0.1 / 1500.7) == r"6.66\cdot 10^{-5}"
    assert [plots.power(x) for x in (1e-6, 1 / 30, 0.3)] == ["10^{-6}", "0.0333", "0.3"]


def test_words_on_a_guide_interrupt_it() -> None:
    every = [x for axes in drawn_with("precession", {}).axes for x in axes.texts]
    around = [x.get_bbox_patch() for x in every if x.get_text().startswith("slope")]
    assert len(around) == 3
    assert all(patch and patch.get_facecolor() == (1, 1, 1, 1) for patch in around)


def test_a_legend_and_labels_beside_a_curve_name_what_a_figure_has() -> None:
    """Neither bodies whose splitting is not resolved, nor cells of none."""

    def lost(resolved: Any) -> Any:
        return resolved & (np.arange(len(resolved)) > 1)[:, None]

    for resolved, named, cells in ((lost, {"b", "i"}, 3), (np.ones_like, {"a", "b", "i"}, 2)):
        _, _, decay, table = drawn_with("splitting", {"bodies/resolved": resolved}).axes
        assert {x.get_text() for x in decay.texts} & {"a", "b", "i"} == named
        legend = table.get_legend()
        assert legend is not None
        told_of = [text.get_text() for text in legend.get_texts()]
        assert (told_of[:2], len(told_of)) == (["53 bits", "106 bits"], cells)


@pytest.mark.parametrize("inside", [True, False])
def test_a_dashed_line_is_told_only_where_the_plane_has_the_config_s_own_value(
    inside: bool,
) -> None:
    data = reference("route_map")["data"]
    [legend] = drawn_with("route_map", {"marked": data["y"][-1] * (1 if inside else 2)}).legends
    assert any("mu" in text.get_text() for text in legend.get_texts()) == inside
    low = reference("exponents")["data"]["log10_J1_0"][0]
    plane, *_ = drawn_with("exponents", {"marked": low - (0 if inside else 1)}).axes
    assert ("dashed" in plane.get_title(loc="left")) == inside


@pytest.mark.parametrize("error", [1e-9, 0.4])
def test_legends_of_closed_orbits_cover_none_of_them(error: float) -> None:
    """With another body a random orbit errs more or less than the orbits differ."""
    other = {"averages/long_orbit_error": error, "orbits/exponent": lambda x: x[::-1]}
    for axes in laid_out(drawn_with("closed_orbits", other)).axes:
        legend = axes.get_legend()
        assert legend is not None
        box = legend.get_window_extent()
        for line in axes.lines:
            places = line.get_transform().transform(np.column_stack(line.get_data()))
            assert (places[:, 1] < box.y0).all()


def test_exponents_that_differ_little_are_written_whole() -> None:
    """And not as what they exceed 18.35 by."""
    other = {"orbits/exponent": lambda x: 18.35 + x / 1000, "averages/long_orbit": 18.353}
    left = laid_out(drawn_with("closed_orbits", other | {"averages/long_orbit_error": 1e-4})).axes[
        0
    ]
    assert left.yaxis.get_offset_text().get_text() == ""
    assert all(x.get_text().startswith("18.35") for x in left.get_yticklabels())


def test_exponents_of_a_single_passage_stand_at_a_whole_number() -> None:
    shorter = dict.fromkeys(("codes", "growth/passages"), lambda x: x[:1])
    figure = laid_out(drawn_with("exponents", shorter | {"growth/exponent": lambda x: x[:, :1]}))
    above = figure.axes[0]
    [spread] = (axes for axes in figure.axes if axes.get_xlabel() == "passages")
    assert above.get_title("left").startswith("a)  exponents of 1 passage,")
    low, high = spread.get_xlim()
    assert [x for x in spread.get_xticks() if low <= x <= high] == [1]


@pytest.mark.parametrize(("flatter", "aspect"), [(1.0, 1.0), (1e-3, "auto")])
def test_a_hodograph_is_drawn_in_one_scale_unless_it_is_flat(flatter: float, aspect: Any) -> None:
    """That of a nearly symmetric body was a line, beside ticks that were upon each other."""
    figure = drawn_with("fig5", {"*/omega": lambda x: x * [flatter, 1, 1]})
    assert [axes.get_aspect() for axes in figure.axes] == ["auto", aspect] * 2


@pytest.mark.parametrize(
    ("nu", "said"),
    [
        ([4.44, 4.44, 4.45, 4.43, 7, 8, 9, 10, 11.3, 19.3], "c, a, 4, b"),
        ([4.44] * 5 + [9, 10, 11, 12, 19.3], "a \N{HORIZONTAL ELLIPSIS} d"),
        ([0.4, 0.5, 0.6, 3, 5, 6, 8, 10, 12, 19.3], "a, 4, b"),
    ],
)
def test_bodies_of_nearly_equal_nu_share_a_label(nu: list[float], said: str) -> None:
    reduced = np.tile((nu / np.sinh(nu))[:, None], 9)
    other = {"bodies/nu": np.array(nu), "bodies/reduced": reduced}
    axes = laid_out(drawn_with("splitting", other)).axes[2]
    names = [text for text in axes.texts if text.get_text()]
    assert said in [text.get_text() for text in names]
    assert not overlap(text.get_window_extent() for text in names)


@pytest.mark.parametrize("name", ["Wide_name_of_the_body_number_{}", "the_{}_"])
def test_labels_of_bodies_end_within_the_panel_of_the_decay(name: str) -> None:
    """A name that ends in an underscore is one without a subscript."""
    names = [name.format(k) for k in range(10)]
    other = {"bodies/name": np.array(names, dtype=object), "curve/body": names[1]}
    axes = laid_out(drawn_with("splitting", other)).axes[2]
    boxes = [x.get_window_extent() for x in axes.texts if x.get_text()]
    frame = axes.get_window_extent()
    assert len(boxes) > 3
    assert all(frame.x0 < box.x0 and box.x1 < frame.x1 for box in boxes)


def test_the_body_of_fig_4_alone_is_called_so() -> None:
    names = np.array(["figaro", "fig4", *"bcdefghi"], dtype=object)
    for body, said in (("figaro", r"$\it{figaro}$"), ("fig4", "Fig. 4")):
        figure = drawn_with("splitting", {"bodies/name": names, "curve/body": body})
        assert f"{said}, " in figure.axes[0].get_title("left")


def test_lines_of_a_route_join_where_there_are_few_samples() -> None:
    sampled = ("t", "theta1", "J1_over_J2", "theta3", "alpha", "omega")
    fewer = {f"*/{name}": lambda x: x[::120] for name in sampled}
    angle, spiral, *_ = drawn_with("fig5", fewer | {"*/wound": lambda x: x // 120}).axes
    for axes, count in ((angle, 6), (spiral, 3)):
        ends = [np.array(line.get_xydata()) for line in axes.lines]
        for one, other in itertools.pairwise(ends[:count]):
            np.testing.assert_array_equal(one[-1], other[0])


def test_a_single_body_stands_in_the_middle_of_the_page() -> None:
    figure = drawn_with("fig3", {"bodies": lambda x: {"a": x["a"]}})
    box = figure.axes[0].get_position()
    assert (box.x0 + box.x1) / 2 == pytest.approx(0.57, abs=0.03)


def test_small_swings_are_written_in_three_digits_beside_an_origin_that_is_not_rounded() -> None:
    """Of 7.98e-6 rad 0.00001 would be shown, beside an origin that is rounded by more."""
    figure = drawn_with("fig3", {"bodies/*/Delta_1": 7.98e-6})
    said = {axes.get_xlabel() for axes in figure.axes} - {""}
    assert said == {"$\\theta_1 - \\alpha_0 - \\beta_0$\n$\\Delta_1 = 7.98\\cdot 10^{-6}$ rad"}
    assert_legible(figure)
    result = reference("fig3")
    put(result["data"], "bodies/*/Delta_1", 7.98e-6)
    [table] = experiments.tables(result)
    assert {row[-1] for row in table.rows} == {"7.98e-06"}


@pytest.mark.parametrize("A3", ["0.50001", "0.99999", "0.5 + 1e-40"])
@pytest.mark.parametrize("name", ["fig1", "fig2"])
def test_labels_of_separatrices_that_nearly_meet_are_apart(name: str, A3: str) -> None:
    """At one place -0.0126 and 0.0127 would read as one number, and 2 be upon 3."""
    content = asked(name, f"problem.A=[1, 0.5, {A3}]", "problem.r=[1, 0, 0]")
    told = {"experiment": content.experiment}
    figure = styled({"attributes": told, "data": computed(content)})
    assert_legible(figure, edge=1)
    *_, plane = figure.axes
    low = [x.get_window_extent() for x in plane.get_xticklabels()]
    assert len({x.get_text() for x in plane.get_xticklabels()}) == 5
    point = figure.dpi / 72
    assert all(b.x0 - a.x1 > 3 * point for a, b in itertools.pairwise(low))
    rings = [ring.get_window_extent() for x in plane.texts if (ring := x.get_bbox_patch())]
    ticks = [x.get_window_extent() for x in plane.get_yticklabels()]
    assert not any(box.overlaps(ring) for box in ticks for ring in rings)


def test_ticks_of_a_window_are_not_upon_each_other() -> None:
    """Nor upon those of the panel beside it, where both are near the edges."""
    wides = [(1.01, ""), (1.01, ""), (1.5, ""), (1.5, ""), (2.5, ""), (5.0, "2"), (100.0, "50")]

    def change(data: Any) -> None:
        for body, (wide, _) in zip(data["bodies"].values(), wides, strict=True):
            body["window"] = body["centre"] + wide * body["Delta_1"] * np.array([-1, 1])

    figure = drawn_with("fig3", change)
    assert_legible(figure)
    for k, axes in enumerate(figure.axes):
        wide, times = wides[k // 2]
        labels = [x for x in axes.get_xticklabels() if x.get_text()]
        assert [x.get_text() for x in labels] == (
            [rf"$-{times}\Delta_1$", rf"${times}\Delta_1$"] if axes.get_xlabel() else []
        )
        places = (axes.get_xticks() - np.mean(axes.get_xlim())) / (np.ptp(axes.get_xlim()) / 2)
        np.testing.assert_allclose(places * wide, np.array([-1, 1]) * float(times or 1), rtol=1e-6)
