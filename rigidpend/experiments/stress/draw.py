"""Trials at the limits: drift, claims against their bounds, growth of errors, symbols decided.

The report's tables count passed trials by kind and name failures; the command's list every claim.
"""

from collections.abc import Iterator
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from rigidpend.experiments.data import Data, Loaded
from rigidpend.experiments.plots import BLUE, GREEN, ORANGE, RED, WIDTH, entry, title
from rigidpend.experiments.stress import LIMIT, PASSED, REFUTED
from rigidpend.machine.wording import Column, Table

CAPTION = (
    "Each trial tests an extreme: its value stays within the bound that was stated before it ran,"
    " a ratio of at most 1, except at documented limits. Drift of the integrals, growth of errors"
    " from passage to passage, and how many symbols each precision decides."
)
HEIGHT = 8.8
"""Height of the figure, inches."""
FLOOR, CEILING = 1e-17, 1e2
"""Ends of the axis of ratios; ratios beyond are drawn at the edge."""
LOOKS = {
    PASSED: (BLUE, "o", "within their bounds"),
    LIMIT: (ORANGE, "D", "beyond, at documented limits"),
    REFUTED: (RED, "X", "beyond: failed"),
}
"""Colour, marker and label of each verdict."""
INTEGRALS = (("energy", BLUE), (r"$|\gamma|$", RED), (r"$M\cdot\gamma$", GREEN))
"""Integrals of motion in the order in which results have them, with their colours."""
PRECISIONS = {53: (BLUE, "-"), 64: (GREEN, "--"), 106: (ORANGE, ":"), 113: (RED, "-.")}
"""Colour and style of each precision, bits."""


def draw(result: Loaded) -> Figure:
    """Draw a result."""
    data = result["data"]
    # A kind of trial that refused to compute has claims, but no curves.
    curves = {kind: data.get(kind, {"curves": {}})["curves"] for kind in ("long_time", "passages")}
    figure = Figure(figsize=(WIDTH, HEIGHT))
    margins: Any = {"left": 0.1, "right": 0.985, "top": 0.965, "bottom": 0.06}
    grid = figure.add_gridspec(3, 6, **margins, hspace=0.42, wspace=1.5, height_ratios=(1, 1.45, 1))
    _draw_drifts(figure.add_subplot(grid[0, :]), list(curves["long_time"].values()))
    _draw_claims(figure.add_axes((0.125, 0.355, 0.86, 0.3)), data)
    if "growth" in curves["passages"]:
        _draw_growth(figure.add_subplot(grid[2, :3]), curves["passages"]["growth"])
    _draw_symbols(figure.add_subplot(grid[2, 3:]), curves["passages"])
    return figure


def _draw_drifts(axes: Axes, curves: list[Any]) -> None:
    """Draw drift against time with the predicted walk; the legend has the fitted powers of t."""
    title(axes, "a", "drift of the integrals")
    entries = [entry(name, color=colour) for name, colour in INTEGRALS]
    if curves:
        axes.plot(curves[0]["rotations"], curves[0]["walk"], color="0.75", lw=3, zorder=0)
        entries.append(entry(r"predicted, $\sqrt{t}$", color="0.75", lw=3))
    for curve, style in zip(curves, ("-", ":"), strict=False):
        for row, (_, colour) in zip(curve["drift"], INTEGRALS, strict=True):
            axes.plot(curve["rotations"], row, style, color=colour, lw=0.9)
        powers = ", ".join(f"{x:.2f}" for x in curve["power"])
        label = f"{str(curve['name']).replace(' at', '')}: {powers}"
        entries.append(entry(label, color="0.2", ls=style, lw=0.9))
    small: Any = {"fontsize": 6.5, "title_fontsize": 6.5, "labelspacing": 0.25, "columnspacing": 1}
    said = "tolerance: power of t of the three" if curves else ""
    axes.legend(handles=entries, loc="upper left", ncols=2, title=said, **small)
    axes.set(xscale="log", yscale="log", xlabel="rotations", ylabel="rms drift, relative")


def _draw_claims(axes: Axes, data: Data) -> None:
    """Draw value over bound of every claim, one row for each kind of trial."""
    counts = dict.fromkeys(LOOKS, 0)
    for row, content in enumerate(data.values()):
        claims = content["claims"]
        # Spread vertically, because claims of equal ratio would coincide.
        n = len(claims["name"])
        lift = np.linspace(-0.32, 0.32, n) if n > 1 else [0.0]
        for verdict, ratio, up in zip(claims["verdict"], claims["ratio"], lift, strict=True):
            colour, marker, _ = LOOKS[verdict]
            x = min(max(ratio, FLOOR), CEILING)
            axes.plot(x, row + up, marker, color=colour, ms=3.2, mew=0, clip_on=False)
            counts[verdict] += 1
    axes.axvline(1, color="0.3", lw=0.8)
    title(axes, "b", f"all {sum(counts.values())} claims")
    axes.set_xscale("log")
    axes.set_xlim(FLOOR / 3, 3 * CEILING)
    powers = range(-16, 3, 2)
    axes.set_xticks([FLOOR, *(10.0**k for k in powers)], ["0", *(f"$10^{{{k}}}$" for k in powers)])
    axes.set_xticks([], minor=True)
    axes.set_yticks(range(len(data)), [x.replace("_", " ") for x in data])
    axes.set(ylim=(len(data) - 0.4, -0.6), xlabel="value / bound")
    entries = [
        entry(f"{counts[key]} {label}", ls="", marker=marker, color=colour, ms=4)
        for key, (colour, marker, label) in LOOKS.items()
        if counts[key]
    ]
    place: Any = {"loc": "lower right", "bbox_to_anchor": (1, 1), "borderaxespad": 0.1}
    axes.legend(handles=entries, ncols=3, fontsize=7, **place)


