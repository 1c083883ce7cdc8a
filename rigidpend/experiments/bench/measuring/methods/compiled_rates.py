"""A body's field compiled by numba, for peers that are called from compiled code or call it."""

from __future__ import annotations

from typing import Any

from rigidpend.experiments.bench.measuring import fields
from rigidpend.experiments.bench.measuring.flat import executed, source_into
from rigidpend.mechanics.body import Body


def rates(body: Body, arguments: str, angles: bool = False) -> Any:
    """Write ``rates(arguments)``, plain Python that numba can compile; 8 components with angles."""
    field = fields.of_body(body, angles=angles)
    return executed(source_into(field, 8 if angles else 6, arguments))
