"""The configs that one file stands for: light enough for a plan that reads none of them."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Generic, NamedTuple, TypeVar

C = TypeVar("C", covariant=True)


class Group(NamedTuple, Generic[C]):
    """The configs that one file stands for: one, or each combination of a sweep."""

    path: Path
    title: str
    """Name of all of them together."""
    members: Sequence[C]
