"""Fig. 2: the graph of the heteroclinic cycle in the plane (theta1, J1/J2)."""

from itertools import pairwise
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from rigidpend.experiments.data import Loaded
from rigidpend.experiments.plots import BLUE, RED, WIDTH, arrow, beside, entry, separatrix_ticks
from rigidpend.machine.wording import Column, Table
from rigidpend.numbers.texts import NO_SYMBOL

PANEL = (0.085, 0.33, 0.845, 0.57)
"""Left, bottom, width and height of the panel, in parts of the figure."""


LOOKS: dict[int, dict[str, Any]] = {
    NO_SYMBOL: {"color": "black", "ls": "-", "label": "separatrix 1, 3 (down), 2, 4 (up)"},
    0: {"color": BLUE, "ls": "-", "label": "turn to the left, symbol 0"},
    1: {"color": RED, "ls": (0, (4, 1.5)), "label": "turn to the right, symbol 1"},
}
"""Looks of edges by symbol; `NO_SYMBOL` is that of the separatrices."""
NARROW = 1.8
"""Width, in radians, below which the name of a rectangle is written vertically."""
TIGHT = 0.5
"""Distance of separatrices, radians, below which rings around their numbers would overlap."""
RING = 9
"""Points from the middle of a vertex within which its ring lies, with some room."""
SHADES = {"left": "#D6E9F5", "right": "#FBE3D2"}
"""Colours of the rectangles: pale versions of their symbols' colours."""


def draw(result: Loaded) -> Figure:
    """Draw the graph of a result."""
    data = result["data"]
    figure = Figure(figsize=(WIDTH, 3.4))
    axes = figure.add_axes(PANEL)
    _draw_rectangles(axes, data["rectangles"])
    shifts = _shifts(data["vertices"])
    _draw_edges(axes, data["edges"], shifts)
    _draw_vertices(axes, data["vertices"], shifts)
    _name_axes(axes, data["vertices"], shifts)
    handles = [entry(**look, lw=1.8) for look in LOOKS.values()]
    figure.legend(handles=handles, loc="lower center", ncols=3, handlelength=2.6)
    return figure


Shifts = dict[tuple[str, float], int]


def _shifts(vertices: Any) -> Shifts:
    """Points to the right by which vertices are drawn off their theta1, as close pairs are.

    They are told apart by number and theta1: neither alone does, of all.
    """
    low = vertices["J1"] == 0
    places = list(zip(vertices["label"][low], vertices["theta1"][low].tolist(), strict=True))
    shifts = dict.fromkeys(places, 0)
    for left, right in pairwise(places):
        if right[1] - left[1] < TIGHT:
            shifts[left], shifts[right] = -RING, RING
    return shifts


def _draw_rectangles(axes: Axes, rectangles: Any) -> None:
    for name, bounds in zip(rectangles["name"], rectangles["theta1"].T, strict=True):
        patch = axes.axvspan(*bounds, color=SHADES[name], lw=0, zorder=0)
        width, side = bounds[1] - bounds[0], -1 if name == "left" else 1
        # The name of a rectangle with no room for it stands beside it, off the other rectangle.
        x, off = ((1 + side) / 2, side * RING) if width < TIGHT else (0.5, 0)
        angle = 90 if width < NARROW else 0
        place: dict[str, Any] = {"xycoords": patch, "ha": "center", "va": "center"}
        beside(axes, f"{name} rectangle", (x, 0.5), off, 0, **place, rotation=angle, style="italic")


def _draw_edges(axes: Axes, edges: Any, shifts: Shifts) -> None:
    for k, symbol in enumerate(map(int, edges["symbol"])):
        look = LOOKS[symbol]
        start, end = zip(edges["theta1"][:, k], edges["J1"][:, k], strict=True)
        colour = "0.6" if edges["again"][k] else look["color"]
        # The ends of the arrow leave room for the vertices, wherever these are drawn.
        ahead = int(np.sign(end[0] - start[0]))
        path = arrow(
            axes, start, end, arrowstyle="-|>,head_width=0.3,head_length=0.6", lw=1.8,
            mutation_scale=12, color=colour, ls=look["ls"],
            shrinkA=RING + ahead * shifts[edges["from"][k][0], start[0]],
            shrinkB=RING - ahead * shifts[edges["to"][k][0], end[0]],
        )  # fmt: skip
        if symbol != NO_SYMBOL:
            # Outside the graph, at the middle of the arrow.
            side, va = (6, "bottom") if start[1] else (-6, "top")
            written: Any = {"ha": "center", "va": va, "color": look["color"], "weight": "bold"}
            beside(axes, str(symbol), (0.5, 0.5), 0, side, xycoords=path.arrow_patch, **written)


def _draw_vertices(axes: Axes, vertices: Any, shifts: Shifts) -> None:
    rows = zip(*(vertices[name] for name in ("label", "theta1", "J1", "again")), strict=True)
    for label, x, y, again in rows:
        ring = {"boxstyle": "circle,pad=0.25", "fc": "white", "ec": "0.6" if again else "black"}
        centred: Any = {"ha": "center", "va": "center", "bbox": ring, "zorder": 6}
        text = beside(axes, label, (x, y), shifts[label[0], x], 0, **centred)
        text.set_color("0.45" if again else "black")


def _name_axes(axes: Axes, vertices: Any, shifts: Shifts) -> None:
    places = vertices["theta1"][vertices["J1"] == 0]
    # First, since it would put labels back that are set apart.
    axes.tick_params(axis="x", pad=18, length=0)
    separatrix_ticks(axes, places, digits=4)
    axes.set_ylim(0, 1)
    axes.set_yticks([0, 1], ["$0$", "$1$"])
    axes.tick_params(axis="y", pad=14 - shifts["1", places[0]], length=0)
    axes.set_ylabel("$J_1/J_2$", labelpad=2)
    axes.spines[:].set_visible(False)


CAPTION = (
    "At the end of each separatrix, 1 to 4, a body with a weight turns to the left or to the"
    " right, symbol 0 or 1, and follows the next one: this graph is the alphabet of the route"
    " codes. Its vertices are the two rotations about the middle axis, in the plane of theta1 and"
    " J1/J2."
)


def tables(result: Loaded) -> list[Table]:
    """Table of the separatrices' places, and a table of the turns with their symbols."""
    vertices, edges = result["data"]["vertices"], result["data"]["edges"]
    once = ~vertices["again"]

    def turns(symbol: int) -> str:
        """Edges of a symbol, each once."""
        chosen = np.flatnonzero((edges["symbol"] == symbol) & ~edges["again"])
        return ", ".join(f"{edges['from'][k]} to {edges['to'][k]}" for k in chosen)

    return [
        Table.of(
            "Vertices; starred ones on J1 = J2",
            [
                Column("vertex", vertices["label"][once]),
                Column("theta1 (rad)", vertices["theta1"][once], ".10f"),
                Column("J1/J2", vertices["J1"][once], "g"),
            ],
        ),
        Table(
            "Turns by their symbol",
            ("symbol", "turns"),
            [("0, left", turns(0)), ("1, right", turns(1))],
        ),
    ]
