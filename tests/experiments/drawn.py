"""Where a stored dataset is seen in a figure: what of the drawing changes when it changes."""

from __future__ import annotations

import marshal
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, NamedTuple, Self

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import Collection, LineCollection, QuadMesh
from matplotlib.colors import to_hex
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.text import Annotation, Text
from matplotlib.ticker import FixedLocator

from rigidpend.experiments.data import FLOAT, TEXT, Field, Layout, Loaded, declared, fields, members
from tests.experiments.figures import styled

Seen = dict[str, list[Any]]
"""What a reader sees, by panel and kind (``a.x``, ``a.colour``): numbers, or other values."""


PANELS = "abcdefghijklmnop"
OTHERS = "all others"
"""The name of all datasets that are not told, changed at once."""
OTHER = {"homoclinic": "heteroclinic", "fig4": "a", "mu": "h0"}
"""Other words for those that a drawing looks up."""


class Place(NamedTuple):
    """A dataset of a result, or one component of it."""

    path: str
    field: Field
    component: tuple[Any, ...] = ()

    def components(self) -> Iterator[Self]:
        """Its parts along dimensions of two to four, as of vectors; itself if there are none."""
        sizes = [n if n in (2, 3, 4) else 1 for n in self.field.dimensions]
        if self.field.kind != FLOAT or not set(sizes) - {1}:
            yield self
            return
        for index in np.ndindex(*map(int, sizes)):
            at = (slice(None) if n == 1 else k for n, k in zip(sizes, index, strict=True))
            yield self._replace(component=tuple(at))

    def __str__(self) -> str:
        at = ",".join(":" if isinstance(x, slice) else str(x) for x in self.component)
        return self.path + (f"[{at}]" if at else "")


def places(layout: Layout, data: Any) -> Iterator[Place]:
    for path, _, field in fields(layout, data):
        yield from Place(path, field).components()


def shortened(layout: Layout | Field, data: Any) -> Any:
    """The data to be drawn sooner: of members of any names the first and the last, three bodies."""
    if isinstance(layout, Field):
        axes = [slice(3) if size == "bodies" else slice(None) for size in layout.dimensions]
        return data[tuple(axes)] if axes else data
    kept = list(data)[:: max(1, len(data) - 1)] if members(layout) else list(data)
    return {name: shortened(node, data[name]) for name, node in declared(layout, kept).items()}


