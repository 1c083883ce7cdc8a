"""Try to prove the full shift of random bodies, and write what came of it into docs/full-shift.md.

    .venv/bin/python -m scripts.random_bodies [--count 20] [--seed 1] [--second]

As a user does: a config of each body, `run`, and with `--second` the second checker, which takes
most of the time: some minutes without it, ten with it.
"""

import argparse
import math
import random
import re
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Sequence
from pathlib import Path

from rigidpend.machine.wording import Table
from rigidpend.mechanics.body import Body
from rigidpend.numbers.exact import exact
from rigidpend.orbits.return_map import MapError
from rigidpend.routes.certified import horseshoe
from scripts.readme_tables import ROOT, write_table
from scripts.times import own

PAGE = ROOT / "docs" / "full-shift.md"
LEAST, MOST = 5e-5, 2e-2
"""Limits of mu/h, whose logarithm is drawn uniformly."""
SETTINGS = "{{A: [{A}], r: [{r}], mu: {mu}, h: 1, J1_0: 1e-10}}"


def main(arguments: Sequence[str] | None = None) -> None:
    """Draw bodies until so many have a return map, and write the table."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--count", type=int, default=20)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--second", action="store_true", help="call the second checker as well")
    given = parser.parse_args(arguments)
    rows: list[tuple[str, ...]] = []
    others = 0
    for drawn in bodies(random.Random(given.seed)):
        try:
            angle = angle_of(drawn)
        except MapError as refused:
            print(*drawn.values(), refused, sep=" | ", file=sys.stderr)
            others += 1
            continue
        with tempfile.TemporaryDirectory() as folder:
            rows.append(
                (*drawn.values(), f"{angle:.1e}", *tried(drawn, Path(folder), given.second))
            )
        print(*rows[-1], sep=" | ", file=sys.stderr, flush=True)
        # After each, so that what was found before an interruption stands.
        write_table(PAGE, "random bodies", table(rows, others, given.seed))
        if len(rows) == given.count:
            break


def bodies(chance: random.Random) -> Iterator[dict[str, str]]:
    """Bodies with A1 = 2 and moments of two decimals that a body can have, uniformly."""
    while True:
        A2, A3 = (round(chance.uniform(low, 2), 2) for low in (0, 1))
        angle = chance.uniform(0, math.pi / 2)
        mu = 10 ** chance.uniform(math.log10(LEAST), math.log10(MOST))
        if 0 < A2 < A3 < 2 <= A2 + A3:
            r = f"{math.cos(angle):.2f}, {math.sin(angle):.2f}, 0"
            yield {"A": f"2, {A2}, {A3}", "r": r, "mu": f"{mu:.2g}"}


def angle_of(drawn: dict[str, str]) -> float:
    """The angle at which the surfaces cross; raises MapError where there is no return map."""
    body = Body(drawn["A"].split(", "), drawn["r"].split(", "), drawn["mu"])
    return horseshoe.angle_of(horseshoe.ShiftProblem(body, exact("1"), 1))


def tried(drawn: dict[str, str], folder: Path, second: bool) -> tuple[str, str, str, str]:
    """Half rotations, processor times of the proof and of the second checker, and the outcome."""
    config, result = folder / "body.yaml", folder / "body.h5"
    settings = SETTINGS.format(**drawn)
    config.write_text(f"experiment: full_shift\nproblem: {settings}\n", encoding="utf-8")
    run, seconds = called("rigidpend", "run", str(config), "--out", str(folder))
    turns = re.findall(r"passages of (\d+) half", run.stderr)
    if run.returncode:
        doubt = run.stderr.strip().splitlines()[-1].partition("nothing is proven: ")[2]
        return ", ".join(turns) or "-", f"{seconds:.0f}", "-", f"undecided: {doubt}"
    if not second:
        return turns[-1], f"{seconds:.0f}", "-", "**proven**"
    checked = str(result), "--config", str(config)
    again, further = called("scripts.check_full_shift", *checked)
    outcome = "**proven**" if again.returncode == 0 else f"only once: {again.stderr.strip()}"
    return turns[-1], f"{seconds:.0f}", f"{further:.0f}", outcome


def called(module: str, *arguments: str) -> tuple[subprocess.CompletedProcess[str], float]:
    """What a module run as a program says, and its seconds of processor time."""
    begun = own()
    done = subprocess.run(
        [sys.executable, "-m", module, *arguments],
        cwd=ROOT, capture_output=True, text=True, check=False,
    )  # fmt: skip
    return done, own() - begun


def table(rows: Sequence[tuple[str, ...]], others: int, seed: int) -> Table:
    """The table of all that were tried."""
    proven = sum(row[-1] == "**proven**" for row in rows)
    header = ("A", "r", "mu", "angle", "half rotations", "s", "s, second checker", "full shift")
    note = f"{proven} of {len(rows)} proven (seed {seed}; h = 1, J1_0 = 1e-10)."
    return Table(f"{note} Without a return map, and left out: {others}.", header, rows)


if __name__ == "__main__":
    main()
