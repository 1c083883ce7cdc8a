"""Work-precision diagrams: time against error, a panel a problem; then cost against size."""

from __future__ import annotations

from itertools import chain
from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from rigidpend.render.palette import BLUE, GREEN, ORANGE, PINK, RED, WIDTH

ROW, FOOT = 2.35, 1.25
"""Inches: the height of a row of panels, the room of the legend."""
LARGEST = 3.0
"""Errors beyond, which are of the size of the answer, are not drawn."""

OURS, SPLITTING, HEYOKA, SCIPY, JAX = BLUE, GREEN, ORANGE, RED, PINK


class Look(NamedTuple):
    """How a method is drawn."""

    label: str
    colour: str
    marker: str
    line: Any = "-"
    width: float = 0.8


LOOKS = {
    "scipy_rk45": Look("SciPy RK45", SCIPY, "o", ":"),
    "scipy_dop853": Look("SciPy DOP853", SCIPY, "s"),
    "scipy_radau": Look("SciPy Radau", SCIPY, "^", "-."),
    "scipy_lsoda": Look("SciPy LSODA", SCIPY, "v", "--"),
    "splitting_2": Look("splitting, order 2", SPLITTING, "o", ":"),
    "splitting_4": Look("splitting, order 4", SPLITTING, "s", "-."),
    "splitting_6": Look("splitting, order 6", SPLITTING, "^", "--"),
    "splitting_8": Look("splitting, order 8", SPLITTING, "D"),
    "diffrax": Look("diffrax Dopri8, vmapped", JAX, "P"),
    "heyoka_eq1": Look("heyoka, plain, (eq1)", HEYOKA, "o", "--"),
    "heyoka_principal": Look("heyoka, plain, Euler-Poisson", HEYOKA, "s"),
    "aligned_113": Look("ours, 113 bits", OURS, "X", ""),
    "aligned_64": Look("ours, 64 bits", OURS, "P", ""),
    "aligned_scalar": Look("ours, scalar", OURS, "o", "--", 1.2),
    "aligned_batch": Look("ours, batch", OURS, "s", "-", 2.0),
    "route_codes": Look("ours, every symbol certain", "black", "o", "-", 2.0),
    "closed_form": Look("ours, closed form", "black", "*", ""),
}
"""In the order in which they are drawn: ours lies above."""


