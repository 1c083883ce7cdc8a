"""Expansions and jets: exact on what they can hold, in every arithmetic."""

import math
from fractions import Fraction

import numpy as np
import pytest

from rigidpend.numbers.exact import context, exact
from rigidpend.orbits.integrate.arithmetic import PAIRS, bits_of_numbers
from rigidpend.orbits.integrate.sum_arrays import SumArray
from rigidpend.orbits.precision import UNDIVIDED, in_sums, in_triples, precision, product, rounded
from rigidpend.orbits.return_map.expansions import (
    Interval,
    fourier_analysis,
    fourier_basis,
    fourier_slopes,
    gauss,
    grouped,
    in_blocks,
    phases,
)
from rigidpend.orbits.return_map.storage import as_doubles, from_doubles

BITS = [53, 64, 113, 160]


@pytest.mark.parametrize("bits", BITS)
def test_agrees_a_fourier_expansion_with_its_function_and_slope(bits: int) -> None:
    a, n = precision(bits), 7
    at = a.array([0.3, 1.7, -2.5])
    values = a.cos(3 * phases(n, a)) - 2 * a.sin(phases(n, a)) + 5
    c = fourier_analysis(n, a) @ values
    expected = a.cos(3 * at) - 2 * a.sin(at) + 5
    slope = -3 * a.sin(3 * at) - 2 * a.cos(at)
    assert a.largest(fourier_basis(at, n, a) @ c - expected) < 100 * a.epsilon
    assert a.largest(fourier_slopes(fourier_basis(at, n, a)) @ c - slope) < 100 * a.epsilon


@pytest.mark.parametrize("bits", BITS)
def test_an_energy_has_the_basis_that_it_has_among_others(bits: int) -> None:
    a = precision(bits)
    interval = Interval(a.number(2.0), a.number(0.5), 4)
    alone, among = (interval.basis(h, a) for h in (a.number(2.25), a.array([2.25, 1.75])))
    assert a.floats(alone).tolist() == a.floats(among[0]).tolist() == [1.0, 0.5, -0.5, -1.0]


@pytest.mark.parametrize("bits", BITS)
def test_gauss_s_rule_is_exact_up_to_twice_its_points(bits: int) -> None:
    """To degree 2 n - 1; at 2 n it errs by (n!)^4/((2 n)!^2 (2 n + 1)) on (0, 1)."""
    a, n = precision(bits), 5
    x, weights = gauss(n, a)
    found = [a.floats((weights * x**k).sum(axis=0) * (k + 1) - 1) for k in (1, 2 * n - 1, 2 * n)]
    assert (np.abs(found[:2]) < 20 * a.epsilon).all()
    assert found[2] == pytest.approx(-(math.factorial(n) ** 4) / math.factorial(2 * n) ** 2)


def test_gauss_s_rule_of_many_points_is_as_sharp_as_pairs() -> None:
    """Next to the ends of the interval, where weights ask most of the points."""
    a, finer = precision(96), precision(160)
    (x, weights), (y, expected) = gauss(40, a), gauss(40, finer)
    for one, other in ((x, y), (weights, expected)):
        off = finer.array([z.exactly() for z in one]) / other - 1
        assert finer.largest(off) < 200 * a.epsilon


@pytest.mark.parametrize("bits", [53, 96])
def test_gauss_s_rule_of_600_points_does_not_underflow(bits: int) -> None:
    """The integral of exp(-40 x) errs by roundings alone, some in each degree of a polynomial."""
    a = precision(bits)
    x, weights = gauss(600, a)
    true = (1 - a.exp(a.array([-40.0]))[0]) / 40
    assert a.largest((weights * a.exp(-40 * x)).sum(axis=0) / true - 1) < 20 * 600 * a.epsilon
    assert a.floats(x)[[0, -1]] == pytest.approx([0, 1], abs=1e-5)


@pytest.mark.parametrize("bits", [53, 64])
@pytest.mark.parametrize("counts", [[3, 1022, 2, 2400, 1], [5, 5], [1024]], ids=str)
def test_points_of_many_groups_are_taken_in_blocks(bits: int, counts: list[int]) -> None:
    """A group that ends with a block, goes over three of them, or shares one."""
    a, random = precision(bits), np.random.default_rng(1)
    rows, matrices = random.normal(size=(sum(counts), 3)), random.normal(size=(len(counts), 3, 2))
    each = np.repeat(matrices, counts, axis=0)
    for terms, most in ((1, 1024), (2_500, 209), (2**20, 1)):
        blocks = list(in_blocks(counts, terms))
        assert max(len(rows[at]) for _, at, _ in blocks) == min(most, sum(counts))
        assert all(len(rows[at]) == sum(here) for _, at, here in blocks)
        found = [grouped(a.array(rows[at]), a.array(matrices[of]), here) for of, at, here in blocks]
        off = a.floats(np.concatenate(found)) - (rows[:, :, None] * each).sum(1)
        assert np.abs(off).max() < 1e-14


