"""Where two results in closed form differ by more than their rounding."""

from __future__ import annotations

from typing import Any

import numpy as np


def differences(stored: Any, fresh: Any, allowed: float, place: str = "") -> list[str]:
    """Compare two trees of arrays: floats up to `allowed`, all else exactly.

    Parameters
    ----------
    stored, fresh : dict or array
        Groups and arrays, loaded.
    allowed : float
        By how much floats may differ, in their own units.
    place : str, optional
        The name of what is compared.
    """
    if not (isinstance(stored, dict) and isinstance(fresh, dict)):
        return _arrays(np.asarray(stored), np.asarray(fresh), allowed, place)
    inside = f"{place}/" if place else ""
    found = [f"{inside}{name} is in one file only" for name in sorted(set(stored) ^ set(fresh))]
    for name in sorted(set(stored) & set(fresh)):
        found += differences(stored[name], fresh[name], allowed, f"{inside}{name}")
    return found


def _arrays(stored: Any, fresh: Any, allowed: float, place: str) -> list[str]:
    if stored.shape != fresh.shape:
        return [f"{place}: shape {stored.shape} stored, {fresh.shape} computed"]
    if stored.dtype.kind == fresh.dtype.kind == "f":
        # Written so that NaN differs from every number.
        wrong = ~(np.abs(stored - fresh) <= allowed) & ~(np.isnan(stored) & np.isnan(fresh))
    else:
        wrong = stored != fresh
    if not wrong.any():
        return []
    first = tuple(np.argwhere(wrong)[0])
    at = ", ".join(map(str, first))
    return [f"{place}[{at}]: stored {stored[first]}, computed {fresh[first]}"]
