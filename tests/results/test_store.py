"""Result files: read back as written, whole or not at all, and damage is noticed."""

import contextlib
import errno
import json
import os
import random
import shutil
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any
from unittest.mock import MagicMock, Mock

import h5py
import numpy as np
import pytest

from rigidpend import experiments
from rigidpend.experiments.data import (
    FLAG,
    FLOAT,
    TEXT,
    WHOLE,
    Coming,
    Field,
    Layout,
    Streamed,
    Tree,
)
from rigidpend.machine import files
from rigidpend.machine.files import StoreError
from rigidpend.results import damage, store, structure
from rigidpend.results.store import OtherVersion
from tests.processes import python

CODES = np.arange(60, dtype=np.uint8).reshape(6, 10) % 2
TIMES = np.linspace(0.0, 1.0, 70).reshape(7, 10)
TREE: Tree = {
    "zebra": {
        "codes": CODES,
        "certain": CODES == 0,
        "times": np.where(CODES == 0, np.nan, TIMES[1:]),
    },
    "ant": {"inner": {"none": np.zeros((0, 3))}},
    "count": np.int64(7),
}
LAYOUT: Layout = {
    "zebra": {
        "codes": Field(WHOLE, ("symbols", "columns"), "1", "symbols"),
        "certain": Field(FLAG, ("symbols", "columns"), "1", "whether they are"),
        "times": Field(FLOAT, ("symbols", "columns"), "t'", "of crossings", gaps=True),
    },
    "ant": {"inner": {"none": Field(FLOAT, (0, 3), "rad", "no row")}},
    "count": Field(WHOLE, (), "1", "a single number"),
}
CONFIG, PROVENANCE = {"ä": 1}, {"created": "now"}
TOLD: Any = ({"name": "x", "experiment": "any"}, CONFIG, PROVENANCE)
OTHER: Tree = {**TREE, "count": 8}


@pytest.fixture(autouse=True)
def declared(monkeypatch: pytest.MonkeyPatch) -> None:
    """Take the layout for that of the experiment, and no file for known, nor for one's own."""
    monkeypatch.setattr(experiments, "layout", lambda _: LAYOUT)
    monkeypatch.setattr(store, "SOUND", set())
    monkeypatch.setattr(store, "WRITTEN", MagicMock())


@pytest.fixture
def path(tmp_path: Path) -> Path:
    store.write(tmp_path / "x.h5", LAYOUT, TREE, *TOLD)
    return tmp_path / "x.h5"


def test_the_same_content_gives_the_same_bytes_which_others_may_read_as_any_file(
    path: Path,
) -> None:
    other = path.with_name("y.h5")
    store.write(other, LAYOUT, TREE, *TOLD)
    assert other.read_bytes() == path.read_bytes()
    (path.parent / "plain").touch()
    assert path.stat().st_mode == (path.parent / "plain").stat().st_mode
    assert store.load(path, ratio=0)["data"]["count"] == TREE["count"], "a small one may have any"


def test_what_a_layout_asks_for_and_is_not_there_is_not_left_out_in_silence(path: Path) -> None:
    before = path.read_bytes()
    lacking = {name: x for name, x in TREE.items() if name != "count"}
    with pytest.raises(KeyError, match="count"):
        store.write(path, LAYOUT, lacking, *TOLD)
    assert path.read_bytes() == before


def test_blocks_of_a_group_inside_another_are_written_where_they_belong(tmp_path: Path) -> None:
    field = Field(WHOLE, ("symbols", "columns"), "1", "symbols")
    layout: Layout = {"codes": field, "inner": {"codes": field}}

    def streamed(k: int, **more: Any) -> Streamed:
        coming = Coming(CODES.shape, CODES.dtype, (6, 5))
        halves = (slice(0, 5), slice(5, 10))
        blocks = ({"codes": ((..., x), k + CODES[:, x])} for x in halves)
        return Streamed({"codes": coming, **more}, blocks)

    store.write(tmp_path / "x.h5", layout, streamed(1, inner=streamed(3)), *TOLD)
    with h5py.File(tmp_path / "x.h5") as file:
        np.testing.assert_array_equal(file["data/codes"][:], 1 + CODES)
        np.testing.assert_array_equal(file["data/inner/codes"][:], 3 + CODES)


