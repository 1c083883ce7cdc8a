"""Figure of the benchmark, one page: who is faster, work and error, trust, and many orbits."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import NullFormatter

from rigidpend.experiments.bench.measuring import reading
from rigidpend.experiments.bench.measuring.problems import NAMES
from rigidpend.experiments.data.tree import Data, Loaded
from rigidpend.experiments.plots import BLUE, GREEN, ORANGE, PINK, RED, SKY, WIDTH, entry, title

ROW, DIAGRAM, LEGEND = 0.24, 2.35, 1.35
"""Inches: a row of ratios, a diagram, and the legend with the labels of the axes."""
LARGEST = 3.0
"""Errors beyond, which are of the size of the answer, are not drawn."""
FASTER = "#FBEFE6"
"""Ground where others are faster than ours."""


class Appearance(NamedTuple):
    """The drawn form of a method."""

    label: str
    colour: str
    marker: str
    line: str = "-"
    width: float = 0.9

    @property
    def style(self) -> dict[str, Any]:
        """The same in the words of a plot."""
        size = 8.0 if self.marker == "*" else 3.8 if self.line else 5.0
        line = {"color": self.colour, "ls": self.line or "none", "lw": self.width}
        return {**line, "marker": self.marker, "ms": size, "mew": 0.7}


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
    """Draw a result: the ratios of all problems above, then two diagrams a row."""
    data = result["data"]
    rows = [
        (name, threads, met)
        for name in NAMES
        for threads in (1, 2)
        if name in data and (met := reading.met(data, name, threads))
    ]
    diagrams = [
        *((_draw_work, data[name]) for name in ("codes", "free_body") if name in data),
        *((_draw_wrong, data[name]) for name in ("random_phases",) if data.get(name)),
        *((_draw_many, data[name]) for name in ("many_orbits",) if data.get(name)),
    ]
    heights = [ROW * (len(rows) + 3), DIAGRAM * -(-len(diagrams) // 2)]
    figure = Figure(figsize=(WIDTH, sum(heights) + LEGEND))
    figure.set_layout_engine("constrained", w_pad=0.05, h_pad=0.05)
    # Apart, so that the long names above take no width from the diagrams.
    halves: Any = figure.subfigures(2, 1, height_ratios=heights)
    above, below = halves
    axes = [above.subplots()]
    _draw_ratios(axes[0], data, rows)
    for k, (draw_one, group) in enumerate(diagrams, 1):
        axes.append(below.add_subplot(-(-len(diagrams) // 2), 2, k))
        draw_one(axes[-1], group)
    for each, letter in zip(axes, "abcde", strict=False):
        title(each, letter, each.get_title())
        each.set_title("")
        each.grid(alpha=0.25, lw=0.4)
    shown = {str(line.get_label()) for each in axes for line in each.lines}
    looks = [look for name, look in reversed(APPEARANCES.items()) if name in shown]
    handles = [entry(look.label, **look.style) for look in looks]
    figure.legend(handles=handles, loc="outside lower center", ncols=4, columnspacing=1.2)
    return figure


def _draw_ratios(axes: Axes, data: Data, rows: list[Any]) -> None:
    """Times in units of ours, a row a problem and number of threads; hollow: level not reached."""
    axes.set_title("time in units of ours, each at its best setting; hollow: too inexact")
    for row, (_, _, met) in enumerate(rows):
        axes.plot([met[0].ratio, met[-1].ratio], [row, row], color="0.85", lw=0.8, zorder=1)
        for result in met:
            look = APPEARANCES[result.method]
            face = look.colour if result.reached else "white"
            style = {**look.style, "ls": "none", "mfc": face, "ms": look.style["ms"] + 1.2}
            axes.plot(result.ratio, row, label=result.method, zorder=_order(result.method), **style)
    axes.axvline(1.0, color="black", lw=0.8, zorder=2)
    axes.set_xscale("log")
    low, high = axes.get_xlim()
    axes.set_xlim(min(low, 0.4), max(high, 2.5))
    axes.axvspan(axes.get_xlim()[0], 1.0, color=FASTER, zorder=0)
    labels = [
        str(data[name]["title"]) + ", 1 thread" if threads == 1 else "2 threads"
        for name, threads, _ in rows
    ]
    axes.set_yticks(range(len(rows)), labels)
    axes.set(ylim=(len(rows) - 0.3, -0.7), xlabel="tinted: faster than ours")
    axes.tick_params(axis="y", length=0)


def _draw_work(axes: Axes, group: Data) -> None:
    """Time against error, the best of the settings; a hollow mark went only a part of the way."""
    for name, record in _in_order(group):
        if "error" not in record:
            continue
        look = APPEARANCES[name]
        error = np.maximum(record["error"], np.finfo(float).eps)
        kept = _front(error, record["seconds"]) & np.isfinite(error) & (error <= LARGEST)
        order = np.argsort(-error[kept])
        face = look.colour if record["part"][kept].all() else "white"
        points = error[kept][order], record["seconds"][kept][order]
        axes.plot(*points, label=name, mfc=face, zorder=_order(name), **look.style)
    codes = "wrong_symbols" in group.get("aligned_batch", {})
    axes.set_title(f"{group['title']}: each alone")
    axes.set(xscale="log", yscale="log", ylabel="time (s)")
    axes.set_xlabel("error of the crossing times ($t'$)" if codes else "error (relative)")
    axes.invert_xaxis()


def _front(error: Any, seconds: Any) -> Any:
    """Mask of the settings that no other beats in both error and time."""
    better = (error[:, None] <= error) & (seconds[:, None] <= seconds)
    strictly = better & ((error[:, None] < error) | (seconds[:, None] < seconds))
    return ~strictly.any(axis=0)


def _draw_wrong(axes: Axes, groups: Data) -> None:
    """Wrong symbols per million against the time of an orbit; none at all lies on the floor."""
    for group, filled in zip(groups.values(), (True, False), strict=False):
        for name, record in _in_order(group):
            wrong = 1e6 * float(record["wrong_trusted"]) / float(record["symbols"])
            cost = 1e3 * float(record["seconds"]) / float(record["orbits"])
            style = {**APPEARANCES[name].style, "ls": "none", "clip_on": False}
            style |= {} if filled else {"mfc": "white"}
            axes.plot(cost, wrong, label=name, zorder=_order(name), **style)
    starts = [name.removeprefix("J1_0_") for name in groups]
    hollow = f", hollow: {starts[1]}" if len(starts) > 1 else ""
    axes.set_title("symbols that are trusted and wrong")
    axes.set(xscale="log", ylabel="wrong per million")
    axes.set_xlabel(f"time of an orbit (ms); J1_0 = {starts[0]}{hollow}")
    axes.set_yscale("symlog", linthresh=10, linscale=0.5)
    axes.set_ylim(0, max(100.0, 1.5 * axes.get_ylim()[1]))
    low, high = axes.get_xlim()
    axes.set_xlim(low / 1.5, high * 1.5)
    axes.xaxis.set_minor_formatter(NullFormatter())


def _draw_many(axes: Axes, group: Data) -> None:
    """Time against the number of orbits; dashed with what is made ready once."""
    most = max(float(max(record["orbits"])) for record in group.values())
    for name, record in _in_order(group):
        orbits, warm = np.asarray(record["orbits"]), np.asarray(record["seconds"])
        style = {**APPEARANCES[name].style, "zorder": _order(name)}
        axes.plot(orbits, warm, label=name, **{**style, "ls": "-"})
        plain = {**style, "marker": "", "lw": 0.7}
        beyond = np.array([orbits[-1], most])
        scaled = warm[-1] * beyond / orbits[-1]
        axes.plot(beyond, scaled, label="_scaled", **{**plain, "ls": ":"})
        first = np.cumsum(record["prepare"]) + warm
        axes.plot(orbits, first, label="_first", **{**plain, "ls": "--"})
    axes.set_title("codes of ever more orbits")
    axes.set(xscale="log", yscale="log", ylabel="time (s)")
    axes.set_xlabel("orbits; dashed: first call, dotted: scaled")


def _in_order(group: Data) -> list[tuple[str, Data]]:
    return [(name, group[name]) for name in APPEARANCES if name in group]


def _order(name: str) -> float:
    return 3.0 + list(APPEARANCES).index(name)
