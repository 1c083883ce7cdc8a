"""Write the tables of the stored measurements into README.md, between marks.

    .venv/bin/python scripts/readme_tables.py [--check]

The measurements are results/measured/bench.h5 and stress.h5; one that is not there leaves its
block as it is. A block begins with a comment ``<!-- NAME -->`` and ends with ``<!-- /NAME -->``;
what is between is replaced. With ``--check`` nothing is written: it fails where README differs.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from rigidpend.experiments.stress import report as trials
from rigidpend.measure.benchmark import reading
from rigidpend.measure.benchmark.methods import METHODS
from rigidpend.measure.benchmark.problems import NAMES
from rigidpend.results import store
from rigidpend.tables import Table, markdown, seconds, times

ROOT = Path(__file__).resolve().parents[1]
README = ROOT / "README.md"
MEASURED = ROOT / "results" / "measured"


def main() -> None:
    """Replace the blocks, or check them."""
    before = README.read_text(encoding="utf-8")
    after = renewed(before)
    if "--check" not in sys.argv[1:]:
        README.write_text(after, encoding="utf-8")
    elif after != before:
        raise SystemExit(f"{README} is not what {MEASURED} says: call make tables")


def renewed(text: str, folder: Path = MEASURED) -> str:
    """The text with the blocks of all measurements that are stored."""
    for name, lines in BLOCKS.items():
        stored = folder / f"{name}.h5"
        if stored.is_file():
            text = replaced(text, name, "\n".join(lines(store.load(stored))))
    return text


def replaced(text: str, name: str, block: str) -> str:
    """The text with another block of that name."""
    before, begin, rest = text.partition(f"<!-- {name} -->\n")
    _, end, after = rest.partition(f"<!-- /{name} -->")
    if not (begin and end):
        raise SystemExit(f"{README}: no block {name}")
    return f"{before}{begin}{block}\n{end}{after}"


def bench_lines(result: Any) -> Iterator[str]:
    """Losses, the codes of Fig. 4, the other problems in short, certificates, random phases."""
    data = result["data"]
    if str(result["attributes"]["name"]) != "bench":
        yield "Measured in small, for function, not for time: `make bench` is for the record."
        yield ""
    yield f"{machine(result)}; medians over rounds in which methods take turns."
    for table in (
        reading.losses_table(data),
        reading.meeting_table(data, "codes"),
        shortest(data),
        reading.certificates_table(data),
        reading.phases_table(data),
        reading.cost_table(data),
    ):
        yield ""
        yield from markdown(table)


def shortest(data: Any) -> Table:
    """Ours and the fastest peer at every problem, with one thread."""
    rows = [row for problem in data if problem in NAMES for row in _pair(data, problem)]
    header = ("problem", "ours", "time", "fastest peer", "time", "times ours")
    return Table("Ours and the fastest peer that reaches the level, one thread:", header, rows)


def _pair(data: Any, problem: str) -> Iterator[tuple[str, ...]]:
    results = reading.met(data, problem, 1)
    own = next((r for r in results if r.method == str(data[problem]["default"])), None)
    if own is None:
        return
    peers = [r for r in results if r.reached and METHODS[r.method].family not in reading.OWN]
    first = (reading.level_text(data, problem), METHODS[own.method].label)
    if not peers:
        yield (*first, seconds(own.seconds), "none reaches it", "-", "-")
        return
    label = METHODS[peers[0].method].label
    ratio = times(peers[0].ratio)
    yield (*first, seconds(own.seconds), label, seconds(peers[0].seconds), ratio)


def stress_lines(result: Any) -> Iterator[str]:
    """The trials by kind."""
    counted, *_ = trials.tables(result)
    yield f"{machine(result)}."
    yield ""
    header = [cell.lower() for cell in counted.header]
    yield from markdown(counted._replace(caption="", header=header))


def machine(result: Any) -> str:
    """What it ran on."""
    found = result["provenance"]
    return f"{found['processor']}, {found['system']}, {str(found['created'])[:10]}"


BLOCKS: dict[str, Callable[[Any], Iterator[str]]] = {"bench": bench_lines, "stress": stress_lines}


if __name__ == "__main__":
    main()
