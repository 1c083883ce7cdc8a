"""Fuzzing of result files: bytes turned over anywhere, sealed anew or not, each read as data.

A script: ``python -m tests.attacks.fuzz COUNT [SEED]`` fuzzes so many of each kind and draws
what is still a result; it ends with 1 at anything but a sentence or a figure.
"""

from __future__ import annotations

import random
import re
import resource
import sys
import tempfile
import time
from pathlib import Path
from typing import NamedTuple

from rigidpend import render
from rigidpend.machine.files import sealed, unsealed
from rigidpend.results import store
from tests.attacks.craft import REFERENCE

NAMES = ("fig2", "fig4", "precession", "fig5")
HEADS = 4096
"""Bytes at the beginning of a file, and around names, where most of what steers HDF5 lies."""


class Outcome(NamedTuple):
    """What became of a file."""

    said: str
    """A sentence; empty where it was read."""
    seconds: float
    """Of the processor, in this process and those that it started."""


def fuzzed(image: bytes, chance: random.Random) -> bytes:
    """The image with one to eight places changed, half of the time in its heads."""
    changed = bytearray(image)
    for _ in range(chance.choice((1, 1, 2, 4, 8))):
        reach = len(changed) if chance.random() < 0.5 else min(HEADS, len(changed))
        place = chance.randrange(8, reach)
        width = chance.choice((1, 1, 2, 4, 8))
        value = chance.choice((b"\x00" * 8, b"\xff" * 8, chance.randbytes(8)))
        changed[place : place + width] = value[: len(changed[place : place + width])]
    return bytes(changed)


def spent() -> float:
    """Seconds of the processor of this process and of those that it started."""
    times = (resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))
    return sum(each.ru_utime + each.ru_stime for each in times)


def outcome(path: Path, *, draw: bool) -> Outcome:
    """Read a file, and draw it if it can be read."""
    begun = spent()
    try:
        result = store.load(path)
        read = spent() - begun
        if draw:
            render.image([result], "png")
    except store.StoreError as error:
        return Outcome(str(error) or "nothing was said", spent() - begun)
    return Outcome("", read)


def run(folder: Path, count: int, seed: int, *, seal: bool, draw: bool) -> list[Outcome]:
    """Fuzz so many files, one after the other."""
    chance, found = random.Random(seed), []
    images = [unsealed((REFERENCE / f"{name}.h5").read_bytes()) or b"" for name in NAMES]
    path = folder / "fuzzed.h5"
    for k in range(count):
        image = fuzzed(images[k % len(images)], chance)
        path.write_bytes(sealed(image) if seal else image)
        found.append(outcome(path, draw=draw))
    return found


def watched(folder: Path, count: int, seed: int, seal: bool) -> tuple[list[Outcome], float]:
    """Fuzz so many files; the outcomes, and the peak of memory of this process and its own, MB."""
    found = run(folder, count, seed, seal=seal, draw=False)
    return found, max(peaks())


def peaks() -> list[float]:
    """The peak of memory of this process and of the largest that it started, MB."""
    # The system's count of a process begins with that of its parent; its status does not.
    status = Path("/proc/self/status")
    own = re.search(r"VmHWM:\s+(\d+) kB", status.read_text()) if status.exists() else None
    mine = int(own[1]) if own else resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return [x / 1024 for x in (mine, resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss)]


def main(count: int, seed: int) -> None:
    with tempfile.TemporaryDirectory() as folder:
        for seal in (True, False):
            begun = time.perf_counter()
            found = run(Path(folder), count, seed, seal=seal, draw=True)
            refused = sum(bool(each.said) for each in found)
            slowest = max(each.seconds for each in found)
            kind = "sealed" if seal else "unsealed"
            print(
                f"{count} {kind}: {refused} refused in a sentence, {count - refused} used as data,"
                f" slowest {slowest:.2f} s, {time.perf_counter() - begun:.0f} s in all"
            )
    for peak in peaks():
        print(f"peak of memory {peak:.0f} MB")


if __name__ == "__main__":
    main(int(sys.argv[1]), int((sys.argv[2:] or ["1"])[0]))
