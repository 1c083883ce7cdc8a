"""Rungs that a ladder has, and by how much each is sharper than what is below it."""

import pytest

from rigidpend.routes.ladder import integrations, rungs


@pytest.mark.parametrize(
    ("asked", "known", "expected"),
    [
        ((106, 160), 53, (64, 76, 88, 106, 120, 131, 160)),
        ((106, 160), 75, (88, 106, 120, 131, 160)),
        ((113,), 53, (64, 76, 88, 113)),
        # At least eight bits from all that are asked for or known.
        ((72,), 53, (64, 72)),
        ((71,), 53, (71,)),
        ((106,), 68, (76, 88, 106)),
        ((106,), 69, (88, 106)),
        ((), 53, ()),
        ((160,), 101, (109, 120, 131, 160)),
        ((160,), 102, (120, 131, 160)),
        # One in pairs of doubles keeps 97 bits, which would be less than is known.
        ((106, 160), 98, (109, 120, 131, 160)),
        ((106, 160), 97, (106, 120, 131, 160)),
        ((83, 106), 83, (83, 106)),
    ],
)
def test_rungs_stand_between_precisions_and_far_from_all(
    asked: tuple[int, ...], known: int, expected: tuple[int, ...]
) -> None:
    """One computation is made on those that were not asked for."""
    found = integrations("taylor", asked, known)
    assert [(x.bits, x.most) for x in found] == [(x, 3 if x in asked else 1) for x in expected]


def test_engines_whose_further_bits_are_integers_have_no_rungs() -> None:
    assert integrations("scipy", (106, 160), 53) == rungs((106, 160), 53)


@pytest.mark.parametrize(
    ("in_pairs", "apart", "expected"),
    [
        # 109 bits are too close to 106, but not to the 97 that pairs may count for.
        (106, 0, {106: 4, 120: 14, 131: 11, 160: 29}),
        (97, 0, {106: 4, 109: 12, 120: 11, 131: 11, 160: 29}),
        (106, 4, {106: 4, 120: 14, 131: 11, 160: 29}),
        (97, 5, {109: 16, 120: 11, 131: 11, 160: 29}),
    ],
)
def test_pairs_of_doubles_count_for_97_bits_beside_less_sharp_ones_and_for_others_as_is_said(
    in_pairs: int, apart: int, expected: dict[int, int]
) -> None:
    """Each rung is compared with the one below it; what is known counts for 93 bits here."""
    found = integrations("taylor", (106, 160), 93, in_pairs, apart)
    assert {x.bits: x.more for x in found} == expected
