"""Crafted and fuzzed files: who reads one says in a sentence why not, or uses it as data."""

from __future__ import annotations

import contextlib
import multiprocessing
import random
import re
import resource
import shutil
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

import pytest

from rigidpend import render
from rigidpend.machine.files import sealed, unsealed
from rigidpend.results import damage, store
from tests.attacks import craft, lot
from tests.cli.calls import REFERENCE, call

SECONDS, MEGABYTES = 2.0, 500
"""What a reader may need of the processor, with what it starts, and of memory."""

DRAWN = {
    "offsets",
    "no symbols, and phases all the same",
    "arrows far away",
    "name a formula",
    "no name, no hash, figure markup, and units a number",
}
"""Attacks whose values are as good as any."""


def spent() -> float:
    """Seconds of the processor of this process and of those that it started."""
    times = (resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))
    return sum(each.ru_utime + each.ru_stime for each in times)


def peaks() -> list[float]:
    """The peak of memory of this process and of the largest that it started, MB."""
    # The system's count of a process begins with that of its parent; its status does not.
    status = Path("/proc/self/status")
    own = re.search(r"VmHWM:\s+(\d+) kB", status.read_text()) if status.exists() else None
    mine = int(own[1]) if own else resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return [x / 1024 for x in (mine, resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss)]


UNSEALED = ("external storage", "soft link", "bomb", "structure", "NaN")
"""Attacks that are tried without a digest too: one of each kind."""


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "seal"),
    # A seal is nothing to rely on, so every file has one; without it the same checks follow.
    [(name, True) for name in craft.ATTACKS] + [(name, False) for name in UNSEALED],
)
def test_an_attack_is_a_sentence_or_a_figure(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str, seal: bool
) -> None:
    # A small image goes the same way as a large one.
    monkeypatch.setattr(render, "PIXELS", 800)
    path = craft.written(tmp_path, name, seal=seal)
    begun = spent()
    try:
        result = store.load(path)
    except store.StoreError as error:
        said = str(error)
        assert spent() - begun < SECONDS
        assert said.startswith(f"{path}: ")
        assert said.isprintable()
        assert len(said) < len(str(path)) + 400
        assert name not in DRAWN
        return
    # What is made as a result, with values that are none, ends where it is drawn.
    try:
        render.image(result, "png")
    except render.Undrawable:
        assert name not in DRAWN
    else:
        assert name in DRAWN


@pytest.mark.slow
def test_no_command_tells_what_another_file_holds(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    results = tmp_path / "results"
    craft.written(results, "external storage", seal=True).rename(results / "fig5.h5")
    shutil.copy(REFERENCE / "fig2.h5", results / "fig2.h5")
    monkeypatch.setattr(render, "PIXELS", 800)
    for command, code in (
        (["report"], 1),
        (["render", "fig5"], 1),
        (["verify", "fig5", "--reference", "results", "--results", "results"], 1),
        (["run", "fig5"], 1),
        (["list"], 0),
    ):
        done = call(tmp_path, *command)
        said = done.stdout + done.stderr
        assert done.returncode == code, (command, said)
        # Lines of a table end where the terminal does.
        told = " ".join(said.split())
        assert "is stored outside of the file, where nothing is read" in told
        assert "internal error" not in told
    page = (results / "report.html").read_text()
    shown = page + said
    assert "115" not in page.partition("<h2>Fig. 2")[0].partition("<main>")[2]
    assert craft.SECRET.decode() not in shown
    assert str(list(craft.SECRET[:5]))[1:-1] not in shown
    assert "where nothing is read" in page
    assert page.count("<img ") == 1


BOMBS = ("bomb", "swollen chunk", "huge shape", "huge virtual chunks")


def drawn_bomb(chance: random.Random) -> craft.Change:
    """An array of any length that holds nothing, in pieces of any size, packed or not."""
    length, piece = (round(10 ** chance.uniform(4, 11)) for _ in range(2))
    how = {"chunks": (min(piece, length, 2**28),)} if chance.random() < 0.7 else {}
    packed = {"compression": "gzip"} if how and chance.random() < 0.5 else {}
    place = chance.choice(["data/case1/t", "data/case1/codes", "data/case2/alpha"])
    return craft.shaped(place, (length,), chance.choice(["f8", "u1", "i8"]), **how, **packed)


def refused_bombs(folder: Path, count: int) -> tuple[int, float]:
    """How many bombs are refused, and the peak of memory of this process and its own, MB."""
    with lot.drawn("bombs") as chance:
        drawn = {f"{k}": craft.attack(drawn_bomb(chance)) for k in range(count)}
    craft.ATTACKS.update(drawn)
    refused = 0
    for name in (*BOMBS, *drawn):
        with contextlib.suppress(store.StoreError):
            store.load(craft.written(folder / name, name, seal=True))
            continue
        refused += 1
    return refused, max(peaks())


def test_pieces_larger_than_what_may_be_read_are_refused(tmp_path: Path) -> None:
    """The reader would make room for one of them whatever the array itself takes."""
    path = craft.written(tmp_path, "huge virtual chunks", seal=True)
    with pytest.raises(store.StoreError, match="is stored in pieces that are too large"):
        store.load(path)


@pytest.mark.slow
def test_the_memory_that_a_bomb_takes_is_bounded(tmp_path: Path) -> None:
    # In a fresh process, which has started nothing else.
    count = lot.trials(8, 0.2)
    with ProcessPoolExecutor(1, multiprocessing.get_context("spawn")) as fresh:
        refused, peak = fresh.submit(refused_bombs, tmp_path, count).result()
    assert refused == len(BOMBS) + count
    assert peak < MEGABYTES


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


@pytest.mark.slow
def test_a_fuzzed_file_is_a_sentence_or_data(tmp_path: Path) -> None:
    """Whether it is sealed anew or not."""
    # In a fresh process: the peak counts all that a process ever started, and what it inherits.
    with ProcessPoolExecutor(1, multiprocessing.get_context("spawn")) as fresh:
        given = [tmp_path] * 2, [lot.trials(16)] * 2, [lot.SEED + 1] * 2, (True, False)
        both = list(fresh.map(watched, *given))
    for found, peak in both:
        said = [each for each, _ in found]
        assert all(x.isprintable() for x in said), lot.SEED
        assert all(not x or x.startswith(f"{tmp_path}") for x in said), lot.SEED
        assert any(said)
        assert not all(said)
        assert max(seconds for _, seconds in found) < damage.ALLOWANCE + 1.0
        assert peak < MEGABYTES
