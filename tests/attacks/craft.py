"""Crafted result files: each a design by which a file could do more than hold data."""

from __future__ import annotations

import os
import zlib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from rigidpend.machine.files import sealed, unsealed
from tests.cli.calls import REFERENCE

SECRET = b"a secret that must not be told, in 40 bytes"

Change = Callable[[Any, Path], Any]
"""Takes an open file and the folder that it lies in."""


def attack(change: Change, name: str = "fig5") -> Callable[[Path], bytes]:
    """A maker of the HDF5 image of a reference, changed, in a folder."""

    def make(folder: Path) -> bytes:
        image = unsealed((REFERENCE / f"{name}.h5").read_bytes())
        assert image is not None
        path = folder / "crafting"
        path.write_bytes(image)
        with h5py.File(path, "r+") as file:
            change(file, folder)
        made = path.read_bytes()
        path.unlink()
        return made

    return make


def external(field: str, size: int, pipe: bool = False) -> Change:
    """A field that is stored in a file of secrets, or in a pipe."""

    def change(file: Any, folder: Path) -> None:
        path = folder / "outside"
        if not pipe:
            path.write_bytes(SECRET)
        elif not path.exists():
            os.mkfifo(path)
        del file[f"data/case1/{field}"]
        where = [(str(path), 0, size)]
        file["data/case1"].create_dataset(field, (size,), "u1", external=where)

    return change


def elsewhere(file: Any, folder: Path) -> str:
    """Another file of symbols, and those of a case gone."""
    del file["data/case1/codes"]
    with h5py.File(folder / "source.h5", "w") as source:
        source["x"] = np.arange(5, dtype="u1")
    return str(folder / "source.h5")


def virtual(file: Any, folder: Path) -> None:
    layout = h5py.VirtualLayout((5,), "u1")
    layout[:] = h5py.VirtualSource(elsewhere(file, folder), "x", (5,))
    file["data/case1"].create_virtual_dataset("codes", layout)


def external_link(file: Any, folder: Path) -> None:
    file["data/case1/codes"] = h5py.ExternalLink(elsewhere(file, folder), "/x")


def soft_link(target: str) -> Change:
    return lambda file, _: (
        file.pop("data/case1/codes"),
        file.__setitem__("data/case1/codes", h5py.SoftLink(target)),
    )


def replaced(place: str, values: Any, **how: Any) -> Change:
    return lambda file, _: (file.pop(place), file.create_dataset(place, data=values, **how))


def shaped(place: str, shape: tuple[int, ...], kind: str, **how: Any) -> Change:
    """A dataset that declares a shape and holds nothing."""
    return lambda file, _: (file.pop(place), file.create_dataset(place, shape, kind, **how))


def bomb(file: Any, _: Path) -> None:
    """Much of nothing, compressed a thousandfold: 400 MB in some hundred kB."""
    del file["data/case1/t"]
    made = file.create_dataset(
        "data/case1/t", (50_000_000,), "f8", chunks=(10**6,), compression="gzip"
    )
    piece = zlib.compress(bytes(8 * 10**6))
    for k in range(0, 50_000_000, 10**6):
        made.id.write_direct_chunk((k,), piece)


def swollen_chunk(file: Any, _: Path) -> None:
    """A piece that is said to be small, and is not once it is inflated."""
    del file["data/case1/codes"]
    made = file.create_dataset("data/case1/codes", (5,), "u1", chunks=(5,), compression="gzip")
    # One piece again and again, an empty last one, and the sum of so many zeros.
    packer, times = zlib.compressobj(1), 300
    piece = packer.compress(bytes(2**20)) + packer.flush(zlib.Z_FULL_FLUSH)
    total = (times * 2**20 % 65521 << 16) + 1
    inner = piece + piece[2:] * (times - 1) + b"\x03\x00" + total.to_bytes(4)
    made.id.write_direct_chunk((0,), inner)


def nested(file: Any, _: Path) -> None:
    node = file["data/case1"]
    for _k in range(5000):
        node = node.create_group("g")


def cycle(file: Any, _: Path) -> None:
    file["data/case1/again"] = file["data"]


def crowd(file: Any, _: Path) -> None:
    inner = file["data"].id
    # Names of one group: to make as many groups takes six times as long.
    for k in range(21_000):
        inner.links.create_hard(b"g%d" % k, inner, b"case1")


def attribute(place: str, name: str, value: Any) -> Change:
    return lambda file, _: file[place].attrs.__setitem__(name, value)


def without(place: str, name: str) -> Change:
    return lambda file, _: file[place].attrs.__delitem__(name)


def together(*changes: Change) -> Change:
    return lambda file, folder: [change(file, folder) for change in changes]


def alone(group: str, kept: str) -> Change:
    """Without all other members of a group, which would take long to draw."""
    return lambda file, _: [file[group].pop(x) for x in list(file[group]) if x != kept]


def config(text: str) -> Change:
    return replaced("config", text)


def renamed(name: str) -> Change:
    return lambda file, _: file.move(f"data/{next(iter(file['data']))}", f"data/{name}")


def filled(place: str, value: float) -> Change:
    return lambda file, _: file[place].__setitem__(..., value)


def filtered(file: Any, _: Path) -> None:
    del file["data/case1/codes"]
    file.create_dataset("data/case1/codes", data=np.zeros(5, "u1"), chunks=(5,), compression="lzf")


