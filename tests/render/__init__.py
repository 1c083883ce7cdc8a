"""Pages without drawing: their pictures are those of the gallery."""

from __future__ import annotations

from typing import Any

from tests.cli.calls import REFERENCE


def in_gallery(results: Any, *_: str) -> bytes:
    """The picture of a reference as it was drawn before."""
    name = results[0]["attributes"]["name"]
    return (REFERENCE.parent / "gallery" / f"{name}.png").read_bytes()
