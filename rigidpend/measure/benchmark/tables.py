"""What the stored data says: time to reach an error, ratios, time to have every symbol right.

All functions take ``/data`` of a result, as `store.load` gives it, and give plain numbers; infinity
stands for what no measurement reached. :func:`text` makes rows of text of them.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np

from rigidpend.measure.benchmark.methods import METHODS

LEVELS = (1e-3, 1e-6, 1e-9, 1e-12)
MEANINGLESS = 0.1
"""Errors beyond are of the size of the answer."""
UNITS = ((1.0, "s"), (1e-3, "ms"), (1e-6, "us"))


class Right(NamedTuple):
    """The cheapest way of a method to have every symbol right, at its loosest such knob."""

    seconds: float
    knob: float
    repeats: int


def time_to_reach(record: Any, level: float) -> float:
    """The shortest of the times in which a method got an error of `level` or less.

    Over long times only what went all the way counts.
    """
    if "error" not in record:
        return math.inf
    enough = np.nan_to_num(record["error"], nan=math.inf) <= level
    return float(min(record["seconds"][enough & arrived(record)], default=math.inf))


def arrived(record: Any) -> Any:
    """Which measurements went as far as they were to go; a mask."""
    if "reach" not in record:
        return np.ones(len(record["error"]), dtype=bool)
    return record["reach"] >= (1 - 1e-9) * record["asked"]


def all_right(record: Any) -> Right:
    """The loosest knob with which every symbol came out right, and its time."""
    if "wrong_symbols" not in record or not (record["wrong_symbols"] == 0).any():
        return Right(math.inf, math.nan, 0)
    k = int(np.flatnonzero(record["wrong_symbols"] == 0)[0])
    return Right(float(record["seconds"][k]), float(record["knob"][k]), int(record["repeats"][k]))


def faster_than_default(data: Any) -> list[tuple[str, str, float, float]]:
    """Where a method of others is faster than the default, at an error that one of them reached.

    Returns
    -------
    list of (problem, method, error, ratio)
        The ratio of the default's time to the method's, more than 1, where it is largest;
        infinite where the default does not reach that error.
    """
    found = []
    for problem, group in _problems(data):
        default = group.get(str(group["default"]), {})
        if "error" not in default:
            continue
        for method in _measured(group):
            if METHODS[method].family in ("ours", "splitting") or "error" not in group[method]:
                continue
            ratio, error = max(_ratios(group[method], default), default=(0.0, math.nan))
            if ratio > 1:
                found.append((problem, method, float(error), float(ratio)))
    return found


def _ratios(record: Any, default: Any) -> Iterator[tuple[float, float]]:
    """The default's time over a method's at the errors that the method reached."""
    enough = arrived(record)
    for error, seconds in zip(record["error"][enough], record["seconds"][enough], strict=True):
        # An error of the size of the answer is none.
        if error <= MEANINGLESS:
            yield time_to_reach(default, error) / seconds, error


def summary(data: Any) -> dict[str, Any]:
    """All of it as plain data, for JSON: None where nothing was reached."""
    found: dict[str, Any] = {}
    for problem, group in _problems(data):
        found[problem] = {
            "title": str(group["title"]),
            "error": str(group["error"]),
            "default": str(group["default"]),
            "methods": {method: _summary(group[method]) for method in _measured(group)},
        }
    found["faster_than_default"] = [
        {"problem": problem, "method": method, "error": error, "ratio": _finite(ratio)}
        for problem, method, error, ratio in faster_than_default(data)
    ]
    for name, group in data.get("scaling", {}).items():
        found[f"against_{name}"] = {method: _plain(record) for method, record in group.items()}
    return found


def text(data: Any) -> Iterator[str]:
    """The tables, line by line, for people."""
    for problem, group in _problems(data):
        yield from _problem_text(problem, group)
    for name, group in data.get("scaling", {}).items():
        yield from _scaling_text(name, group)
    yield "where another method is faster than the default:"
    faster = faster_than_default(data)
    for problem, method, error, ratio in faster:
        label = METHODS[method].label
        how = f"{_times(ratio)} as fast" if math.isfinite(ratio) else "which it does not reach"
        yield f"  {problem}: {label}, at an error of {error:.1e}, {how}"
    if not faster:
        yield "  nowhere"


def _problem_text(problem: str, group: Any) -> Iterator[str]:
    default = group.get(str(group["default"]), {})
    yield f"{group['title']}: time to reach an error (in brackets: times the default's)"
    yield f"  error: {group['error']}"
    head = [f"{level:.0e}" for level in LEVELS]
    further = {"codes": ["all symbols right"], "long_time": ["reach, periods"]}.get(problem, [])
    rows = [["method", *head, *further, "MB", ""]]
    for method in _measured(group):
        record = group[method]
        cells = [
            _cell(time_to_reach(record, level), time_to_reach(default, level)) for level in LEVELS
        ]
        if problem == "codes":
            right = all_right(record)
            cells.append(_cell(right.seconds, all_right(default).seconds))
        if problem == "long_time":
            cells.append(_reach(record))
        memory = f"{record['memory'].max():.0f}" if "memory" in record else ""
        mark = " *" if method == str(group["default"]) else ""
        ended = str(record["ended"])
        said = "" if ended == "complete" else ended
        rows.append([METHODS[method].label + mark, *cells, memory, said])
    yield from _aligned(rows)
    yield "  * the method that rigidpend picks by default"
    if problem == "codes":
        yield "  Without a certificate, as all methods but route_codes: it computes every symbol"
        yield "  twice, and again in more bits where the two differ."
    yield ""


def _scaling_text(name: str, group: Any) -> Iterator[str]:
    field = {"orbits": "columns", "symbols": "n_symbols"}[name]
    sizes = sorted({int(n) for record in group.values() for n in record.get(field, ())})
    yield f"route codes against the number of {name}"
    rows = [["method", *map(str, sizes), ""]]
    for method, record in group.items():
        at = dict(zip(map(int, record.get(field, ())), record.get("seconds", ()), strict=True))
        ended = str(record["ended"])
        cells = [_seconds(at.get(n, math.inf)) for n in sizes]
        rows.append([METHODS[method].label, *cells, "" if ended == "complete" else ended])
    yield from _aligned(rows)
    yield ""


def _problems(data: Any) -> Iterator[tuple[str, Any]]:
    return ((name, group) for name, group in data.items() if name != "scaling")


def _measured(group: Any) -> list[str]:
    return [name for name in group if name in METHODS]


def _summary(record: Any) -> dict[str, Any]:
    right = all_right(record)
    found = {
        "time_to_reach": {f"{level:.0e}": _finite(time_to_reach(record, level)) for level in LEVELS}
    }
    if "wrong_symbols" in record:
        found["all_right"] = {"seconds": _finite(right.seconds), "knob": _finite(right.knob)}
    return {**found, **_plain(record)}


def _plain(record: Any) -> dict[str, Any]:
    """A record as JSON has it."""
    return {
        name: [_finite(x) for x in values] if np.ndim(values) else _single(values)
        for name, values in record.items()
    }


def _single(value: Any) -> Any:
    return value if isinstance(value, str) else _finite(value)


def _finite(x: Any) -> float | None:
    return float(x) if math.isfinite(x) else None


def _cell(seconds: float, default: float) -> str:
    if not math.isfinite(seconds):
        return "-"
    return _seconds(seconds) + (f" ({_times(seconds / default)})" if math.isfinite(default) else "")


def _times(ratio: float) -> str:
    return f"{ratio:.2g}x" if ratio < 100 else f"{ratio:.0f}x"


def _reach(record: Any) -> str:
    """From the shortest to the longest way that a method went."""
    if "reach" not in record:
        return "-"
    low, high = record["reach"].min(), record["reach"].max()
    return f"{high:.3g}" if low == high else f"{low:.3g} to {high:.3g}"


def _seconds(seconds: float) -> str:
    if not math.isfinite(seconds):
        return "-"
    unit, name = next((u for u in UNITS if seconds >= u[0]), UNITS[-1])
    return f"{seconds / unit:.3g} {name}"


def _aligned(rows: list[list[str]]) -> Iterator[str]:
    """Rows as columns of equal width."""
    widths = [max(len(row[k]) for row in rows) for k in range(len(rows[0]))]
    for row in rows:
        first = row[0].ljust(widths[0])
        rest = (cell.rjust(width) for cell, width in zip(row[1:-1], widths[1:-1], strict=True))
        yield "  " + "  ".join([first, *rest, row[-1]]).rstrip()