REFERENCE_KIND = h5py.ref_dtype
STRUCTURE = np.zeros(5, dtype=[("a", "u1"), ("b", "f8")])
TEXTS = h5py.string_dtype()

ATTACKS: dict[str, Callable[[Path], bytes]] = {
    "external storage": attack(external("codes", 5)),
    "external storage of another shape": attack(external("bits", 41)),
    "external storage in a pipe": attack(external("codes", 5, pipe=True)),
    "virtual dataset": attack(virtual),
    "external link": attack(external_link),
    "soft link": attack(soft_link("/data/case2/codes")),
    "dangling link": attack(soft_link("/nowhere")),
    "link to itself": attack(soft_link("/data/case1/codes")),
    "huge shape": attack(shaped("data/case1/t", (180_000_000,), "f8")),
    "huge virtual chunks": attack(
        shaped("data/case1/t", (5689,), "f8", maxshape=(None,), chunks=(2**28,))
    ),
    "bomb": attack(bomb),
    "swollen chunk": attack(swollen_chunk),
    "nested groups": attack(nested),
    "cycle of groups": attack(cycle),
    "crowd of groups": attack(crowd),
    "another filter": attack(filtered),
    "structure": attack(replaced("data/case1/codes", STRUCTURE)),
    "references": attack(shaped("data/case1/codes", (5,), REFERENCE_KIND)),
    "texts for symbols": attack(replaced("data/case1/codes", ["a"] * 5, dtype=TEXTS)),
    "complex numbers": attack(replaced("data/case1/t", np.zeros(5689, "c16"))),
    "no elements": attack(replaced("data/case1/t", np.zeros(0))),
    "another shape": attack(replaced("data/case1/t", np.zeros(7))),
    "another dimension": attack(replaced("data/case1/t", np.zeros((5689, 1)))),
    "no values at all": attack(replaced("data/case1/t", h5py.Empty("f8"))),
    "group for an array": attack(
        lambda file, _: (file.pop("data/case1/t"), file.create_group("data/case1/t"))[0]
    ),
    "array for a group": attack(replaced("data/case1", np.zeros(3))),
    "NaN": attack(filled("data/case1/t", np.nan)),
    "infinity": attack(filled("data/case1/alpha", np.inf)),
    "zeros": attack(filled("data/case1/t", 0)),
    "no such separatrix": attack(filled("data/case1/separatrix", 200)),
    "samples far away": attack(filled("data/case1/wound", 2**62)),
    "negative samples": attack(filled("data/case1/wound", -(2**62))),
    "offsets": attack(filled("data/bodies/a/S1_minus/offsets", 2**62), "fig3"),
    "no such mu": attack(filled("data/drawn", -(2**40)), "precession"),
    "no symbols, and phases all the same": attack(
        together(filled("data/left/codes", 77), filled("data/right/theta2_0", 0)), "fig4"
    ),
    "zoom by nothing": attack(
        together(alone("data/levels", "level00"), filled("data/levels/level00/step", 0)),
        "fig4_zoom",
    ),
    "graph of nothing": attack(filled("data/vertices/J1", 5), "fig2"),
    "arrows far away": attack(filled("data/orbits/arrows", 2**40), "fig1"),
    "name of a formula": attack(renamed("$\\frac{$")),
    "name of a broken formula": attack(renamed("\\frac{"), "fig3"),
    "name with a control": attack(renamed("a\x1b[2J")),
    "name of a thousand characters": attack(renamed("a" * 1000)),
    "config no JSON": attack(config("{")),
    "config no object": attack(config("[1]")),
    "config too deep": attack(config("[" * 100_000 + "]" * 100_000)),
    "config rather deep": attack(config('{"a":' * 400 + "1" + "}" * 400)),
    "config no text": attack(replaced("config", 7)),
    "unknown experiment": attack(attribute("/", "experiment", "nonesuch")),
    "another experiment": attack(attribute("/", "experiment", "route_codes")),
    "experiment a path": attack(attribute("/", "experiment", "../../evil")),
    "experiment a number": attack(attribute("/", "experiment", 7)),
    "no experiment": attack(without("/", "experiment")),
    "name an array": attack(attribute("/", "name", [1, 2, 3])),
    "name a formula": attack(attribute("/", "name", "$\\frac{$"), "fig2"),
    "no name, no hash, figure markup, and units a number": attack(
        together(
            *(without("/", name) for name in ("name", "config_hash")),
            attribute("/", "figure", "<script>"),
            attribute("data/vertices/J1", "units", 3.5),
        ),
        "fig2",
    ),
    "attribute a structure": attack(attribute("data/case1/t", "extra", STRUCTURE)),
    "attribute a reference": attack(lambda file, _: file.attrs.__setitem__("x", file["data"].ref)),
    "more at the root": attack(lambda file, _: file.create_group("more")),
    "format version of many": attack(attribute("/", "format_version", [1, 1])),
}
"""What each does, and what makes the image of its file."""


def written(folder: Path, name: str, *, seal: bool) -> Path:
    """A crafted file in a folder of its own, under the name of its figure."""
    folder.mkdir(parents=True, exist_ok=True)
    image = ATTACKS[name](folder)
    path = folder / "attack.h5"
    path.write_bytes(sealed(image) if seal else image)
    return path
