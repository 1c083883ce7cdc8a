"""The audit of pinned versions: a vulnerability fails, silence is not taken for soundness."""

from __future__ import annotations

import subprocess
from pathlib import Path
from typing import Any

import pytest

from scripts import audit

ROOT = Path(__file__).resolve().parents[1]
SOUND = {"name": "click", "version": "8.5.1", "vulns": []}
UNKNOWN = {"name": "numpy", "skip_reason": "Dependency not found"}
BAD = {"name": "h5py", "version": "3.13", "vulns": [{"id": "X-1", "fix_versions": ["3.14"]}]}


@pytest.mark.parametrize("document", [None, {"dependencies": [UNKNOWN, UNKNOWN]}])
def test_where_nothing_was_asked_that_is_said(document: Any) -> None:
    assert audit.verdict(document) == (
        ["not audited: the service cannot be asked from here"],
        False,
    )


def test_a_vulnerability_fails_with_its_name_and_mending() -> None:
    lines, vulnerable = audit.verdict({"dependencies": [SOUND, BAD, UNKNOWN]})
    assert lines == ["h5py 3.13: X-1, mended in 3.14", "2 versions audited, 1 not found"]
    assert vulnerable


def test_sound_versions_pass() -> None:
    assert audit.verdict({"dependencies": [SOUND]}) == (["1 versions audited"], False)


def test_every_pinned_version_is_asked_about() -> None:
    text = (ROOT / "constraints.txt").read_text(encoding="utf-8")
    lines = [line for line in text.splitlines() if line and not line.startswith("#")]
    assert len(lines) - len(audit.pinned(text)) == 1, "heyoka alone is a range"


def test_without_pip_audit_nothing_is_known(monkeypatch: pytest.MonkeyPatch) -> None:
    def absent(command: list[str], **_: Any) -> Any:
        assert command[1:3] == ["-m", "pip_audit"]
        assert Path(command[4]).read_text() == "click==8.5.1"
        return subprocess.CompletedProcess(command, 1)

    monkeypatch.setattr(subprocess, "run", absent)
    assert audit.asked(["click==8.5.1"]) is None