def test_points_of_a_phase_stay_together_in_blocks() -> None:
    """Also where those of one phase are more than a block's."""
    counts, shared = [7 * 120, 5 * 60, 1400], [7, 5, 1400]
    blocks = list(in_blocks(counts, shared=shared))
    assert [here for *_, here in blocks] == [[840, 180], [120], [1400]]
    assert [(at.start, at.stop) for _, at, _ in blocks] == [(0, 1020), (1020, 1140), (1140, 2540)]
    assert [(of.start, of.stop) for of, *_ in blocks] == [(0, 2), (1, 2), (2, 3)]
    most = [here for *_, here in in_blocks(counts[:2], 2**19 // 8, shared[:2])]
    assert most == [[7]] * 120 + [[5]] * 60


def test_a_product_without_rows_has_none() -> None:
    assert product(np.empty((2, 0, 9)), np.empty((9, 40_000))).shape == (2, 0, 40_000)
    assert product(np.empty((2, 0, 9)), np.empty((9, 3))).shape == (2, 0, 3)


@pytest.mark.parametrize(("rows", "width"), [(1, 7), (7, 1), (40_000, 3), (3, 40_000), (2, 2)])
def test_products_in_doubles_are_whole_however_they_are_divided(rows: int, width: int) -> None:
    random = np.random.default_rng(1)
    x, y = random.normal(size=(2, rows, 9)), random.normal(size=(9, width))
    assert (max(rows, width) * 9 * 3 > UNDIVIDED) == (max(rows, width) > 7)
    assert np.abs(product(x, y) - np.matmul(x, y)).max() < 1e-13


@pytest.mark.parametrize("bits", BITS)
def test_numbers_are_rounded_once_and_stored_without_loss(bits: int) -> None:
    a = precision(bits)
    third = a.array([Fraction(1, 3), Fraction(-1, 7), 0])
    assert a.largest(third * 21 - a.array([7, -3, 0])) <= 8 * a.epsilon
    assert a.largest(a.number(exact("1/3")) - third[0]) < 2.0**-30 * a.epsilon
    assert (from_doubles(as_doubles(third), a) == third).all()
    if bits > 53:
        assert a.largest(third - a.array(third.astype(float))) > a.epsilon, "more than doubles"


def test_triples_hold_numbers_of_every_kind_with_all_their_digits() -> None:
    """Those of other precisions without loss, and all others as close as 159 bits come."""
    a, m = in_triples(148), context(150)
    pairs = SumArray(np.array([[1.0, -3.0], [2.0**-60, 2.0**-58]]))
    wide = 1 + m.mpf(2) ** -140
    kept = Fraction(1) + Fraction(1, 2**60), Fraction(-3) + Fraction(1, 2**58)
    true = Fraction(1) + Fraction(1, 2**140)
    for given, values in (
        (pairs, kept),
        ([pairs[0], 0.5], (kept[0], Fraction(1, 2))),
        (np.array([wide, m.mpf(2)]), (true, 2)),
        ([[1, 0.5], [-2, true]], ((1, Fraction(1, 2)), (-2, true))),
        (np.array([3, 4]), (3, 4)),
    ):
        found = a.array(given)
        assert len(found.parts) == 3
        assert (found.exactly() == np.array(values, dtype=object)).all()
    assert a.array(a.number(wide)).exactly() == a.number(true).exactly() == true
    fine = context(400)
    for found, x in (
        (a.pi, fine.pi),
        (a.number(exact("sqrt(2)")), fine.sqrt(2)),
        (a.number(Fraction(1, 3)), fine.mpf(1) / 3),
        (a.array([exact("sqrt(3)")])[0], fine.sqrt(3)),
    ):
        assert abs(sum(map(fine.mpf, found.parts.tolist())) / x - 1) < 2.0**-159
    assert (a.zeros((2, 4)).parts == np.zeros((3, 2, 4))).all()
    np.testing.assert_array_equal(a.floats(a.array([0.1, 2])), [0.1, 2.0])
    assert (a.bits, a.parts, a.epsilon) == (148, 3, 2.0**-147)


def test_sums_become_numbers_of_other_precisions() -> None:
    """Of more bits without loss, and of fewer by what these cannot hold."""
    triples = in_triples(148).array([Fraction(1, 3), Fraction(-7, 5)])
    for parts in (2, 3):
        given = SumArray(triples.parts[:parts])
        found = precision(200).array(given)
        assert [Fraction(*x.as_integer_ratio()) for x in found] == list(given.exactly())
    np.testing.assert_array_equal(precision(96).array(triples).parts, triples.parts[:2])
    np.testing.assert_array_equal(precision(53).array(triples), triples.parts[0])


def test_sums_have_at_least_the_bits_that_are_asked_for() -> None:
    """From 107 on triples: of fewer bits orbits are integrated in pairs, whatever holds them."""
    found = [in_sums(bits) for bits in (53.1, 96.0, 96.1, 107.0, 107.1, 147.1, 148.1)]
    assert [a.bits for a in found] == [54, 96, 107, 107, 108, 148, 148]
    assert all(a.parts == (2 if bits_of_numbers(a.bits) == PAIRS else 3) for a in found)


def test_records_are_rounded_with_all_that_they_hold_but_doubles() -> None:
    """Numbers come out as numbers, and arrays as arrays."""
    triples, pairs = in_triples(148), precision(96)
    third = Fraction(1, 3)
    inner = Interval(triples.number(third), 0.1, 3)
    nothing, found, array = rounded(Interval(None, inner, triples.array([third])), pairs)
    assert nothing is None
    assert isinstance(found, Interval)
    assert (found.half_width, found.n) == (0.1, 3)
    for one in (found.centre, array[0]):
        assert one.exactly() == pairs.number(third).exactly() != third
        assert one.shape == ()
    assert array.shape == (1,)
    low = rounded(inner, precision(53))
    assert (low, type(low.centre)) == (Interval(1 / 3, 0.1, 3), np.float64)
    assert not isinstance(rounded(inner, precision(200)).centre, np.ndarray)
