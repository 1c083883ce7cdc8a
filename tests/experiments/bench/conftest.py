"""A clock of the tests' own, so that no time is measured on a busy machine."""

from __future__ import annotations

from types import SimpleNamespace

import pytest

from rigidpend.experiments.bench import protocol


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> list[float]:
    """The clock of all timings, which goes on only when it is told to."""
    now = [0.0]
    monkeypatch.setattr(protocol, "time", SimpleNamespace(perf_counter=lambda: now[0]))
    return now
