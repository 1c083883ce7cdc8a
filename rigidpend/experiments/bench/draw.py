"""Figure of the benchmark: ratios of time, diagrams of work and error, wrong symbols."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import count
from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import NullFormatter

from rigidpend.experiments.bench.measuring import reading
from rigidpend.experiments.bench.measuring.methods import METHODS
from rigidpend.experiments.bench.measuring.problems import NAMES
from rigidpend.experiments.data.tree import Data, Loaded
from rigidpend.experiments.plots.palette import (
    BLUE,
    GREEN,
    ORANGE,
    PINK,
    RED,
    SKY,
    WIDTH,
)
from rigidpend.experiments.plots.panels import entry

BASE, ROW, PLOT, FOOT = 0.75, 0.155, 2.6, 1.0
"""Inches: a panel of ratios without rows, a row, a diagram, the legend."""
LARGEST = 3.0
"""Errors beyond, which are of the size of the answer, are not drawn."""
LOSS, TINT = RED, "#FBEFE6"
"""Colours of the ratios, and of the ground, where ours is slower."""


class Appearance(NamedTuple):
    """The drawn form of a method."""

    label: str
    colour: str
    marker: str
    line: str = "-"
    width: float = 0.9


OURS, HEYOKA, CYRK, JAX, SCIPY, GREY = BLUE, ORANGE, GREEN, PINK, RED, "#666666"
APPEARANCES = {
    "scipy_dop853": Appearance("SciPy DOP853", SCIPY, "s"),
    "scipy_radau": Appearance("SciPy Radau", SCIPY, "^", ":"),
    "scipy_lsoda": Appearance("SciPy LSODA", SCIPY, "v", "--"),
    "scipy_two_tolerances": Appearance("SciPy, compared", SCIPY, "X", ""),
    "cvode": Appearance("SUNDIALS CVODE", GREY, "D", "--"),
    "rebound": Appearance("REBOUND", GREY, "o"),
    "diffrax": Appearance("diffrax, vmapped", JAX, "P"),
    "diffrax_two_tolerances": Appearance("diffrax, compared", JAX, "X", ""),
    "lie_poisson": Appearance("operator splitting", SKY, "D"),
    "cyrk": Appearance("CyRK, compiled", CYRK, "o"),
    "cyrk_two_methods": Appearance("CyRK, compared", CYRK, "X", ""),
    "heyoka_ensemble": Appearance("heyoka, ensemble", HEYOKA, "^", ":"),
    "heyoka_eq1": Appearance("heyoka, (eq1)", HEYOKA, "o", "--"),
    "heyoka_principal": Appearance("heyoka, Euler-Poisson", HEYOKA, "s"),
    "heyoka_two_tolerances": Appearance("heyoka, 2 tolerances", HEYOKA, "X", ""),
    "heyoka_two_forms": Appearance("heyoka, both forms", HEYOKA, "P", ""),
    "aligned_113": Appearance("ours, 113 bits", OURS, "v", ""),
    "aligned_106": Appearance("ours, 106 bits", OURS, "D", ""),
    "aligned_64": Appearance("ours, 64 bits", OURS, "^", ""),
    "aligned_batch": Appearance("ours, batches", OURS, "s", "-", 2.0),
    "route_codes_map": Appearance("ours, maps, certain", "black", "o", "-", 2.0),
    "route_codes": Appearance("ours, certain", "black", "P", ""),
    "closed_form": Appearance("ours, closed form", "black", "*", ""),
}
"""Appearance of the methods, in the order in which they are drawn: ours lies above."""


def draw(result: Loaded) -> Figure:
    """Draw all panels of a result."""
    data = result["data"]
    met = [name for name in NAMES if name in data and reading.met(data, name, 1)]
    searched = [name for name in ("codes", "free_body") if name in data]
    phases = list(data.get("random_phases", {}))
    heights = [_height(data, pair) for pair in _pairs(met)]
    further = [("search", name) for name in searched] + [("phases", name) for name in phases]
    further += [("many", "many_orbits")] if data.get("many_orbits") else []
    heights += [PLOT] * -(-len(further) // 2)
    figure = Figure(figsize=(WIDTH, sum(heights) + FOOT))
    figure.set_layout_engine("constrained", w_pad=0.05, h_pad=0.05)
    grid = figure.subplots(len(heights), 2, squeeze=False, height_ratios=heights)
    letters = iter("abcdefghijkl")
    free = [*grid[: len(_pairs(met))].ravel()]
    for axes, name in zip(free, met, strict=False):
        _draw_ratios(axes, data, name)
        _title(axes, letters, str(data[name]["title"]))
    for axes in free[len(met) :]:
        _explain(axes)
    rest = grid[len(_pairs(met)) :].ravel()
    for axes, (kind, name) in zip(rest, further, strict=False):
        if kind == "search":
            _draw_work(axes, data[name])
            _title(axes, letters, f"{data[name]['title']}: each alone")
        elif kind == "many":
            _draw_many(axes, data[name])
            _title(axes, letters, "codes of ever more orbits")
        else:
            _draw_wrong(axes, data["random_phases"][name])
            _title(axes, letters, f"random phases, J1_0 = {name.removeprefix('J1_0_')}")
    for axes in rest[len(further) :]:
        axes.set_axis_off()
    shown = {x for name in searched for x in data[name]} | {
        x for name in phases for x in data["random_phases"][name]
    }
    shown |= set(data.get("many_orbits", {}))
    handles = _legend(shown & set(APPEARANCES))
    figure.legend(handles=handles, loc="outside lower center", ncols=4, columnspacing=1.2)
    return figure


def _pairs(names: Sequence[str]) -> list[Sequence[str]]:
    return [names[k : k + 2] for k in range(0, len(names), 2)]


def _height(data: Data, names: Sequence[str]) -> float:
    return BASE + ROW * max(len(reading.met(data, name, 1)) for name in names)


def _title(axes: Axes, letters: Any, text: str) -> None:
    axes.set_title(f"{next(letters)})  {text}", loc="left")


def _draw_ratios(axes: Axes, data: Data, problem: str) -> None:
    """Times a method needs in units of ours, the fastest on top; rings: up to two threads, both."""
    results = reading.met(data, problem, 1)
    more = {result.method: result for result in reading.met(data, problem, 2)}
    default = str(data[problem]["default"])
    for row, result in zip(count(), reversed(results)):
        look = APPEARANCES[result.method]
        axes.plot([result.low, result.high], [row, row], color=look.colour, lw=1.0, zorder=3)
        axes.plot(result.ratio, row, "o", color=look.colour, ms=4.2, zorder=4, label=result.method)
        if result.method in more:
            ratio = more[result.method].ratio
            axes.plot(ratio, row, "o", color=look.colour, mfc="white", ms=6.5, mew=0.8, zorder=3)
    axes.axvline(1.0, color="black", lw=0.8, zorder=2)
    axes.set_xscale("log")
    axes.xaxis.set_minor_formatter(NullFormatter())
    low, high = axes.get_xlim()
    axes.set_xlim(min(low, 0.4), max(high, 2.5))
    axes.axvspan(axes.get_xlim()[0], 1.0, color=TINT, zorder=0)
    axes.set_yticks(
        range(len(results)),
        [APPEARANCES[r.method].label + ("" if r.reached else " $^+$") for r in reversed(results)],
        fontsize=7,
    )
    for tick, result in zip(axes.get_yticklabels(), reversed(results), strict=True):
        tick.set_fontweight("bold" if result.method == default else "normal")
        if result.ratio < 1 and result.reached and METHODS[result.method].family != "ours":
            tick.set_color(LOSS)
    axes.set_ylim(-0.7, len(results) - 0.3)
    axes.tick_params(axis="y", length=0)
    axes.set_xlabel("time, in units of ours (bold)")
    axes.grid(axis="x", alpha=0.25, lw=0.4)


def _explain(axes: Axes) -> None:
    """Say in the room that is left how to read the ratios."""
    axes.set_axis_off()
    text = (
        "dot: one thread, and the quartiles\n"
        "ring: up to two threads, ours too\n"
        "tinted, name in red: faster than ours\n"
        "$^+$ did not reach the error asked for"
    )
    axes.text(0.0, 0.95, text, transform=axes.transAxes, va="top", fontsize=7.5, linespacing=1.5)


def _draw_work(axes: Axes, group: Data) -> None:
    """Time against error, the best of the settings; a hollow mark went only a part of the way."""
    for name, look in APPEARANCES.items():
        record = group.get(name, {})
        if "error" not in record:
            continue
        error = np.maximum(record["error"], np.finfo(float).eps)
        kept = _front(error, record["seconds"]) & np.isfinite(error) & (error <= LARGEST)
        order = np.argsort(-error[kept])
        x, y = error[kept][order], record["seconds"][kept][order]
        style = look.line or "none"
        face = look.colour if record["part"][kept].all() else "white"
        axes.plot(
            x, y, look.marker, color=look.colour, ls=style, lw=look.width, ms=_size(look), mfc=face,
            mew=0.7, zorder=_order(name), label=name,
        )  # fmt: skip
    axes.set(xscale="log", yscale="log")
    axes.invert_xaxis()
    codes = "wrong_symbols" in group.get("aligned_batch", {})
    axes.set_xlabel("error of the crossing times ($t'$)" if codes else "error (relative)")
    axes.set_ylabel("time (s)")
    axes.grid(alpha=0.25, lw=0.4)


def _front(error: Any, seconds: Any) -> Any:
    """Mask of the settings that no other beats in both error and time."""
    better = (error[:, None] <= error) & (seconds[:, None] <= seconds)
    strictly = better & ((error[:, None] < error) | (seconds[:, None] < seconds))
    return ~strictly.any(axis=0)


def _draw_wrong(axes: Axes, group: Data) -> None:
    """Wrong symbols per million against the time of an orbit; none at all lies on the floor."""
    for name, look in APPEARANCES.items():
        if name not in group:
            continue
        record = group[name]
        wrong = 1e6 * float(record["wrong_trusted"]) / float(record["symbols"])
        cost = 1e3 * float(record["seconds"]) / float(record["orbits"])
        axes.plot(
            cost, wrong, look.marker, color=look.colour, ms=_size(look) + 2, zorder=_order(name),
            label=name, clip_on=False,
        )  # fmt: skip
    axes.set_xscale("log")
    axes.set_yscale("symlog", linthresh=10, linscale=0.5)
    axes.set_ylim(0, max(100.0, axes.get_ylim()[1]))
    low, high = axes.get_xlim()
    axes.set_xlim(low / 1.5, high * 1.5)
    axes.xaxis.set_minor_formatter(NullFormatter())
    axes.set(xlabel="time of an orbit (ms)", ylabel="wrong, trusted, per million")
    axes.grid(alpha=0.25, lw=0.4)


def _draw_many(axes: Axes, group: Data) -> None:
    """Time against the number of orbits; dashed with what is made ready once."""
    ends = [float(edge(record["orbits"])) for record in group.values() for edge in (min, max)]
    for name, look in APPEARANCES.items():
        if name not in group:
            continue
        record = group[name]
        orbits, warm = np.asarray(record["orbits"]), np.asarray(record["seconds"])
        # Dotted beyond what was measured: scaled.
        beyond = np.array([orbits[-1], max(ends)])
        style: dict[str, Any] = {"color": look.colour, "lw": look.width, "zorder": _order(name)}
        axes.plot(
            orbits, warm, look.marker, ls="-", ms=_size(look), mew=0.7, label=name, **style
        )  # fmt: skip
        axes.plot(beyond, warm[-1] * beyond / orbits[-1], ls=":", label="_scaled", **style)
        first = np.cumsum(record["prepare"]) + warm
        axes.plot(orbits, first, ls="--", label="_first", **{**style, "lw": 0.7})
    axes.set(xscale="log", yscale="log", xlabel="number of orbits", ylabel="time (s)")
    said = "dashed: with tables and\ncompilation, made once\ndotted: scaled from\nfewer orbits"
    beside = axes.text(1.06, 0.95, said, transform=axes.transAxes, va="top", fontsize=7.5)
    beside.set(linespacing=1.5)
    # It stands in the room of the next panel, and asks for none beside its own.
    beside.set_in_layout(False)
    axes.grid(alpha=0.25, lw=0.4)


def _size(look: Appearance) -> float:
    return 8.0 if look.marker == "*" else 3.6 if look.line else 5.0


def _order(name: str) -> float:
    return 3.0 + list(APPEARANCES).index(name)


def _legend(shown: set[str]) -> list[Line2D]:
    return [_entry(look) for name, look in reversed(APPEARANCES.items()) if name in shown]


def _entry(look: Appearance) -> Line2D:
    style: dict[str, Any] = {"color": look.colour, "ls": look.line or "none", "lw": look.width}
    return entry(look.label, **style, marker=look.marker, ms=_size(look))
