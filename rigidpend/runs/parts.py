"""Finished parts of a long run, kept until its result is written: a run goes on where it was."""

from __future__ import annotations

import os
import shutil
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Self

from rigidpend.machine import cache, files
from rigidpend.machine.workers import ahead, check_stop

if TYPE_CHECKING:
    from rigidpend.experiments.contract import Piece
    from rigidpend.experiments.data import Tree


class Parts:
    """The parts of one run, in a folder of their own beside the result.

    Runs of the same name at the same time share the folder; the last one removes it. To be
    used in a ``with`` statement, at whose end the folder is left to others.

    Parameters
    ----------
    target : Path
        The result file.
    fingerprint : str
        All that the result depends on. Parts of another fingerprint are not used.
    """

    def __init__(self, target: Path, fingerprint: str) -> None:
        self._whole = _folder(target)
        self._fingerprint = fingerprint
        self._folder = self._whole / cache.name_of(fingerprint.encode())
        self._handle: int | None = None

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._leave()

    def __len__(self) -> int:
        return len(list(self._folder.glob("[!.]*.h5")))

    def keep(self, name: str, compute: Callable[[], Tree]) -> Tree:
        """The part of that name: as kept by an earlier run, or computed and kept.

        One that does not fit is told, and computed again (see `cache.load_file`).

        Parameters
        ----------
        name : str
            Of letters, digits, ``_``, ``.`` and ``-``.
        compute : callable
            Makes the part where there is none.

        Raises
        ------
        StoreError
            It cannot be written, as where a folder is in its place.
        """
        # HDF5 is for runs that keep something; a plan sweeps up without it.
        from rigidpend.results import store

        self._join()
        path, of = self._folder / f"{name}.h5", f"{self._fingerprint}, part {name}".encode()
        # Asked before hours of computation, which could not be kept.
        files.make_way(path)
        content = cache.load_file(path, of)
        if content is not None:
            try:
                return store.read_part(path, content)
            except store.StoreError as error:
                cache.tell(path, str(error))
        check_stop()
        made = compute()
        try:
            cache.save_file(path, of, store.part(made))
        except OSError as error:
            raise store.StoreError(f"{path}: cannot be written: {error.strerror}") from None
        return made

    def has(self, name: str) -> bool:
        """True if there is a part of that name."""
        return (self._folder / f"{name}.h5").is_file()

    def in_order(self, pieces: Sequence[Piece], jobs: int = 1) -> Iterator[Tree]:
        """The parts one after the other, each :meth:`keep`, so many of them side by side."""
        self._join()
        if jobs == 1:
            return map(self._piece, pieces)
        return ahead(self._piece, pieces, jobs)

    def _piece(self, piece: Piece) -> Tree:
        return self.keep(piece.name, partial(piece.work, *piece.arguments))

    def drop(self) -> None:
        """Remove all parts, those of other fingerprints too, unless another run needs them."""
        self._leave()
        _remove(self._whole)

    def _join(self) -> None:
        """Hold the folder together with other runs, so that none removes it."""
        while self._handle is None:
            try:
                for folder in (self._whole, self._folder):
                    _make(folder)
                handle = os.open(self._whole, os.O_RDONLY | files.NOT_WAITING)
            except FileNotFoundError:
                # Another run has just removed it.
                continue
            except OSError as error:
                raise files.StoreError(f"{self._whole}: {error.strerror}") from None
            files.share(handle)
            if files.is_at(handle, self._whole):
                self._handle = handle
            else:
                files.release(handle)

    def _leave(self) -> None:
        if self._handle is not None:
            files.release(self._handle)
        self._handle = None


def sweep(target: Path) -> None:
    """Remove what killed runs left beside a finished result; not what a living one needs."""
    files.sweep(target)
    _remove(_folder(target))


def _make(folder: Path) -> None:
    """Make a folder; what is there instead, a link elsewhere too, makes room."""
    if folder.is_symlink() or (folder.exists() and not folder.is_dir()):
        folder.unlink()
    folder.mkdir(parents=True, exist_ok=True)


def _folder(target: Path) -> Path:
    return target.with_name(f".{target.stem}.parts")


def _remove(folder: Path) -> None:
    with files.deserted(folder) as free:
        if free:
            shutil.rmtree(folder, ignore_errors=True)
