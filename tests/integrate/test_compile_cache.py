"""Compiled code is kept apart by processor, and where the user says."""

from __future__ import annotations

import os
import platform
import sys
from pathlib import Path

import pytest

from rigidpend.integrate import compile_cache
from rigidpend.integrate.compile_cache import VARIABLE

INTEL = "model name\t: A processor 3 GHz\nflags\t\t: fpu sse2 avx2 avx512f"
PLAIN = "model name\t: A processor 3 GHz\nflags\t\t: fpu sse2"


@pytest.fixture
def unset(monkeypatch: pytest.MonkeyPatch) -> pytest.MonkeyPatch:
    # Set first, so that what `choose` sets is taken back even where it was unset before.
    monkeypatch.setenv(VARIABLE, "anything")
    monkeypatch.delenv(VARIABLE)
    return monkeypatch


def chosen(monkeypatch: pytest.MonkeyPatch, processor: str) -> Path:
    monkeypatch.delenv(VARIABLE, raising=False)
    monkeypatch.setattr(compile_cache, "_processor", lambda: processor)
    compile_cache.choose()
    return Path(os.environ[VARIABLE])


def test_folder_of_the_user_is_left_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(VARIABLE, "my folder")
    compile_cache.choose()
    assert os.environ[VARIABLE] == "my folder"


def test_folder_differs_by_the_flags_of_the_processor_alone(unset: pytest.MonkeyPatch) -> None:
    here, there = chosen(unset, INTEL), chosen(unset, PLAIN)
    assert here != there
    assert here.parent == there.parent
    assert chosen(unset, INTEL) == here


def test_folder_lies_in_the_cache_of_the_user(unset: pytest.MonkeyPatch, tmp_path: Path) -> None:
    unset.setattr(sys, "platform", "linux")
    unset.setenv("XDG_CACHE_HOME", str(tmp_path))
    assert chosen(unset, INTEL).parent == tmp_path / "rigidpend"
    unset.delenv("XDG_CACHE_HOME")
    unset.setattr(Path, "home", lambda: tmp_path / "home")
    assert chosen(unset, INTEL).parent == tmp_path / "home" / ".cache" / "rigidpend"
    unset.setattr(sys, "platform", "darwin")
    assert chosen(unset, INTEL).parent == tmp_path / "home" / "Library" / "Caches" / "rigidpend"


def test_processor_model_is_read_from_what_the_system_tells(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(compile_cache, "_processor", lambda: INTEL)
    assert compile_cache.processor_model() == "A processor 3 GHz"


def test_processor_is_told_without_proc(monkeypatch: pytest.MonkeyPatch) -> None:
    def missing(*_: object) -> str:
        raise FileNotFoundError

    monkeypatch.setattr(Path, "read_text", missing)
    monkeypatch.setattr(platform, "machine", lambda: "arm64")
    assert "arm64" in compile_cache._processor()
    assert compile_cache.processor_model()
