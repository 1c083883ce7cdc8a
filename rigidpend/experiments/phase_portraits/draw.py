"""Fig. 1: the Euler case on the sphere of M, hidden parts lighter, and in (theta1, J1/J2)."""

from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from rigidpend.experiments import plots
from rigidpend.experiments.data import Data, Loaded
from rigidpend.machine.wording import Column, Table
from rigidpend.numbers import Scalar

SPHERE, PLANE = (0.02, 0.10, 0.43, 0.86), (0.515, 0.305, 0.432, 0.565)
"""Left, bottom, width and height of the panels, in parts of the figure."""
NAME = 0.2
"""Room for the name of an axis beyond its tip, in units of |M|."""
PALE = {plots.PINK: "#EFD6E4", plots.GREEN: "#B3DDD0", plots.BLUE: "#A3CBE3", plots.RED: "#F1C09C"}
"""Colour of the hidden part of a line, by the colour of the line."""
ORBITS: dict[int, dict[str, Any]] = {
    1: {"color": plots.PINK, "lw": 0.9, "label": r"orbits around $\pm M_1$"},
    2: {"color": plots.GREEN, "lw": 0.9, "label": r"orbits around $\pm M_2$"},
}
"""Looks of the orbits by the axis that they encircle."""
RISING: dict[str, Any] = {"color": plots.BLUE, "lw": 2.2, "label": "separatrices 2, 4 (up)"}
FALLING: dict[str, Any] = {"color": plots.RED, "lw": 1.8, "label": "separatrices 1, 3 (down)"}
FALLING |= {"ls": (0, (4, 1))}


class Curve(NamedTuple):
    """One curve of the result."""

    number: int
    """Number of the separatrix; 0 for an orbit."""
    look: dict[str, Any]
    arrows: Any
    """Indices of the points with an arrow."""
    projected: Any
    visible: Any
    theta1: Any
    J1: Any


def all_curves(data: Data) -> list[Curve]:
    """Cut every orbit from the flat arrays, then the separatrices, which are drawn above."""
    orbits, separatrices = data["orbits"], data["separatrices"]
    # Orbits around one axis look alike.
    looks = [(0, ORBITS[axis]) for axis in orbits["around"].tolist()]
    numbered = [(i, FALLING if i % 2 else RISING) for i in separatrices["number"].tolist()]
    found = []
    for group, each in ((orbits, looks), (separatrices, numbered)):
        for (a, b), (number, look) in zip(pairwise(group["offsets"]), each, strict=True):
            flat = (group[field][..., a:b] for field in Curve._fields[3:])
            arrows = group["arrows"][(group["arrows"] >= a) & (group["arrows"] < b)] - a
            found.append(Curve(number, look, arrows, *flat))
    return found


def draw(result: Loaded) -> Figure:
    """Draw both phase portraits of a result."""
    data = result["data"]
    figure = Figure(figsize=(plots.WIDTH, 3.3))
    _draw_sphere(figure.add_axes(SPHERE), data)
    _draw_plane(figure.add_axes(PLANE), data)
    for x, name in ((SPHERE[0], "a"), (PLANE[0], "b")):
        figure.text(x, 0.94, name, style="italic", fontsize=9)
    handles = [plots.entry(**look) for look in (RISING, FALLING, *ORBITS.values())]
    figure.legend(handles=handles, loc="lower center", ncols=4, handlelength=2.2, columnspacing=1.4)
    return figure


def _draw_sphere(axes: Axes, data: Data) -> None:
    axes.set_aspect("equal")
    axes.set_axis_off()
    axes.plot(*data["sphere"]["outline"], color="0.35", lw=0.8, zorder=3)
    feet, tips = (data["sphere"][f"axis_{end}"][:2] for end in ("feet", "tips"))
    # The middles of what is written: of the axes' names, then of the numbers too.
    written = list((tips + NAME / 2 * np.where(tips > feet, 1, -1)).T)
    for curve in all_curves(data):
        x, y, _ = curve.projected
        look, seen = curve.look, curve.visible
        # NaN breaks a line: each curve is drawn twice, its hidden parts paler and below.
        axes.plot(np.where(seen, np.nan, x), y, color=PALE[look["color"]], lw=0.7 * look["lw"])
        axes.plot(np.where(seen, x, np.nan), y, **look, zorder=4)
        _draw_arrows(axes, x, y, curve.arrows[seen[curve.arrows]], look)
        if curve.number:
            written.append(_name_separatrix(axes, curve, written))
    _draw_centres(axes, data["centres"])
    _draw_axes(axes, data["sphere"])
    # Room for the sphere, and beyond each axis for its name.
    low = np.minimum((-1.12, -1.05), tips.min(axis=1) - NAME)
    high = np.maximum((1.5, 1.52), tips.max(axis=1) + NAME)
    axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]))


