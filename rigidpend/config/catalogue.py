"""Catalogue of the configs that can be named; light, because shells complete names by it."""

from __future__ import annotations

import re
from pathlib import Path

from rigidpend.config.complaints import Complaint, ConfigError, Origin, meant

MEASURE = "measure"
"""Folder of configs that measure this machine for minutes; `all` leaves them out."""
NAMING, LOOKED_AT = re.compile(rb"^experiment *:", re.MULTILINE), 10_000
"""The key that every config has, and the number of bytes of a file that are searched for it."""
PACKAGE = Path(__file__).resolve().parents[1]
"""Folder of the package, in a checkout or as installed."""
RESULTS = Path("results")
"""Default folder of results."""
REFERENCES = RESULTS / "reference"
"""Default folder of references."""


SUFFIXES = (".yaml", ".yml", ".h5")
"""Endings of files that hold a config: as text, or in a result."""


def folders() -> list[Path]:
    """Folders in which names are looked up, in order: here, the checkout, the installed package."""
    candidates = (Path("configs"), PACKAGE.parent / "configs", PACKAGE / "configs")
    return [folder for folder in candidates if folder.is_dir()]


def shipped() -> list[Path]:
    """Files of the configs that come with the package; only they make the paper's figures."""
    candidates = (PACKAGE.parent / "configs", PACKAGE / "configs")
    return sorted(file for folder in candidates for file in folder.glob("*.yaml"))


def known() -> dict[str, Path]:
    """Map every name to its file; the first folder that has a name wins."""
    found: dict[str, Path] = {}
    for folder in folders():
        for path in sorted([*folder.glob("*.yaml"), *folder.glob(f"{MEASURE}/*.yaml")]):
            found.setdefault(path.stem, path)
    return dict(sorted(found.items()))


def own() -> dict[str, Path]:
    """Map names to the configs in the current folder, other than those of `known`."""
    paths = [path for path in sorted(Path().glob("*.y*ml")) if _is_config(path)]
    others = known() if paths else {}
    return {path.stem: path for path in paths if path.stem not in others}


def _is_config(path: Path) -> bool:
    """True if a file is readable and has, near its beginning, the key that every config has."""
    try:
        # Reading a device or a pipe might never end.
        if not path.is_file():
            return False
        with path.open("rb") as file:
            return NAMING.search(file.read(LOOKED_AT)) is not None
    except OSError:
        return False


def in_all(path: Path) -> bool:
    """True if `all` includes this config."""
    return path.parent in folders()


def resolve(names: tuple[str, ...], folder: Path = RESULTS) -> list[Path]:
    """Find the files meant by names, by paths, or by `all`; each once, in order.

    A name stands for a known config, for one in the current folder, or for a result stored in the
    folder of results. One error lists all wrong names.
    """
    by_name = known()
    paths: list[Path] = []
    complaints: list[Complaint] = []
    for name in names:
        try:
            everything = filter(in_all, by_name.values())
            paths.extend(everything if name == "all" else [_file(name, by_name, folder)])
        except ConfigError as error:
            complaints += error.complaints
    if complaints:
        raise ConfigError(complaints)
    return list(dict.fromkeys(paths))


def _file(name: str, by_name: dict[str, Path], folder: Path) -> Path:
    path = Path(name)
    if path.suffix in SUFFIXES:
        if path.is_file():
            return path
        # Reading a device or a pipe might never end.
        message = "not a file" if path.exists() else "there is no such file"
        raise ConfigError.of(Origin(name), "a folder, not a file" if path.is_dir() else message)
    if name in by_name:
        return by_name[name]
    # A path such as "." has no name to which a suffix could be added.
    for suffix in SUFFIXES[:2] if path.name else ():
        if (candidate := path.with_name(f"{path.name}{suffix}")).is_file():
            return candidate
    stored = folder / f"{name}.h5"
    if name and stored.is_file():
        return stored
    names = [*by_name, *own()]
    others = f"; known are {', '.join(names)} and all, or give a FILE.yaml or a RESULT.h5"
    raise ConfigError.of(Origin(name or "''"), f"no such config{meant(name, names, 0.6) or others}")
