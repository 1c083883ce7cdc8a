"""Figure of the splitting of S1- and S2+: the range and the errors of Melnikov's formula."""

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch, Rectangle

from rigidpend.experiments import plots
from rigidpend.experiments.data import Data, Loaded
from rigidpend.experiments.shared import MU_OVER_H0
from rigidpend.machine.wording import Column, Table

SHOWN = 0.03
"""Least mu/h0 at which curves are drawn."""
LOOKS: tuple[tuple[str, Any], ...] = (
    (plots.GREEN, (0, (1, 1))),
    (plots.ORANGE, (0, (4, 1, 1, 1))),
    (plots.RED, (0, (4, 1))),
    (plots.BLUE, "-"),
    (plots.PINK, (0, (6, 1, 1, 1, 1, 1))),
)
"""Colour and line of the curves, weight by weight."""
CHOSEN: tuple[dict[str, Any], ...] = tuple(
    {"color": colour, "marker": marker, "ms": 4, "lw": 0.9}
    for colour, marker in ((plots.BLUE, "o"), (plots.RED, "s"), (plots.GREEN, "^"))
)
"""Looks of the highlighted bodies: that of least nu, the drawn one, that of largest nu."""
OTHER: dict[str, Any] = {"color": "0.72", "lw": 0.6}
"""Look of the other bodies."""
WHOLE: dict[str, Any] = {"fillstyle": "full", "ls": "-"}
COSINE: dict[str, Any] = {"fillstyle": "none", "ls": (0, (4, 1.5))}
"""Look of the errors of the cosine, beside those of the whole curve."""
BITS = {53: "#FFFFFF", 64: "#DCEEF8", 106: "#9DCFEB", 113: "#5FB0E0"}
"""Colour of a cell of the table, by the precision that decided."""
PANEL, LETTER, LINE, MOST_NAMES = (210.0, 158.0), 4.4, 9.0, 4
"""Width and height of a panel, width of a letter, height of a line, points; names in a label."""
NARROW = 188.0
"""Width of a panel beside one whose ticks are long names, points."""
LONGEST = 9
"""Letters of a name in a label."""
NONE = "#F2B8A0"
"""Colour of a cell of the table that no precision decided."""


def draw(result: Loaded) -> Figure:
    """Draw the distance of a body, the errors of the formula, its decay, and the precisions."""
    data = result["data"]
    figure = Figure(figsize=(plots.WIDTH, 6.1))
    figure.set_layout_engine("constrained", w_pad=0.06, h_pad=0.07, wspace=0.03, hspace=0.03)
    panels = figure.subplots(2, 2).ravel()
    for axes, drawn, letter in zip(
        panels, (_draw_curve, _draw_error, _draw_decay, _draw_table), "abcd", strict=True
    ):
        plots.title(axes, letter, drawn(axes, data))
    return figure


def _drawn(data: Data) -> int:
    """The place of the body whose distance is drawn."""
    return list(data["bodies"]["name"]).index(data["curve"]["body"])


def _name(bodies: Data, row: int) -> str:
    """Name a body by its nu, and that of Fig. 4 in words."""
    name, nu = bodies["name"][row], bodies["nu"][row]
    escaped = _short(name).replace("_", r"\_").replace("\u2026", r"\ldots ")
    shown = "Fig. 4" if name == "fig4" else rf"$\it{{{escaped}}}$"
    return rf"{shown}, $\nu = {nu:.2f}$"


def _draw_curve(axes: Axes, data: Data) -> str:
    curve, ratios, bodies = data["curve"], data["mu_over_h0"], data["bodies"]
    axes.plot(curve["g"], curve["melnikov"], color="black", lw=2.2, alpha=0.35, label="Melnikov")
    shown = np.flatnonzero((ratios >= SHOWN) & np.isfinite(curve["measured"]).all(axis=1))
    for k, (colour, style) in zip(shown[-len(LOOKS) :], LOOKS, strict=False):
        said = f"${plots.power(ratios[k])}$"
        axes.plot(curve["g"], curve["measured"][k], color=colour, ls=style, lw=1.3, label=said)
    axes.axhline(0, color="0.6", lw=0.5, zorder=0)
    ring: Any = {"ms": 5, "mfc": "white", "mec": "black", "zorder": 4, "label": "heteroclinic"}
    axes.plot([-np.pi / 2, np.pi / 2], [0, 0], "o", **ring)
    axes.set_xlim(-np.pi, np.pi)
    names = [r"$-\pi$", r"$-\pi/2$", "0", r"$\pi/2$", r"$\pi$"]
    axes.set_xticks(np.linspace(-np.pi, np.pi, 5), names)
    axes.set_xlabel(r"phase on the section, $g = \theta_1/2 + \theta_2$ (rad)")
    axes.set_ylabel(r"$\theta_1(S_1^-) - \theta_1(S_2^+)$ in Melnikov's amplitude", fontsize=8.5)
    axes.set_ylim(top=1.32)
    small: Any = {"fontsize": 7, "title_fontsize": 7.5, "labelspacing": 0.25}
    where: Any = {"loc": "upper right", "borderaxespad": 0.2}
    axes.legend(title=plots.axis_label(MU_OVER_H0) if shown.size else None, **where, **small)
    return f"distance on $J_1 = J_2/2$, body {_name(bodies, _drawn(data))}"