@pytest.mark.parametrize("error", [OSError(errno.ENOSPC, "No space left on device"), SystemExit()])
@pytest.mark.parametrize("function", ["fsync", "replace"])
def test_a_failed_or_interrupted_write_leaves_the_old_file_and_nothing_else(
    path: Path, monkeypatch: pytest.MonkeyPatch, function: str, error: BaseException
) -> None:
    before = path.read_bytes()

    monkeypatch.setattr(os, function, Mock(side_effect=error))
    with pytest.raises((StoreError, SystemExit)) as caught:
        store.write(path, LAYOUT, OTHER, *TOLD)
    said = f"{path}: cannot be written: No space left on device"
    assert caught.value is error or str(caught.value) == said
    assert path.read_bytes() == before
    assert [x.name for x in path.parent.iterdir()] == ["x.h5"]


@pytest.mark.parametrize(
    "act", [files.prepare, lambda path: store.write(path, LAYOUT, TREE, *TOLD)]
)
def test_a_file_in_the_place_of_a_folder_is_named(tmp_path: Path, act: Any) -> None:
    (tmp_path / "file").write_text("mine")
    target = tmp_path / "file" / "x.h5"
    said = rf"^{target}: {target.parent} is not writable \(.*choose another folder with --out$"
    with pytest.raises(StoreError, match=said):
        act(target)
    assert (tmp_path / "file").read_text() == "mine"


def refusal(path: Path) -> str:
    """What is said of a file that is unfit, the same by all that read it."""
    said = set()
    for read in (store.attributes, store.load):
        with pytest.raises(StoreError) as caught:
            read(path)
        said.add((type(caught.value), str(caught.value)))
    [(kind, text)] = said
    assert kind is (OtherVersion if "format version" in text else StoreError)
    assert text.startswith(f"{path}: ")
    assert "\n" not in text
    return text


@pytest.mark.parametrize("content", [None, b"", b"words", b"\x89HDF\r\n\x1a\n", bytes(5000)])
def test_what_is_absent_or_no_hdf5_is_refused(tmp_path: Path, content: bytes | None) -> None:
    path = tmp_path / "x.h5"
    if content is None:
        with pytest.raises(files.Absent, match="there is no such file"):
            store.load(path)
        return
    path.write_bytes(content)
    assert "not a readable HDF5 file" in refusal(path)


VERSION = "its format version is"


def told(place: str = "/", /, **values: Any) -> Callable[[Any], None]:
    """A change of attributes."""
    return lambda file: file[place].attrs.update(values)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda file: file.attrs.pop("format"), "an HDF5 file, but not a result of rigidpend"),
        *((told(format_version=x), f"{VERSION} {x}, this program") for x in (0, "1")),
        (lambda file: file.attrs.pop("format_version"), f"{VERSION} None, this program reads 1"),
        (told(**{str(k): k for k in range(65)}), "attributes, too many"),
        (told(name="a" * 1001), "its attribute name is not a short text"),
        (told("data/ant", more=h5py.Empty("f")), "an attribute without a value"),
        (told("data/count", more=1j), "an attribute that is neither a text nor a number"),
        *(
            (lambda file, x=x: file.pop(x), f"not a result that can be used: {x} is absent")
            for x in ("config", "provenance", "data")
        ),
    ],
)
def test_a_file_that_is_made_otherwise_is_refused(
    path: Path, change: Callable[[Any], None], said: str
) -> None:
    with h5py.File(path, "a") as file:
        change(file)
    assert said in refusal(path)


DOUBLES, TEXTS = (Field(kind, (10,), "1", "ten") for kind in (FLOAT, TEXT))
PACKED = {"compression": "gzip", "shuffle": True, "fletcher32": True}


