"""Draw how the tables of return maps decay, and measure where the maps end.

    .venv/bin/python scripts/map_page.py [--limits]

Writes docs/static/return_map.png, and with ``--limits`` (some minutes) the table of
docs/return-map.md between its marks.
"""

import argparse
import contextlib
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from rigidpend.experiments.plots import BLUE, GREEN, ORANGE, RED, WIDTH
from rigidpend.machine.wording import Table
from rigidpend.mechanics.body import Body
from rigidpend.numbers.exact import exact
from rigidpend.orbits.return_map import MapError, ReturnMap, kernel, return_map
from rigidpend.orbits.return_map.build import table_bits
from rigidpend.orbits.return_map.normal_form import powers
from rigidpend.render import STYLE
from rigidpend.routes.map_start import start_Qp
from rigidpend.routes.problem import RouteProblem
from scripts.readme_tables import ROOT, write_table

PICTURE, PAGE = ROOT / "docs" / "static" / "return_map.png", ROOT / "docs" / "return-map.md"
A, R, H0 = (2, 1, "3/2"), (1, 1, 0), "1.3342"
"""The body of Fig. 4."""
WEIGHTS = ("0.001", "0.01", "0.03")
LOOKS = ((BLUE, "o", "-"), (ORANGE, "s", "--"), (RED, "^", ":"))
BODIES: dict[str, tuple[Any, Any, str]] = {
    "Fig. 4: A = 2, 1, 3/2; r along (1, 1, 0)": (A, R, H0),
    "Fig. 5: A = 2, 3/2, 9/5; r along (0, 1, 0)": ((2, "1.5", "1.8"), (0, 1, 0), "10/9"),
}
RATIOS = (0.001, 0.01, 0.02, 0.03, 0.045, 0.06)
"""Values of mu/h0 that are tried, up to the first that is refused."""
GROWING = ("1e-6", "0.001", "0.01", "0.03", "0.045", "0.06", "0.08")
"""Values of mu of the body of Fig. 4 whose maps' sizes are told."""


