"""Look up the known vulnerabilities of the versions in constraints.txt, with pip-audit.

    python scripts/audit.py        where pip-audit is installed: `make audit` sees to that

It ends with 1 if there is one. Where the service cannot be asked it says so and ends with 0:
pip-audit itself calls a package without fault that it has not found.
"""

import json
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any, NamedTuple

ROOT = Path(__file__).resolve().parents[1]
PATIENCE = 300
"""Seconds after which the service is taken to be out of reach."""


class Verdict(NamedTuple):
    """What is to be said, and whether it is a vulnerability."""

    lines: list[str]
    vulnerable: bool


def pinned(text: str) -> list[str]:
    """The lines of a file of constraints that name one version."""
    return [line for line in text.splitlines() if "==" in line.partition("#")[0]]


def asked(constraints: list[str]) -> Any:
    """pip-audit's document about pinned versions; None where it made none."""
    with tempfile.TemporaryDirectory() as folder:
        given, told = Path(folder, "constraints.txt"), Path(folder, "told.json")
        given.write_text("\n".join(constraints))
        options = ["--disable-pip", "--no-deps", "--progress-spinner", "off", "--format", "json"]
        command = [sys.executable, "-m", "pip_audit", "-r", str(given), "-o", str(told), *options]
        try:
            subprocess.run(command, capture_output=True, timeout=PATIENCE, check=False)
            return json.loads(told.read_text())
        except (OSError, ValueError, subprocess.TimeoutExpired):
            return None


def verdict(document: Any) -> Verdict:
    """What a document of pip-audit means."""
    packages = document["dependencies"] if document else []
    known = [package for package in packages if "vulns" in package]
    if not known:
        return Verdict(["not audited: the service cannot be asked from here"], False)
    lines = [
        f"{package['name']} {package['version']}: {found['id']}, mended in"
        f" {', '.join(found['fix_versions']) or 'no version yet'}"
        for package in known
        for found in package["vulns"]
    ]
    left = len(packages) - len(known)
    lines.append(f"{len(known)} versions audited" + (f", {left} not found" if left else ""))
    return Verdict(lines, len(lines) > 1)


def main() -> None:
    made = verdict(asked(pinned((ROOT / "constraints.txt").read_text(encoding="utf-8"))))
    print("\n".join(made.lines))
    sys.exit(made.vulnerable)


if __name__ == "__main__":
    main()
