"""A clock of the tests' own, so that no time is measured on a busy machine."""

from __future__ import annotations

from types import SimpleNamespace

import pytest

from rigidpend.experiments import principal_axes
from rigidpend.experiments.bench import measure


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> list[float]:
    """The clock of all timings, which goes on only when it is told to."""
    now = [0.0]
    for module in (measure, principal_axes):
        monkeypatch.setattr(module, "time", SimpleNamespace(perf_counter=lambda: now[0]))
    return now
