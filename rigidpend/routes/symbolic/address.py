"""Addresses: the symbols of an orbit, with its half rotations between crossings.

The phase chi of a crossing of M3 = 0 is theta1/2 + theta2 + pi/2, with theta1 modulo 2 pi near
alpha0 + beta0 if it is upward, and near 2 pi - alpha0 + beta0 if downward (`return_map.poincare`).
Through a passage theta1 + theta2 is followed past the upper periodic orbit, and theta2 past the
lower one; the docs have it in M and gamma. The surfaces of the two orbits meet where gamma3 = 0, at
every multiple of pi, for every body: the reversor takes each to the other there. A crossing lies in
cell j if chi is nearer to j pi than to any other multiple of pi. An address is the parity of the
first crossing's cell, then for every passage its symbol and the growth of j, its half rotations.
"""

from __future__ import annotations

import itertools
import operator
import re
from collections.abc import Sequence
from typing import Any, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from rigidpend.machine.wording import short
from rigidpend.numbers.checked import ParameterError
from rigidpend.numbers.texts import named

LETTERS = "ab"
"""Letters of the first crossing's cell: a for an even j (chi near 0), b for an odd j (near pi)."""
_TERM = re.compile(r"([01])(?:\^([0-9]{1,6}))?|\(([01])\^([0-9]{1,6})\)\*([0-9]{1,6})")


Code: TypeAlias = "str | Sequence[int] | NDArray[np.integer[Any]] | Address"
"""An orbit's code as a caller may give it: text, numbers or an address."""


class Address(NamedTuple):
    """The address of an orbit, or of a family of orbits where half rotations are not given."""

    first: int | None
    """0 or 1: the parity of the first crossing's cell; None where either will do."""
    symbols: tuple[int, ...]
    """0 left, 1 right."""
    half_turns: tuple[int, ...] | None
    """Half rotations of each passage; None where they are free."""

    @staticmethod
    def of(chi: Any, symbols: Sequence[Any] | NDArray[Any]) -> Address:
        """The address of an orbit from chi (n + 1,) of its crossings, whole turns included."""
        cells = cells_of(chi)
        turns = tuple(int(n) for n in np.diff(cells))
        return Address(int(cells[0]) % 2, tuple(int(s) for s in symbols), turns)

    def __str__(self) -> str:
        start = [] if self.first is None else [LETTERS[self.first]]
        if self.half_turns is None:
            return " ".join([*start, "".join(map(str, self.symbols))])
        terms = zip(self.symbols, self.half_turns, strict=True)
        # Equal terms in succession are written once: (0^11)*2.
        groups = ((term, len(list(run))) for term, run in itertools.groupby(terms))
        shown = [f"{s}^{n}" if k == 1 else f"({s}^{n})*{k}" for (s, n), k in groups]
        return " ".join([*start, *shown])


def cells_of(chi: Any) -> NDArray[np.int64]:
    """The cells of angles chi, radians: the number of the nearest multiple of pi."""
    return np.rint(np.asarray(chi) / np.pi).astype(np.int64)


def parsed(text: Code) -> Address:
    """The address of a code such as `0011`, `0^9 1^8` or `a 0^9 (1^8)*2`; or ParameterError."""
    if isinstance(text, Address):
        address = text
    elif isinstance(text, str):
        address = _read(text)
    else:
        try:
            address = Address(None, tuple(map(operator.index, text)), None)
        except TypeError:
            message = f"a code is a text such as 0011 or a list of 0 and 1, got {named(text)}"
            raise ParameterError("code", message) from None
    first, symbols, half_turns = address
    if not symbols:
        raise ParameterError("code", "a code has at least one symbol")
    if not set(symbols) <= {0, 1}:
        raise ParameterError("code", f"symbols are 0 and 1: {short(str(symbols), 40)!r}")
    if first not in (None, 0, 1):
        raise ParameterError("code", f"the first cell is 0 or 1, got {first!r}")
    if half_turns is not None and len(half_turns) != len(symbols):
        raise ParameterError("code", "there must be as many half rotations as symbols")
    return address


def _read(text: str) -> Address:
    """The address that a text stands for; ParameterError where it cannot be read."""
    words = text.split()
    first = LETTERS.index(words.pop(0)) if words and words[0] in tuple(LETTERS) else None
    terms: list[tuple[str, str | None]] = []
    for word in words:
        at = 0
        # Terms may follow one another without spaces, as in 0011.
        while at < len(word):
            term = _TERM.match(word, at)
            if term is None:
                told = "symbols are 0 and 1, half rotations follow as in 0^9"
                raise ParameterError(
                    "code", f"{short(word[at:], 40)!r} in a code cannot be read: {told}"
                )
            symbol, turns, repeated, each, times = term.groups()
            terms += [(symbol or repeated, turns or each)] * int(times or 1)
            at = term.end()
    given = [int(n) for _, n in terms if n is not None]
    if given and len(given) < len(terms):
        raise ParameterError(
            "code", f"give the half rotations of all passages or of none: {short(text, 40)!r}"
        )
    return Address(first, tuple(int(s) for s, _ in terms), tuple(given) or None)
