"""Figures of results, with all that is on them in its place, and the rule that all can be read."""

import itertools
from collections.abc import Callable, Iterable, Iterator, Mapping
from typing import Any

import matplotlib
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.text import Text

from rigidpend import experiments
from rigidpend.render import STYLE
from tests.experiments.trees import reference


def styled(result: Any) -> Figure:
    """The figure of a result in the style of all."""
    with matplotlib.rc_context(fname=STYLE):
        figure: Figure = experiments.drawing(result["attributes"]["experiment"]).draw(result)
    return figure


def drawn_with(name: str, change: Callable[[Any], object] | Mapping[str, Any]) -> Figure:
    """The figure of a stored result whose data a function changes, or other values by place."""
    result = reference(name)
    if callable(change):
        change(result["data"])
    else:
        for place, value in change.items():
            put(result["data"], place, value)
    return styled(result)


def put(node: Any, place: str, value: Any) -> None:
    """Set what is at a place, where * is every name: to a value, or a function of what is there."""
    name, _, rest = place.partition("/")
    for key in node if name == "*" else [name]:
        if rest:
            put(node[key], rest, value)
        else:
            node[key] = value(node[key]) if callable(value) else value


def laid_out(figure: Figure) -> Figure:
    """The same figure, whose artists have their places."""
    with matplotlib.rc_context(fname=STYLE):
        # With a canvas all passes measure the same text once.
        FigureCanvasAgg(figure)
        figure.draw_without_rendering()
    return figure


def overlap(boxes: Iterable[Any]) -> bool:
    """Whether a box is upon another one."""
    return any(one.overlaps(other) for one, other in itertools.combinations(boxes, 2))


def tick_labels(axis: Any) -> list[Text]:
    """The labels of the ticks that an axis shows."""
    low, high = sorted(axis.get_view_interval())
    ticks = (*axis.get_major_ticks(), *axis.get_minor_ticks())
    return [x.label1 for x in ticks if low <= x.get_loc() <= high and x.label1.get_text()]


def words(figure: Figure) -> Iterator[Text]:
    """All texts of a figure but its foot, which is below the page."""
    legends = [x for part in (figure, *figure.subfigs) for x in part.legends]
    for axes in figure.axes:
        legends += filter(None, [axes.get_legend()])
        for axis in (axes.xaxis, axes.yaxis):
            yield from (axis.label, *tick_labels(axis))
        yield from (text for text in axes.get_children() if isinstance(text, Text))
    yield from (text for legend in legends for text in (legend.get_title(), *legend.get_texts()))
    yield from (text for text in figure.texts if text.get_position()[1] >= 0)


def assert_legible(figure: Figure, edge: float = 0.0) -> None:
    """Panels and words are on the page, words but for some pixels, and none is upon another.

    An axis with a name has a number, and a logarithmic one has two.
    """
    shown = [x for x in words(laid_out(figure)) if x.get_visible() and x.get_text()]
    boxes = [x.get_window_extent() for x in shown]
    for text, box in zip(shown, boxes, strict=True):
        assert -edge <= box.x0 < box.x1 <= figure.bbox.width + edge, text
        assert 0 <= box.y0 < box.y1 <= figure.bbox.height, text
    assert not overlap(boxes)
    panels = [axes.get_window_extent() for axes in figure.axes]
    for panel in panels:
        assert 0 <= panel.x0 < panel.x1 <= figure.bbox.width + 1e-6
        assert 0 <= panel.y0 < panel.y1 <= figure.bbox.height
    assert not overlap(panels)
    assert figure.get_figwidth() <= 7.2 + 1e-9
    for axes in figure.axes:
        for axis in (axes.xaxis, axes.yaxis):
            least = 2 if axis.get_scale() == "log" else 1
            assert not axis.label.get_text() or len(tick_labels(axis)) >= least, axis
