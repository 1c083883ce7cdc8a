"""The lot of the attacks: repeatable, of each kind its own, and named where one fails."""

from __future__ import annotations

import pytest

from tests.attacks import lot


def test_a_seed_gives_the_same_lot_each_kind_its_own_and_a_failure_names_it(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def draws(kind: str) -> list[float]:
        with lot.drawn(kind) as chance:
            return [chance.random() for _ in range(3)]

    first = draws("kills")
    assert first == draws("kills") != draws("names")
    monkeypatch.setattr(lot, "SEED", 41)
    assert draws("kills") != first
    with pytest.raises(ValueError, match="wrong") as caught, lot.drawn("kills"):
        raise ValueError("wrong")
    assert "SEED=41" in caught.value.__notes__[0]
