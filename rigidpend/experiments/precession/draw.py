"""Increments of theta3 along the separatrices: the orders of (trieq), the remainders of (tri1)."""

from itertools import cycle
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from rigidpend.experiments import plots
from rigidpend.experiments.data import Data, Loaded
from rigidpend.experiments.shared import MU_OVER_H0
from rigidpend.machine.wording import Column, Table
from rigidpend.numbers import Array

MARKERS = "osD^"
"""Markers of the separatrices 1, 2, 3, 4."""
BODIES: list[dict[str, Any]] = [
    {"color": colour, "ls": style, "marker": marker, "ms": 3.5, "mfc": "none", "lw": 1.0}
    for colour, style, marker in (
        (plots.BLUE, "-", "o"),
        (plots.ORANGE, (0, (5, 1)), "s"),
        (plots.RED, (0, (3, 1, 1, 1)), "^"),
        (plots.GREEN, (0, (1, 1)), "D"),
        (plots.PINK, (0, (6, 1, 1, 1, 1, 1)), "v"),
        ("black", "-", "x"),
    )
]
"""Looks of the bodies, in turn."""
FIRST: dict[str, Any] = {"color": "black", "mfc": "none", "ms": 9, "mew": 0.7, "lw": 0}
GAINED: dict[str, Any] = {"ms": 4.5, "lw": 0}
"""Looks of the first order's marks and of those of the full dynamics."""
REST = (
    ("remainder", 1, 2, "separatrices 2 and 4"),
    ("remainder", 0, 2, "separatrices 1 and 3"),
    ("mean_remainder", 1, 3, "2 and 4, mean of the two orbits"),
)
"""Panels of the remainders: field, separatrix counted from 0, power of mu, title."""


def draw(result: Loaded) -> Figure:
    """Draw the increments of every body, and their remainders against mu."""
    data = result["data"]
    figure = Figure(figsize=(plots.WIDTH, 5.4))
    figure.set_layout_engine("constrained", w_pad=0.05, h_pad=0.06, hspace=0.05)
    rows: Any = figure.subfigures(2, 1, height_ratios=(1.12, 1))
    above, below = rows
    _draw_orders(above.subplots(), data)
    panels = below.subplots(1, 3, sharey=True)
    for axes, letter, (field, separatrix, slope, text) in zip(panels, "bcd", REST, strict=True):
        _draw_remainder(axes, data, field, separatrix, slope)
        plots.title(axes, letter, text, size=8)
    panels[0].set_ylabel(r"$|\Delta\theta_3 -$ (tri1)$|$ (rad)")
    looks = zip(data["bodies"]["name"], cycle(BODIES), strict=False)
    entries = [plots.entry(f"{name})", **look) for name, look in looks]
    entries.append(plots.entry("guide", color="black", lw=0.7))
    figure.legend(handles=entries, loc="outside lower center", ncols=6, columnspacing=1.6)
    return figure


def _draw_orders(axes: Axes, data: Data) -> None:
    """Draw the increments in units of the largest, body beside body."""
    bodies, drawn = data["bodies"], int(data["drawn"])
    unit = bodies["unit"][:, drawn]
    first = bodies["first_order"][:, drawn] / unit[:, None]
    gained = bodies["gained"][:, drawn] / unit[:, None, None]
    for row in range(len(unit)):
        if np.isnan(gained[row]).any():
            axes.text(row, 0, "\N{MULTIPLICATION SIGN}", ha="center", va="center", fontsize=30)
        axes.hlines(first[row], row - 0.36, row + 0.36, color="0.75", lw=0.8, zorder=0)
        for k, (colour, marker) in enumerate(zip(plots.SEPARATRIX.values(), MARKERS, strict=True)):
            x, y = row + 0.18 * (k - 1.5), first[row, k]
            axes.plot(x, y, marker=marker, **FIRST)
            axes.plot([x, x], gained[row, :, k], marker=marker, color=colour, **GAINED)
            side: Any = {"ha": "center", "va": "center", "weight": "bold", "fontsize": 8}
            ends = y, *gained[row, :, k]
            far, above = (np.nanmax(ends), 11) if y >= 0 else (np.nanmin(ends), -11)
            plots.beside(axes, str(k + 1), (x, far), 0, above, color=colour, **side)
        if row:
            axes.axvline(row - 0.5, color="0.85", lw=0.6)
    axes.axhline(0, color="0.4", lw=0.7, zorder=0)
    axes.set_xlim(-0.5, len(unit) - 0.5)
    # In these units increments are within +-1; the rest is room for the numbers.
    axes.set_ylim(-1.45, 1.45)
    names = [_about(bodies, row) for row in range(len(unit))]
    look: Any = {"linespacing": 1.5}
    # More texts than these are wider than their columns: the names alone stand upright.
    if len(names) > len(BODIES) - 1:
        names, look = list(bodies["name"]), {"rotation": 90}
    axes.set_xticks(range(len(unit)), names, **look)
    axes.tick_params(axis="x", length=0)
    axes.set_ylabel(r"$\Delta\theta_3$ / $(\mu\pi\varkappa/h_0\sin\alpha_0)$")
    ratio = rf"$\mu/h_0 = {plots.power(data['mu_over_h0'][drawn])}$"
    plots.title(axes, "a", f"increments along separatrices 1 to 4, {ratio}")
    handles = [
        plots.entry("(tri1), first order", marker="s", **FIRST),
        plots.entry("full dynamics, two orbits each", marker="s", color=plots.BLUE, **GAINED),
    ]
    plots.legend_above(axes, handles, ncols=2)


