"""Catalogue of the configs that can be named, and of the commands that make their results.

It is light, because shells complete names by it.
"""

from __future__ import annotations

import os
import re
import shlex
from pathlib import Path
from typing import TYPE_CHECKING

from rigidpend.config.complaints import Complaint, ConfigError, Origin, meant

if TYPE_CHECKING:
    from rigidpend.machine.files import StoreError

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
    first: dict[Path, Path] = {}
    for path in paths:
        # A link keeps its own name, which is that of its result.
        first.setdefault(path.parent.resolve() / path.name, path)
    return list(first.values())


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
    others = f"; give a FILE.yaml, a RESULT.h5, all or one of {', '.join(names)}"
    raise ConfigError.of(Origin(name or "''"), f"no such config{meant(name, names, 0.6) or others}")


def with_remedy(error: StoreError) -> str:
    """The sentence of an error, with the remedy if it concerns a result or a certificate."""
    mend = remedy(error.file) if error.file else ""
    return f"{error}; {mend}" if mend else str(error)


def remedy(file: Path) -> str:
    """Advice on the command that makes a result or certificate, or that helps to find it.

    Empty for a file that does not exist and that no known config makes.
    """
    from rigidpend.machine.files import CERTIFICATE

    if file.is_dir():
        return "a folder is in its place: move that away"
    if file.exists() and not os.access(file, os.R_OK):
        return "you may not read it: ask its owner, or take another copy of it"
    name = file.stem.removesuffix(CERTIFICATE)
    log = file.with_suffix(".log")
    if name in {**known(), **own()}:
        force = " --force" if file.exists() else ""
        return call("certify" if file.stem != name else "run", [name], file.parent, force)
    if log.is_file():
        return f"the first line of {log} has the command that made it: add --force"
    lost = "make it anew from its config, or take another copy of it"
    return lost if file.exists() else ""


def call(command: str, words: list[str], folder: Path, further: str = "") -> str:
    """Advice to call a command whose results are in that folder."""
    out = [] if folder == RESULTS else ["--out", str(folder)]
    return f"call: rigidpend {command} {shlex.join([*words, *out])}{further}"


def remedy_of_reference(config: Path, file: Path) -> str:
    """Advice on making a config's reference that is absent or cannot be used."""
    if PACKAGE in file.absolute().parents:
        return "it is a part of the package: install rigidpend anew"
    given = [] if file.parent == REFERENCES else ["--reference", str(file.parent)]
    return f"call: rigidpend reference {shlex.join([str(config), *given])} --reason WHY"