def _draw_error(axes: Axes, data: Data) -> str:
    bodies, ratios = data["bodies"], data["mu_over_h0"]
    resolved, title = bodies["resolved"], r"error: $O(\mu)$, of the $\cos g$ part $O(\mu^2)$"
    if not resolved.any():
        plots.say_nothing_found(axes, "no distance is resolved")
        return title
    chosen = dict(zip(_chosen(data), CHOSEN, strict=False))
    # Longer names make the legend wider.
    left = 0.4 if max(len(bodies["name"][row]) for row in chosen) < LONGEST else 0.28
    for values, place, said, kind in (
        (bodies["curve_excess"], (0.05, 0.62), "whole curve,\nslope 1", WHOLE),
        (np.abs(bodies["excess"][..., 0]), (left, 0.03), "$\\cos g$ part,\nslope 2", COSINE),
    ):
        for row, known in enumerate(resolved):
            look = chosen.get(row, OTHER)
            order = 3 if row in chosen else 1
            axes.loglog(ratios[known], values[row][known], zorder=order, **look, **kind)
        axes.text(*place, said, transform=axes.transAxes, fontsize=7.5)
    axes.axhline(1, color="black", lw=0.6, ls=":")
    plots.logarithmic_ticks(axes, ratios)
    axes.set_xlabel(plots.axis_label(MU_OVER_H0))
    axes.set_ylabel("relative error of Melnikov's formula", fontsize=8.5)
    named = [plots.entry(_name(bodies, row), **look) for row, look in chosen.items()]
    if len(named) < len(resolved):
        named.append(plots.entry("the other bodies", **OTHER))
    axes.legend(handles=named, loc="lower right", fontsize=7, labelspacing=0.3, borderaxespad=0.3)
    return title


def _chosen(data: Data) -> list[int]:
    """Choose the bodies to highlight: that of least nu, the drawn one, that of largest nu."""
    nu = data["bodies"]["nu"]
    return list(dict.fromkeys((int(np.argmin(nu)), _drawn(data), int(np.argmax(nu)))))


def _draw_decay(axes: Axes, data: Data) -> str:
    bodies, ratios, closed = data["bodies"], data["mu_over_h0"], data["closed_form"]
    axes.semilogy(closed["nu"], closed["decay"], color="black", lw=1.0, label=r"$\nu/\sinh\nu$")
    resolved = bodies["resolved"]
    known = np.flatnonzero(resolved.any(axis=0))
    last = [k for k in known if ratios[k] >= 0.1]
    for k, (marker, colour, size) in zip(
        dict.fromkeys((*known[:1], *last)),
        (("o", plots.BLUE, 6), ("s", plots.ORANGE, 5), ("D", plots.RED, 4), ("v", plots.PINK, 4)),
        strict=False,
    ):
        rows, said = resolved[:, k], rf"$\mu/h_0 = {plots.power(ratios[k])}$"
        look: Any = {"ms": size, "mfc": "none", "mec": colour, "mew": 1.1, "label": said}
        axes.semilogy(bodies["nu"][rows], bodies["reduced"][rows, k], marker, **look)
    for k in known[:1]:
        rows = np.flatnonzero(resolved[:, k])
        rows = rows[np.argsort(bodies["nu"][rows])]
        places = np.stack((bodies["nu"], bodies["reduced"][:, k]), axis=1)[rows]
        names = ["4" if name == "fig4" else _short(name) for name in bodies["name"][rows]]
        ends = closed["nu"][-1], closed["decay"][-1] / closed["decay"][0]
        for said, place in _together(names, places, ends):
            # On the left of its place, below the curve, where the right has no room.
            room = (1 - place[0] / ends[0]) * NARROW - LETTER
            ends_in = 72 * plots.inches(said, 7) < room
            off: Any = (4, 6) if ends_in else (-4, -10)
            plots.beside(axes, said, place, *off, fontsize=7, ha="left" if ends_in else "right")
    axes.set(xlim=(0, closed["nu"][-1]), xlabel=r"$\nu = \pi\varkappa/\sin\alpha_0$")
    axes.set_ylabel(r"$\cos g$ part of the distance, relative to $\nu = 0$", fontsize=8.5)
    axes.legend(loc="lower left", fontsize=7, labelspacing=0.3)
    return "exponentially small in $\\nu$"


