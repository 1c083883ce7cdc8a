"""Fuzzing of result files: bytes turned over anywhere, sealed anew or not, each read as data."""

from __future__ import annotations

import random
import re
import resource
from pathlib import Path

from rigidpend.machine.files import sealed, unsealed
from rigidpend.results import store
from tests.cli.calls import REFERENCE

NAMES = ("fig2", "fig4", "precession", "fig5")
HEADS = 4096
"""Bytes at the beginning of a file, and around names, where most of what steers HDF5 lies."""


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


def watched(
    folder: Path, count: int, seed: int, seal: bool
) -> tuple[list[tuple[str, float]], float]:
    """Fuzz and read so many files: what is said of each, its seconds, and the peak, MB."""
    chance, found = random.Random(seed), []
    images = [unsealed((REFERENCE / f"{name}.h5").read_bytes()) or b"" for name in NAMES]
    path = folder / "fuzzed.h5"
    for k in range(count):
        image = fuzzed(images[k % len(images)], chance)
        path.write_bytes(sealed(image) if seal else image)
        begun, said = spent(), ""
        try:
            store.load(path)
        except store.StoreError as error:
            said = str(error) or "nothing was said\n"
        found.append((said, spent() - begun))
    return found, max(peaks())


def peaks() -> list[float]:
    """The peak of memory of this process and of the largest that it started, MB."""
    # The system's count of a process begins with that of its parent; its status does not.
    status = Path("/proc/self/status")
    own = re.search(r"VmHWM:\s+(\d+) kB", status.read_text()) if status.exists() else None
    mine = int(own[1]) if own else resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return [x / 1024 for x in (mine, resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss)]
