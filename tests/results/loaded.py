"""Results as the store gives them, for tests that have only their data."""

from __future__ import annotations

from typing import Any

from rigidpend.experiments.data import Loaded


def loaded(data: Any, **attributes: Any) -> Loaded:
    """A loaded result of such data."""
    return {"attributes": attributes, "config": {}, "provenance": {}, "data": data}
