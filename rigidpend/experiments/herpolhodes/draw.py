"""Fig. 5: alpha(t) over the separatrices of a route, and the spiral (omega_zeta, omega_xi)."""

from collections.abc import Iterator
from itertools import pairwise
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from rigidpend.experiments import plots
from rigidpend.experiments.data import Data, Loaded
from rigidpend.experiments.herpolhodes import ALPHA
from rigidpend.experiments.plots import SEPARATRIX as COLOUR
from rigidpend.machine.wording import Column, Table
from rigidpend.numbers import Scalar

ROW = 2.75
"""Height of a case, inches."""
STYLE: dict[int, Any] = {1: (0, (4, 1)), 2: "-", 3: (0, (4, 1, 1, 1)), 4: (0, (1.5, 0.8))}
"""Line style of each separatrix."""
PLATEAU, PRECESSION = "black", "0.55"
"""Colours of the predicted plateaus and of theta3."""


def draw(result: Loaded) -> Figure:
    """Draw the cases of a result below each other."""
    cases = result["data"]
    figure = Figure(figsize=(plots.WIDTH, ROW * len(cases) + 0.35))
    figure.set_layout_engine("constrained", w_pad=0.08)
    grid = figure.add_gridspec(len(cases), 2, width_ratios=(1.55, 1))
    letters = iter("abcdefgh")
    for row, case in enumerate(cases.values()):
        angle, spiral = (figure.add_subplot(grid[row, column]) for column in range(2))
        _draw_angle(angle, case)
        _draw_spiral(spiral, case)
        for axes in (angle, spiral):
            said = rf"{next(letters)})  $\theta_2^0 = {float(case['theta2_0']):g}$"
            axes.set_title(said, loc="left")
    figure.legend(handles=_legend(cases), loc="outside lower center", ncols=4, columnspacing=2.0)
    return figure


def _parts(case: Data) -> Iterator[tuple[int, Any]]:
    """Each separatrix of the route with its samples, which end halfway between crossings.

    The next one's first sample is among them, so that no gap is between two lines.
    """
    crossing, t = case["crossing_time"], case["t"]
    bounds = np.concatenate((t[:1], (crossing[:-1] + crossing[1:]) / 2, t[-1:]))
    for i, (start, end) in zip(case["separatrix"], pairwise(bounds), strict=True):
        first, last = np.searchsorted(t, (start, end))
        yield int(i), np.arange(first, min(last + 1, t.size))


def _draw_angle(axes: Axes, case: Data) -> None:
    t = case["t"]
    for i, part in _parts(case):
        axes.plot(t[part], case["alpha"][part], color=COLOUR[i], lw=1.0)
    axes.plot(t, case["theta3"], color=PRECESSION, lw=2.2, zorder=1)
    stays = np.concatenate((t[:1], case["crossing_time"], t[-1:]))
    axes.hlines(case["plateaus"], stays[:-1], stays[1:], PLATEAU, "--", lw=0.8)
    low, high = case["alpha"].min(), case["alpha"].max()
    # Room for the numbers above the curve.
    axes.set_ylim(low - 0.05 * (high - low), high + 0.16 * (high - low))
    # The separatrices are numbered at the crossings of J1 = J2/2.
    for i, time in zip(case["separatrix"], case["crossing_time"], strict=True):
        axes.axvline(time, color="0.85", lw=0.6, zorder=0)
        colour, place = COLOUR[int(i)], axes.get_xaxis_transform()
        ring = {"boxstyle": "circle,pad=0.15", "fc": "white", "ec": colour, "lw": 0.8}
        look: Any = {"color": colour, "bbox": ring, "weight": "bold", "ha": "center", "va": "top"}
        plots.beside(axes, str(i), (time, 1.0), 0, -3, xycoords=place, **look)
    axes.set(xlim=(t[0], t[-1]), xlabel="$t'$ (dimensionless)", ylabel=plots.axis_label(ALPHA))


def _draw_spiral(axes: Axes, case: Data) -> None:
    first, last = case["wound"]
    omega = case["omega"]
    for i, k in _parts(case):
        k = k[(k >= first) & (k <= last)]
        if k.size > 1:
            x, y = omega[k, 2], omega[k, 0]
            axes.plot(x, y, color=COLOUR[i], ls=STYLE[i], lw=0.9)
            _arrows(axes, x, y, COLOUR[i])
    _ends(axes, case)
    plots.label_hodograph(axes)


