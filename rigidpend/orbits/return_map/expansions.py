"""Fourier and Chebyshev expansions of functions known at nodes, in any precision.

A function of a phase p is ``c0 + c1 cos(p) + c2 sin(p) + c3 cos(2 p) + c4 sin(2 p) + ...``, always
with an odd number n of terms: with an even n the n nodes would not determine the sine of the
highest harmonic, which vanishes at all of them. A function of x in [-1, 1] is a sum of Chebyshev
polynomials.
"""

import functools
import math
from collections.abc import Iterator, Sequence
from fractions import Fraction
from typing import Any, NamedTuple

import numpy as np

from rigidpend.numbers import Scalar
from rigidpend.orbits.precision import Precision, product

AT_ONCE = 1024
"""Number of points that are worked on together, so few that their arrays stay in a core's cache."""
ROOM = 2**19
"""Largest number of terms of the series of a block's points.

The coefficients then take some 6 MB in doubles. Larger arrays get new pages of memory at each use,
which takes longer than the sums."""
MOST_KEPT = 256
"""Number of sets of nodes, and of each kind of matrix, that are kept for the tables of all maps."""


@functools.lru_cache(maxsize=MOST_KEPT)
def phases(n: int, a: Precision) -> Any:
    """The n equidistant phases 0, 2 pi/n, ..."""
    return 2 * a.pi * a.array(np.arange(n)) / n


def fourier_basis(phase: Scalar, n: int, a: Precision) -> Any:
    """The n functions 1, cos, sin, cos 2, ... at phases: (..., n)."""
    basis = a.zeros((*np.shape(phase), n))
    basis[..., 0] = a.number(1)
    if n > 1:
        basis[..., 1], basis[..., 2] = a.cos(phase), a.sin(phase)
    known, most = 1, n // 2
    while known < most:
        # Harmonics k + 1 to 2 k follow from those up to k by the addition theorems. Doubling takes
        # log2(n) passes over long arrays in the place of n over short ones.
        more = min(known, most - known)
        c, s = basis[..., 1 : 2 * more : 2], basis[..., 2 : 2 * more + 1 : 2]
        cos, sin = (basis[..., j : j + 1] for j in (2 * known - 1, 2 * known))
        first, last = 2 * known + 1, 2 * (known + more) + 1
        basis[..., first:last:2] = c * cos - s * sin
        basis[..., first + 1 : last : 2] = s * cos + c * sin
        known += more
    return basis