def _draw_growth(axes: Axes, growth: Any) -> None:
    """Draw errors at each crossing: all orbits, their mean, and the prediction."""
    title(axes, "c", "rounding error at each crossing")
    x = growth["crossing"] + 1
    for column in growth["scatter"].T:
        # An error of exactly 0 has no place on a logarithmic axis.
        axes.plot(x, np.where(column > 0, column, np.nan), ".", color="0.75", ms=2, zorder=0)
    axes.plot(x, growth["measured"], "o", color=BLUE, ms=4, label="measured")
    axes.plot(x, growth["predicted"], "-", color=RED, label="predicted, nothing fitted")
    axes.plot(x, growth["floor"], ":", color="0.4", label="last bit of the time")
    axes.set(yscale="log", xlabel="crossing", ylabel="phase error, rad")
    factors = (float(growth[f"growth_{kind}"]) for kind in ("measured", "predicted"))
    said = "a passage: ×{:.2f} measured,\n×{:.2f} predicted".format(*factors)
    paper = {"fc": "white", "lw": 0, "alpha": 0.85, "pad": 1.5}
    axes.text(0.97, 0.05, said, transform=axes.transAxes, ha="right", fontsize=7.5, bbox=paper)
    axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    axes.legend(loc="upper left", fontsize=7)


def _draw_symbols(axes: Axes, curves: Any) -> None:
    """Draw the share of orbits of which each precision decides at least a number of symbols."""
    title(axes, "d", "symbols that a precision decides")
    for curve in (x for x in curves.values() if "bits" in x):
        bits = int(curve["bits"])
        colour, style = PRECISIONS[bits]
        looks: tuple[tuple[str, dict[str, Any]], ...] = (
            ("measured", {"ls": style, "lw": 1.4}),
            ("predicted", {"ls": "-", "lw": 2.6, "alpha": 0.35}),
        )
        for key, look in looks:
            ordered = np.r_[0, np.sort(curve[key])]
            share = np.linspace(1, 0, ordered.size)
            axes.step(ordered, share, where="post", color=colour, **look)
        axes.plot([], [], style, color=colour, label=f"{bits} bits")
    axes.plot([], [], "-", color="0.6", lw=2.6, label="predicted")
    axes.set(xlabel="symbols", ylabel="share of orbits with more", ylim=(0, 1.02), xlim=(0, None))
    axes.legend(loc="upper right", fontsize=7)


def tables(result: Loaded) -> list[Table]:
    """Table of the trials by kind, then a table of those beyond their bounds."""
    kinds, beyond = list(_kinds(result)), list[tuple[str, ...]]()
    rows = [_counted(kind, claims["verdict"], claims["ratio"]) for kind, claims in kinds]
    every = [np.concatenate([x[key] for _, x in kinds]) for key in ("verdict", "ratio")]
    rows.append(_counted("all", *every))
    for kind, claims in kinds:
        for k in np.flatnonzero(claims["verdict"] != PASSED):
            told = (str(claims[key][k]) for key in ("measured", "note", "limit"))
            reason = "; ".join(filter(None, told))
            beyond.append((claims["verdict"][k], f"{kind}, {claims['name'][k]}", reason))
    caption = "Trials of each kind, and the largest ratio of value and bound of those that passed"
    found = [Table(caption, ("kind", *LOOKS, "largest ratio"), rows)]
    if beyond:
        found.append(Table("Beyond their bounds", ("verdict", "trial", "reason"), beyond))
    return found


def _counted(kind: str, verdicts: Any, ratios: Any) -> tuple[str, ...]:
    """A row: the number of claims with each verdict, and the largest ratio of those that passed."""
    numbers = (str((verdicts == x).sum()) for x in LOOKS)
    return kind, *numbers, f"{ratios[verdicts == PASSED].max(initial=0):.2g}"


def claims_tables(result: Loaded) -> list[Table]:
    """A table for each kind of trial: every claim with its value and its bound."""
    forms = dict.fromkeys(("value", "bound", "ratio"), ".2g")
    keys = ("name", "value", "bound", "ratio", "unit", "verdict")
    return [
        Table.of(kind, [Column(key, claims[key], forms.get(key, "")) for key in keys])
        for kind, claims in _kinds(result)
    ]


def _kinds(result: Loaded) -> Iterator[tuple[str, Data]]:
    """The kinds of trials in words, with their claims."""
    for group, content in result["data"].items():
        yield group.replace("_", " "), content["claims"]