def _ends(axes: Axes, case: Data) -> None:
    """Mark and name the vertices between which the curve runs."""
    first, last = case["wound"]
    passed = int((case["crossing_time"] < case["t"][last]).sum())
    # The route names the vertices at which each separatrix begins and ends.
    names = case["route"].split("-")
    outward = 1 if case["omega"][last, 2] > case["omega"][first, 2] else -1
    for k, name, marker, side in (
        (first, names[0], "o", -outward),
        (last, names[2 * passed - 1], "s", outward),
    ):
        place = (case["omega"][k, 2], case["omega"][k, 0])
        axes.plot(*place, marker, ms=5, mfc="white", mec="black", zorder=5)
        frame = {"boxstyle": "round,pad=0.15", "fc": "white", "ec": "0.4", "lw": 0.5}
        look: Any = {"ha": "center", "va": "center", "bbox": frame, "zorder": 6}
        line = {"arrowstyle": "-", "lw": 0.5}
        said = f"${name.replace('*', '^*')}$"
        plots.beside(axes, said, place, 12 * side, -14, arrowprops=line, **look)


def _arrows(axes: Axes, x: Scalar, y: Scalar, colour: str) -> None:
    """Draw arrow heads in the direction of time, where the curve is wide."""
    length = np.hypot(np.diff(x), np.diff(y))
    far = np.flatnonzero(length > 0.5 * length.max())
    for k in far[len(far) // 8 :: max(1, len(far) // 4)]:
        ends = (x[k], y[k]), (x[k + 1], y[k + 1])
        plots.arrow(axes, *ends, color=colour, lw=0.8, mutation_scale=8)


def _legend(cases: Data) -> list[Line2D]:
    shown = sorted({int(i) for case in cases.values() for i in case["separatrix"]})
    return [
        *(plots.entry(f"separatrix {i}", color=COLOUR[i], ls=STYLE[i]) for i in shown),
        plots.entry(r"$\theta_3$", color=PRECESSION, lw=2.2),
        plots.entry("predicted plateau", color=PLATEAU, ls="--", lw=0.8),
        plots.entry("start", color="black", marker="o", mfc="white", ls=""),
        plots.entry("end", color="black", marker="s", mfc="white", ls=""),
    ]


CAPTION = (
    "The angle of precession stays at a plateau, swings as the orbit goes along a separatrix, and"
    " goes on to the next plateau, as (tri1) predicts for a small weight. Beside it the curve of"
    " the angular velocity in a horizontal plane."
)

FIGURE = "5"
"""Figure of the paper to which the printed values belong."""
ROUTES = {
    1.02: "2-2*-1*-1-4-4*-3*-3-4-4*-1*-1",
    1.83: "2-2*-3*-3-4-4*-1*-1-2-2*-1*-1",
}
"""Routes that the paper prints, by theta2_0."""
INCREMENT = "0.057715"
"""Increment of theta3 along separatrices 1 and 2, as the paper prints it."""


def tables(result: Loaded) -> list[Table]:
    """Tables of routes and plateaus, printed values where the paper has the case."""
    cases = list(result["data"].values())
    # The paper's phases serve as keys: rounded to doubles they equal those of the config.
    published = ROUTES if result["attributes"].get("figure") == FIGURE else {}
    phases = [float(case["theta2_0"]) for case in cases]
    phase = Column("theta2_0", phases, "g")
    told = ["all symbols" if case["certain"].all() else "not all symbols" for case in cases]
    # Rounded first and added to 0.0, so that no zero has a minus sign.
    levels = [", ".join(f"{round(x, 4) + 0.0:.4f}" for x in case["plateaus"]) for case in cases]
    gains = [case["plateaus"][1] - case["plateaus"][0] for case in cases]
    return [
        Table.of(
            "Routes through the heteroclinic cycle",
            [
                phase,
                Column("printed", [published.get(x, "") for x in phases]),
                Column("computed", [case["route"] for case in cases]),
                Column("certain", told),
                Column("bits", [int(case["bits"]) for case in cases]),
            ],
        ),
        Table.of(
            "Plateaus of theta3 by (tri1), in radians",
            [
                phase,
                Column("plateaus", levels),
                Column("increment printed", [INCREMENT * (x in published) for x in phases]),
                Column("computed", gains, ".6f"),
            ],
        ),
    ]
