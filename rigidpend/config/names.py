"""Names of configs: each stands for a file `NAME.yaml`."""

from __future__ import annotations

import difflib
from pathlib import Path

from rigidpend.config.catalogue import in_all, known
from rigidpend.config.complaints import Complaint, ConfigError, Origin

__all__ = ["known", "resolve"]


def resolve(names: tuple[str, ...]) -> list[Path]:
    """Find the files that are meant by names, by paths, or by `all`; each once, in order.

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
            paths.extend(everything if name == "all" else [_file(name, catalogue)])
        except ConfigError as error:
            complaints += error.complaints
    if complaints:
        raise ConfigError(complaints)
    return list(dict.fromkeys(paths))


def _file(name: str, catalogue: dict[str, Path]) -> Path:
    path = Path(name)
    if path.suffix in (".yaml", ".yml"):
        if path.is_file():
            return path
        # A device or a pipe might never end.
        message = "not a file" if path.exists() else "there is no such file"
        raise ConfigError([Complaint(Origin(name), (), message)])
    if name in catalogue:
        return catalogue[name]
    raise ConfigError([Complaint(Origin(name), (), f"no such config{_hint(name, catalogue)}")])


def _hint(name: str, catalogue: dict[str, Path]) -> str:
    close = difflib.get_close_matches(name, catalogue, 1)
    if close:
        return f"; did you mean {close[0]}?"
    return f"; known are {', '.join(catalogue)} and all, or give a FILE.yaml"
