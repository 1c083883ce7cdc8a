"""The configs that can be named. Nothing heavy is imported: a shell completes names with this."""

from __future__ import annotations

from pathlib import Path

MEASURE = "measure"
"""The folder of configs that measure this machine for minutes: `all` leaves them out."""
PACKAGE = Path(__file__).resolve().parents[1]


def folders() -> list[Path]:
    """Where names are looked for, in order: here, the checkout, the installed package."""
    candidates = (Path("configs"), PACKAGE.parent / "configs", PACKAGE / "configs")
    return [folder for folder in candidates if folder.is_dir()]


def known() -> dict[str, Path]:
    """Every name with its file; the first folder that has a name wins."""
    found: dict[str, Path] = {}
    for folder in folders():
        for path in sorted([*folder.glob("*.yaml"), *folder.glob(f"{MEASURE}/*.yaml")]):
            found.setdefault(path.stem, path)
    return dict(sorted(found.items()))


def in_all(path: Path) -> bool:
    """Whether `all` means this config too."""
    return path.parent.name != MEASURE
