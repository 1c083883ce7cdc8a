"""The floors of the house, read from the contract that holds them: `.importlinter`."""

import ast
import configparser
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
PACKAGE = ROOT / "rigidpend"
MATHEMATICS = ("surfaces", "routes", "orbits", "mechanics", "numbers")
"""Floors whose every module is on the page of modules; of the others their folder's docstring."""


def floors() -> list[tuple[str, ...]]:
    """The floors from above: names of folders and modules, those side by side in one tuple."""
    contracts = configparser.ConfigParser()
    contracts.read(ROOT / ".importlinter")
    layers = contracts["importlinter:contract:floors"]["layers"].split("\n")
    return [tuple(name.strip() for name in line.split("|")) for line in layers if line.strip()]


def upwards() -> Iterator[str]:
    """Names of all folders and modules in the order of reading, from the lowest floor up."""
    for floor in reversed(floors()):
        yield from floor


def picture() -> Iterator[str]:
    """A table of the floors, the highest first, each with the first sentence of its docstring."""
    yield "| floor | folder | what it holds |"
    yield "| --- | --- | --- |"
    for height, floor in zip(range(len(floors()) - 1, -1, -1), floors(), strict=True):
        for name in floor:
            shown = f"{name}/" if (PACKAGE / name).is_dir() else f"{name}.py"
            yield f"| {height} | `{shown}` | {first_sentence(name)} |"


def first_sentence(name: str) -> str:
    """The first line of the docstring of a folder or a module."""
    folder, module = PACKAGE / name / "__init__.py", PACKAGE / f"{name}.py"
    source = (folder if folder.is_file() else module).read_text(encoding="utf-8")
    return (ast.get_docstring(ast.parse(source)) or "").partition("\n")[0]
