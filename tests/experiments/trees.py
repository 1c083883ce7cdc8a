"""Results as trees of plain arrays, as they are read from a file."""

from __future__ import annotations

from typing import Any

import numpy as np


def plain(tree: Any) -> Any:
    """The arrays of what an experiment computed, as `store.load` would give them."""
    if isinstance(tree, dict):
        return {name: plain(node) for name, node in tree.items()}
    return tree.values if isinstance(tree.values, str) else np.array(tree.values)
