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
from rigidpend.results import store

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
    """Draw a loaded result, as the bytes of a file of that format."""
    # What the user's shell says of a display does not matter to a figure in a file, and an
    # unknown backend there would stop matplotlib's import.
    os.environ["MPLBACKEND"] = "agg"
    import matplotlib

    with matplotlib.rc_context(fname=STYLE):
        experiment = result["attributes"]["experiment"]
        figure = experiments.drawing(experiment).draw(result)
        return _image(figure, suffix, result["attributes"])


def _image(figure: Any, suffix: str, attributes: Any) -> bytes:
    """Write a figure, as bytes."""
    buffer = io.BytesIO()
    figure.savefig(buffer, format=suffix, metadata=metadata(suffix, attributes))
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
    title = f"rigidpend {attributes['name']}, config {attributes['config_hash']}"
    marks = {
        "Experiment": str(attributes["experiment"]),
        "Config-Hash": str(attributes["config_hash"]),
        "Code-Hash": str(attributes.get("code_hash", "unknown")),
        "Engine": str(attributes.get("engine", "unknown")),
    }
    text = "; ".join(f"{key}: {value}" for key, value in marks.items())
    return {
        "png": {"Software": None, "Title": title, **marks},
        "svg": {"Date": None, "Creator": None, "Title": title, "Description": text},
        "pdf": dict.fromkeys(("CreationDate", "Creator", "Producer"))
        | {"Title": title, "Subject": text},
    }[suffix]
