"""Comparison of two results, and bounds for the difference of a field between them.

A layout declares the bound of each field: a number, or a function to the allowed difference of
each element or to the differences themselves. Bounds follow from the stored result and from
declarations; an error that a fresh result states of itself widens none.
"""

from __future__ import annotations

from collections import ChainMap
from collections.abc import Callable
from typing import Any, Self, TypeAlias

import numpy as np

from rigidpend.experiments.data import ANY, Allowed, Data, Field, Layout, declared

Scope: TypeAlias = ChainMap[str, Any]
"""A group of a result, with the groups that enclose it."""

ROOT, PROVENANCE = "/", "/provenance"
VOLATILE = ("name", "config_hash", "code_hash", "engine")
"""Root attributes whose values may differ between equal results; configs are compared by key."""
NUMERICS = ("tolerance", "precisions")
"""Root attributes that also differ if other numerics are asked for."""
TOLD = ("reasons", "doubt", "seconds")
"""Root attributes that are not compared: their content is compared elsewhere, or need not be."""
PRESENT, ABSENT = "(present)", "(absent)"
"""Placeholders for values that only one side has, or that are not compared."""


class Difference(str):
    """A sentence on a difference of two results, with its parts as attributes."""

    place: str
    stored: Any
    computed: Any
    allowed: float
    """Allowed difference; 0 where the values must be equal."""

    def __new__(
        cls, place: str, stored: Any, computed: Any, allowed: float = 0.0, words: str = ""
    ) -> Self:
        words = words or f": stored {shown(stored)}, computed {shown(computed)}"
        self = super().__new__(cls, place + words)
        self.place, self.stored, self.computed, self.allowed = place, stored, computed, allowed
        return self

    def inside(self, group: str) -> Self:
        """The same difference, with the group before its place."""
        values, words = (self.stored, self.computed, self.allowed), self[len(self.place) :]
        return type(self)(f"{group}/{self.place}", *values, words)


def shown(value: Any) -> str:
    """A value as text, with all digits."""
    if isinstance(value, bytes):
        return value.decode(errors="replace")
    return f"{value:.17g}" if isinstance(value, float | np.floating) else str(value)


def keys(stored: Any, fresh: Any) -> list[Difference]:
    """Find the keys that only one of two mappings has."""
    lost = [name for name in stored if name not in fresh]
    new = [name for name in fresh if name not in stored]
    return [
        *(Difference(x, PRESENT, ABSENT, words=" is only stored") for x in lost),
        *(Difference(x, ABSENT, PRESENT, words=" is only computed") for x in new),
    ]


def outlines(stored: Any, fresh: Any, *, same_numerics: bool) -> list[Difference]:
    """Find where two result files differ in their structure: see `store.outline`.

    The place, date, code and engine of a result, and its name, are not compared, but must be there;
    the reasons why a reference was renewed are ignored. If other numerics are asked for, tolerance
    and precisions are not compared either.
    """
    found = keys(stored, fresh)
    for place in [place for place in stored if place in fresh and place != PROVENANCE]:
        old, new = stored[place], fresh[place]
        if place == ROOT:
            passed = VOLATILE if same_numerics else (*VOLATILE, *NUMERICS)
            # Engines have different default tolerances; that is no difference of the problem.
            if len({str(one.get("engine")).partition(" ")[0] for one in (old, new)}) > 1:
                passed = (*passed, "tolerance")
            old, new = (
                {k: PRESENT if k in passed else x for k, x in one.items() if k not in TOLD}
                for one in (old, new)
            )
        for name in dict.fromkeys((*old, *new)):
            if not (name in old and name in new and np.array_equal(old[name], new[name])):
                pair = old.get(name, ABSENT), new.get(name, ABSENT)
                found.append(Difference(f"{place}@{name}", *pair))
    return found


def differences(layout: Layout, stored: Data, fresh: Data) -> list[Difference]:
    """Find where ``/data`` of two results disagrees by more than the bounds of its fields.

    Bounds come from the stored result, the reference, and from the layout: an error that the
    fresh result states widens none. A field whose bound is `ANY` is not compared.
    """
    return _groups(layout, ChainMap(dict(stored)), ChainMap(dict(fresh)))


def _groups(layout: Layout, stored: Scope, fresh: Scope) -> list[Difference]:
    """Differences in one group; the enclosing groups are at hand for bounds."""
    old, new = stored.maps[0], fresh.maps[0]
    nodes = {**{x: {} for x in (*old, *new)}, **declared(layout, (*old, *new))}
    kept = {x: node for x, node in nodes.items() if getattr(node, "within", None) != ANY}
    found = keys([x for x in kept if x in old], [x for x in kept if x in new])
    for x, node in kept.items():
        if not found and isinstance(node, Field) and node.sized:
            found += _shapes(x, np.shape(old[x]), np.shape(new[x]))
    # The bound of one field may use others, also of enclosing groups: all must be there and fit.
    if found:
        return found
    for x, node in kept.items():
        if not isinstance(node, Field):
            inner = _groups(node, stored.new_child(old[x]), fresh.new_child(new[x]))
            found += [difference.inside(x) for difference in inner]
        else:
            told = node.within(x, stored, fresh) if callable(node.within) else node.within
            found += told if isinstance(told, list) else arrays(x, old[x], new[x], told)
    return found


