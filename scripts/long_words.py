"""Seconds to find and to establish orbits of long random words, for docs/addresses.md.

    .venv/bin/python -m scripts.long_words [--symbols COUNT,COUNT,...] [--seed SEED]

Words are drawn by lot, of the body of Fig. 4. What is told is time of the processor, of all
processes together: what other work takes does not count. 150 symbols take some minutes.
"""

from __future__ import annotations

import argparse
import os
import random
from collections.abc import Iterator, Sequence
from typing import NamedTuple

from rigidpend import Body, find_orbit, route_codes
from rigidpend.machine.tables import Table, markdown
from rigidpend.numbers.exact import exact
from scripts.readme_tables import ROOT, replaced

PAGE = ROOT / "docs" / "addresses.md"
BODY, H0, J1_0 = Body(A=(2, 1, "3/2"), r=(1, 1, 0), mu="0.001"), exact("1.3342"), exact("1e-8")
COUNTS = "19,40,76,150"
DIGITS_A_SYMBOL, MORE_DIGITS = 1.25, 5
"""Digits of theta2_0 that determine a word: some for each symbol, and as many besides."""
JOBS = 2


class Found(NamedTuple):
    """A word's orbit, and the seconds of the processor that it took."""

    symbols: int
    digits: int
    bits: int
    to_find: float
    to_establish: float


def found(symbols: int, seed: int) -> Found:
    """Find the orbit of a random word, and establish all of its symbols from its phase alone."""
    word = "".join(random.Random(seed).choices("01", k=symbols))
    digits = round(DIGITS_A_SYMBOL * symbols + MORE_DIGITS)
    given = {"h0": H0, "J1_0": J1_0, "jobs": JOBS}
    begun = spent()
    orbit = find_orbit(BODY, word, digits=digits, **given)
    between = spent()
    more = {"n_symbols": symbols, "precisions": (orbit.bits,), "method": "integration"}
    routes = route_codes(BODY, [orbit.theta2_0], **given, **more)
    took = spent() - between
    # Finding ends with the same two computations.
    if routes.words != [word] or orbit.confirmed != symbols:
        raise SystemExit(f"{symbols} symbols: {orbit.confirmed} confirmed, {routes.words[0]}")
    return Found(symbols, digits, orbit.bits, between - begun - took, took)


def spent() -> float:
    """Seconds of the processor that this process and those it has started have taken."""
    return sum(os.times()[:4])


def lines(rows: Sequence[Found]) -> Iterator[str]:
    """The table of the page."""
    head = ("symbols", "digits", "bits", "to find", "to establish")
    cells = [(*map(str, row[:3]), *(f"{x:.2g} s" if x < 10 else f"{x:.0f} s" for x in row[3:]))
             for row in rows]  # fmt: skip
    yield from markdown(Table("", head, cells))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--symbols", default=COUNTS)
    parser.add_argument("--seed", type=int, default=1)
    given = parser.parse_args()
    rows = []
    for count in map(int, given.symbols.split(",")):
        rows.append(found(count, given.seed))
        print(rows[-1], flush=True)
    text = replaced(PAGE.name, PAGE.read_text("utf-8"), "words", "\n".join(lines(rows)))
    PAGE.write_text(text, "utf-8")


if __name__ == "__main__":
    main()
