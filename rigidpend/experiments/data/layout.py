"""Layouts of results as plain data, by which they are written and checked.

A layout names the fields of a group and the groups inside it::

    LAYOUT = {"<arrays>": {"codes": Field(WHOLE, ("symbols", "columns"), "1", "...")}}

A name in ``<>`` stands for members of any names, as many as the dimension of that name; one
that ends in ``?`` may be absent. A dimension has one size throughout, but in each member of
such a group its own. Nothing heavy is imported: whoever reads a result reads this first.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple, TypeAlias

from rigidpend.experiments.data.tree import Dataset

FLOAT, WHOLE, FLAG, TEXT = "double", "whole", "flag", "text"
NUMBER = "number"
"""Kinds of elements of a field; a number is a double or whole."""


class Field(NamedTuple):
    """An array, a number or a text in a result, with its unit and meaning."""

    kind: str
    dimensions: tuple[int | str, ...] = ()
    """Sizes, or names of sizes, which may have a number added: ``symbols+1``."""
    units: str = ""
    description: str = ""
    gaps: bool = False
    """True if it may hold NaN or infinity."""

    def dataset(self, values: Any) -> Dataset:
        """Values with their meaning, as they are stored."""
        return Dataset(values, self.units, self.description, self.dimensions)


Layout: TypeAlias = Mapping[str, "Field | Layout"]
Fields: TypeAlias = Mapping[str, Field]


def datasets(fields: Fields, values: Mapping[str, Any]) -> dict[str, Dataset]:
    """Give the values of a group their meaning: those that the fields name."""
    return {name: field.dataset(values[name]) for name, field in fields.items()}


def members(layout: Layout) -> tuple[str, Field | Layout] | None:
    """The dimension that counts members of any names, and what each is; None without such."""
    for name, node in layout.items():
        if name.startswith("<"):
            return name.strip("<>"), node
    return None


def named(layout: Layout) -> dict[str, tuple[Field | Layout, bool]]:
    """Members with a name of their own, each with True if it must be there."""
    return {
        name.removesuffix("?"): (node, not name.endswith("?"))
        for name, node in layout.items()
        if not name.startswith("<")
    }
