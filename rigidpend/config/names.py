"""Names of configs: each stands for a file `NAME.yaml`."""

from __future__ import annotations

import difflib
from pathlib import Path

from rigidpend.config.catalogue import RESULTS, in_all, known, own
from rigidpend.config.complaints import Complaint, ConfigError, Origin

__all__ = ["known", "resolve"]


SUFFIXES = (".yaml", ".yml", ".h5")
"""Endings of files that hold a config: as text, or in a result."""


def resolve(names: tuple[str, ...], folder: Path = RESULTS) -> list[Path]:
    """Find the files that are meant by names, by paths, or by `all`; each once, in order.

    A name stands for a config that is known, for one in this folder, or for a stored result.

    Parameters
    ----------
    names : tuple of str
    folder : Path, optional
        Folder of the results.

    Raises
    ------
    ConfigError
        A name that no folder has, or a path that is not there.
    """
    catalogue = known()
    paths: list[Path] = []
    complaints: list[Complaint] = []
    for name in names:
        try:
            everything = filter(in_all, catalogue.values())
            paths.extend(everything if name == "all" else [_file(name, catalogue, folder)])
        except ConfigError as error:
            # All names that are wrong are told at once.
            complaints += error.complaints
    if complaints:
        raise ConfigError(complaints)
    return list(dict.fromkeys(paths))


def _file(name: str, catalogue: dict[str, Path], folder: Path) -> Path:
    path = Path(name)
    if path.suffix in SUFFIXES:
        if path.is_file():
            return path
        # A device or a pipe might never end.
        message = "not a file" if path.exists() else "there is no such file"
        message = "a folder, not a file" if path.is_dir() else message
        raise ConfigError([Complaint(Origin(name), (), message)])
    if name in catalogue:
        return catalogue[name]
    for candidate in (path.with_name(f"{path.name}{suffix}") for suffix in SUFFIXES[:2]):
        if path.name and candidate.is_file():
            return candidate
    stored = folder / f"{name}.h5"
    if name and stored.is_file():
        return stored
    raise ConfigError([Complaint(Origin(name), (), f"no such config{_hint(name, catalogue)}")])


def _hint(name: str, catalogue: dict[str, Path]) -> str:
    close = difflib.get_close_matches(name, [*catalogue, *own()], 1)
    if close:
        return f"; did you mean {close[0]}?"
    names = ", ".join([*catalogue, *own()])
    return f"; known are {names} and all, or give a FILE.yaml or a RESULT.h5"
