"""Parts that drawings share: colours, titles, legends, symbols, planes, ticks, axis labels.

Colours are Okabe and Ito's palette, safe for the colour-blind (M. Okabe and K. Ito, Color
Universal Design, 2008). In arrays of symbols black is 0, white is 1, grey is no symbol.
"""

from decimal import Decimal
from fractions import Fraction
from itertools import pairwise
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import BoundaryNorm, Colormap, ListedColormap
from matplotlib.figure import Figure
from matplotlib.font_manager import FontProperties
from matplotlib.image import AxesImage
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.text import Annotation
from matplotlib.textpath import text_to_path
from matplotlib.ticker import FixedFormatter, NullFormatter
from matplotlib.transforms import ScaledTranslation
from numpy.typing import ArrayLike, NDArray

from rigidpend.experiments.data import Field
from rigidpend.numbers import Array
from rigidpend.numbers.texts import NO_SYMBOL

WIDTH = 7.2
"""Width of a page, inches."""

BLUE, RED, GREEN = "#0072B2", "#D55E00", "#009E73"
PINK, ORANGE = "#CC79A7", "#E69F00"

SEPARATRIX = {1: GREEN, 2: BLUE, 3: PINK, 4: RED}
"""Colour of each separatrix."""

ZOOM, DOUBT, ZERO, NO_RETURN = RED, PINK, BLUE, "0.7"
"""Colours of a magnified part, an uncertain symbol, a zero of Melnikov's integral, no return."""
PROVEN = GREEN
"""Colour of a proven symbol's dot."""
SYMBOL_COLOURS = ListedColormap(["black", "white", NO_RETURN])
"""Colours of the codes 0, 1 and `NO_SYMBOL`, in the order of the intervals of `SYMBOL_NORM`."""
SYMBOL_NORM = BoundaryNorm([-0.5, 0.5, 1.5, NO_SYMBOL + 0.5], 3)

LINES = ((0.9, "0.0"), (0.55, "0.12"), (0.3, "0.25"))
"""Widths and greys of the lines where symbols 1, 2, 3 change."""

SEPARATRIX_NAMES = (
    "$\\beta_0-\\alpha_0$\n",
    "$\\beta_0+\\alpha_0$\n",
    "$\\beta_0-\\alpha_0$\n$+2\\pi$",
    "$\\beta_0+\\alpha_0$\n$+2\\pi$",
    "$\\beta_0-\\alpha_0$\n$+4\\pi$",
)
"""Labels of the separatrices 1, 2, 3, 4 and 1 again, by theta1 as in (sol_1)-(sol_22)."""
CLOSE = 0.14
"""Distance of places, as a share of the axis, below which labels are set apart to not overlap."""

APART = 2
"""Points by which such labels stand off their places."""


def axis_label(field: Field) -> str:
    """Label of an axis: the symbol of a field, with its unit unless it is 1."""
    return field.symbol if field.units == "1" else f"{field.symbol} ({field.units})"


def decimals(number: Fraction, places: int) -> str:
    """A number as text, rounded to `places` digits after the point."""
    return f"{Decimal(f'{round(number * 10**places)}e-{places}'):f}"


def power(x: float) -> str:
    """A positive number in three digits, as mathematics: a small one with its power of ten."""
    if x >= 2e-3:
        return f"{x:.3g}"
    digits, exponent = f"{x:.2e}".split("e")
    factor = f"{float(digits):g}" + r"\cdot "
    return ("" if float(digits) == 1 else factor) + f"10^{{{int(exponent)}}}"


def logarithmic_ticks(axes: Axes, values: Array) -> None:
    """Label an axis across, logarithmic, by powers of ten, or by the ends of a short one."""
    low, high = float(values.min()), float(values.max())
    # Over two decades there is a power of ten inside, and matplotlib labels nothing in between.
    if high < 100 * low:
        axes.set_xticks([low, high], [f"${power(x)}$" for x in (low, high)])
        axes.xaxis.set_minor_formatter(NullFormatter())


def inches(said: str, size: float) -> float:
    """Width of a line of a size in points, in which nothing is a formula."""
    font = FontProperties(size=size)
    return float(text_to_path.get_text_width_height_descent(said, font, ismath=False)[0]) / 72


def fitting(said: str, size: float, room: float) -> str:
    """A text, with its middle left out if it is wider than a room in inches."""
    short, half = said, (len(said) - 1) // 2
    while half and inches(short, size) > room:
        short, half = f"{said[:half]}\u2026{said[-half:]}", half - 1
    return short


FLATTEST = 0.1
"""Least height of a hodograph over its width, or width over its height, drawn in one scale."""


def label_hodograph(axes: Axes) -> None:
    """Set the labels and the scale of a curve (omega_zeta, omega_xi), of one if it is not flat."""
    # With a nearly symmetric body omega_xi is some thousandth of omega_zeta: a line in one scale.
    low, high = sorted(axes.dataLim.size)
    axes.set_aspect("equal" if low > FLATTEST * high else "auto")
    if low <= FLATTEST * high:
        # A flat curve ends at the panel's edges: room for the names of its ends.
        axes.margins(x=0.12)
    axes.set(xlabel=r"$\omega_\zeta$ ($1/t$)", ylabel=r"$\omega_\xi$ ($1/t$)")


def title(axes: Axes, letter: str, text: str, size: float = 8.5) -> None:
    """Title of a panel, behind its letter."""
    axes.set_title(f"{letter})  {text}", loc="left", fontsize=size)


def entry(label: str, **look: Any) -> Line2D:
    """Legend entry for lines or marks of a given look."""
    return Line2D([], [], label=label, **look)


