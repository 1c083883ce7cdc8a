"""Figure of the benchmark: times by body, time against error, and wrong symbols."""

from functools import partial
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import NullFormatter, PercentFormatter

from rigidpend.experiments.bench import report
from rigidpend.experiments.bench.methods import METHODS
from rigidpend.experiments.data import Data, Loaded
from rigidpend.experiments.plots import BLUE, GREEN, ORANGE, RED, WIDTH, entry, title

CAPTION = (
    "Times of methods with random bodies, time against error with one body, and the share"
    " of wrong symbols among those that a method calls right. Every method is used as in its own"
    " documentation, on one machine."
)
tables = report.tables
DIAGRAM, LEGEND = 2.15, 0.45
"""Heights of a row of diagrams and of the legend, inches."""
LARGEST = 3.0
"""Largest error that is drawn; larger errors are of the size of the answer."""
APPEARANCES: dict[str, dict[str, str]] = {
    "scipy": {"label": "SciPy DOP853", "color": RED, "marker": "v"},
    "cyrk": {"label": "CyRK (numba)", "color": GREEN, "marker": "o"},
    "heyoka": {"label": "heyoka, batches", "color": ORANGE, "marker": "s"},
    "ours": {"label": "rigidpend", "color": BLUE, "marker": "*"},
}
"""Appearance of the families, in the order of drawing: ours comes last and lies on top."""
CERTAIN = {"color": "black", "ls": "-", "lw": 1.6}
"""Look of our method with every symbol certain, which no peer offers."""


def style(name: str) -> dict[str, Any]:
    """Plot arguments of a method: colour by family, dashes where two runs are compared."""
    method = METHODS[name]
    look = APPEARANCES[method.family]
    said: dict[str, Any] = {**look, "ls": "--" if method.certain else "-", "lw": 1.1, "mew": 0.8}
    said["ms"] = 7.5 if look["marker"] == "*" else 4.2
    if method.certain and method.family == "ours":
        said |= CERTAIN
    return {**said, "label": name, "zorder": 3.0 + list(APPEARANCES).index(method.family)}


def draw(result: Loaded) -> Figure:
    """Draw a result, two diagrams in a row."""
    data = result["data"]
    of_bodies = [partial(_draw_shares, call=call) for call in ("again", "first")]
    diagrams = [*(of_bodies if data.get("bodies") else ()), _draw_work, _draw_wrong]
    rows = len(diagrams) // 2
    figure = Figure(figsize=(WIDTH, DIAGRAM * rows + LEGEND))
    figure.set_layout_engine("constrained", w_pad=0.05, h_pad=0.05)
    every = list(figure.subplots(rows, 2).flat)
    for axes, letter, draw_one in zip(every, "abcd", diagrams, strict=False):
        draw_one(axes, data)
        title(axes, letter, axes.get_title())
        axes.set_title("")
        axes.grid(alpha=0.25, lw=0.4)
        # On an axis shorter than a decade the labels of minor ticks would overlap.
        axes.xaxis.set_minor_formatter(NullFormatter())
    _draw_legend(figure, every)
    return figure


def _draw_shares(axes: Axes, data: Data, call: str) -> None:
    """Draw the share of bodies for which a method takes less than a time."""
    (_, own), *_ = report.records(data["bodies"])
    unit, said, of = {
        "again": (1e6, "the same call again", "an orbit (us)"),
        "first": (1.0, "first call with each", f"{max(own['orbits']):,.0f} orbits (s)"),
    }[call]
    axes.set(title=f"random bodies: {said}", xlabel=f"time of {of}")
    for name, record in report.of_bodies(data).items():
        ordered = np.sort(unit * record[call])
        share = np.arange(1, ordered.size + 1) / ordered.size
        axes.step(ordered, share, where="post", **{**style(name), "marker": ""})
    axes.set(xscale="log", ylim=(0, 1.03), ylabel="share of bodies below")
    axes.yaxis.set_major_formatter(PercentFormatter(1.0))


def _draw_work(axes: Axes, data: Data) -> None:
    """Draw time against error: the best settings of methods that give no certainty."""
    for name, record in report.records(data["fig4"]):
        if "error" not in record or METHODS[name].certain:
            continue
        error = np.maximum(record["error"], np.finfo(float).eps)
        kept = _front(error, record["seconds"]) & np.isfinite(error) & (error <= LARGEST)
        order = np.argsort(-error[kept])
        axes.plot(error[kept][order], record["seconds"][kept][order], **style(name))
    axes.set(title="Fig. 4: time against error", ylabel="time (s)")
    axes.set(xscale="log", yscale="log", xlabel="error of the crossing times ($t'$)")
    axes.invert_xaxis()


def _front(error: Any, seconds: Any) -> Any:
    """Mask of the settings that no other beats in both error and time."""
    better = (error[:, None] <= error) & (seconds[:, None] <= seconds)
    strictly = better & ((error[:, None] < error) | (seconds[:, None] < seconds))
    return ~strictly.any(axis=0)


def _draw_wrong(axes: Axes, data: Data) -> None:
    """Draw wrong symbols per million against the time of an orbit; none is drawn at the bottom."""
    for group in data["random_phases"].values():
        for name, record in report.records(group):
            wrong = 1e6 * float(record["wrong_trusted"]) / float(record["symbols"])
            cost = 1e3 * float(record["seconds"]) / float(record["orbits"])
            look = {**style(name), "ls": "none", "clip_on": False}
            look |= {"mfc": "white"} if METHODS[name].certain else {}
            axes.plot(cost, wrong, **look)
    axes.set(title="Fig. 4: wrong symbols; hollow: compared", ylabel="wrong per million")
    axes.set(xscale="log", xlabel="time of an orbit (ms)")
    axes.set_yscale("symlog", linthresh=10, linscale=0.5)
    axes.set_ylim(0, max(100.0, 1.5 * axes.get_ylim()[1]))
    low, high = axes.get_xlim()
    axes.set_xlim(low / 1.5, high * 1.5)


def _draw_legend(figure: Figure, every: list[Axes]) -> None:
    """Draw the legend of families and line styles below the diagrams."""
    shown = {str(line.get_label()) for one in every for line in one.lines} & set(METHODS)
    families = {METHODS[name].family for name in shown}
    looks = [look for family, look in reversed(APPEARANCES.items()) if family in families]
    handles = [entry(**look, ms=6) for look in looks]
    if any(METHODS[name].certain for name in shown):
        handles.insert(1, entry("rigidpend, every symbol certain", **CERTAIN))
        handles.append(entry("two runs of a peer compared", color="0.4", ls="--"))
    figure.legend(handles=handles, loc="outside lower center", ncols=4, fontsize=8, frameon=False)
