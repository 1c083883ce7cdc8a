"""What a config may hold: one module an experiment, every field with its meaning and unit.

A config has two parts: `problem` says what is computed, `numerics` how well. Numbers are kept
exact, as written. Unknown keys are errors. A module named as the experiment defines `Config`.
"""

from __future__ import annotations

import importlib
import pkgutil
from typing import Any


def experiments() -> list[str]:
    """The names of all experiments that have a schema."""
    return sorted(module.name for module in pkgutil.iter_modules(__path__) if module.name != "base")


def of(experiment: str) -> Any:
    """The schema of an experiment, a pydantic model."""
    return importlib.import_module(f"{__name__}.{experiment}").Config
