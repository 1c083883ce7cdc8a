"""Figures as image files, drawn from result files alone, and one page of all of them.

An experiment's `draw.py` draws. No display is needed, and no integrator is imported. The metadata
of an image identify what it was drawn from: the bytes of the files, the drawing code, the style and
the libraries. An image is kept while these are the same.
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
"""Attributes in the metadata of an image, besides its experiment."""
PIXELS = 20_000
"""Longest side of an image, pixels."""
ENDS = {"png": b"IEND\xaeB`\x82", "svg": b"</svg>\n", "pdf": b"%%EOF\n"}
"""Formats of an image, by the suffix of its file, and the bytes with which such a file ends."""
LIBRARIES = ("matplotlib", "numpy", "pillow")
"""Libraries whose version may change a figure."""
FOOT, LINE, CHARACTER, MARGIN = 6, 0.11, 0.043, 0.1
"""Text at the foot: size in points; line height, mean character width and margin in inches."""
STYLE = Path(__file__).with_name("rigidpend.mplstyle")
"""Style sheet of all figures."""


OF_VALUES = (ValueError, ArithmeticError, LookupError, UserWarning, RuntimeWarning)
"""Errors that unchecked values of a foreign file may cause.

Warnings are errors if Python is told so: NumPy and matplotlib warn of values by these two. Other
errors, such as a missing name or a value of a type that layouts exclude, are faults of the program
and are reported as such."""


def render(source: Path, target: Path, *, force: bool = False) -> bool:
    """Draw a result into a file whose suffix is the format, unless the image there is up to date.

    Returns True if it was drawn; `force` draws it in any case. If a certificate is beside the
    result, proven symbols are marked. StoreError if the result cannot be read, or the figure cannot
    be written.
    """
    origin = drawn_from(source, str(store.attributes(source)["experiment"]))
    if not force and kept(target, origin):
        return False
    files.make_way(target)
    result = storage.marked(store.load(source), storage.beside(source))
    try:
        drawn = image(result, target.suffix[1:], origin)
    except OF_VALUES as error:
        raise files.StoreError.of(source, f"cannot be drawn: {wording.error(error)}") from error
    files.write(target, drawn)
    return True


def drawn_from(source: Path, experiment: str) -> str:
    """Fingerprint of everything that the image of a result depends on."""
    drawing = inside("experiments", experiment, "draw.py")
    own = [inside("render", name) for name in ("__init__.py", "captions.py")]
    every = source, storage.certificate_of(source)
    parts = [files.content(each) if each.is_file() else b"" for each in every]
    parts += [STYLE.read_bytes(), code_hash_of(drawing, *own).encode()]
    parts += [installed.version(name).encode() for name in LIBRARIES]
    digests = (hashlib.sha256(part).digest() for part in parts)
    return hashlib.sha256(b"".join(digests)).hexdigest()


def kept(target: Path, origin: str) -> bytes | None:
    """The existing image, if it is complete and was drawn from this origin; else None."""
    try:
        found = target.read_bytes()
    except OSError:
        return None
    whole = found.endswith(ENDS[target.suffix[1:]])
    return found if whole and origin.encode() in found else None


def settle() -> None:
    """Settle what matplotlib, before its import, takes from its surroundings and says of them."""
    # A figure in a file needs no display; an unknown backend in the user's environment would stop
    # matplotlib's import.
    os.environ["MPLBACKEND"] = "agg"
    # It warns where it cannot keep its cache of fonts, and fontTools of the dates in these.
    for name in ("matplotlib", "fontTools"):
        logging.getLogger(name).setLevel(logging.ERROR)


def image(result: Loaded, suffix: str, origin: str = "") -> bytes:
    """Draw a loaded result as the bytes of a file, whose format is one of `ENDS`.

    Its metadata have the `origin`, as of :func:`drawn_from`. One of `OF_VALUES` if its values
    cannot be drawn, as layouts declare no ranges.
    """
    settle()
    import matplotlib

    told = {**result["attributes"], "drawn_from": origin}
    with matplotlib.rc_context(fname=STYLE):
        figure = experiments.drawing(told["experiment"]).draw(result)
        return _image(figure, suffix, told, captions.foot(result))


def _image(figure: Figure, suffix: str, attributes: Any, foot: Sequence[str]) -> bytes:
    """Write a figure with lines on what it shows and on its body below, as bytes."""
    buffer = io.BytesIO()
    from matplotlib import rcParams
    from matplotlib.transforms import Bbox

    from rigidpend.experiments.plots import inches

    wide, high = map(float, figure.get_size_inches())
    room = max(20, int((wide - 2 * MARGIN) / CHARACTER))
    lines = _wrapped(foot, room)
    # Digits and capitals are wider than the mean.
    while room > 20 and max(inches(x, FOOT) for x in lines) > wide - 2 * MARGIN:
        room -= 1
        lines = _wrapped(foot, room)
    below = LINE * len(lines) + MARGIN
    figure.text(
        MARGIN / wide,
        -MARGIN / 2 / high,
        "\n".join(lines),
        va="top",
        fontsize=FOOT,
        color="0.35",
        linespacing=LINE * 72 / FOOT / 1.2,
        # A name may contain a dollar sign, which must not begin a formula.
        parse_math=False,
    )
    engine = figure.get_layout_engine()
    if engine is not None:
        # Laid out once, before room for the foot changes the edges. With a layout engine that
        # does nothing matplotlib would draw everything twice.
        engine.execute(figure)
        figure.set_layout_engine(None)
    for legend in figure.legends:
        # A legend of the whole figure without an anchor would follow the new edge.
        if legend.get_bbox_to_anchor() is figure.bbox:
            legend.set_bbox_to_anchor((0, 0, 1, 1), figure.transFigure)
    # A large figure gets fewer pixels per inch, because an image has a largest size.
    dpi = min(rcParams["savefig.dpi"], PIXELS / max(wide, high + below))
    box = Bbox.from_extents(0, -below, wide, high)
    figure.savefig(
        buffer, format=suffix, metadata=metadata(suffix, attributes), dpi=dpi, bbox_inches=box
    )
    return buffer.getvalue()


def _wrapped(foot: Sequence[str], room: int) -> list[str]:
    return [line for said in foot for line in textwrap.wrap(said, room)]


def metadata(suffix: str, attributes: Any) -> dict[str, str | None]:
    """Metadata of an image in a format: the fingerprint of the result that it shows.

    Times, the commit and the machine are left out, so that equal results give equal images;
    they are in the result file, which the fingerprint identifies.
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
