"""Modules with a slip: some texts of the source replaced, to show that a check is needed."""

from __future__ import annotations

import inspect
from types import ModuleType


def weakened(module: ModuleType, *changes: tuple[str, str]) -> ModuleType:
    """A module of its own with each text, which must stand in the source once, replaced."""
    source = inspect.getsource(module)
    for before, after in changes:
        assert source.count(before) == 1, f"{source.count(before)} times in the source: {before}"
        source = source.replace(before, after)
    made = ModuleType(module.__name__)
    made.__file__ = module.__file__
    exec(compile(source, f"<{module.__file__} with a slip>", "exec"), made.__dict__)
    return made
