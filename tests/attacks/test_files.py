"""Crafted and fuzzed files: who reads one says in a sentence why not, or uses it as data."""

import itertools
import multiprocessing
import random
import re
import resource
import zlib
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest

from rigidpend import render
from rigidpend.machine import files
from rigidpend.machine.files import sealed, unsealed
from rigidpend.results import damage, store
from tests.attacks import lot
from tests.cli.calls import REFERENCE

Change = Callable[[Any, Path], Any]
"""Takes an open file and the folder that it lies in."""


def image(name: str) -> bytes:
    """The HDF5 file in a reference."""
    found = unsealed((REFERENCE / f"{name}.h5").read_bytes())
    assert found is not None
    return found


def written(folder: Path, change: Change, name: str = "fig5", *, seal: bool = True) -> Path:
    """A changed reference in a folder of its own."""
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / "attack.h5"
    path.write_bytes(image(name))
    with h5py.File(path, "r+") as file:
        change(file, folder)
    if seal:
        path.write_bytes(sealed(path.read_bytes()))
    return path


CODES, TIMES = "data/case1/codes", "data/case1/t"


def made(place: str, *given: Any, **how: Any) -> Change:
    """Another dataset at a place."""
    return lambda file, _: (file.pop(place), file.create_dataset(place, *given, **how))[1]


def external(file: Any, folder: Path) -> None:
    """Symbols that are stored in another file, as good as any."""
    (folder / "outside").write_bytes(bytes(5))
    made(CODES, (5,), "u1", external=[(str(folder / "outside"), 0, 5)])(file, folder)


def elsewhere(virtual: bool) -> Change:
    """Symbols of another file, by a virtual dataset or by a link."""

    def change(file: Any, folder: Path) -> None:
        del file[CODES]
        other = str(folder / "source.h5")
        with h5py.File(other, "w") as source:
            source["x"] = np.zeros(5, dtype="u1")
        if virtual:
            layout = h5py.VirtualLayout((5,), "u1")
            layout[:] = h5py.VirtualSource(other, "x", (5,))
            file.create_virtual_dataset(CODES, layout)
        else:
            file[CODES] = h5py.ExternalLink(other, "/x")

    return change


def bomb(file: Any, folder: Path) -> None:
    """Much of nothing, compressed a thousandfold: 400 MB in some hundred kB."""
    much = made(TIMES, (50_000_000,), "f8", chunks=(10**6,), compression="gzip")(file, folder)
    piece = zlib.compress(bytes(8 * 10**6))
    for k in range(0, 50_000_000, 10**6):
        much.id.write_direct_chunk((k,), piece)


def swollen_chunk(file: Any, folder: Path) -> None:
    """A piece that is said to be small, and is not once it is inflated."""
    little = made(CODES, (5,), "u1", chunks=(5,), compression="gzip")(file, folder)
    # One piece again and again, an empty last one, and the sum of so many zeros.
    packer, times = zlib.compressobj(1), 300
    piece = packer.compress(bytes(2**20)) + packer.flush(zlib.Z_FULL_FLUSH)
    total = (times * 2**20 % 65521 << 16) + 1
    inner = piece + piece[2:] * (times - 1) + b"\x03\x00" + total.to_bytes(4)
    little.id.write_direct_chunk((0,), inner)


def nested(file: Any, _: Path) -> None:
    node = file["data/case1"]
    for _k in range(5000):
        node = node.create_group("g")


def crowd(file: Any, _: Path) -> None:
    inner = file["data"].id
    # Names of one group: to make as many groups takes six times as long.
    for k in range(21_000):
        inner.links.create_hard(b"g%d" % k, inner, b"case1")


def attributes(place: str = "/", **values: Any) -> Change:
    return lambda file, _: file[place].attrs.update(values)


def together(*changes: Change) -> Change:
    return lambda file, folder: [change(file, folder) for change in changes]


def without(*names: str) -> Change:
    return lambda file, _: [file.attrs.pop(name) for name in names]


