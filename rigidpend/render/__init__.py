"""Figures from result files: one module an experiment. Nothing is computed here.

Each has ``draw(result) -> Figure``, from what `store.load` gives. No display is needed, and no
integrator is imported.
"""

from __future__ import annotations

import io
import os
from pathlib import Path
from typing import Any

from rigidpend import experiments
from rigidpend.certified import storage
from rigidpend.results import store, words

KEYS = ("name", "config_hash", "code_hash", "engine")
"""Attributes that an image tells, besides its experiment."""
PIXELS = 20_000
"""The longest side of an image."""
FORMATS = ("png", "svg", "pdf")
STYLE = Path(__file__).with_name("rigidpend.mplstyle")


class Undrawable(store.StoreError):
    """A result whose values cannot be drawn, as those of a foreign file."""


def render(source: Path, target: Path) -> None:
    """Draw a result file; the suffix of `target` is the format.

    Where a certificate is beside it, what that proves is marked.

    Raises
    ------
    StoreError
        The result cannot be read, or the figure not written.
    """
    result = storage.marked(store.load(source), storage.beside(source))
    try:
        drawn = image(result, target.suffix[1:])
    except Undrawable as error:
        raise Undrawable(f"{source}: {error}") from error
    try:
        store.replace(target, drawn)
    except OSError as error:
        raise store.StoreError(f"{target}: cannot be written: {error.strerror}") from None


def image(result: Any, suffix: str) -> bytes:
    """Draw a loaded result, as the bytes of a file of that format.

    Raises
    ------
    Undrawable
        Its values, of which the layout declares no range, cannot be drawn.
    """
    # What the user's shell says of a display does not matter to a figure in a file, and an
    # unknown backend there would stop matplotlib's import.
    os.environ["MPLBACKEND"] = "agg"
    import matplotlib

    with matplotlib.rc_context(fname=STYLE):
        drawing = experiments.drawing(result["attributes"]["experiment"])
        try:
            return _image(drawing.draw(result), suffix, result["attributes"])
        except MemoryError:
            raise
        except Exception as error:
            # A file may hold any values: what an algorithm makes of them cannot be foreseen.
            raise Undrawable(f"cannot be drawn: {words.error(error)}") from error


def _image(figure: Any, suffix: str, attributes: Any) -> bytes:
    """Write a figure, as bytes."""
    buffer = io.BytesIO()
    from matplotlib import rcParams

    # Beyond so many pixels no image is made: a figure of many parts has fewer in an inch.
    dpi = min(rcParams["savefig.dpi"], PIXELS / max(figure.get_size_inches()))
    told = metadata(suffix, attributes)
    figure.savefig(buffer, format=suffix, metadata=told, dpi=dpi)
    return buffer.getvalue()


def metadata(suffix: str, attributes: Any) -> dict[str, str | None]:
    """Metadata of an image: the fingerprint of the result that it shows.

    Times, the commit and the machine are left out, so that equal results give equal images;
    they are in the result file, to which the fingerprint leads.

    Parameters
    ----------
    suffix : str
        One of `FORMATS`.
    attributes : mapping
        Root attributes of the result file.
    """
    known = {key: str(attributes.get(key, "unknown")) for key in KEYS}
    title = f"rigidpend {known['name']}, config {known['config_hash']}"
    marks = {
        "Experiment": str(attributes["experiment"]),
        "Config-Hash": known["config_hash"],
        "Code-Hash": known["code_hash"],
        "Engine": known["engine"],
    }
    text = "; ".join(f"{key}: {value}" for key, value in marks.items())
    return {
        "png": {"Software": None, "Title": title, **marks},
        "svg": {"Date": None, "Creator": None, "Title": title, "Description": text},
        "pdf": dict.fromkeys(("CreationDate", "Creator", "Producer"))
        | {"Title": title, "Subject": text},
    }[suffix]
