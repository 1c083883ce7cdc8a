"""Signs of functions given by Chebyshev series, from integers: on an interval, without doubt."""

from __future__ import annotations

import functools
from operator import mul

from rigidpend.routes.certified.models import Model

PARTS = (32, 256)
"""Numbers of equal parts of a step: the second where the first leave a sign in doubt."""
GRAIN = 64
"""Numbers of terms of a table are multiples of it."""
BITS = 62
"""Values are integers in units of 2^-BITS."""
SPARE = 34
"""Bits of the recurrence of T_j beyond these."""


class Values:
    """Values of a model at the ends of equal parts of [-1, 1], and its bounds on each part."""

    def __init__(self, model: Model, parts: int) -> None:
        series = [_shifted(w, BITS - model.bits) for w in model.series]
        # A longer row than the series does no harm, and few tables are made.
        rows = _table(parts, -(-len(series) // GRAIN) * GRAIN)
        self.at = [sum(map(mul, series, row)) >> BITS for row in rows]
        # A coefficient, a T_j and the sum are each rounded by a unit at most.
        rounding = len(series) + (sum(map(abs, series)) >> BITS) + 2
        self.doubt = rounding + _shifted(model.error, BITS - model.bits) + 1
        slopes = Model.of_series(model.series, model.bits).derivative()
        # From one end of a part to the other it changes by this at most, rounded up.
        self.change = _shifted(2 * slopes.size, BITS - model.bits) // parts + 1

    def least(self, k: int) -> int:
        """Lower bound on |g| over part k; 0 where its sign is in doubt."""
        a, b = self.at[k], self.at[k + 1]
        if (a > 0) != (b > 0):
            return 0
        # Between values of one sign g stays above (|a| + |b| - sup |g'| dx)/2.
        return max(0, (abs(a) + abs(b) - self.change) // 2 - self.doubt)

    def most(self, k: int) -> int:
        """Upper bound on |g| over part k."""
        return (abs(self.at[k]) + abs(self.at[k + 1]) + self.change) // 2 + 1 + self.doubt


@functools.lru_cache(maxsize=8)
def _table(parts: int, terms: int) -> list[list[int]]:
    """T_j at the ends of the parts, a power of two of them, within a unit of 2^-BITS."""
    # By the recurrence with bits to spare: n terms lose n^2/2 of its units, and half of one of
    # ours when they are rounded.
    rows, half = [], 1 << (SPARE - 1)
    for k in range(parts + 1):
        # x = (2 k - parts)/parts, and so 2 x here is a shift of a product.
        twice, shift = 2 * (2 * k - parts), parts.bit_length() - 1
        before, here = 1 << (BITS + SPARE), (twice << (BITS + SPARE - 1)) // parts
        row = []
        for _ in range(terms):
            row.append((before + half) >> SPARE)
            before, here = here, ((twice * here) >> shift) - before
        # P = w_0/2 + ...
        rows.append([row[0] // 2, *row[1:]])
    return rows


def _shifted(x: int, by: int) -> int:
    return x << by if by >= 0 else x >> -by
