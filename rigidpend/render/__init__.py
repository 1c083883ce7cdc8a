"""Figures from result files: one module an experiment. Nothing is computed here.

Each has ``draw(result) -> Figure``, from what `store.load` gives. No display is needed, and no
integrator is imported.
"""

from __future__ import annotations

import importlib
import io
import os
from pathlib import Path
from typing import Any

from rigidpend import store

FORMATS = ("png", "svg", "pdf")
STYLE = Path(__file__).with_name("rigidpend.mplstyle")


def render(source: Path, target: Path) -> None:
    """Draw a result file; the suffix of `target` is the format.

    Raises
    ------
    StoreError
        The result cannot be read, or the figure not written.
    """
    drawn = image(store.load(source), target.suffix[1:])
    try:
        store.replace(target, drawn)
    except OSError as error:
        raise store.StoreError(f"{target}: cannot be written: {error.strerror}") from None


def image(result: Any, suffix: str) -> bytes:
    """A loaded result's figure, as the bytes of a file of that format."""
    # What the user's shell says of a display does not matter to a figure in a file, and an
    # unknown backend there would stop matplotlib's import.
    os.environ["MPLBACKEND"] = "agg"
    import matplotlib

    with matplotlib.rc_context(fname=STYLE):
        experiment = result["attributes"]["experiment"]
        figure = importlib.import_module(f"rigidpend.render.{experiment}").draw(result)
        return _image(figure, suffix, _title(result["attributes"]))


def _image(figure: Any, suffix: str, title: str) -> bytes:
    """The figure's bytes, with no time or version in them: equal results, equal images."""
    plain: dict[str, dict[str, Any]] = {
        "png": {"Software": None, "Title": title},
        "svg": {"Date": None, "Creator": None, "Title": title},
        "pdf": {"CreationDate": None, "Creator": None, "Producer": None, "Title": title},
    }
    buffer = io.BytesIO()
    figure.savefig(buffer, format=suffix, metadata=plain[suffix])
    return buffer.getvalue()


def _title(attributes: Any) -> str:
    return f"rigidpend {attributes['name']}, config {attributes['config_hash']}"
