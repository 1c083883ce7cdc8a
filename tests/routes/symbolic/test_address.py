"""Codes and addresses as texts."""

from __future__ import annotations

import pytest

from rigidpend.routes.symbolic.address import Address, AddressError, parsed


def test_symbols_alone_leave_rotations_free() -> None:
    assert parsed("0011") == Address(None, (0, 0, 1, 1), None)
    assert parsed([0, 1]) == Address(None, (0, 1), None)
    assert str(parsed("b 01")) == "b 01"


def test_rotations_belong_to_their_symbols() -> None:
    wanted = Address(0, (0, 1, 1, 0), (9, 10, 10, 110))
    assert parsed("a 0^9 1^10 1^10 0^110") == wanted
    assert str(wanted) == "a 0^9 (1^10)*2 0^110"
    assert parsed(str(wanted)) == wanted


@pytest.mark.parametrize(
    ("text", "word"),
    [
        ("", "one symbol"),
        ("012", "'2'"),
        ("0^9 1", "all passages"),
        ("a", "one symbol"),
        ("0^", "^"),
    ],
)
def test_no_code_says_why(text: str, word: str) -> None:
    with pytest.raises(AddressError, match=word.replace("^", r"\^")):
        parsed(text)


def test_wrong_records_are_refused() -> None:
    with pytest.raises(AddressError, match="as many"):
        parsed(Address(0, (0, 1), (9,)))
    with pytest.raises(AddressError, match="first cell"):
        parsed(Address(2, (0, 1), None))
    with pytest.raises(AddressError, match="0 and 1"):
        parsed([0, 2])