def _shapes(place: str, stored: tuple[int, ...], fresh: tuple[int, ...]) -> list[Difference]:
    said = f": shape {stored} stored, {fresh} computed"
    return [] if stored == fresh else [Difference(place, stored, fresh, words=said)]


def arrays(
    place: str, stored: Any, fresh: Any, allowed: Any = 0.0, said: str = ""
) -> list[Difference]:
    """The worst difference of two arrays, if it exceeds the allowed one (a number, or for each).

    Floats are compared within the allowed difference, and not where it is infinite; NaN equals
    NaN. All other kinds must be equal. `said` replaces the words on the values, with places for
    the stored and the computed one, and for the allowed difference.
    """
    a, b = np.asarray(stored), np.asarray(fresh)
    if found := _shapes(place, a.shape, b.shape):
        return found
    most = np.broadcast_to(allowed, a.shape)
    excess = _excess(a, b, most)
    if not excess.any():
        return []
    at = np.unravel_index(np.argmax(excess), excess.shape)
    limit = float(most[at]) if a.dtype.kind == "f" else 0.0
    count = int((excess > 0).sum())
    aside = [f"may differ by {limit:.2g}"] if limit and not said else []
    aside += [f"{count} of {excess.size} differ"] if count > 1 else []
    old, new = shown(a[at]), shown(b[at])
    words = said.format(old, new, limit) if said else f"stored {old}, computed {new}"
    words = f": {words}" + (f" ({', '.join(aside)})" if aside else "")
    index = f"[{', '.join(map(str, at))}]" if at else ""
    return [Difference(f"{place}{index}", a[at], b[at], limit, words)]


def _excess(a: Any, b: Any, allowed: Any) -> Any:
    """Difference of each element over the allowed one; 0 where the elements count as equal."""
    if not a.dtype.kind == b.dtype.kind == "f":
        return ((a != b) & np.isfinite(allowed)).astype(float)
    with np.errstate(invalid="ignore", divide="ignore"):
        gap = np.abs(a - b)
        # NaN equals only NaN and an infinity only itself: their gap is NaN or infinite.
        same = (gap <= allowed) | (a == b) | (np.isnan(a) & np.isnan(b)) | np.isinf(allowed)
        return np.where(same, 0.0, np.nan_to_num(gap / allowed, nan=np.inf, posinf=np.inf))


ROUNDING = 1e-14
"""Allowed difference by rounding alone: absolute for angles in radians, relative for the rest."""


def where(compared: Callable[[Data, Data], Any]) -> Allowed:
    """Demand equality where a mask is true; `compared` makes it from both groups."""
    return lambda name, stored, fresh: np.where(compared(stored, fresh), 0.0, np.inf)


def relative(share: float, to: str = "") -> Allowed:
    """Bound of each element, relative to its stored value, or to that of another field."""
    return lambda name, stored, fresh: share * np.abs(stored[to or name])


def of_largest(share: float, least: float = 0.0) -> Allowed:
    """Bound of all elements, relative to the largest stored one, or to `least` if that is more."""
    return lambda name, stored, fresh: share * np.abs(stored[name]).max(initial=least)


def modulo(period: float, allowed: Allowed) -> Allowed:
    """Bound of each element of a periodic quantity."""

    def apart(name: str, stored: Data, fresh: Data) -> list[Difference]:
        old, new = np.asarray(stored[name]), np.asarray(fresh[name])
        # Rounding may put one result at each end of the period.
        new = old + np.remainder(new - old + period / 2, period) - period / 2
        return arrays(name, old, new, allowed(name, stored, fresh))

    return apart


def stated(most: float | Allowed) -> Allowed:
    """Bound of the errors that each result states of itself.

    `most` is the largest admitted size, infinite for any, or a bound that gives it; what follows
    from one result bounds the errors of the other. Gaps must be at the same places in both.
    """

    def apart(name: str, stored: Data, fresh: Data) -> list[Difference]:
        limit, back = (
            most(name, *pair) if callable(most) else most
            for pair in ((stored, fresh), (fresh, stored))
        )
        known, free = ~np.isnan(stored[name]), np.where(np.isinf(limit), np.inf, 0.0)
        gaps = arrays(name, known, ~np.isnan(fresh[name]), free)
        old, new = (np.where(known, np.abs(x[name]), 0.0) for x in (stored, fresh))
        none, told = np.zeros(new.shape), "{} is stated, at most {{2:.2g}} is declared"
        return (
            gaps
            or arrays(name, none, new, limit, told.format("{1}"))
            or arrays(name, old, none, back, told.format("stored {0}"))
        )

    return apart