def changed(data: Any, place: Place) -> Any:
    """Change the data in that place, and return the values that are there now.

    Doubles are scaled and moved, so that they keep their order; of flags one is turned; of all
    else each element gets the value of the one before.
    """
    group = data
    *outer, last = place.path.split("/")
    for name in outer:
        group = group[name]
    stored = group[last]
    array = np.array(stored, dtype=object if place.field.kind == TEXT else None)
    part = array[place.component]
    if array.dtype.kind == "f":
        known = np.abs(part[np.isfinite(part)])
        new = part * 1.0137 + 0.0319 * known.max(initial=1e-9)
    elif array.dtype.kind == "b":
        new = part.copy()
        new[tuple(n // 2 for n in part.shape)] ^= True
    else:
        new = np.roll(part, 1)
        if (new == part).all():
            new = _others(part)
    array[place.component] = np.asarray(new)[()]
    group[last] = array if array.ndim else array[()]
    return new


def _others(part: Any) -> Any:
    """Other whole numbers, or other texts, than those of an array of equal ones."""
    if np.asarray(part).dtype.kind in "ui":
        return np.where(part > 0, part - 1, part + 1).astype(part.dtype)
    return np.array(OTHER.get(str(part), f"9{part}"), dtype=object)


def seen(figure: Figure) -> Seen:
    """What a reader sees of a figure, whatever draws it."""
    found: Seen = {}

    def put(panel: str, kind: str, values: Any) -> None:
        flat = np.asarray(values).ravel().tolist()
        found.setdefault(f"{panel}.{kind}", []).extend(flat)

    for panel, axes in zip(PANELS, figure.axes, strict=False):
        for artist in (*axes.lines, *axes.collections, *axes.patches, *axes.texts, *axes.images):
            _of_artist(panel, artist, put)
        _of_axes(panel, axes, put)
    legends = [t for legend in figure.legends for t in (legend.get_title(), *legend.get_texts())]
    texts = [*figure.texts, *legends]
    put("figure", "text", [t.get_text() for t in texts])
    return found


def _points(artist: Any) -> list[Any]:
    """Where an artist is, as arrays (..., 2) in its own coordinates."""
    if isinstance(artist, Line2D):
        return [artist.get_xydata()]
    if isinstance(artist, LineCollection):
        return list(artist.get_segments())
    if isinstance(artist, QuadMesh):
        return [artist.get_coordinates()]
    if isinstance(artist, Collection):
        return [*(path.vertices for path in artist.get_paths()), artist.get_offsets()]
    if isinstance(artist, Annotation):
        # What is tied to another artist, or to the frame, is nowhere by itself.
        tied = isinstance(artist.xycoords, str) and artist.xycoords != "data"
        return [] if tied else [[artist.xy, artist.xyann]]
    if isinstance(artist, Text):
        return [artist.get_position()]
    if isinstance(artist, Patch):
        return [artist.get_patch_transform().transform(artist.get_path().vertices)]
    return [np.reshape(artist.get_extent(), (2, 2)).T]


def _colours(artist: Any) -> list[Any]:
    """The colours of an artist, or the values that a map turns into colours."""
    if isinstance(artist, (Line2D, Text)):
        return [to_hex(artist.get_color())]
    if isinstance(artist, Patch):
        return [to_hex(artist.get_facecolor()), to_hex(artist.get_edgecolor())]
    if artist.get_array() is not None:
        return np.ravel(artist.get_array()).tolist()
    return [str(colour) for colour in artist.get_edgecolor().tolist()]


def _of_artist(panel: str, artist: Any, put: Any) -> None:
    label = str(artist.get_label())
    # A label with a number is itself of the data.
    numbered = any(sign.isdigit() for sign in label)
    name = f" of {label}" if label in _legend(artist.axes) and not numbered else ""
    for points in _points(artist):
        for k, kind in enumerate("xy"):
            put(panel, kind + name, np.asarray(points)[..., k])
    put(panel, "colour", _colours(artist))
    if isinstance(artist, Text):
        put(panel, "text", artist.get_text())


def _legend(axes: Axes) -> list[str]:
    legend = axes.get_legend()
    return [text.get_text() for text in legend.get_texts()] if legend is not None else []


def _of_axes(panel: str, axes: Axes, put: Any) -> None:
    """Titles, names, and those ticks and limits that the drawing has set itself."""
    put(panel, "text", [axes.get_title(loc="left"), axes.get_title(), axes.get_title(loc="right")])
    put(panel, "text", _legend(axes))
    for kind, axis, ends, auto in (
        ("x", axes.xaxis, axes.get_xlim(), axes.get_autoscalex_on()),
        ("y", axes.yaxis, axes.get_ylim(), axes.get_autoscaley_on()),
    ):
        put(panel, "text", axis.get_label_text())
        if isinstance(axis.get_major_locator(), FixedLocator):
            put(panel, f"{kind} ticks", axis.get_majorticklocs())
            put(panel, "text", [label.get_text() for label in axis.get_majorticklabels()])
        if not auto:
            put(panel, f"{kind} window", ends)


def where(drawing: Any, layout: Layout, result: Loaded, told: Mapping[str, str]) -> Any:
    """The names of all axes, and where each of the told datasets is seen: ``a.x= b.colour``.

    What is drawn as it is stored is marked ``=`` where all its values are drawn and ``<`` where
    some are; what only follows from it has no mark. Those that are told to be drawn as they are
    stored, in places of their own, are changed at once and known by their values; and so are all
    that are not told: where they are seen stands under `OTHERS`.
    """
    data = result["data"]

    def drawn(data: Any) -> dict[str, Any]:
        return seen(styled(drawing.draw, {**result, "data": data}))

    def moved(some: Sequence[Place]) -> Iterator[tuple[str, str]]:
        """Where each of some that are changed is seen: what is not told of another one of them."""
        other = _groups(data)
        new = {str(place): changed(other, place) for place in some}
        try:
            after = drawn(other)
        except (ValueError, LookupError):
            yield from dict.fromkeys(new, "refused").items()
            return
        changes = {x for x in {*before, *after} if before.get(x) != written(after.get(x))}
        for name, values in new.items():
            others = set().union(*(_keys(told.get(x, "")) for x in new if x != name))
            keys = sorted(changes - others)
            yield name, ", ".join(key + _mark(values, after.get(key, [])) for key in keys)

    def written(values: Any) -> bytes:
        """Values as bytes, in which NaN is NaN."""
        return marshal.dumps(values, 2)

    figure = styled(drawing.draw, result)
    before = {x: written(values) for x, values in seen(figure).items()}
    rest, groups = list[Place](), list[list[Place]]()
    for place in places(layout, data):
        said = told.get(str(place))
        fits = (x for x in groups if said and all(_apart(said, told[str(y)]) for y in x))
        if said is None:
            rest.append(place)
        elif (group := next(fits, None)) is not None:
            group.append(place)
        else:
            groups.append([place])
    found = dict(each for group in groups for each in moved(group))
    return names_of_axes(figure), {**found, OTHERS: "".join(set(dict(moved(rest)).values()))}


def _groups(tree: Any) -> Any:
    """A copy whose arrays can be exchanged; they themselves are the same."""
    return {x: _groups(y) for x, y in tree.items()} if isinstance(tree, dict) else tree


def _keys(said: str) -> set[str]:
    return {place.rstrip("=<") for place in said.split(", ")}


def _apart(one: str, other: str) -> bool:
    """True if two datasets are told to be drawn as they are stored, and in different places."""
    stored = all(place.endswith("=") for place in f"{one}, {other}".split(", "))
    return stored and _keys(one).isdisjoint(_keys(other))


def _mark(new: Any, drawn: list[Any]) -> str:
    if new.dtype.kind != "f" or not new.size:
        return ""
    known = np.unique(new[np.isfinite(new)])
    there = np.isin(known, np.array([x for x in drawn if isinstance(x, float)]))
    return "=" if there.all() else "<" if there.any() else ""


def names_of_axes(figure: Figure) -> dict[str, list[str]]:
    return {
        panel: [axes.get_xlabel(), axes.get_ylabel()]
        for panel, axes in zip(PANELS, figure.axes, strict=False)
    }
