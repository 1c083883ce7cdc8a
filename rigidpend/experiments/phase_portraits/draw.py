"""Fig. 1: the Euler case on the sphere of M, hidden parts lighter, and in (theta1, J1/J2)."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from rigidpend.experiments.data.tree import Data, Loaded
from rigidpend.experiments.phase_portraits.curves import (
    FALLING,
    ORBITS,
    RISING,
    Curve,
    CurveLook,
    all_curves,
)
from rigidpend.experiments.plots import separatrix_ticks
from rigidpend.experiments.plots.palette import WIDTH
from rigidpend.experiments.plots.panels import entry
from rigidpend.numbers.generic import Scalar

HEIGHT = 3.3
"""Height of the figure, inches."""
SPHERE, PLANE = (0.02, 0.10, 0.43, 0.86), (0.515, 0.305, 0.432, 0.565)
"""Left, bottom, width and height of the panels, in parts of the figure."""
ARROW = {"arrowstyle": "-|>", "shrinkA": 0, "shrinkB": 0}
"""Arrows that end at their points."""


def draw(result: Loaded) -> Figure:
    """Draw both phase portraits of a result."""
    data = result["data"]
    figure = Figure(figsize=(WIDTH, HEIGHT))
    _draw_sphere(figure.add_axes(SPHERE), data)
    _draw_plane(figure.add_axes(PLANE), data)
    for x, name in ((SPHERE[0], "a"), (PLANE[0], "b")):
        figure.text(x, 0.94, name, style="italic", fontsize=9)
    looks = (RISING, FALLING, *ORBITS.values())
    handles = [entry(look.label, **look.line) for look in looks]
    figure.legend(handles=handles, loc="lower center", ncols=4, handlelength=2.2, columnspacing=1.4)
    return figure


def _draw_sphere(axes: Axes, data: Data) -> None:
    axes.set_aspect("equal")
    axes.set_axis_off()
    axes.plot(*data["sphere"]["outline"], color="0.35", lw=0.8, label="outline", zorder=3)
    for curve in all_curves(data):
        x, y, _ = curve.projected
        look, seen = curve.look, curve.visible
        # NaN breaks a line: each curve is drawn twice, its hidden parts paler and below.
        hidden, said = np.where(seen, np.nan, x), f"{curve.name}, hidden"
        axes.plot(hidden, y, color=look.pale, lw=0.7 * look.width, label=said)
        axes.plot(np.where(seen, x, np.nan), y, **look.line, label=curve.name, zorder=4)
        _draw_arrows(axes, x, y, curve.arrows[seen[curve.arrows]], look)
        if curve.name != "orbit":
            _name_separatrix(axes, curve)
    _draw_centres(axes, data["centres"])
    _draw_axes(axes, data["sphere"])
    # More room to the right and above, where the names of the axes are.
    axes.set(xlim=(-1.12, 1.5), ylim=(-1.05, 1.52))


def _name_separatrix(axes: Axes, curve: Curve) -> None:
    """Write the number at the middle of a separatrix, pale where that is hidden."""
    middle = len(curve.visible) // 2
    seen, (x, y, _) = curve.visible[middle], curve.projected[:, middle]
    axes.text(
        x,
        y,
        curve.name.removeprefix("separatrix "),
        color=curve.look.colour if seen else curve.look.pale,
        weight="bold",
        ha="center",
        va="center",
        bbox={"boxstyle": "circle,pad=0.1", "fc": "white", "lw": 0},
        zorder=5 if seen else 2.5,
    )


def _draw_centres(axes: Axes, centres: Any) -> None:
    x, y, _ = centres["projected"]
    for seen, colour in ((False, "0.75"), (True, "black")):
        mask = centres["visible"] == seen
        axes.plot(x[mask], y[mask], "o", ms=2.5, color=colour, zorder=4 + seen, label="centres")


def _draw_axes(axes: Axes, sphere: Any) -> None:
    """Draw the axes outside the sphere; those away from the viewer lie behind it."""
    for i in range(3):
        foot, tip = sphere["axis_feet"][:, i], sphere["axis_tips"][:2, i]
        arrow: dict[str, Any] = {**ARROW, "lw": 0.9, "color": "black"}
        note = axes.annotate("", tip, foot[:2], arrowprops=arrow, annotation_clip=False)
        note.set_zorder(6 if foot[2] >= 0 else 0)
        # The name stands on the far side of the tip, away from the arrow.
        side = ("left" if tip[0] > foot[0] else "right", "bottom" if tip[1] > foot[1] else "top")
        text = axes.text(tip[0], tip[1], f"$M_{i + 1}$", ha=side[0], va=side[1], fontsize=9)
        text.set(zorder=6, bbox={"boxstyle": "square,pad=0.05", "fc": "white", "lw": 0})


def _draw_plane(axes: Axes, data: Data) -> None:
    plane, curves = data["plane"], all_curves(data)
    for curve in (c for c in curves if c.name == "orbit"):
        axes.plot(curve.theta1, curve.J1, **curve.look.line, label="orbit")
        _draw_arrows(axes, curve.theta1, curve.J1, curve.arrows, curve.look)
    named = {curve.name: curve for curve in curves}
    for x, number in zip(plane["separatrix_theta1"], plane["separatrix"], strict=True):
        _draw_segment(axes, x, named[f"separatrix {number}"], str(number))
    centres = data["centres"]
    axes.plot(centres["theta1"], centres["J1"], "o", ms=2.5, color="black", label="centres")
    separatrix_ticks.put(axes, plane["separatrix_theta1"], digits=3)
    axes.set_ylim(0, 1)
    axes.set_yticks([0, 0.5, 1])
    axes.set_xlabel(r"$\theta_1$ (rad, modulo $4\pi$)", labelpad=3)
    axes.set_ylabel(r"$J_1/J_2$", labelpad=1)


def _draw_segment(axes: Axes, theta1: float, curve: Curve, number: str) -> None:
    """Draw a separatrix at its place, or 4 pi further."""
    look, x = curve.look, np.full_like(curve.J1, theta1)
    # The outer ones lie on the edges, which would cut off half of their width.
    axes.plot(x, curve.J1, **look.line, label=curve.name, clip_on=False, zorder=4)
    _draw_arrows(axes, x, curve.J1, curve.arrows, look)
    above: dict[str, Any] = {"xytext": (0, 3), "textcoords": "offset points", "ha": "center"}
    axes.annotate(number, (theta1, 1), **above, color=look.colour, weight="bold")


def _draw_arrows(axes: Axes, x: Scalar, y: Scalar, indices: Any, look: CurveLook) -> None:
    """Draw arrow heads that point from each marked point to the next."""
    for i in indices:
        head: dict[str, Any] = {**ARROW, "color": look.colour, "lw": 0}
        head["mutation_scale"] = 6 + 3 * look.width
        ends = (x[i + 1], y[i + 1]), (x[i], y[i])
        axes.annotate("", *ends, arrowprops=head, annotation_clip=False, zorder=5)