def _about(bodies: Data, row: int) -> str:
    """Text below a body's column: its regime, angles and order."""
    order = str(bodies["regime"][row]).replace(" ", "").replace("=", " = ").replace(">", " > ")
    angles = rf"$\alpha_0 = {bodies['alpha0'][row]:.2f}$, $\beta_0 = {bodies['beta0'][row]:.2f}$"
    return f"{bodies['name'][row]})  {order}\n{angles}"


def _draw_remainder(axes: Axes, data: Data, field: str, separatrix: int, slope: int) -> None:
    bodies, ratios = data["bodies"], data["mu_over_h0"]
    values = bodies[field][..., separatrix]
    # A config may have 26 bodies, more than there are looks: these come again.
    for one, look in zip(values, cycle(BODIES), strict=False):
        axes.loglog(ratios, one, **look)
    found = np.isfinite(values)
    if not found.any():
        plots.say_nothing_found(axes, "no orbits are found")
        return
    low, high = ratios[0], ratios[found.any(axis=0)][-1]
    # The guide line is above the ends of the curves: only its slope has a meaning.
    ends = [(ratios[k][-1], one[k][-1]) for one, k in zip(values, found, strict=True) if k.any()]
    guide = 4 * max(y * (high / x) ** slope for x, y in ends)
    guide = guide * (np.array([low, high]) / high) ** slope
    axes.plot([low, high], guide, color="black", lw=0.7)
    # Over few weights the guide passes there, and the words interrupt it.
    around: Any = {"facecolor": "white", "edgecolor": "none", "pad": 1}
    axes.text(0.06, 0.94, f"slope {slope}", transform=axes.transAxes, va="top", bbox=around)
    plots.logarithmic_ticks(axes, ratios)
    axes.set_xlabel(plots.axis_label(MU_OVER_H0))
    # The curves of bodies whose increment is zero show rounding only.
    found = np.isfinite(bodies["error"])
    gone = (np.abs(bodies["first_order"][..., separatrix]) <= bodies["error"]) | ~found
    gone = gone.all(axis=1) & found.any(axis=1)
    if gone.any():
        names = ", ".join(bodies["name"][gone])
        said = f"{names}) no increment: rounding"
        axes.text(0.5, 0.3, said, transform=axes.transAxes, ha="center", fontsize=7.5)


CAPTION = (
    "The gain of theta3 along a separatrix (filled marks) is close to the first order (tri1) (open"
    " marks), which has the order of (trieq), if the weight is small. What the first order leaves"
    " out falls as mu^2 along each orbit, and as mu^3 in the mean of the two. A body on which the"
    " weight acts so strongly that no such orbits were found is crossed out."
)


def tables(result: Loaded) -> list[Table]:
    """Table of the drawn weight, and one of the slopes."""
    data = result["data"]
    bodies, drawn = data["bodies"], int(data["drawn"])
    name = Column("body", bodies["name"])
    # Adding 0.0 removes the sign of a negative zero.
    gained = bodies["gained"].mean(axis=2)[:, drawn].T + 0.0
    pairs = list(zip(gained, bodies["first_order"][:, drawn].T + 0.0, strict=True))
    both = [
        [
            f"{'not found' if np.isnan(x) else f'{x:.6f}'} ({y:.6f})"
            for x, y in zip(*pair, strict=True)
        ]
        for pair in pairs
    ]
    ordered = np.count_nonzero(bodies["ordered"]), np.count_nonzero(np.isfinite(bodies["error"]))
    return [
        Table.of(
            f"Increments of theta3 in radians at mu = {float(data['mu_over_h0'][drawn]):g} h0,"
            " mean of two orbits, with (tri1) in brackets",
            [name, *(Column(f"separatrix {k}", values) for k, values in enumerate(both, 1))],
        ),
        Table.of(
            "Powers of mu by which the rest falls",
            [
                name,
                Column("order of the separatrices by (trieq)", bodies["regime"]),
                Column("of an orbit", map(_range, bodies["slope"])),
                Column("of the mean", map(_range, bodies["mean_slope"])),
            ],
            f"The order is that of (trieq) in {ordered[0]} of {ordered[1]} cases of body and"
            f" mu; in {bodies['error'].size - ordered[1]} no orbits were found.",
        ),
    ]


def _range(slopes: Array) -> str:
    """Least and largest of some slopes, without NaN, for which too few weights are known."""
    known = slopes[np.isfinite(slopes)]
    return f"{known.min():.3f} to {known.max():.3f}" if known.size else "not fitted"
