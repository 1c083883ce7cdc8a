"""Print the lowest versions that pyproject.toml allows, as constraints for pip."""

import re
import tomllib
from pathlib import Path

PROJECT = Path(__file__).parents[1] / "pyproject.toml"


def lowest(project: str) -> list[str]:
    """Lines of a constraints file from the text of a pyproject.toml.

    Raises ValueError for a dependency without a lowest version.
    """
    lines = []
    for wanted in tomllib.loads(project)["project"]["dependencies"]:
        found = re.match(r"([\w.-]+)>=([\w.]+)", wanted)
        if not found:
            raise ValueError(f"{wanted!r} names no lowest version")
        lines.append("==".join(found.groups()))
    return lines


if __name__ == "__main__":
    print("\n".join(lowest(PROJECT.read_text(encoding="utf-8"))))