def main() -> None:
    """Draw the figure; measure the limits if that is asked for."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--limits", action="store_true", help="measure the tables, some minutes")
    given = parser.parse_args()
    with matplotlib.rc_context(fname=STYLE):
        draw([_map(mu) for mu in WEIGHTS]).savefig(PICTURE)
    if given.limits:
        write_table(PAGE, "limits", limits_table(list(measured(BODIES))))
        write_table(PAGE, "sizes", sizes_table(GROWING))


def _map(mu: str) -> ReturnMap:
    half = exact(mu)
    ends = exact(H0) - half, exact(H0) + half
    return return_map(Body(A, R, mu), h=ends, bits=table_bits(53))


def draw(maps: Sequence[ReturnMap]) -> Figure:
    """Draw the decay of the normal form, and of the charts in each of their variables."""
    figure = Figure(figsize=(WIDTH, 3.0), layout="constrained")
    panels = figure.subplots(1, 4, sharey=True)
    for made, mu, (colour, marker, line) in zip(maps, WEIGHTS, LOOKS, strict=False):
        style = {"color": colour, "marker": marker, "ls": line, "ms": 3, "lw": 0.9}
        decays = [normal_form_decay(made), *chart_decays(made)]
        for axes, (order, size) in zip(panels, decays, strict=True):
            axes.plot(order, size, label=rf"$\mu = {float(mu):g}$", **style)
    names = (
        "degree $j + k$",
        "Chebyshev order in $d$",
        r"harmonic of $\chi$",
        "Chebyshev order in $h$",
    )
    for letter, axes, name in zip("abcd", panels, names, strict=True):
        _finish(axes, letter, name)
    panels[0].set_ylabel("largest coefficient, relative")
    panels[0].set_title("a)  normal form", loc="left")
    panels[0].legend(fontsize=7)
    return figure


def _finish(axes: Axes, letter: str, name: str) -> None:
    axes.set_yscale("log")
    axes.set_ylim(1e-21, 3)
    axes.axhline(2.0**-53, color=GREEN, lw=0.8)
    axes.text(0.04, 2.0**-53, "doubles", ha="left", va="top", fontsize=6.5, color=GREEN,
              transform=axes.get_yaxis_transform())  # fmt: skip
    axes.set_xlabel(name)
    axes.set_title(f"{letter})  charts", loc="left")
    axes.grid(alpha=0.25, lw=0.4)


def normal_form_decay(made: ReturnMap) -> tuple[Any, Any]:
    """Degrees of the normal form, and the largest term at its border in each, relative."""
    nf = made.normal_form
    degrees = powers(nf.degree, 1).sum(axis=1)
    sizes = np.abs(nf.odd[:, :2].astype(float)).max(axis=(0, 1)) * nf.radius**degrees
    return _largest(degrees, sizes)


def chart_decays(made: ReturnMap) -> Iterator[tuple[Any, Any]]:
    """Orders in d, chi and h, and the largest coefficient of U, V and the time in each."""
    table = made.charts[1].forward
    values = np.abs(table.values[..., :3].astype(float))
    values = values.reshape(-1, table.n_x, table.n_phase, 3)
    values = (values / values.max(axis=(0, 1, 2))).max(axis=3)
    for axis, order in ((1, np.arange(table.n_x)), (2, (np.arange(table.n_phase) + 1) // 2),
                        (0, np.arange(len(values)))):  # fmt: skip
        rest = tuple(k for k in range(3) if k != axis)
        yield _largest(order, values.max(axis=rest))


def _largest(order: Any, sizes: Any) -> tuple[Any, Any]:
    """The largest size of each order, relative to the largest of all; zeros left out."""
    known = np.unique(order)
    found = np.array([sizes[order == k].max() for k in known]) / sizes.max()
    return known[found > 0], found[found > 0]


def sizes_table(weights: Sequence[str]) -> Table:
    """The sizes of maps of 64 bits at one energy, and the errors that they state."""
    rows = []
    for mu in weights:
        try:
            made = return_map(Body(A, R, mu), h=H0, bits=64)
            o = made.orders
            told = [*map(str, (o.degree, o.n_x, o.n_phase)), f"{made.errors.charts:.0e}"]
        except MapError as error:
            told = ["refused:", str(error).partition(":")[0], "", ""]
        rows.append((mu, *told))
    return Table("", ("mu", "degree", "nodes in d", "phases", "error of charts"), rows)


def measured(bodies: dict[str, tuple[Any, Any, str]]) -> Iterator[tuple[str, ...]]:
    """Rows of the table of limits, a body each: the reach in mu/h0 and in J1_0."""
    for name, (moments, direction, h0) in bodies.items():
        served: list[tuple[float, float]] = []
        reason = "none of those tried"
        for ratio in RATIOS:
            body = Body(moments, direction, ratio * float(exact(h0)))
            try:
                served.append((ratio, largest_start(body, h0)))
            except MapError as error:
                reason = str(error).partition(":")[0]
                break
        reach = {ratio: f"{start:.0e}" for ratio, start in served}
        tried = [reach.get(ratio, "-") for ratio in (0.001, 0.01, 0.03)]
        yield name, f"{served[-1][0]:g}" if served else "none", *tried, reason


def largest_start(body: Body, h0: str) -> float:
    """The largest J1_0, a power of ten, from which a map follows orbits; no least one is known.

    Raises
    ------
    MapError
        There is no map at the energy h0, or no start within it.
    """
    made, zero = return_map(body, h=h0, bits=table_bits(53)), np.zeros(1)
    for exponent in range(-1, -17, -1):
        problem = RouteProblem(body, exact(h0), exact(f"1e{exponent}"), 1)
        Qp = start_Qp(problem, "1", made.bits)
        with contextlib.suppress(MapError):
            program = made.program(53, Qp, Qp)
            begin = kernel.follow(program, np.array([float(Qp)]), zero, zero, 1)
            if begin.separatrix[0, 0]:
                return 10.0**exponent
    raise MapError("no start lies within the normal form")


def limits_table(rows: Sequence[tuple[str, ...]]) -> Table:
    """The table of where maps end."""
    starts = (f"largest J1_0 at {ratio}" for ratio in (0.001, 0.01, 0.03))
    header = ("body", "largest mu/h0", *starts, "the next is refused, for")
    tried = ", ".join(f"{ratio:g}" for ratio in RATIOS)
    note = f"Tried were mu/h0 = {tried}, at the energy h0, tables in 64 bits."
    return Table("", header, list(rows), note)


if __name__ == "__main__":
    sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
    main()