def fourier_slopes(basis: Any) -> Any:
    """The derivatives of the functions of :func:`fourier_basis`, from their values."""
    slopes, k = np.zeros_like(basis), np.arange(1, basis.shape[-1] // 2 + 1)
    slopes[..., 1::2], slopes[..., 2::2] = -k * basis[..., 2::2], k * basis[..., 1::2]
    return slopes


@functools.lru_cache(maxsize=MOST_KEPT)
def fourier_synthesis(few: int, n: int, a: Precision) -> Any:
    """The matrix (few, n) from n coefficients to values at the `few` :func:`phases`."""
    return fourier_basis(phases(few, a), n, a)


@functools.lru_cache(maxsize=MOST_KEPT)
def fourier_analysis(n: int, a: Precision) -> Any:
    """The matrix (n, n) from values at :func:`phases` to coefficients."""
    # The n functions are orthogonal over the n phases: squares sum up to n/2, but those of 1 to n.
    matrix = fourier_synthesis(n, n, a).T * 2 / n
    matrix[0] = matrix[0] / 2
    return matrix


@functools.lru_cache(maxsize=MOST_KEPT)
def nodes(n: int, a: Precision) -> Any:
    """The n zeros of the n-th Chebyshev polynomial, in [-1, 1], in descending order."""
    return a.cos(a.pi * (2 * a.array(np.arange(n)) + 1) / (2 * n))


def chebyshev_basis(x: Scalar, n: int, a: Precision) -> Any:
    """The Chebyshev polynomials T_0 .. T_{n-1} at x: (..., n)."""
    T = a.zeros((*np.shape(x), n))
    T[..., 0] = a.number(1)
    T[..., 1:2] = x[..., None]
    known = 1
    while known < n - 1:
        # Orders k + 1 to 2 k follow from those up to k: T_(k+j) = 2 T_k T_j - T_(k-j).
        more = min(known, n - 1 - known)
        highest, lower = T[..., known : known + 1], T[..., 1 : more + 1]
        below = T[..., known - more : known][..., ::-1]
        T[..., known + 1 : known + more + 1] = (highest + highest) * lower - below
        known += more
    return T


def chebyshev_slopes(T: Any, x: Scalar) -> Any:
    """The derivatives of the polynomials of :func:`chebyshev_basis` at x, from their values T."""
    slopes = np.zeros_like(T)
    slopes[..., 1:2] = 1 + 0 * T[..., 1:2]
    # The derivative of T_k = 2 x T_(k-1) - T_(k-2).
    for k in range(2, T.shape[-1]):
        slopes[..., k] = 2 * T[..., k - 1] + 2 * x * slopes[..., k - 1] - slopes[..., k - 2]
    return slopes


@functools.lru_cache(maxsize=MOST_KEPT)
def chebyshev_synthesis(few: int, n: int, a: Precision) -> Any:
    """The matrix (few, n) from n coefficients to values at the `few` :func:`nodes`."""
    return chebyshev_basis(nodes(few, a), n, a)


@functools.lru_cache(maxsize=MOST_KEPT)
def chebyshev_analysis(n: int, a: Precision) -> Any:
    """The matrix (n, n) from values at :func:`nodes` to coefficients."""
    matrix = chebyshev_synthesis(n, n, a).T * 2 / n
    matrix[0] = matrix[0] / 2
    return matrix


@functools.lru_cache(maxsize=MOST_KEPT)
def gauss(n: int, a: Precision) -> tuple[Any, Any]:
    """The n points, in ascending order, and the weights of Gauss's rule on (0, 1)."""
    x = a.array(np.polynomial.legendre.leggauss(n)[0])
    # Newton's method starts from doubles and doubles the digits in each pass. Two passes more:
    # points in doubles lack some bits, and the weights need polynomials at sharp points.
    for _ in range(2 + math.ceil(math.log2(a.bits / 53))):
        # Legendre polynomials of degree n - 1 and n by their three-term recurrence, with 2^k as the
        # first coefficient: those of monic ones of 540 points would underflow in the weights.
        before, last = np.ones_like(x), 2 * x
        for k in range(2, n + 1):
            share = a.number(Fraction(4 * (k - 1) ** 2, (2 * k - 1) * (2 * k - 3)))
            before, last = last, 2 * x * last - share * before
        slope = (a.number(Fraction(2 * n * n, 2 * n - 1)) * before - n * x * last) / (1 - x * x)
        x = x - last / slope
    # Known up to a factor; the weights sum up to the length of the interval, 1.
    weights = (1 - x * x) / (before * before)
    return (1 + x) / 2, weights / weights.sum(axis=0)


class Interval(NamedTuple):
    """An interval of energies with its Chebyshev nodes; it has one node if it is a single point."""

    centre: Any
    half_width: Any
    n: int
    """Number of Chebyshev nodes."""

    def nodes(self, a: Precision) -> Any:
        """The energies at the nodes, (n,)."""
        return self.centre + self.half_width * nodes(self.n, a)

    def basis(self, h: Scalar, a: Precision) -> Any:
        """The n Chebyshev polynomials at energies h: (..., n)."""
        if self.n == 1:
            # A single point has no width to divide by.
            ones = np.ones((*np.shape(h), 1), dtype=float)
            return a.array(ones)
        # Where h is a number and not an array, so is the difference; the basis takes arrays only.
        return chebyshev_basis(a.array((h - self.centre) / self.half_width), self.n, a)


def in_blocks(
    counts: Sequence[int], terms: int = 1, shared: Sequence[int] | None = None
) -> Iterator[tuple[slice, slice, list[int]]]:
    """Blocks of at most `AT_ONCE` points, for consecutive groups of `counts` points each.

    Where each point has a series of `terms` terms, a block has no more than `ROOM` of them. Points
    of a group that stay together, `shared` successive ones, are not divided.

    A block is given as the slice of its groups, the slice of its points, and the number of its
    points in each of these groups; a group may be divided between blocks.
    """
    edges, most = np.append(0, np.cumsum(counts)), max(1, min(AT_ONCE, ROOM // terms))
    together = [1] * len(counts) if shared is None else shared
    pieces = np.floor_divide(counts, together)
    cuts, own = np.append(0, np.cumsum(np.repeat(together, pieces))), 0
    while own < len(cuts) - 1:
        begin = cuts[own]
        own = max(own + 1, np.searchsorted(cuts, begin + most, side="right") - 1)
        end = cuts[own]
        first, last = np.searchsorted(edges[1:], (begin, end - 1), side="right")
        here = np.diff(np.clip(edges[first : last + 2], begin, end))
        yield slice(first, last + 1), slice(begin, end), here.tolist()


def grouped(rows: Any, matrices: Any, counts: Any = None) -> Any:
    """Products of rows (N, K), in E groups, with a matrix for each group, (E, K, M): (N, M).

    The groups have `counts` rows each, or all the same number.
    """
    many, terms, width = matrices.shape
    if counts is None or len(set(counts)) == 1:
        return product(rows.reshape(many, -1, terms), matrices).reshape(-1, width)
    edges = np.append(0, np.cumsum(counts))
    parts = zip(edges[:-1], edges[1:], matrices, strict=True)
    return np.concatenate([product(rows[k:n], matrix) for k, n, matrix in parts])
