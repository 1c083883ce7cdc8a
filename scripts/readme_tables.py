"""Write tables into pages, between marks: stored measurements, and the floors of the house.

    .venv/bin/python scripts/readme_tables.py [--check]

The measurements are results/measured/bench.h5 and stress.h5; one that is not there leaves its
block as it is. A block begins with a comment ``<!-- NAME -->`` and ends with ``<!-- /NAME -->``;
what is between is replaced. With ``--check`` nothing is written: it fails where a page differs.
"""

import argparse
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np

from docs import floors
from rigidpend.experiments.bench import report as reading
from rigidpend.experiments.bench.methods import DEFAULT, METHODS
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
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument(
        "--check", action="store_true", help="write nothing: fail if a page differs"
    )
    given = parser.parse_args()
    for page in (*PAGES, HOUSE):
        path = ROOT / page
        before = path.read_text(encoding="utf-8")
        after = renewed(page, before)
        if not given.check:
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
    """Losses, bodies by lot, the codes of Fig. 4, trust."""
    yield from provisional(result)
    yield f"{machine(result)}; medians over rounds in which methods take turns."
    for table in reading.tables(result):
        yield ""
        yield from markdown(table)


def shortest(data: Data) -> Table:
    """Ours and the fastest peer: at Fig. 4, and with bodies drawn by lot, medians over these.

    With the bodies it is the fastest of those that vouch for symbols too.
    """
    rows, found = [], reading.of_bodies(data)
    standings = {x.method: x for x in reading.met(data) if x.reached}
    peers = [x for x in standings.values() if METHODS[x.method].peer]
    if DEFAULT in standings and peers:
        own = METHODS[DEFAULT].label, seconds(standings[DEFAULT].seconds)
        rows.append(
            (reading.FIG4_TITLE, *own, *_of(peers[0].method, peers[0].seconds, peers[0].ratio[0]))
        )
    vouching = [name for name in found if METHODS[name].certain and METHODS[name].peer]
    for call, key in reading.CALLS.items() if vouching else ():
        (name, took), *_ = found.items()
        best = min(vouching, key=lambda x: float(np.median(found[x][key])))
        middle, ratio = np.median(found[best][key]), np.median(found[best][key] / took[key])
        text = f"random bodies, every symbol vouched for: {call}"
        own = METHODS[name].label, seconds(float(np.median(took[key])))
        rows.append((text, *own, *_of(best, float(middle), float(ratio))))
    header = ("problem", "ours", "time", "fastest peer", "time", "times ours")
    return Table("Ours and the fastest peer:", header, rows)


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