@pytest.mark.parametrize(
    ("changes", "layout", "most", "objects", "said"),
    [
        # A text is 8 bytes, a pointer, and each array 80.
        ({}, DOUBLES, 168, 5, ""),
        ({}, DOUBLES, 167, 5, "data/b is too large"),
        ({}, DOUBLES, 168, 4, "data has 2 members, too many"),
        ({"chunks": (10,)}, DOUBLES, 248, 5, ""),
        ({"chunks": (10,)}, DOUBLES, 247, 5, "data/b is stored in pieces that are too large"),
        ({"data": np.zeros(0)}, Field(FLOAT, ("n+1",), "1", "ends"), 500, 5, "another shape"),
        ({"chunks": (10,), **PACKED}, DOUBLES, 248, 5, ""),
        # HDF5 has no filter of this kind by itself.
        ({"compression": "lzf"}, DOUBLES, 500, 5, "data/a is stored through an unknown filter"),
        ({"data": np.zeros(10, "S4096")}, TEXTS, 10**5, 5, ""),
        ({"data": np.zeros(10, "S4097")}, TEXTS, 10**5, 5, "data/a does not hold texts"),
    ],
)
def test_limits_are_those_of_all_arrays_together(
    changes: Any, layout: Any, most: int, objects: int, said: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(structure, "OBJECTS", objects)
    with h5py.File.in_memory() as file:
        file["config"], _ = "{}", file.create_group("provenance")
        for name in "ab":
            file.create_dataset(f"data/{name}", **{"data": np.zeros(10), **changes})
        root = h5py.h5g.open(file.id, b"/")
        found = ""
        try:
            structure.Checker(most).file(root, {"a": layout, "b": layout})
        except StoreError as error:
            found = str(error)
    assert (said in found, bool(found)) == (True, bool(said))


@pytest.mark.parametrize("error", [RuntimeError("mine"), OSError("mine"), KeyError("mine")])
def test_an_error_of_who_reads_is_not_laid_to_the_file(path: Path, error: Exception) -> None:
    with pytest.raises(type(error)) as caught, store.opened(path):
        raise error
    assert caught.value is error


def test_load_gives_the_whole_file_as_it_was_written_with_an_outline(path: Path) -> None:
    loaded, outline = store.load_outlined(path)
    np.testing.assert_equal(store.load(path), loaded)
    assert list(loaded) == ["attributes", "config", "provenance", "data"]
    assert loaded["attributes"] == store.attributes(path)
    assert (loaded["config"], loaded["provenance"]) == (CONFIG, PROVENANCE)
    np.testing.assert_equal(loaded["data"], TREE)
    assert list(loaded["data"]) == list(TREE), "in its order"
    found, stored = (x["zebra"] for x in (loaded["data"], TREE))
    assert [(x, found[x].dtype) for x in found] == [(x, stored[x].dtype) for x in stored]
    told = {"units": "1", "description": "symbols", "(kind)": "u1", "(dimensions)": 2}
    assert outline["/data/zebra/codes"] == told


def test_a_config_has_no_more_brackets_inside_each_other_than_are_read() -> None:
    inner: Any = []
    for _ in range(30):
        inner = [inner]
    assert store.read_config(json.dumps({"a": inner})) == {"a": inner}
    with pytest.raises(StoreError, match="more than 32 brackets inside each other"):
        store.read_config(json.dumps({"a": [inner]}))


def complaint(path: Path) -> str:
    """What is said of a file; nothing if it is read."""
    try:
        store.load(path)
    except StoreError as error:
        return str(error)
    return ""


@pytest.mark.slow
def test_no_damage_goes_unnoticed_hangs_or_crashes(path: Path) -> None:
    """Where HDF5 itself is asked, 4 and 11 in 8,000 crash it or make it hang."""
    content, chance = path.read_bytes(), random.Random(20)
    for _ in range(1000):
        at = chance.randrange(len(content))
        other = bytes([content[at] ^ chance.randrange(1, 256)]) + content[at + 1 :]
        path.write_bytes(broken := content[:at] + chance.choice([b"", other]))
        # Cut exactly between the HDF5 file and its digest, nothing is lost.
        whole = len(broken) == len(content) - files.SEAL_LENGTH
        said = complaint(path)
        assert said.startswith(f"{path}: not a readable HDF5 file: ") is not whole
        assert bool(said) is not whole


@pytest.mark.slow
def test_what_another_program_changed_is_read_and_damage_to_it_is_noticed_too(path: Path) -> None:
    # Another program drops what is behind the HDF5 file.
    with h5py.File(path, "a") as file:
        file["data/count"][()] = 8
    assert files.unsealed(path.read_bytes()) is None
    assert store.load(path)["data"]["count"] == 8
    changed = bytearray(path.read_bytes())
    with h5py.File(path, "r") as file:
        changed[file["data/zebra/codes"].id.get_chunk_info(0).byte_offset] ^= 0xFF
    path.write_bytes(changed)
    assert complaint(path).startswith(f"{path}: ")


def test_a_number_that_its_field_excludes_is_no_value(
    path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    codes = Field(WHOLE, ("symbols", "columns"), "1", "symbols", among=(0, 1))
    zebra: Any = LAYOUT["zebra"]
    layout = {**LAYOUT, "zebra": {**zebra, "codes": codes}}
    monkeypatch.setattr(experiments, "layout", lambda _: layout)
    assert (store.load(path)["data"]["zebra"]["codes"] == CODES).all()
    with h5py.File(path, "a") as file:
        file["data/zebra/codes"][5, 9] = 7
    with pytest.raises(StoreError, match=r"data/zebra/codes has another number than 0, 1$"):
        store.load(path)


def busy() -> None:
    while True:
        pass


@pytest.mark.slow
@pytest.mark.parametrize(
    ("act", "patience", "said"),
    [
        (os.abort, 30, damage.CANNOT),
        (lambda: os.kill(os.getpid(), 9), 30, damage.CANNOT),
        (lambda: time.sleep(60), 1, damage.TOO_LONG),
        (busy, 30, damage.TOO_LONG),
        (lambda: [0] * 2**31, 30, "more memory than its size allows"),
    ],
)
def test_a_file_that_crashes_or_hangs_its_reader_is_refused(
    monkeypatch: pytest.MonkeyPatch, act: Callable[[], Any], patience: int, said: str
) -> None:
    """What is busy is ended by the processor's time."""
    parent, begun = os.getpid(), time.monotonic()

    def read() -> None:
        assert os.getpid() != parent
        act()

    monkeypatch.setattr(damage, "PATIENCE", patience)
    monkeypatch.setattr(damage, "ALLOWANCE", 1)
    assert damage.seconds(3 * 2**18) == 4
    with pytest.raises(ValueError, match=said):
        damage.tried(read, 0, 2**30)
    assert time.monotonic() - begun < 30


FORKING = """
import os, warnings
from rigidpend.results import damage

fork = os.fork

def warned():
    warnings.warn("This process is multi-threaded, use of fork() may hang", stacklevel=2)
    # As another thread would, while a file is read.
    warnings.warn("of another thread", stacklevel=1)
    return fork()

os.fork = warned
before = list(warnings.filters)
damage.tried(lambda: None, 0, 2**30)
print(warnings.filters == before)
"""


def test_warnings_of_other_threads_are_shown_while_a_file_is_read() -> None:
    done = python(Path.cwd(), "-W", "always", "-c", FORKING)
    [said] = [line for line in done.stderr.splitlines() if "Warning: " in line]
    assert said.endswith("of another thread")
    assert done.stdout == "True\n"


@pytest.mark.parametrize(("read", "whole"), [(store.load, True), (store.attributes, False)])
def test_values_are_read_by_another_process_before(
    monkeypatch: pytest.MonkeyPatch, path: Path, read: Callable[[Path], Any], whole: bool
) -> None:
    values, seen = h5py.Dataset.__getitem__, list[str]()

    def look(node: Any, what: Any) -> Any:
        seen.append(node.name)
        return values(node, what)

    def tried(trial: Callable[[], None], *_: int) -> None:
        with monkeypatch.context() as patch:
            patch.setattr(h5py.Dataset, "__getitem__", look)
            trial()

    monkeypatch.setattr(store, "tried", tried)
    read(path)
    assert ("/data/zebra/times" in seen) is whole


def test_another_process_reads_once_what_is_then_found_sound(
    monkeypatch: pytest.MonkeyPatch, path: Path
) -> None:
    """The same bytes wherever they are, for no more values and no more memory than it read."""
    monkeypatch.setattr(store, "tried", asked := Mock())

    def trials(read: Callable[..., Any], file: Path, *given: Any, **named: Any) -> int:
        asked.reset_mock()
        for _ in range(2):
            with contextlib.suppress(StoreError):
                read(file, *given, **named)
        return asked.call_count

    # The layout of something else may lead to other values.
    assert trials(store.load, path, LAYOUT) == 2
    assert trials(store.attributes, path) == 1
    assert trials(store.load, path) == 1
    assert trials(store.attributes, Path(shutil.copy(path, path.with_name("y.h5")))) == 0
    store.write(path.with_name("z.h5"), LAYOUT, OTHER, *TOLD)
    assert trials(store.load, path.with_name("z.h5")) == 1
    assert trials(store.attributes, path.with_name("z.h5")) == 0
    assert trials(store.load, path, LAYOUT) == 2
    assert trials(store.load, path, ratio=10**6) == 1
    store.SOUND.clear()
    monkeypatch.setattr(experiments, "layout", lambda _: {**LAYOUT, "more": LAYOUT["count"]})
    assert trials(store.load, path) == 2, "what is refused is not known to be sound"
    monkeypatch.setattr(store, "WRITTEN", set())
    store.write(path, LAYOUT, OTHER, *TOLD)
    assert trials(store.load, path, LAYOUT) == 0, "this process has written it"
    with h5py.File(path, "a") as file:
        file["data/count"][...] = 9
    assert trials(store.load, path, LAYOUT) == 2, "another program has changed it"