def alone(group: str, kept: str) -> Change:
    """Without all other members of a group, which would take long to draw."""
    return lambda file, _: [file[group].pop(x) for x in list(file[group]) if x != kept]


def renamed(name: str) -> Change:
    return lambda file, _: file.move("data/case1", f"data/{name}")


def filled(place: str, value: float) -> Change:
    return lambda file, _: file[place].__setitem__(..., value)


ATTACKS: dict[str, tuple[Any, ...]] = {
    "external storage": (external,),
    "virtual dataset": (elsewhere(virtual=True),),
    "external link": (elsewhere(virtual=False),),
    "link to itself": (
        lambda file, _: (file.pop(CODES), file.__setitem__(CODES, h5py.SoftLink(f"/{CODES}"))),
    ),
    "huge shape": (made(TIMES, (180_000_000,), "f8"),),
    "huge virtual chunks": (made(TIMES, (5689,), "f8", maxshape=(None,), chunks=(2**28,)),),
    "bomb": (bomb,),
    "swollen chunk": (swollen_chunk,),
    "nested groups": (nested,),
    "cycle of groups": (lambda file, _: file.__setitem__("data/case1/again", file["data"]),),
    "crowd of groups": (crowd,),
    "structure": (made(CODES, (5,), [("a", "u1"), ("b", "f8")]),),
    "texts for symbols": (made(CODES, data=["a"] * 5, dtype=h5py.string_dtype()),),
    "another shape": (made(TIMES, data=np.zeros(7)),),
    "another dimension": (made(TIMES, data=np.zeros((5689, 1))),),
    "no values at all": (made(TIMES, data=h5py.Empty("f8")),),
    "group for an array": (lambda file, _: (file.pop(TIMES), file.create_group(TIMES))[0],),
    "array for a group": (made("data/case1", data=np.zeros(3)),),
    "NaN": (filled("data/case1/theta1", np.nan),),
    "no such separatrix": (filled("data/case1/separatrix", 200),),
    "samples far away": (filled("data/case1/wound", 2**62),),
    "offsets": (filled("data/bodies/a/S1_minus/offsets", 2**62), "fig3"),
    "no symbols, and phases all the same": (
        together(filled("data/left/codes", 255), filled("data/right/theta2_0", 0)),
        "fig4",
    ),
    "codes that are none": (filled("data/left/codes", 77), "fig4"),
    "zoom by nothing": (
        together(alone("data/levels", "level00"), filled("data/levels/level00/step", 0)),
        "fig4_zoom",
    ),
    "arrows far away": (filled("data/orbits/arrows", 2**40), "fig1"),
    "name of a formula": (renamed("$\\frac{$"),),
    "name with a control": (renamed("a\x1b[2J"),),
    "name of a thousand characters": (renamed("a" * 1000),),
    "config no JSON": (made("config", data="{"),),
    "config no object": (made("config", data="[1]"),),
    "config too deep": (made("config", data="[" * 100_000 + "]" * 100_000),),
    "config no text": (made("config", data=7),),
    "another experiment": (attributes(experiment="route_codes"),),
    "experiment a path": (attributes(experiment="../../evil"),),
    "experiment a number": (attributes(experiment=7),),
    "no experiment": (without("experiment"),),
    "name a formula": (attributes(name="$\\frac{$"), "fig2"),
    "no name, no hash, figure markup, and units a number": (
        together(
            without("name", "config_hash"),
            attributes(figure="<script>"),
            attributes("data/vertices/J1", units=3.5),
        ),
        "fig2",
    ),
    "attribute a reference": (lambda file, _: file.attrs.update(x=file["data"].ref),),
    "more at the root": (lambda file, _: file.create_group("more"),),
    "format version of many": (attributes(format_version=[1, 1]),),
}
"""What each changes, and in which reference if not in Fig. 5."""

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


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "seal"),
    # A seal is nothing to rely on, so every file has one; without it the same checks follow.
    [*((name, True) for name in ATTACKS), *((name, False) for name in ("bomb", "NaN"))],
)
def test_an_attack_is_a_sentence_or_a_figure(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str, seal: bool
) -> None:
    # A small image goes the same way as a large one.
    monkeypatch.setattr(render, "PIXELS", 800)
    path = written(tmp_path, *ATTACKS[name], seal=seal)
    begun = spent()
    try:
        result = store.load(path)
    except files.StoreError as error:
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
    except render.OF_VALUES:
        assert name not in DRAWN
    else:
        assert name in DRAWN


