"""Where configs are found: a name stands for a file `NAME.yaml`."""

from __future__ import annotations

import difflib
from pathlib import Path

from rigidpend.config.reader import ConfigError, Origin, Problem

MEASURE = "measure"
"""The folder of configs that measure this machine for minutes: `all` leaves them out."""
_PACKAGE = Path(__file__).resolve().parent.parent


def folders() -> list[Path]:
    """Where names are looked for, in order: here, the checkout, the installed package."""
    candidates = (Path("configs"), _PACKAGE.parent / "configs", _PACKAGE / "configs")
    return [folder for folder in candidates if folder.is_dir()]


def known() -> dict[str, Path]:
    """Every name with its file; the first folder that has a name wins."""
    found: dict[str, Path] = {}
    for folder in folders():
        for path in sorted([*folder.glob("*.yaml"), *folder.glob(f"{MEASURE}/*.yaml")]):
            found.setdefault(path.stem, path)
    return dict(sorted(found.items()))


def resolve(names: tuple[str, ...]) -> list[Path]:
    """The files that are meant by names, by paths, or by `all`; each once, in order.

    Raises
    ------
    ConfigError
        A name that no folder has, or a path that is not there.
    """
    catalogue = known()
    paths: list[Path] = []
    for name in names:
        paths.extend(_all(catalogue) if name == "all" else [_file(name, catalogue)])
    return list(dict.fromkeys(paths))


def _all(catalogue: dict[str, Path]) -> list[Path]:
    return [path for path in catalogue.values() if path.parent.name != MEASURE]


def _file(name: str, catalogue: dict[str, Path]) -> Path:
    path = Path(name)
    if path.suffix in (".yaml", ".yml"):
        if path.is_file():
            return path
        raise ConfigError([Problem(Origin(name), (), "there is no such file")])
    if name in catalogue:
        return catalogue[name]
    raise ConfigError([Problem(Origin(name), (), f"no such config{_hint(name, catalogue)}")])


def _hint(name: str, catalogue: dict[str, Path]) -> str:
    close = difflib.get_close_matches(name, catalogue, 1)
    if close:
        return f"; did you mean {close[0]}?"
    return f"; known are {', '.join(catalogue)} and all, or give a FILE.yaml"
