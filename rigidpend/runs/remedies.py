"""Remedies: the commands that make an absent or unusable result or certificate again."""

from __future__ import annotations

import os
import shlex
from pathlib import Path

from rigidpend.config import catalogue
from rigidpend.machine.files import CERTIFICATE, StoreError


def told(error: StoreError) -> str:
    """The sentence of an error, with the remedy if it concerns a result or a certificate."""
    mend = remedy(error.file) if error.file else ""
    return f"{error}; {mend}" if mend else str(error)


def remedy(file: Path) -> str:
    """Advice on the command that makes a result or certificate, or that helps to find it.

    Empty for a file that does not exist and that no known config makes.
    """
    if file.is_dir():
        return "a folder is in its place: move that away"
    if file.exists() and not os.access(file, os.R_OK):
        return "you may not read it: ask its owner, or take another copy of it"
    name = file.stem.removesuffix(CERTIFICATE)
    log = file.with_name(f"{name}.log")
    if name in {**catalogue.known(), **catalogue.own()}:
        force = " --force" if file.exists() else ""
        return call("certify" if file.stem != name else "run", [name], file.parent, force)
    if log.is_file():
        return f"the first line of {log} has the command that made it: add --force"
    lost = "make it anew from its config, or take another copy of it"
    return lost if file.exists() else ""


def call(command: str, words: list[str], folder: Path, further: str = "") -> str:
    """Advice to call a command whose results are in that folder."""
    out = [] if folder == catalogue.RESULTS else ["--out", str(folder)]
    return f"call: rigidpend {command} {shlex.join([*words, *out])}{further}"


def reference(config: Path, file: Path) -> str:
    """Advice on making a config's reference that is absent or cannot be used."""
    if catalogue.PACKAGE in file.absolute().parents:
        return "it is a part of the package: install rigidpend anew"
    given = [] if file.parent == catalogue.REFERENCES else ["--reference", str(file.parent)]
    return f"call: rigidpend reference {shlex.join([str(config), *given])} --reason WHY"