def draw(result: Any) -> Figure:
    """Draw all panels of a result.

    Parameters
    ----------
    result : dict
        Of the experiment `bench`, as loaded.
    """
    data = result["data"]
    problems = [group for name, group in data.items() if name != "scaling"]
    has_codes = "wrong_symbols" in data.get("codes", {}).get("route_codes", {})
    panels = len(problems) + len(data["scaling"]) + has_codes
    rows = -(-panels // 2)
    figure = Figure(figsize=(WIDTH, ROW * rows + FOOT))
    figure.set_layout_engine("constrained", w_pad=0.06, h_pad=0.06)
    grid = figure.subplots(rows, 2, squeeze=False).ravel()
    letters = iter("abcdefghij")
    for axes, group in zip(grid, problems, strict=False):
        _draw_problem(axes, group)
        axes.set_title(f"{next(letters)})  {group['title']}", loc="left")
    for axes, (name, group) in zip(grid[len(problems) :], data["scaling"].items(), strict=False):
        _draw_scaling(axes, name, group)
        axes.set_title(f"{next(letters)})  route codes, against {name}", loc="left")
    if has_codes:
        _draw_right(grid[panels - 1], data["codes"])
        grid[panels - 1].set_title(f"{next(letters)})  every symbol right", loc="left")
    for axes in grid[panels:]:
        axes.set_axis_off()
    shown = set(chain.from_iterable(problems)) & set(LOOKS)
    figure.legend(handles=_legend(shown), loc="outside lower center", ncols=3, columnspacing=1.5)
    return figure


def _draw_problem(axes: Axes, group: Any) -> None:
    """Time against error; a hollow mark was extrapolated or measured fewer times than asked."""
    for name, look in LOOKS.items():
        record = group.get(name, {})
        if "error" not in record:
            continue
        error = np.maximum(record["error"], np.finfo(float).eps)
        kept = np.isfinite(error) & (error <= LARGEST)
        x, y = error[kept], record["seconds"][kept]
        style = "-" if look.line == "" else look.line
        axes.plot(x, y, color=look.colour, ls=style, lw=look.width, zorder=_order(name), label=name)
        _mark(axes, x, y, look, name, _whole(record)[kept])
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.invert_xaxis()
    axes.set_xlabel(_axis(str(group["title"])))
    axes.set_ylabel("time (s)")
    axes.grid(alpha=0.25, lw=0.4)


def _draw_scaling(axes: Axes, name: str, group: Any) -> None:
    field = {"orbits": "columns", "symbols": "n_symbols"}[name]
    for method, look in LOOKS.items():
        record = group.get(method, {})
        if field not in record:
            continue
        x, y = record[field], record["seconds"]
        axes.plot(
            x,
            y,
            color=look.colour,
            ls=look.line,
            lw=look.width,
            zorder=_order(method),
            label=method,
        )
        _mark(axes, x, y, look, method, np.ones(len(x), dtype=bool))
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.set_xlabel({"orbits": "number of orbits", "symbols": "number of symbols"}[name])
    axes.set_ylabel("time (s)")
    axes.grid(alpha=0.25, lw=0.4)


def _draw_right(axes: Axes, group: Any) -> None:
    """The time to have every symbol right, at the loosest tolerance of each method that does."""
    times = {}
    for name in LOOKS:
        right = group.get(name, {}).get("wrong_symbols", np.ones(1)) == 0
        if right.any():
            times[name] = float(group[name]["seconds"][np.flatnonzero(right)[0]])
    middle = np.sqrt(min(times.values()) * max(times.values()))
    for row, name in enumerate(sorted(times, key=lambda name: -times[name])):
        look, seconds = LOOKS[name], times[name]
        axes.plot(seconds, row, look.marker, color=look.colour, ms=5, label=name)
        fast = seconds <= middle
        axes.annotate(
            look.label.removesuffix(", vmapped"),
            (seconds, row),
            (7 if fast else -7, 0),
            textcoords="offset points",
            ha="left" if fast else "right",
            va="center",
            fontsize=7,
        )
    axes.set_xscale("log")
    axes.set_xlim(min(times.values()) / 3, max(times.values()) * 3)
    axes.set_ylim(-0.7, len(times) - 0.3)
    axes.set_yticks([])
    axes.set_xlabel("time (s)")
    axes.grid(axis="x", alpha=0.25, lw=0.4)


def _mark(axes: Axes, x: Any, y: Any, look: Look, name: str, whole: Any) -> None:
    size = 9.0 if look.marker == "*" else 3.4
    for mask, face in ((whole, look.colour), (~whole, "white")):
        axes.plot(
            x[mask],
            y[mask],
            look.marker,
            color=look.colour,
            mfc=face,
            ms=size,
            mew=0.7,
            zorder=_order(name) + 0.5,
            label=f"{name}, marks",
        )


def _whole(record: Any) -> Any:
    """Which points were followed to the end, where that is told."""
    if "reach" not in record:
        return np.ones(len(record["error"]), dtype=bool)
    return record["reach"] >= (1 - 1e-9) * record["asked"]


def _order(name: str) -> float:
    return 3.0 + list(LOOKS).index(name)


def _axis(title: str) -> str:
    if "integrals" in title:
        return "largest relative drift"
    if "codes" in title:
        return "median error of the crossing times ($t'$)"
    return "error of alpha (rad)" if "alpha" in title else "error (relative)"


def _legend(shown: set[str]) -> list[Line2D]:
    return [
        Line2D(
            [],
            [],
            color=look.colour,
            ls=look.line or "none",
            lw=look.width,
            marker=look.marker,
            ms=7 if look.marker == "*" else 3.8,
            label=look.label,
        )
        for name, look in reversed(LOOKS.items())
        if name in shown
    ]
