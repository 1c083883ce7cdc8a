"""The extra `certified`: python-flint, without which nothing is proven or checked."""

from __future__ import annotations

import importlib.metadata
import importlib.util


class ExtraMissing(ModuleNotFoundError):
    """Error: python-flint is not installed; tells how to install it."""


if importlib.util.find_spec("flint") is None:
    raise ExtraMissing(
        "python-flint is needed to prove or check, and not installed;"
        " install it with: python -m pip install 'rigidpend[certified]'",
        name="flint",
    )


def version() -> str:
    """Version of python-flint."""
    return importlib.metadata.version("python-flint")