def symbol_entries(zero: str = r"$z_i = 0$ (left)", one: str = r"$z_i = 1$ (right)") -> list[Patch]:
    """Legend entries of the two symbols."""
    return [
        Patch(facecolor="black", edgecolor="0.6", label=zero),
        Patch(facecolor="white", edgecolor="0.6", label=one),
    ]


def beside(
    axes: Axes, text: str, place: Any, right: float, above: float, **look: Any
) -> Annotation:
    """Write a text beside a place, offset to the right and above by points."""
    return axes.annotate(text, place, (right, above), textcoords="offset points", **look)


def arrow(axes: Axes, start: Any, end: Any, **look: Any) -> Annotation:
    """Draw an arrow between two places, which may lie outside of the panel."""
    look = {"arrowstyle": "-|>", **look}
    return axes.annotate("", end, start, arrowprops=look, annotation_clip=False)


def say_nothing_found(axes: Axes, said: str) -> None:
    """Say in the middle of a panel that it has nothing to show; without data ticks are invented."""
    axes.text(0.5, 0.5, said, ha="center", transform=axes.transAxes)
    axes.set(xticks=[], yticks=[])


def legend_above(axes: Axes, handles: list[Any], ncols: int) -> None:
    """Put a legend on the upper right edge of a panel, beside its title."""
    look: dict[str, Any] = {"ncols": ncols, "fontsize": 7.5, "borderaxespad": 0.1}
    axes.legend(handles=handles, loc="lower right", bbox_to_anchor=(1.0, 1.0), **look)


def panel(figure: Figure, left: float, bottom: float, width: float, height: float) -> Axes:
    """Add axes to a figure in inches, from its lower left corner."""
    wide, high = map(float, figure.get_size_inches())
    return figure.add_axes((left / wide, bottom / high, width / wide, height / high))


def column_edges(phases: Array) -> Array:
    """Edges of columns, halfway between their phases."""
    # A single column has no neighbour to derive a width from; any width shows it.
    step = np.diff(phases) if phases.size > 1 else np.array([1.0])
    inner = phases[:-1] + np.diff(phases) / 2
    return np.concatenate(([phases[0] - step[0] / 2], inner, [phases[-1] + step[-1] / 2]))


def draw_codes(
    axes: Axes,
    edges: Array,
    codes: NDArray[np.uint8],
    cmap: Colormap = SYMBOL_COLOURS,
    norm: BoundaryNorm = SYMBOL_NORM,
    **look: Any,
) -> None:
    """Draw an array of codes, (symbols, columns), between column edges; symbol 1 at the bottom."""
    rows = len(codes)
    axes.pcolormesh(edges, np.arange(rows + 1) + 0.5, codes, cmap=cmap, norm=norm, **look)
    axes.set_yticks([1, *range(5, rows + 1, 5)] if rows <= 40 else [1, rows])
    axes.set_ylabel("$i$", rotation=0, va="center", labelpad=6)


def mark_doubt(axes: Axes, x: Array, certain: NDArray[np.bool_], size: float = 3.0) -> None:
    """Cross out the cells of an array of codes that are not certain."""
    row, column = np.nonzero(~certain)
    if row.size:
        axes.plot(x[column], row + 1, "x", color=DOUBT, ms=size, mew=0.3 * size)


def cell_ends(values: Array) -> tuple[float, float]:
    """The outer ends of a row of cells, from their evenly spaced middles."""
    half = (values[1] - values[0]) / 2
    return float(values[0] - half), float(values[-1] + half)


def holds(values: Array, value: float) -> bool:
    """True if a row of cells, of which these are the middles, has a value between its ends."""
    low, high = cell_ends(values)
    return low <= value <= high


def draw_cells(axes: Axes, x: Array, y: Array, values: Array, **colours: Any) -> AxesImage:
    """Draw the values of a plane of cells, (rows, columns), as colours; x, y are cell middles."""
    return axes.imshow(
        values,
        origin="lower",
        extent=(*cell_ends(x), *cell_ends(y)),
        aspect="auto",
        interpolation="nearest",
        **colours,
    )


def draw_changes(
    axes: Axes,
    x: Array,
    y: Array,
    codes: NDArray[np.uint8],
    lines: tuple[tuple[float, str], ...] = LINES,
) -> None:
    """Draw lines where the first symbols of codes (symbols, rows, columns) change."""
    for (width, grey), layer in reversed(list(zip(lines, codes, strict=False))):
        if (layer != layer.flat[0]).any():
            axes.contour(x, y, layer == 1, [0.5], colors=grey, linewidths=width)


def separatrix_ticks(axes: Axes, places: ArrayLike, digits: int) -> None:
    """Name the separatrices 1, 2, 3, 4 and 1 again on a theta1 axis that ends at the outer ones.

    `places` are their theta1, ascending, in radians, written with `digits` after the point.
    """
    x = np.asarray(places, dtype=float).tolist()
    labels = [
        f"{name}\n${place:.{digits}f}$" for name, place in zip(SEPARATRIX_NAMES, x, strict=True)
    ]
    axes.set_xticks(x)
    # By number: by their place two at one place would have one label.
    axes.xaxis.set_major_formatter(FixedFormatter(labels))
    texts = axes.get_xticklabels()
    for (left, right), (first, second) in zip(pairwise(x), pairwise(texts), strict=True):
        if right - left < CLOSE * (x[-1] - x[0]):
            for text, side, away in ((first, "right", -APART), (second, "left", APART)):
                text.set(horizontalalignment=side)
                # Both may stand at almost one place, where they would read as one number.
                moved = ScaledTranslation(away / 72, 0, axes.figure.dpi_scale_trans)
                text.set_transform(text.get_transform() + moved)
    axes.set_xlim(x[0], x[-1])
    axes.set_xlabel(r"$\theta_1$ (rad, modulo $4\pi$)", labelpad=3)
