"""Figures are those of the gallery, and no word of them is upon another: one rule for all.

The gallery is drawn of the references, and looked at. A column or an axis that is taken for
another, a mark, a colour or a word of something else, what is left out: all of it is noticed.
"""

import io
from collections.abc import Iterator
from importlib import metadata
from pathlib import Path
from typing import Any, NamedTuple

import h5py
import matplotlib
import numpy as np
import pytest
from matplotlib.figure import Figure
from matplotlib.text import Text
from PIL import Image

from rigidpend import experiments, render
from rigidpend.results import store
from tests.cli.calls import REFERENCE

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
    """The figure of a stored result, as it is on the page."""

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
        image = render.image(store.load(STORED[request.param]), "png")
    return Drawn(STORED[request.param].stem, made[0], image)


def shades(picture: Any) -> Any:
    return np.asarray(Image.open(picture).convert("RGB")).astype(np.int16)


VERSION = f"matplotlib=={metadata.version('matplotlib')}\n"


@pytest.mark.slow
@pytest.mark.skipif(
    VERSION not in (RESULTS.parent / "constraints.txt").read_text(),
    reason="the gallery is drawn by another matplotlib",
)
def test_a_figure_is_that_of_the_gallery(drawn: Drawn) -> None:
    """`make gallery` draws it again; what has changed there is looked at."""
    found = shades(io.BytesIO(drawn.image))
    known = shades(RESULTS / "gallery" / f"{drawn.name}.png")
    assert found.shape == known.shape
    other = np.argwhere(np.abs(found - known).max(axis=-1) > SHADES)
    assert len(other) < TICK, f"rows and columns {other.min(axis=0)} to {other.max(axis=0)}"


def test_every_experiment_is_drawn() -> None:
    assert sorted(STORED) == sorted(experiments.names())


def words(figure: Figure) -> Iterator[Text]:
    """The texts that a drawing puts in places of its own, which matplotlib does not keep apart."""
    legends = [x for part in (figure, *figure.subfigs) for x in part.legends]
    for axes in figure.axes:
        legends += filter(None, [axes.get_legend()])
        yield from (axes.xaxis.label, axes.yaxis.label)
        yield from (text for text in axes.get_children() if isinstance(text, Text))
    yield from (text for legend in legends for text in (legend.get_title(), *legend.get_texts()))
    # The last one is the foot, below the page.
    yield from figure.texts[:-1]


@pytest.mark.slow
def test_words_are_on_the_page_and_none_is_upon_another(drawn: Drawn) -> None:
    made = drawn.figure
    # In its own pixels, which are not those of the image.
    with matplotlib.rc_context(fname=render.STYLE):
        made.draw_without_rendering()
    boxes = [x.get_window_extent() for x in words(made) if x.get_visible() and x.get_text()]
    assert made.get_figwidth() <= 7.2 + 1e-9
    assert made.get_figheight() < 9.1
    # Pixels; of two figures a frame is broad.
    edge = 3 if drawn.name in ("asymptotic_orbits", "fig4") else 1
    for axes in made.axes:
        box = axes.get_tightbbox()
        assert box is not None
        assert min(box.x0, box.y0) > -edge
        assert box.x1 < made.bbox.width + edge
        assert box.y1 < made.bbox.height + edge
    for k, box in enumerate(boxes):
        assert 0 <= box.x0 < box.x1 <= made.bbox.width
        assert 0 <= box.y0 < box.y1 <= made.bbox.height
        assert not any(box.overlaps(other) for other in boxes[:k])
