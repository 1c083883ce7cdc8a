"""The surfaces of Fig. 3: S2+ above, S1- below, a column for each body."""

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure

from rigidpend.experiments import plots
from rigidpend.experiments.asymptotic_surfaces import CURVES
from rigidpend.experiments.data import Data, Loaded
from rigidpend.machine.wording import Column, Table

COLUMN, ROW = 0.87, 2.35
"""Largest width and the height of a panel, inches."""
LEFT, RIGHT, BELOW, ABOVE, BETWEEN, APART = 0.62, 0.1, 0.72, 0.42, 0.08, 0.13
"""Margins around the panels, between columns and between rows, inches."""
ACROSS = 7
"""Largest number of bodies side by side; further ones stand below."""
COLOURS = {"S2_plus": plots.BLUE, "S1_minus": plots.RED}
NAMES = {"S2_plus": "$S_2^{+}$", "S1_minus": "$S_1^{-}$"}
"""The surfaces from top to bottom, as the paper writes them."""
SMALL = 1e-3
"""Swing Delta_1, radians, of which five digits after the point show at least a hundredth."""
NARROW = 1.5
"""Half width of a window, in Delta_1, below which ticks at its swing are near its edges."""
LONG = 11
"""Number of letters for which a panel has room. Below the figure longer names stand whole."""
BORN: Any = (0, (4, 3))
"""Line style for the swing Delta_1 of the periodic orbits from which surfaces begin."""
THIN = 0.28
"""Line width of an orbit, points."""


def draw(result: Loaded) -> Figure:
    """Draw both surfaces of every body, all panels of one height."""
    bodies, nu = result["data"]["bodies"], result["data"]["table"]["nu"]
    n, blocks = min(len(bodies), ACROSS), -(-len(bodies) // ACROSS)
    column = min(COLUMN, (plots.WIDTH - LEFT - RIGHT - BETWEEN * (n - 1)) / n)
    # A single column would be too narrow for the legend.
    filled = LEFT + RIGHT + n * column + (n - 1) * BETWEEN
    wide = max(filled, plots.WIDTH / 2)
    pitch = BELOW + ABOVE + 2 * ROW + APART
    figure = Figure(figsize=(wide, blocks * pitch))
    for number, (name, body) in enumerate(bodies.items()):
        block, k = divmod(number, ACROSS)
        under = (blocks - 1 - block) * pitch + BELOW
        for row, surface in enumerate(NAMES):
            left = LEFT + (wide - filled) / 2 + k * (column + BETWEEN)
            bottom = under + (1 - row) * (ROW + APART)
            axes = plots.panel(figure, left, bottom, column, ROW)
            _draw_surface(axes, body, surface)
            axes.tick_params(labelleft=k == 0, labelbottom=row == 1)
            if k == 0:
                axes.set_ylabel(plots.axis_label(CURVES[surface]["J1_over_J2"]), labelpad=2)
                look: Any = {"color": COLOURS[surface], "fontsize": 11, "ha": "center"}
                axes.text(-0.44, 0.75, NAMES[surface], transform=axes.transAxes, **look)
        # The last two panels are this column: title above the upper, axis below the lower.
        figure.axes[-2].set_title(_title(name, nu[number]), fontsize=8)
        figure.axes[-1].set_xlabel(_about(body), fontsize=7, labelpad=3, linespacing=1.5)
    entries = [plots.entry(f"orbits on {NAMES[name]}", color=COLOURS[name]) for name in NAMES]
    entries.append(plots.entry(r"$\alpha_0 + \beta_0 \pm \Delta_1$", color="0.35", ls=BORN, lw=0.8))
    figure.legend(handles=entries, loc="lower center", ncols=3, borderaxespad=0.1)
    return figure


def _title(name: str, nu: float) -> str:
    if len(name) > LONG:
        name = name[: LONG - 4] + r"\ldots " + name[-3:]
    # matplotlib's mathematics would read an underscore as a subscript.
    return rf"$\it{{{name}}}$".replace("_", r"\_") + "\n" + rf"$\nu = {nu:.2f}$"


def _about(body: Data) -> str:
    """Origin and unit of the ticks of theta1."""
    # There is no room for an origin in so many digits that a small unit asks for.
    origin, unit = r"\alpha_0 - \beta_0$", plots.power(body["Delta_1"])
    if body["Delta_1"] >= SMALL:
        origin, unit = f"{body['centre']:.4f}$ rad", f"{body['Delta_1']:.5f}"
    return rf"$\theta_1 - {origin}" + "\n" + rf"$\Delta_1 = {unit}$ rad"


def _draw_surface(axes: Axes, body: Data, surface: str) -> None:
    curves = body[surface]
    points = np.column_stack((curves["theta1"], curves["J1_over_J2"]))
    lines = np.split(points, np.asarray(curves["offsets"])[1:-1])
    drawn = LineCollection(lines, colors=COLOURS[surface], linewidths=THIN)
    axes.add_collection(drawn, autolim=False)
    for edge in body["born"]:
        axes.axvline(edge, color="0.35", ls=BORN, lw=0.5, zorder=3)
    axes.set_xlim(*map(float, body["window"]))
    # Without a margin the frame would cover curves near the periodic orbits.
    axes.set_ylim(-0.02, 1.02)
    # In a wide window ticks at its swing would be upon each other.
    half = (body["window"][1] - body["centre"]) / body["Delta_1"]
    times = max(1, int(half / 2 + 0.01))
    names = [rf"${sign}{times if times > 1 else ''}\Delta_1$" for sign in ("-", "")]
    axes.set_xticks(
        [body["centre"] + x * times * body["Delta_1"] for x in (-1, 1)], names, fontsize=7
    )
    if half < NARROW:
        # In their middle they would be upon those of the neighbours.
        first, second = axes.get_xticklabels()
        first.set_horizontalalignment("left")
        second.set_horizontalalignment("right")
    axes.set_yticks([0, 0.5, 1], ["0", "0.5", "1"])
    axes.tick_params(length=2)


CAPTION = (
    "With a weight the orbits that leave one rotation (S1-, below) and those that approach the"
    " other (S2+, above) no longer lie on separatrix 2 but sway on both sides of it, for each body"
    " in its own way. In units of Delta_1. Dashed: how far the formula (dt) lets them swing beside"
    " their own orbit."
)

FIGURE = "3"
"""Figure of the paper to which the printed values belong."""
PRINTED = {
    "alpha0": ("2.91891", "2.23654", "1.23096", "1.61146", "1.97724", "0.79020", "0.56207"),
    "gamma0": ("2.46192", "1.95519", "0.92730", "1.34948", "1.77215", "0.57351", "0.40272"),
}
"""Table 1 of the paper, bodies a to g."""


def tables(result: Loaded) -> list[Table]:
    """Table 1, printed values where the paper has the bodies, and the widths Delta_1."""
    table, bodies = result["data"]["table"], result["data"]["bodies"]
    published = result["attributes"].get("figure") == FIGURE
    columns = [Column("body", bodies)]
    for name, printed in PRINTED.items():
        same = published and len(bodies) == len(printed)
        columns += [
            Column(f"{name} printed", printed if same else [""] * len(bodies)),
            Column("computed", table[name], ".7f"),
        ]
    widths = [body["Delta_1"] for body in bodies.values()]
    columns += [Column("nu", table["nu"], ".4f"), Column("Delta_1", widths, ".4g")]
    return [Table.of("Table 1, in radians, with nu and Delta_1 (dt)", columns)]