def _name_separatrix(axes: Axes, curve: Curve, written: list[Any]) -> Any:
    """Write the number of a separatrix near its middle, apart from what is `written`; its place.

    The colour is pale if that place is hidden.
    """
    off = np.abs(curve.projected[:2, :, None] - np.transpose(written)[:, None])
    near, k = (off.max(axis=0) < NAME).any(axis=1), np.arange(len(curve.visible))
    # Of places that are apart, or of all if none is, the one nearest to the middle.
    at = int(np.argmin(np.abs(k - len(k) // 2) + len(k) * near))
    seen, (x, y, _) = curve.visible[at], curve.projected[:, at]
    own = curve.look["color"]
    colour, order = (own, 5) if seen else (PALE[own], 2.5)
    ring = {"boxstyle": "circle,pad=0.1", "fc": "white", "lw": 0}
    text = axes.text(x, y, str(curve.number), color=colour, ha="center", va="center", zorder=order)
    text.set(weight="bold", bbox=ring)
    return x, y


def _draw_centres(axes: Axes, centres: Any) -> None:
    x, y, _ = centres["projected"]
    for seen, colour in ((False, "0.75"), (True, "black")):
        mask = centres["visible"] == seen
        axes.plot(x[mask], y[mask], "o", ms=2.5, color=colour, zorder=4 + seen)


def _draw_axes(axes: Axes, sphere: Any) -> None:
    """Draw the axes outside the sphere; those away from the viewer lie behind it."""
    for i in range(3):
        foot, tip = sphere["axis_feet"][:, i], sphere["axis_tips"][:2, i]
        drawn = plots.arrow(axes, foot[:2], tip, lw=0.9, color="black", shrinkA=0, shrinkB=0)
        drawn.set_zorder(6 if foot[2] >= 0 else 0)
        # The name goes beyond the tip, away from the arrow.
        side = ("left" if tip[0] > foot[0] else "right", "bottom" if tip[1] > foot[1] else "top")
        text = axes.text(tip[0], tip[1], f"$M_{i + 1}$", ha=side[0], va=side[1], fontsize=9)
        text.set(zorder=6, bbox={"boxstyle": "square,pad=0.05", "fc": "white", "lw": 0})


def _draw_plane(axes: Axes, data: Data) -> None:
    plane, curves = data["plane"], all_curves(data)
    for curve in (c for c in curves if not c.number):
        axes.plot(curve.theta1, curve.J1, **curve.look)
        _draw_arrows(axes, curve.theta1, curve.J1, curve.arrows, curve.look)
    places, numbers = plane["separatrix_theta1"], plane["separatrix"]
    plots.separatrix_ticks(axes, places, digits=3)
    numbered = {curve.number: curve for curve in curves}
    for x, number, label in zip(places, numbers, axes.get_xticklabels(), strict=True):
        # Set apart where the labels below are.
        _draw_segment(axes, x, numbered[int(number)], label.get_horizontalalignment())
    centres = data["centres"]
    axes.plot(centres["theta1"], centres["J1"], "o", ms=2.5, color="black")
    axes.set_ylim(0, 1)
    axes.set_yticks([0, 0.5, 1])
    axes.set_ylabel(r"$J_1/J_2$", labelpad=1)


def _draw_segment(axes: Axes, theta1: float, curve: Curve, side: str) -> None:
    """Draw a separatrix at its place, or 4 pi further, with its number above."""
    look, x = curve.look, np.full_like(curve.J1, theta1)
    # The outer ones lie on the edges of the panel; clipping would halve their width.
    axes.plot(x, curve.J1, **look, clip_on=False, zorder=4)
    _draw_arrows(axes, x, curve.J1, curve.arrows, look)
    said: dict[str, Any] = {"ha": side, "color": look["color"], "weight": "bold"}
    # Side by side at one place, 1 and 2 would read as one number.
    off = plots.APART if side == "left" else 0
    plots.beside(axes, str(curve.number), (theta1, 1), off, 3, **said)


def _draw_arrows(axes: Axes, x: Scalar, y: Scalar, indices: Any, look: Any) -> None:
    """Draw arrow heads that point from each marked point to the next."""
    colour, size = look["color"], 6 + 3 * look["lw"]
    head: dict[str, Any] = {"color": colour, "lw": 0, "mutation_scale": size}
    for i in indices:
        ends = (x[i], y[i]), (x[i + 1], y[i + 1])
        plots.arrow(axes, *ends, shrinkA=0, shrinkB=0, **head).set_zorder(5)


CAPTION = (
    "Without weight the angular momentum goes around two of the body's axes on closed curves;"
    " between these lie the separatrices 1 to 4, which join the two rotations about the middle"
    " axis. On the left on the sphere of the angular momentum, on the right in the plane of theta1"
    " and J1/J2. Closed forms; nothing is integrated."
)


def tables(result: Loaded) -> list[Table]:
    """Table of the orbits by height, and a table of the separatrices."""
    orbits, separatrices = result["data"]["orbits"], result["data"]["separatrices"]
    kinds = np.stack((orbits["around"], orbits["height"]))
    (around, heights), first, counts = np.unique(
        kinds, axis=1, return_index=True, return_counts=True
    )
    begins = separatrices["offsets"][:-1]
    spread = float(np.abs(separatrices["level"]).max())
    return [
        Table.of(
            "Orbits, with their dimensionless energy H/J2^2 at J3 = 0",
            [
                Column("around", [f"M{axis:.0f}" for axis in around]),
                Column("largest |M3|/|M|", heights, "g"),
                Column("orbits", counts),
                Column("H/J2^2", orbits["energy"][first], ".10g"),
                Column("above the separatrices", orbits["level"][first], ".10g"),
            ],
        ),
        Table.of(
            "Separatrices",
            [
                Column("number", separatrices["number"]),
                Column("theta1 (rad)", separatrices["theta1"][begins], ".10f"),
                Column("H/J2^2", separatrices["energy"], ".10g"),
            ],
            f"The integral that is 0 on a separatrix is at most {spread:.1g} J2^2 halfway.",
        ),
    ]
