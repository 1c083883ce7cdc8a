"""Finished parts of a long run, kept until its result is written: a run goes on where it was."""

from __future__ import annotations

import contextlib
import shutil
from collections.abc import Callable
from pathlib import Path

from rigidpend import store
from rigidpend.tree import Tree


class Parts:
    """The parts of one run, in a folder of their own beside the result.

    Parameters
    ----------
    target : Path
        The result file.
    fingerprint : str
        What the result depends on. Parts of another fingerprint are not used.
    """

    def __init__(self, target: Path, fingerprint: str) -> None:
        self._whole = target.with_name(f".{target.stem}.parts")
        self._folder = self._whole / fingerprint

    def keep(self, name: str, compute: Callable[[], Tree]) -> Tree:
        """The part of that name: as kept by an earlier run, or computed and kept.

        Parameters
        ----------
        name : str
            Of letters, digits, ``_``, ``.`` and ``-``.
        compute : callable
            Makes the part where there is none.

        Raises
        ------
        StoreError
            It cannot be written.
        """
        path = self._folder / f"{name}.h5"
        if path.is_file():
            # A damaged part is none: it is computed again.
            with contextlib.suppress(store.StoreError):
                return store.read_tree(path)
        made = compute()
        store.write(path, store.Result({"part": name}, "", {}, made))
        return made

    def drop(self) -> None:
        """Remove all parts, those of other fingerprints too: the result is there."""
        shutil.rmtree(self._whole, ignore_errors=True)
