"""The trial of spoilt maps: flags hold, and a rule that trusts too much is found out."""

from __future__ import annotations

from typing import Any

import pytest

from rigidpend.experiments.stress.trials import claims, spoilt_maps
from rigidpend.routes import certainty
from tests.orbits.integrate.problems import FIG4


def verdicts() -> dict[str, str]:
    trial = spoilt_maps.trial(FIG4, "1.3342", "1e-8", 1, orbits=60, n_symbols=15, seed=2)
    made: Any = claims.tried(trial)
    # 60 orbits in doubles, and one of them again with 64 bits and with 106.
    for which in ("one", "all"):
        assert "of 930 symbols" in made["claims"][f"lies, {which} off by 1e-12"]["note"].values
    return {name: str(claim["verdict"].values) for name, claim in made["claims"].items()}


@pytest.mark.slow
def test_no_flag_lies_where_maps_are_spoilt() -> None:
    assert set(verdicts().values()) == {"passed"}


@pytest.mark.slow
def test_flags_that_ask_for_no_agreement_are_found_out(monkeypatch: pytest.MonkeyPatch) -> None:
    for limit in ("CLOSE", "AGREEMENT", "LINEAR"):
        monkeypatch.setattr(certainty, limit, 1e9)
    found = verdicts()
    assert found["lies, all off by 1e-9"] == "FAILED"
