"""Figures show what is stored: one rule for all, and what of the paper's conventions it cannot say.

`drawn.yaml` tells where each dataset of each reference is seen. It is changed, and that place of
the figure changes and no other: a column or an axis taken for another, a part that is not drawn
and a label of something else are all noticed.
"""

from __future__ import annotations

import gc
from collections.abc import Iterator
from pathlib import Path

import pytest
import yaml
from matplotlib.figure import Figure
from matplotlib.text import Text

from rigidpend import experiments
from rigidpend.results import store
from tests.cli.calls import REFERENCE
from tests.experiments import drawn
from tests.experiments.figures import styled
from tests.experiments.trees import reference

WHERE = yaml.safe_load(Path(__file__).with_name("drawn.yaml").read_text(encoding="utf-8"))


@pytest.fixture(autouse=True)
def garbage_waits() -> Iterator[None]:
    """Figures refer to themselves: to look for garbage among dozens takes a third of the time."""
    gc.disable()
    yield
    gc.enable()


def test_every_reference_is_told() -> None:
    assert {path.stem for path in REFERENCE.glob("*.h5")} == set(WHERE)


@pytest.mark.slow
@pytest.mark.parametrize("name", WHERE)
def test_each_dataset_is_seen_where_it_belongs_and_nowhere_else(name: str) -> None:
    result = reference(name)
    experiment = result["attributes"]["experiment"]
    drawing, layout = experiments.drawing(experiment), experiments.layout(experiment)
    result["data"] = drawn.shortened(layout, result["data"])
    told = WHERE[name]["seen"]
    axes, seen = drawn.where(drawing, layout, result, told)
    assert seen == {**told, drawn.OTHERS: ""}
    assert axes == WHERE[name]["axes"]


def words(figure: Figure) -> Iterator[Text]:
    """The texts that a drawing puts in places of its own, which matplotlib does not keep apart."""
    legends = [x for part in (figure, *figure.subfigs) for x in part.legends]
    for axes in figure.axes:
        legends += filter(None, [axes.get_legend()])
        yield from (axes.xaxis.label, axes.yaxis.label)
        yield from (text for text in axes.get_children() if isinstance(text, Text))
    yield from (text for legend in legends for text in (legend.get_title(), *legend.get_texts()))
    yield from figure.texts


MEASURED = ("bench", "stress")
"""Results that no config of a figure has."""


@pytest.mark.slow
@pytest.mark.parametrize("name", [*WHERE, *MEASURED])
def test_words_are_on_the_page_and_none_is_upon_another(name: str) -> None:
    measured = REFERENCE.parent / "measured" / f"{name}.h5"
    result = store.load(measured) if name in MEASURED else reference(name)
    drawing = experiments.drawing(result["attributes"]["experiment"])
    made = styled(drawing.draw, result, laid_out=True)
    boxes = [x.get_window_extent() for x in words(made) if x.get_visible() and x.get_text()]
    assert made.get_figwidth() <= 7.2 + 1e-9
    assert made.get_figheight() < 9.1
    # Pixels; of two figures a frame is broad.
    edge = 3 if name in ("asymptotic_orbits", "fig4") else 1
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
