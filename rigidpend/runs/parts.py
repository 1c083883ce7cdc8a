"""Finished parts of a long run, stored until its result is written, from which a run continues."""

from __future__ import annotations

import contextlib
import io
import json
import shutil
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from operator import methodcaller
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rigidpend.machine import cache, files
from rigidpend.machine.workers import ahead, check_stop, worth_processes

# Plans use `remove_leftovers`, and must not import numpy.
if TYPE_CHECKING:
    from rigidpend.experiments.contract import Piece
    from rigidpend.experiments.data import Tree


class Parts:
    """The parts of one run, in a folder of their own beside the result.

    A fingerprint identifies everything that the result depends on, and has a folder of its own, so
    that parts of another fingerprint are not used. If another run drops the parts meanwhile, new
    ones are stored.
    """

    def __init__(self, target: Path, fingerprint: str) -> None:
        self._whole = _folder(target)
        self._fingerprint = fingerprint
        self._folder = self._whole / cache.name_of(fingerprint.encode())
        self.crew = Counter[str]()
        """The number of parts that each worker of a cluster has computed."""

    def __len__(self) -> int:
        return len(list(self._folder.glob("*.kept")))

    def keep(self, name: str, compute: Callable[[], Tree]) -> Tree:
        """The part of that name: stored by an earlier run, or computed and stored now.

        A part that does not fit is reported, and computed again (see `cache.load_file`). StoreError
        if it cannot be written, for example because a folder is in its place.
        """
        self._make_room()
        path, of = self._path(name), f"{self._fingerprint}, part {name} as npy".encode()
        # Checked before hours of computation whose result could not be stored.
        files.make_way(path)
        content = cache.load_file(path, of)
        if content is not None:
            try:
                return unpacked(content)
            # Whatever else was sealed under this name may raise anything.
            except Exception:  # noqa: BLE001
                cache.tell(path, "no part of a run")
        check_stop()
        made = compute()
        try:
            cache.save_file(path, of, packed(made))
        except OSError as error:
            raise files.StoreError(f"{path}: cannot be written: {error.strerror}") from None
        return made

    def has(self, name: str) -> bool:
        """True if there is a part of that name."""
        return self._path(name).is_file()

    def in_order(self, pieces: Sequence[Piece], jobs: int = 1) -> Iterator[Tree]:
        """The parts in order, each by :meth:`keep`; many parts are computed by processes."""
        missing = [piece for piece in pieces if not self.has(piece.name)]
        apart = missing if worth_processes(len(missing), jobs) else []
        made, names = ahead(methodcaller("compute"), apart, jobs), {piece.name for piece in apart}
        for piece in pieces:
            # A part that another run has stored meanwhile is the same.
            again = [next(made)].pop if piece.name in names else piece.compute
            yield self.keep(piece.name, again)

    def drop(self) -> None:
        """Remove all parts, and those of other fingerprints that were left behind."""
        shutil.rmtree(self._folder, ignore_errors=True)
        _remove_old(self._whole)

    def _path(self, name: str) -> Path:
        return self._folder / f"{name}.kept"

    def _make_room(self) -> None:
        """Remove a file or link that is in the place of a folder."""
        try:
            for folder in (self._whole, self._folder):
                if folder.is_symlink() or (folder.exists() and not folder.is_dir()):
                    folder.unlink()
        except OSError as error:
            raise files.StoreError(f"{self._whole}: {error.strerror}") from None


def packed(tree: Tree) -> bytes:
    """A part as bytes: a line of its groups and texts in JSON, then its arrays as NumPy's files."""
    import numpy as np

    arrays: list[Any] = []
    content = io.BytesIO()
    content.write(json.dumps(_outlined(tree, arrays)).encode() + b"\n")
    for array in arrays:
        np.save(content, array, allow_pickle=False)
    return content.getvalue()


# A module's function, because a recursive closure is a reference cycle, which would keep the
# arrays in memory until a garbage collection.
def _outlined(node: Any, arrays: list[Any]) -> Any:
    """The groups and texts of a part, with None for each array; `arrays` collects these."""
    if isinstance(node, Mapping):
        return {name: _outlined(inner, arrays) for name, inner in node.items()}
    if isinstance(node, str):
        return node
    arrays.append(node)
    return None


def unpacked(content: bytes) -> Tree:
    """The part that was given to :func:`packed`; an error of some kind for other bytes."""
    file = io.BytesIO(content)
    tree: Tree = _filled(json.loads(file.readline()), file)
    return tree


def _filled(node: Any, file: io.BytesIO) -> Any:
    """A part from its outline, with the next array of the file in the place of each None."""
    import numpy as np

    if isinstance(node, dict):
        return {name: _filled(inner, file) for name, inner in node.items()}
    # A number by itself is stored as an array without axes.
    return np.load(file)[()] if node is None else node


def remove_leftovers(target: Path) -> None:
    """Remove files and parts that killed runs left beside a finished result some time ago."""
    files.remove_leftovers(target)
    _remove_old(_folder(target))


def _folder(target: Path) -> Path:
    return target.with_name(f".{target.stem}.parts")


def _remove_old(whole: Path) -> None:
    """Remove folders of parts to which no run has added for long, and folders left empty."""
    with contextlib.suppress(OSError):
        for folder in () if whole.is_symlink() else whole.iterdir():
            if files.is_left(folder):
                shutil.rmtree(folder, ignore_errors=True)
        whole.rmdir()
