"""The lot of the attacks: repeatable, of each kind its own, and named where one fails."""

from __future__ import annotations

import pytest

from tests.attacks import lot


def draws(kind: str) -> list[float]:
    with lot.drawn(kind) as chance:
        return [chance.random() for _ in range(3)]


def test_a_seed_gives_the_same_lot_and_each_kind_its_own(monkeypatch: pytest.MonkeyPatch) -> None:
    first, other = draws("kills"), draws("names")
    assert first == draws("kills") != other
    monkeypatch.setattr(lot, "SEED", lot.SEED + 1)
    assert draws("kills") != first


def test_a_failure_names_its_seed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(lot, "SEED", 41)
    with pytest.raises(ValueError, match="wrong") as caught, lot.drawn("kills"):
        raise ValueError("wrong")
    assert "SEED=41" in caught.value.__notes__[0]
