"""Write the summaries of the stored bench and stress results into docs/measured.md, between marks.

    .venv/bin/python scripts/readme_tables.py [FOLDER]

FOLDER holds bench.h5 and stress.h5; results if not given. A block begins with a comment
``<!-- NAME -->`` and ends with ``<!-- /NAME -->``; what is between is replaced.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from rigidpend.experiments.stress import report as trials
from rigidpend.measure.benchmark.methods import METHODS
from rigidpend.measure.benchmark.tables import all_right, time_to_reach
from rigidpend.results import store

PAGE = Path(__file__).resolve().parents[1] / "docs" / "measured.md"
LEVEL = 1e-9
"""The error at which methods are compared on the page."""


def main(folder: Path) -> None:
    """Replace both blocks."""
    text = PAGE.read_text(encoding="utf-8")
    for name, lines in (("bench", bench_lines), ("stress", stress_lines)):
        block = "\n".join(lines(store.load(folder / f"{name}.h5")))
        text = replaced(text, name, block)
    PAGE.write_text(text, encoding="utf-8")


def replaced(text: str, name: str, block: str) -> str:
    """The text with another block of that name."""
    before, begin, rest = text.partition(f"<!-- {name} -->\n")
    _, end, after = rest.partition(f"<!-- /{name} -->")
    if not (begin and end):
        raise SystemExit(f"{PAGE}: no block {name}")
    return f"{before}{begin}{block}\n{end}{after}"


def bench_lines(result: Any) -> Iterator[str]:
    """All symbols right, then the error level of each other problem."""
    data = result["data"]
    yield f"{machine(result)}, one core, warm, medians. All 945 symbols of Fig. 4, left, right:"
    yield ""
    default = all_right(data["codes"][str(data["codes"]["default"])]).seconds
    rows = [
        (METHODS[name].label, shown(right.seconds), f"{right.seconds / default:.3g}")
        for name, record in data["codes"].items()
        if name in METHODS and math.isfinite((right := all_right(record)).seconds)
    ]
    rows.sort(key=lambda row: float(row[2]))
    yield from table(("method", "time", "times ours in one batch"), rows)
    yield ""
    yield f"Time to an error of {LEVEL:.0e}, by default and by the fastest method of others:"
    yield ""
    problems = [name for name in data if name not in ("codes", "scaling")]
    header = ("problem", "ours, default", "", "fastest other", "", "ratio")
    yield from table(header, [comparison(data[name]) for name in problems])


def comparison(group: Any) -> tuple[str, ...]:
    """The default and the fastest method of others at a problem."""
    name = str(group["default"])
    own = time_to_reach(group[name], LEVEL)
    others = {
        METHODS[method].label: time_to_reach(group[method], LEVEL)
        for method in group
        if method in METHODS and METHODS[method].family not in ("ours", "splitting")
    }
    other = min(others, key=lambda label: others[label])
    first = (str(group["title"]), METHODS[name].label, shown(own))
    if not math.isfinite(others[other]):
        return (*first, "none reaches it", "", "")
    return (*first, other, shown(others[other]), f"{others[other] / own:.2g}")


def stress_lines(result: Any) -> Iterator[str]:
    """The trials by kind."""
    counted, *_ = trials.tables(result)
    yield f"{machine(result)}."
    yield ""
    yield from table([cell.lower() for cell in counted.header], counted.rows)


def table(header: Sequence[str], rows: Sequence[Sequence[str]]) -> Iterator[str]:
    """Markdown."""
    for cells in (header, ["---"] * len(header), *rows):
        yield f"| {' | '.join(cells)} |"


def machine(result: Any) -> str:
    """What it ran on."""
    found = result["provenance"]
    return f"{found['processor']}, {found['system']}, {str(found['created'])[:10]}"


def shown(seconds: float) -> str:
    """A time for people."""
    if not math.isfinite(seconds):
        return "not reached"
    return f"{1e3 * seconds:.3g} ms" if seconds < 1 else f"{seconds:.3g} s"


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "results"))
