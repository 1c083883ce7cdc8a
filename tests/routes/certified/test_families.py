"""Families of functions: what is known of their derivatives in u, v and w."""

from __future__ import annotations

from rigidpend.routes.certified.models import Family

BITS = 40
FIRST: dict[tuple[int, ...], int] = {(0, 0, 0, 0): 3**21, (2, 3, 1, 1): 3**20}
SECOND: dict[tuple[int, ...], int] = {(1, 0, 2, 0): 3**19, (0, 1, 0, 2): 3**18}


def test_degrees_are_the_largest_of_all_terms_and_add_up_in_products() -> None:
    """A derivative errs by as many times more: by its degree."""
    one, other = Family.of(FIRST, BITS), Family.of(SECOND, BITS)
    assert (one.orders, other.orders, (one * other).orders) == (
        (3, 1, 1),
        (1, 2, 2),
        (4, 3, 3),
    )
