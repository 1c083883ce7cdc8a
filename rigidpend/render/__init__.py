"""Figures from result files: one module an experiment. Nothing is computed here.

Each has ``draw(result) -> Figure``, from what `store.load` gives. No display is needed, and no
integrator is imported. An image says in its metadata what it was drawn from: the bytes of the
files, the code that draws, the style and the libraries. One that says what is there now is kept.
"""

from __future__ import annotations

import hashlib
import io
import logging
import os
import textwrap
from collections.abc import Sequence
from importlib import metadata as installed
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rigidpend import experiments
from rigidpend.experiments.data import Loaded
from rigidpend.machine import files, wording
from rigidpend.machine.code_hash import code_hash_of, inside
from rigidpend.render import captions
from rigidpend.results import store
from rigidpend.runs import certificate_files as storage

if TYPE_CHECKING:
    from matplotlib.figure import Figure

KEYS = ("name", "config_hash", "code_hash", "engine", "drawn_from")
"""Attributes that an image tells, besides its experiment."""
PIXELS = 20_000
"""The longest side of an image."""
ENDS = {"png": b"IEND\xaeB`\x82", "svg": b"</svg>\n", "pdf": b"%%EOF\n"}
"""Formats of an image, by the suffix of its file, and the bytes with which such a file ends."""
LIBRARIES = ("matplotlib", "numpy", "pillow")
"""Libraries whose version may change a figure."""
FOOT, LINE, CHARACTER, MARGIN = 6, 0.11, 0.043, 0.1
"""Size of the text at the foot in points; its lines, its mean characters and margins in inches."""
STYLE = Path(__file__).with_name("rigidpend.mplstyle")
"""Style sheet of all figures."""


OF_VALUES = (ValueError, ArithmeticError, LookupError, UserWarning, RuntimeWarning)
"""Errors that values of a foreign file may cause, which nothing has checked.

Warnings are errors where Python is told so: of values NumPy and matplotlib give these two.
Others, as a name that is not there or a value of a type that layouts exclude, are faults of the
program: they are told as such."""


class Undrawable(store.StoreError):
    """A result whose values cannot be drawn, as those of a foreign file."""


def render(source: Path, target: Path, *, force: bool = False) -> bool:
    """Draw a result into a file whose suffix is the format, unless the image there is up to date.

    Whether it was drawn; `force` draws it even so. Where a certificate is beside the result, what
    that proves is marked. StoreError where the result cannot be read, or the figure not written.
    """
    origin = drawn_from(source, str(store.attributes(source)["experiment"]))
    if not force and kept(target, origin):
        return False
    files.make_way(target)
    result = storage.marked(store.load(source), storage.beside(source))
    try:
        drawn = image(result, target.suffix[1:], origin)
    except Undrawable as error:
        raise Undrawable.of(source, str(error)) from error
    files.write(target, drawn)
    return True


def drawn_from(source: Path, experiment: str) -> str:
    """Fingerprint of all that the image of a result of an experiment depends on."""
    drawing = inside("experiments", experiment, "draw.py")
    own = [inside("render", name) for name in ("__init__.py", "captions.py")]
    every = source, storage.certificate_of(source)
    parts = [files.content(each) if each.is_file() else b"" for each in every]
    parts += [STYLE.read_bytes(), code_hash_of(drawing, *own).encode()]
    parts += [installed.version(name).encode() for name in LIBRARIES]
    digests = (hashlib.sha256(part).digest() for part in parts)
    return hashlib.sha256(b"".join(digests)).hexdigest()


def kept(target: Path, origin: str) -> bytes | None:
    """The image that is there, if it is whole and was drawn from just that; None if not."""
    try:
        found = target.read_bytes()
    except OSError:
        return None
    whole = found.endswith(ENDS[target.suffix[1:]])
    return found if whole and origin.encode() in found else None


def image(result: Loaded, suffix: str, origin: str = "") -> bytes:
    """Draw a loaded result as the bytes of a file, whose format is one of `ENDS`.

    It tells what it was drawn from, :func:`drawn_from`. Undrawable is raised of values, of which
    the layout declares no range, that cannot be drawn.
    """
    # What the user's shell says of a display does not matter to a figure in a file, and an
    # unknown backend there would stop matplotlib's import.
    os.environ["MPLBACKEND"] = "agg"
    import matplotlib

    # It warns of the dates in matplotlib's own fonts.
    logging.getLogger("fontTools").setLevel(logging.ERROR)
    told = {**result["attributes"], "drawn_from": origin}
    with matplotlib.rc_context(fname=STYLE):
        try:
            figure = experiments.drawing(told["experiment"]).draw(result)
            return _image(figure, suffix, told, captions.foot(result))
        except OF_VALUES as error:
            raise Undrawable(f"cannot be drawn: {wording.error(error)}") from error


def _image(figure: Figure, suffix: str, attributes: Any, foot: Sequence[str]) -> bytes:
    """Write a figure with lines on what it shows and on its body below, as bytes."""
    buffer = io.BytesIO()
    from matplotlib import rcParams
    from matplotlib.transforms import Bbox

    wide, high = map(float, figure.get_size_inches())
    room = max(20, int((wide - 2 * MARGIN) / CHARACTER))
    lines = [line for said in foot for line in textwrap.wrap(said, room)]
    below = LINE * len(lines) + MARGIN
    figure.text(
        MARGIN / wide,
        -MARGIN / 2 / high,
        "\n".join(lines),
        va="top",
        fontsize=FOOT,
        color="0.35",
        linespacing=LINE * 72 / FOOT / 1.2,
        # A name may hold a dollar sign, which is drawn as it is.
        parse_math=False,
    )
    engine = figure.get_layout_engine()
    if engine is not None:
        # Laid out before the line below changes the edges. An engine that only does nothing
        # would make matplotlib draw everything once more.
        engine.execute(figure)
        figure.set_layout_engine(None)
    for legend in figure.legends:
        # One that is not anchored would follow the new edge.
        if legend.get_bbox_to_anchor() is figure.bbox:
            legend.set_bbox_to_anchor((0, 0, 1, 1), figure.transFigure)
    # Beyond so many pixels no image is made: a figure of many parts has fewer in an inch.
    dpi = min(rcParams["savefig.dpi"], PIXELS / max(wide, high + below))
    box = Bbox.from_extents(0, -below, wide, high)
    figure.savefig(
        buffer, format=suffix, metadata=metadata(suffix, attributes), dpi=dpi, bbox_inches=box
    )
    return buffer.getvalue()


def metadata(suffix: str, attributes: Any) -> dict[str, str | None]:
    """Metadata of an image of that format: the fingerprint of the result that it shows.

    Times, the commit and the machine are left out, so that equal results give equal images;
    they are in the result file, to which the fingerprint leads.
    """
    known = {key: str(attributes.get(key, "unknown")) for key in KEYS}
    title = f"rigidpend {known.pop('name')}, config {known['config_hash']}"
    marks = {key.replace("_", "-").title(): value for key, value in known.items()}
    marks = {"Experiment": str(attributes["experiment"]), **marks}
    text = "; ".join(f"{key}: {value}" for key, value in marks.items())
    return {
        "png": {"Software": None, "Title": title, **marks},
        "svg": {"Date": None, "Creator": None, "Title": title, "Description": text},
        "pdf": dict.fromkeys(("CreationDate", "Creator", "Producer"))
        | {"Title": title, "Subject": text},
    }[suffix]