BOMBS = ("bomb", "swollen chunk", "huge shape", "huge virtual chunks")


def bombs(folder: Path, count: int, chance: random.Random) -> Iterator[Path]:
    """Arrays of any length that hold nothing, in pieces of any size, packed or not."""
    for name in BOMBS:
        yield written(folder, *ATTACKS[name])
    for _ in range(count):
        length, piece = (round(10 ** chance.uniform(4, 11)) for _ in range(2))
        how = {"chunks": (min(piece, length, 2**28),)} if chance.random() < 0.7 else {}
        packed = {"compression": "gzip"} if how and chance.random() < 0.5 else {}
        place = chance.choice(["data/case1/t", "data/case1/codes", "data/case2/alpha"])
        kind = chance.choice(["f8", "u1", "i8"])
        yield written(folder, made(place, (length,), kind, **how, **packed))


NAMES = ("fig2", "fig4", "precession", "fig5")
HEADS = 4096
"""Bytes at the beginning of a file, and around names, where most of what steers HDF5 lies."""


def fuzzed(folder: Path, count: int, chance: random.Random, *, seal: bool) -> Iterator[Path]:
    """References with one to eight places changed, half of the time in their heads."""
    path = folder / "fuzzed.h5"
    for content in itertools.islice(itertools.cycle(map(image, NAMES)), count):
        changed = bytearray(content)
        for _ in range(chance.choice((1, 1, 2, 4, 8))):
            reach = len(changed) if chance.random() < 0.5 else min(HEADS, len(changed))
            place, width = chance.randrange(8, reach), chance.choice((1, 1, 2, 4, 8))
            value = chance.choice((b"\x00" * 8, b"\xff" * 8, chance.randbytes(8)))
            changed[place : place + width] = value[: len(changed[place : place + width])]
        path.write_bytes(sealed(bytes(changed)) if seal else changed)
        yield path


KINDS: dict[str, tuple[Callable[..., Iterator[Path]], int]] = {
    "bombs": (bombs, lot.trials(8, 0.2)),
    "sealed": (partial(fuzzed, seal=True), lot.trials(16)),
    "unsealed": (partial(fuzzed, seal=False), lot.trials(16)),
}
"""Files by chance, and how many of them."""


def read(kind: str, folder: Path) -> tuple[list[tuple[str, float]], float]:
    """Read files of a kind: what is said of each, its seconds, and the peak of memory, MB."""
    make, count = KINDS[kind]
    found = []
    with lot.drawn(kind) as chance:
        for path in make(folder, count, chance):
            begun, said = spent(), ""
            try:
                store.load(path)
            except files.StoreError as error:
                said = str(error) or "nothing was said\n"
            found.append((said, spent() - begun))
    return found, max(peaks())


@pytest.mark.slow
def test_a_fuzzed_file_or_a_bomb_is_a_sentence_or_data_in_bounded_memory(tmp_path: Path) -> None:
    # In a fresh process: the peak counts all that a process ever started, and what it inherits.
    with ProcessPoolExecutor(1, multiprocessing.get_context("spawn")) as fresh:
        every = dict(zip(KINDS, fresh.map(read, KINDS, [tmp_path] * len(KINDS)), strict=True))
    for kind, (found, peak) in every.items():
        said = [each for each, _ in found]
        assert all(x.isprintable() for x in said), lot.SEED
        assert all(not x or x.startswith(f"{tmp_path}") for x in said), lot.SEED
        assert any(said)
        assert all(said) == (kind == "bombs")
        assert max(seconds for _, seconds in found) < damage.ALLOWANCE + 1.0
        assert peak < MEGABYTES