def _together(names: list[str], places: Any, ends: tuple[float, float]) -> Any:
    """Labels with their places (nu, reduced), ascending: one for names that would overlap.

    `ends` are the largest nu of the panel and the ratio of its least and its largest distance.
    """
    groups = list[tuple[list[str], Any]]()
    for name, (nu, reduced) in zip(names, places, strict=True):
        if groups:
            before, (x, y) = groups[-1]
            right = (nu - x) / ends[0] * PANEL[0]
            below = np.log(reduced / y) / np.log(ends[1]) * PANEL[1]
            if right < LETTER * len(_joined(before)) and abs(below) < LINE:
                before.append(name)
                continue
        groups.append(([name], (nu, reduced)))
    return [(_joined(group), place) for group, place in groups]


def _joined(names: list[str]) -> str:
    """Names of bodies in one label; of many, or of long ones, only the first and the last."""
    few = len(names) <= MOST_NAMES and len("".join(names)) <= 2 * LONGEST
    return ", ".join(names) if few else f"{names[0]} \u2026 {names[-1]}"


def _short(name: str) -> str:
    """A name as a label has room for it; the table of the result has all of it."""
    half = LONGEST // 2
    return name if len(name) <= LONGEST else f"{name[:half]}\u2026{name[-half:]}"


def _draw_table(axes: Axes, data: Data) -> str:
    bodies, ratios = data["bodies"], data["mu_over_h0"]
    n_bodies, n_weights = bodies["bits"].shape
    for row, column in np.ndindex(n_bodies, n_weights):
        colour, said = NONE, "\N{MULTIPLICATION SIGN}"
        if bodies["resolved"][row, column]:
            colour = BITS.get(int(bodies["bits"][row, column]), BITS[113])
            exponent = np.ceil(np.log10(bodies["error"][row, column]))
            said = f"{exponent:.0f}".replace("-", "\N{MINUS SIGN}")
        cell = Rectangle((column - 0.5, row - 0.5), 1, 1, fc=colour, ec="0.75", lw=0.5)
        axes.add_patch(cell)
        axes.text(column, row, said, ha="center", va="center", fontsize=6.5)
    axes.set(xlim=(-0.5, n_weights - 0.5), ylim=(n_bodies - 0.5, -0.5))
    # A factor stands above its power of ten, for a cell has no room for both beside each other.
    weights = [f"${plots.power(x)}$".replace(r"\cdot ", "$\n$\\cdot ") for x in ratios]
    axes.set_xticks(range(n_weights), weights, fontsize=6.5)
    pairs = zip(bodies["name"], bodies["nu"], strict=True)
    names = [f"{'Fig. 4' if name == 'fig4' else _short(name)}  {nu:.1f}" for name, nu in pairs]
    axes.set_yticks(range(n_bodies), names, fontsize=7)
    axes.tick_params(length=0)
    axes.set(xlabel=plots.axis_label(MU_OVER_H0), ylabel=r"body, $\nu$")
    used = set(bodies["bits"][bodies["resolved"]].tolist())
    keys = {f"{bits} bits": colour for bits, colour in BITS.items() if bits in used}
    if not bodies["resolved"].all():
        keys["not resolved"] = NONE
    patches = [Patch(fc=colour, ec="0.5", lw=0.5, label=said) for said, colour in keys.items()]
    below: Any = {"loc": "upper center", "bbox_to_anchor": (0.42, -0.19), "ncols": 4}
    close: Any = {"handlelength": 1.2, "columnspacing": 0.9, "handletextpad": 0.4}
    axes.legend(handles=patches, fontsize=6.5, **below, **close)
    return r"$\log_{10}$ of the error, and precision"


CAPTION = (
    "The distance of the surfaces S1- and S2+ is a cosine of the phase with the amplitude of"
    " Melnikov's formula, the more exactly the smaller the weight is. On the section J1 = J2/2 the"
    " formula's curve errs by O(mu), its amplitude by O(mu^2). Each distance has an error of its"
    " own; those that no precision resolved are crossed out."
)


def tables(result: Loaded) -> list[Table]:
    """Table of the bodies: nu, amplitude at the smallest weight, powers of mu, resolved ones."""
    data = result["data"]
    bodies, weight = data["bodies"], float(data["mu_over_h0"][0])
    resolved = [f"{np.count_nonzero(each)} of {each.size}" for each in bodies["resolved"]]
    table = Table.of(
        f"Largest distance in theta1 at mu = {weight:g} h0; powers of mu by which the rest falls",
        [
            Column("body", bodies["name"]),
            Column("nu", bodies["nu"], ".4f"),
            Column("Melnikov (rad)", bodies["amplitude"][:, 0], ".6g"),
            Column("computed", bodies["largest"][:, 0], ".6g"),
            Column("power, curve", bodies["slope_curve"], ".4f"),
            Column("amplitude", bodies["slope_amplitude"], ".4f"),
            Column("resolved", resolved),
        ],
        f"Decided in {', '.join(map(str, np.unique(bodies['bits'])))} bits.",
    )
    return [table]
