"""Write tables into pages, between marks: stored measurements, and the floors of the house.

    .venv/bin/python scripts/readme_tables.py [--check]

The measurements are results/measured/bench.h5 and stress.h5; one that is not there leaves its
block as it is. A block begins with a comment ``<!-- NAME -->`` and ends with ``<!-- /NAME -->``;
what is between is replaced. With ``--check`` nothing is written: it fails where a page differs.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np

from docs import floors
from rigidpend.experiments.bench import report as reading
from rigidpend.experiments.bench.methods import METHODS, PROBLEMS
from rigidpend.experiments.data import Data, Loaded
from rigidpend.experiments.stress import draw as trials
from rigidpend.machine.wording import Table, markdown, seconds, times
from rigidpend.results import store

ROOT = Path(__file__).resolve().parents[1]
MEASURED = ROOT / "results" / "measured"
HOUSE = "CONTRIBUTING.md"
"""The page with the floors."""


def main() -> None:
    """Replace the blocks of all pages, or check them."""
    for page in (*PAGES, HOUSE):
        path = ROOT / page
        before = path.read_text(encoding="utf-8")
        after = renewed(page, before)
        if "--check" not in sys.argv[1:]:
            path.write_text(after, encoding="utf-8")
        elif after != before:
            raise SystemExit(
                f"{page} is not what {MEASURED} or .importlinter says: call make tables"
            )


def renewed(page: str, text: str, folder: Path = MEASURED) -> str:
    """The text of a page with the blocks of all measurements that are stored."""
    if page == HOUSE:
        return replaced(page, text, "floors", "\n".join(floors.picture()))
    for block, (name, lines) in PAGES[page].items():
        stored = folder / f"{name}.h5"
        if stored.is_file():
            written = "\n".join(lines(store.load(stored)))
            text = replaced(page, text, block, written)
    return text


def replaced(page: str, text: str, name: str, block: str) -> str:
    """The text with another block of that name."""
    before, begin, rest = text.partition(f"<!-- {name} -->\n")
    _, end, after = rest.partition(f"<!-- /{name} -->")
    if not (begin and end):
        raise SystemExit(f"{page}: no block {name}")
    return f"{before}{begin}{block}\n{end}{after}"


def write_table(page: Path, name: str, table: Table) -> None:
    """Put a table in the place of a page's block of that name."""
    text = page.read_text(encoding="utf-8")
    text = replaced(page.name, text, name, "\n".join(markdown(table)))
    page.write_text(text, encoding="utf-8")


def speed_lines(result: Loaded) -> Iterator[str]:
    """Ours and the fastest peer at every problem, for the README."""
    yield from provisional(result)
    yield from markdown(shortest(result["data"]))
    yield ""
    yield f"{machine(result)}."


def provisional(result: Loaded) -> Iterator[str]:
    """A word of warning where the measurement is the quick one."""
    name, _, quick = str(result["attributes"]["name"]).partition("_")
    if quick:
        yield f"Measured in small, for function: `make {name}` is for the record."
        yield ""


def bench_lines(result: Loaded) -> Iterator[str]:
    """Losses, bodies by lot, the codes of Fig. 4, the rest in short, trust."""
    data = result["data"]
    yield from provisional(result)
    yield f"{machine(result)}; medians over rounds in which methods take turns."
    for table in (
        reading.losses_table(data),
        *reading.bodies_tables(data),
        reading.meeting_table(data, "codes"),
        shortest(data),
        reading.phases_table(data),
    ):
        yield ""
        yield from markdown(table)


def shortest(data: Data) -> Table:
    """Ours and the fastest peer at every problem, with one thread, and with bodies, with two."""
    rows = [row for problem in data if problem in PROBLEMS for row in _pair(data, problem)]
    rows += _pairs_with_bodies(data)
    header = ("problem", "ours", "time", "fastest peer", "time", "times ours")
    return Table("Ours and the fastest peer that reaches the level, one thread:", header, rows)


def _pair(data: Data, problem: str) -> Iterator[tuple[str, ...]]:
    results = reading.met(data, problem, 1)
    own = next((r for r in results if r.method == str(data[problem]["default"])), None)
    best = next((r for r in results if r.reached and METHODS[r.method].peer), None)
    if own:
        yield (
            *(reading.level_text(data, problem), METHODS[own.method].label, seconds(own.seconds)),
            *(
                _of(best.method, best.seconds, best.ratio[0])
                if best
                else ("none reaches it", "-", "-")
            ),
        )


def _pairs_with_bodies(data: Data) -> Iterator[tuple[str, ...]]:
    """Ours and the fastest peer that vouches for symbols too, medians over the bodies."""
    found = reading.of_bodies(data)
    peers = [name for name in found if METHODS[name].certain and METHODS[name].peer]
    for call, key in reading.CALLS.items() if peers else ():
        (name, own), *_ = found.items()
        medians = {peer: float(np.median(found[peer][key])) for peer in peers}
        best = min(medians, key=medians.__getitem__)
        yield (
            *(f"bodies drawn by lot, every symbol vouched for: {call}", METHODS[name].label),
            seconds(float(np.median(own[key]))),
            *_of(best, medians[best], float(np.median(found[best][key] / own[key]))),
        )


def _of(method: str, time: float, ratio: float) -> tuple[str, str, str]:
    return METHODS[method].label, seconds(time), times(ratio)


def stress_lines(result: Loaded) -> Iterator[str]:
    """The trials by kind."""
    counted, *_ = trials.tables(result)
    yield from provisional(result)
    yield f"{machine(result)}."
    yield ""
    header = [cell.lower() for cell in counted.header]
    yield from markdown(counted._replace(caption="", header=header))


def machine(result: Loaded) -> str:
    """What it ran on."""
    found = result["provenance"]
    return f"{found['processor']}, {found['system']}, {str(found['created'])[:10]}"


PAGES: dict[str, dict[str, tuple[str, Callable[[Loaded], Iterator[str]]]]] = {
    "README.md": {"speed": ("bench", speed_lines)},
    "docs/measured.md": {"bench": ("bench", bench_lines), "stress": ("stress", stress_lines)},
}
"""Per page its blocks, each with the measurement and what is told of it."""


if __name__ == "__main__":
    main()
