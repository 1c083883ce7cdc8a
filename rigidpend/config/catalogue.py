"""Catalogue of the configs that can be named; imports nothing heavy, for shells complete by it."""

from __future__ import annotations

from pathlib import Path

MEASURE = "measure"
"""Folder of configs that measure this machine for minutes; `all` leaves them out."""
PACKAGE = Path(__file__).resolve().parents[1]


def folders() -> list[Path]:
    """Folders in which names are looked up, in order: here, the checkout, the installed package."""
    candidates = (Path("configs"), PACKAGE.parent / "configs", PACKAGE / "configs")
    return [folder for folder in candidates if folder.is_dir()]


def known() -> dict[str, Path]:
    """Map every name to its file; the first folder that has a name wins."""
    found: dict[str, Path] = {}
    for folder in folders():
        for path in sorted([*folder.glob("*.yaml"), *folder.glob(f"{MEASURE}/*.yaml")]):
            found.setdefault(path.stem, path)
    return dict(sorted(found.items()))


def in_all(path: Path) -> bool:
    """True if `all` includes this config."""
    return path.parent.name != MEASURE
