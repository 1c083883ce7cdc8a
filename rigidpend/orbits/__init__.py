"""Orbits followed, in any precision.

Modules
-------
integrate   step by step, by Taylor series in machine code or in integers, or by DOP853
precision   arrays of numbers of any precision, for maps and whoever else computes beyond doubles
return_map  from section to section, without integration, by a normal form and tables

Integration and maps give records: named tuples of arrays, or of records, whose last axis counts
orbits.
"""

from collections.abc import Callable
from typing import Any, TypeVar

import numpy as np

M_UNITS = "1", "1.37", "0.61"
"""Units of M of independent computations of an orbit, so that no two share their roundings."""

Record = TypeVar("Record", bound=tuple[Any, ...])


def columns(record: Record, where: Any) -> Record:
    """Some of the columns, or all in another order; fields that are no arrays stay as they are."""
    return _each(lambda x: x[..., where] if isinstance(x, np.ndarray) else x, record)


def joined(parts: list[Record]) -> Record:
    """Records of successive orbits as one."""
    return _each(lambda *x: np.concatenate(x, axis=-1), *parts)


def put(target: Record, where: Any, source: Record) -> None:
    """Replace some columns by those of another record, in place."""
    _each(lambda into, x: into.__setitem__((..., where), x), target, source)


def _each(work: Callable[..., Any], *records: Any) -> Any:
    """The record whose fields are `work` of the records' fields, also within inner records."""
    places = zip(*records, strict=True)
    found = (_each(work, *x) if isinstance(x[0], tuple) else work(*x) for x in places)
    return type(records[0])._make(found)
