"""The normal form at given energies: its rates, its series, and (u, v) of points near the orbit."""

from __future__ import annotations

import copy
import functools
import math
from typing import Any, NamedTuple

import numpy as np

from rigidpend.numbers import Scalar
from rigidpend.orbits.precision import Precision, correction, precision, product
from rigidpend.orbits.return_map.expansions import fourier_basis, grouped, in_blocks
from rigidpend.orbits.return_map.normal_form import GUARD_SHARE, MapError, NormalForm, powers

MOST_ITERATIONS = 12
"""Largest number of corrections with all terms; each doubles the digits if the series converge."""
SETTLED = 1e-9
"""Relative correction in doubles after which the next one would be rounding.

Slopes from terms up to half the degree leave 2^-24 of a correction."""
SLOPES = 2.0**-44
"""Share of a correction that remains to be done when its slopes are those in doubles."""
OUT_OF_REACH = (
    "the series of the normal form cannot be inverted at the ends of the section's arcs, for it"
    " does not reach so far; a smaller mu brings them within reach"
)


class TorusRates(NamedTuple):
    """The rates Lambda(I) and mean dt'/dpsi on tori uv = I, with derivatives in I, (N,) each."""

    exponent: Any
    exponent_slope: Any
    rotation: Any
    rotation_slope: Any


def _polynomial(c: Any, by_power: Any) -> tuple[Any, Any]:
    """The values and slopes (N,) of polynomials with coefficients c (K, N), from known powers."""
    few = len(c)
    slopes = c[1:] * np.arange(1, few)[:, None]
    return (by_power[:few] * c).sum(axis=0), (by_power[: few - 1] * slopes).sum(axis=0)


def _powers(x: Any, n: int) -> Any:
    """The powers 1, x, ..., x^(n-1): (n, N)."""
    found = np.zeros_like(x, shape=(n, len(x)))
    found[0] = 1 + 0 * x
    known = 1
    while known < n:
        # The number of known powers doubles each time: few operations on short arrays.
        more = min(known, n - known)
        found[known : known + more] = found[known - 1] * x * found[:more]
        known += more
    return found


class NormalPoint(NamedTuple):
    """Points in the coordinates of the normal form, (N,) each."""

    u: Any
    v: Any
    tau: Any
    """The oscillation of time about its mean growth, t'."""
    sigma: Any = None
    """The oscillation of theta3, radians, about a mean growth of 0; None if it is not known."""


class TorusForm:
    """The normal form at E energies, for points in E consecutive groups, one for each energy.

    Parameters
    ----------
    nf : NormalForm
    h : (E,) array
        Energies.
    a : Precision
    counts : E ints, optional
        Number of points of each group, if the groups are not all of one length.
    weights : (E, count) array, optional
        The Chebyshev polynomials at the energies, if they are already known.
    shared : E ints, optional
        Number of successive points of each group that have a phase in common, if they do; then
        `counts` are given too.
    """

    def __init__(
        self,
        nf: NormalForm,
        h: Scalar,
        a: Precision,
        counts: Any = None,
        weights: Any = None,
        shared: Any = None,
    ) -> None:
        self.nf, self.h, self.a, self.counts, self.shared = nf, h, a, counts, shared
        self.weights = nf.energies.basis(h, a) if weights is None else weights
        # What `at_energies` found; and the form that this is a part of, with the part's groups.
        self._at_energies: dict[tuple[int, int], Any] = {}
        self._whole: tuple[TorusForm, slice] | None = None

    @functools.cached_property
    def exponent(self) -> Any:
        """(E, K): the coefficients of Lambda(I)."""
        return self.weights @ self.nf.exponent

    @functools.cached_property
    def rotation(self) -> Any:
        """(E, K + 1): the coefficients of the mean dt'/dpsi."""
        return self.weights @ self.nf.rotation

    def part(self, groups: slice, counts: Any) -> TorusForm:
        """The same for some of the groups, with `counts` points in each of them."""
        given = self.nf, self.h[groups], self.a, counts, self.weights[groups]
        found = TorusForm(*given, self.shared and self.shared[groups])
        found._whole = self, groups
        return found

    def at_energies(self, parity: int, terms: int) -> Any:
        """The first terms of the odd (1) or the even (0) series at each energy, (E, n F terms)."""
        if self._whole:
            # Its parts share what a form has found.
            form, groups = self._whole
            return form.at_energies(parity, terms)[groups]
        if (parity, terms) not in self._at_energies:
            part = self.nf.series[1 - parity][..., :terms]
            part = product(self.weights, part.reshape(self.weights.shape[1], -1))
            self._at_energies[parity, terms] = part
        return self._at_energies[parity, terms]

    @functools.cached_property
    def in_doubles(self) -> TorusForm:
        """The same in doubles."""
        floats = self.a.floats
        if self._whole:
            form, groups = self._whole
            found = form.in_doubles.part(groups, self.counts)
        else:
            nf = self.nf._replace(odd=floats(self.nf.odd), even=floats(self.nf.even))
            given = nf, floats(self.h), precision(53), self.counts, floats(self.weights)
            found = TorusForm(*given, self.shared)
        # These take the place of the cached properties: rounded last, so sharper than from rounded
        # weights.
        found.exponent, found.rotation = floats(self.exponent), floats(self.rotation)
        return found

    def group_sizes(self, points: int) -> Any:
        """The number of points of each group, given the number of all points."""
        return points // len(self.weights) if self.counts is None else self.counts

    def rates(self, I: Scalar) -> TorusRates:
        """The rates at the invariants I, (N,), of points in groups."""
        by_power = _powers(I, max(self.exponent.shape[1], self.rotation.shape[1]))
        each = self.group_sizes(len(I))
        found = (
            _polynomial(np.repeat(c.T, each, axis=1), by_power)
            for c in (self.exponent, self.rotation)
        )
        return TorusRates(*next(found), *next(found))

    def placed(self, psi: Scalar, u: Scalar, v: Scalar) -> tuple[Any, Any, Any]:
        """Qp, Qm and the oscillation of time, t', at points of the normal form, (N,) each."""
        Qp, Qm, *_, tau = TorusSeries(self, psi).values(u, v)
        return Qp, Qm, tau

    def inverted(self, psi: Scalar, Qp: Scalar, Qm: Scalar) -> NormalPoint:
        """The coordinates u and v of points (Qp, Qm) at phases psi, by Newton's method.

        Newton's method runs in doubles up to the last correction. In this one only the terms of
        low degree are summed in the full precision: all others are so small that doubles have
        digits enough for them.

        Raises
        ------
        MapError
            A point lies outside of the range of the normal form.
        """
        # Each phase has series of its own, with room for odd and even terms; where points share
        # phases these are few.
        rough, terms = self.in_doubles, 1 if self.shared else (self.nf.degree + 1) ** 2
        counts = self.counts or (len(psi) // len(self.weights),) * len(self.weights)
        found = [
            _inverted(self.part(groups, here), rough.part(groups, here), psi[at], (Qp[at], Qm[at]))
            for groups, at, here in in_blocks(counts, terms, self.shared)
        ]
        return NormalPoint(*(np.concatenate(x) for x in zip(*found, strict=True)))


def _inverted(form: TorusForm, rough: TorusForm, psi: Any, Q: tuple[Any, Any]) -> tuple[Any, ...]:
    """The fields of `NormalPoint` for a block of points; `rough` is the normal form in doubles."""
    a, doubles = form.a, rough.a
    given = [a.floats(x) for x in Q]
    series = TorusSeries(rough, a.floats(psi))
    u, v = _newton(series, given[0], given[1])
    if a.bits == 53:
        # `values` gives Qp, Qm, sigma if it is known, and tau; here tau and sigma are wanted.
        return (u, v, *series.values(u, v)[:1:-1])
    # Terms behind `low` may be rounded to doubles; slopes need terms up to `fine` only.
    sizes = [doubles.largest(x) for x in (u, v)]
    # The smaller of u and v has to keep its own digits.
    apart = min(sizes) / max(sizes) or 1.0
    shares = apart * 2.0 ** (53 - a.bits), SLOPES
    low, fine = series.least_degrees(*sizes, *(GUARD_SHARE * share for share in shares))
    _, by_u, by_v = series.part(0, fine).slopes(u, v, every=True)
    head = TorusSeries(form, psi, low)
    tail = series.part(low + 1)
    u, v = a.array(u), a.array(v)
    for _ in range(MOST_ITERATIONS):
        values = head.values(u, v) + tail.values(a.floats(u), a.floats(v))
        du, dv = correction(by_u, by_v, (values[0] - Q[0], values[1] - Q[1]))
        u, v = u - du, v - dv
        if _relative(du, dv, u, v, a) * SLOPES < 4 * a.epsilon:
            # tau and sigma follow the last correction to first order: no further sum is needed.
            left = values - by_u * du - by_v * dv
            return (u, v, *left[:1:-1])
    raise MapError(OUT_OF_REACH)


def _newton(series: TorusSeries, Qp: Any, Qm: Any) -> tuple[Any, Any]:
    """The coordinates u and v in doubles, from a start at 0 by terms of growing degree."""
    u, v = 0 * Qp, 0 * Qp
    # A correction doubles the correct digits, so that each pass takes twice as many terms, up to
    # pass `all_terms`: those left out are smaller than the error of u and v.
    all_terms = series.degree.bit_length() - 1
    with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
        for k in range(all_terms + MOST_ITERATIONS):
            if k and k == all_terms:
                # The slopes of the pass before, with half of the degree, are good enough.
                p, m, *_ = series.values(u, v)
            else:
                degree = math.ceil(series.degree / 2 ** max(all_terms - k, 0))
                (p, m), by_u, by_v = series.part(0, degree).slopes(u, v)
            du, dv = correction(by_u, by_v, (p - Qp, m - Qm))
            u, v = u - du, v - dv
            off = _relative(du, dv, u, v, precision(53))
            if k >= all_terms and off < SETTLED:
                return u, v
            if not off < np.inf:
                break
    raise MapError(OUT_OF_REACH)


def _relative(du: Any, dv: Any, u: Any, v: Any, a: Precision) -> float:
    """The largest correction relative to |u| + |v|."""
    size = a.floats(np.abs(u) + np.abs(v))
    # On the periodic orbit itself |u| + |v| = 0, and the correction counts as it stands.
    return a.largest(a.floats(np.abs(du) + np.abs(dv)) / (size + (size == 0)))


class TorusSeries:
    """The series at given phases: polynomials in u and v, with coefficients for each phase."""

    def __init__(self, form: TorusForm, psi: Scalar, most_degree: int | None = None) -> None:
        nf, counts = form.nf, form.counts
        self.degree = nf.degree if most_degree is None else min(most_degree, nf.degree)
        self.runs = [(len(psi), 1)]
        """Numbers of successive phases, and of the points that share each of these."""
        if form.shared:
            sizes = zip(form.group_sizes(len(psi)), form.shared, strict=True)
            self.runs = [(count // each, each) for count, each in sizes]
            counts = [count for count, _ in self.runs]
            own = np.repeat(form.shared, counts)
            psi = psi[np.cumsum(own) - own]
        basis, groups = fourier_basis(psi, nf.n, form.a), len(form.weights)
        alone = 1 < groups == len(psi)
        if alone:
            # Each phase has an energy of its own: one product of matrices sums over energy and
            # phase together. Otherwise the sum over energies is done once for each group.
            basis = (form.weights[:, :, None] * basis[:, None, :]).reshape(len(psi), -1)
            groups, counts = 1, None
        self.series: list[tuple[Any, int]] = []
        """Coefficients (phases, F, K, J), and the parity of total degrees: 1, then 0.

        Those at [..., k, j] belong to v^k u^(2 j), or u^(2 j + 1) where k has not this parity. Of
        the F functions Qp, Qm and sigma if it is known, then of tau."""
        for parity in (1, 0):
            exponents = powers(self.degree, parity)
            part = nf.series[1 - parity][..., : len(exponents)]
            of, part = part.shape[1], part if alone else form.at_energies(parity, len(exponents))
            part = grouped(basis, part.reshape(groups, basis.shape[1], -1), counts)
            (j, k), shape = exponents.T, (len(psi), of, self.degree + 1, self.degree // 2 + 1)
            c = np.zeros_like(part, shape=shape)
            c[..., k, j // 2] = part.reshape(*shape[:2], -1)
            self.series.append((c, parity))

    def part(self, least_degree: int, most_degree: int | None = None) -> TorusSeries:
        """The terms from `least_degree` on; and up to `most_degree` at least, if it is given."""
        made, D = copy.copy(self), self.degree if most_degree is None else most_degree
        made.degree, made.series = min(D, self.degree), []
        for c, parity in self.series:
            some = c[..., : D + 1, : D // 2 + 1]
            if least_degree:
                some = some * (sum(_exponents(some, parity)) >= least_degree)
            made.series.append((some, parity))
        return made

    def least_degrees(self, u: float, v: float, *shares: float) -> list[int]:
        """The degrees above which all terms are below given shares of the largest term.

        Terms are compared at the largest |u| and |v|, and separately for each of the functions.
        """
        found = [1] * len(shares)
        for c, parity in self.series:
            k, j = _exponents(c, parity)
            sizes = np.abs(c).max(axis=0) * (v**k * u**j)
            sizes = (sizes / np.maximum(sizes.max(axis=(1, 2), keepdims=True), 1e-300)).max(axis=0)
            large = ((k + j)[sizes > share].max(initial=1) for share in shares)
            found = [max(low, int(high)) for low, high in zip(found, large, strict=True)]
        return found

    def values(self, u: Scalar, v: Scalar) -> Any:
        """The values of Qp, Qm, sigma if it is known, and tau at points: (3 or 4, N)."""
        return np.concatenate([self._summed(*own, u, v)[0] for own in self.series])

    def slopes(self, u: Scalar, v: Scalar, *, every: bool = False) -> tuple[Any, Any, Any]:
        """The values of Qp and Qm, with their derivatives in u and in v: (2, N) each.

        With `every`, all functions of :meth:`values` in their order: (3 or 4, N) each.
        """
        odd, parity = self.series[0]
        of = self.series if every else [(odd[:, :2], parity)]
        found = [self._summed(*own, u, v, slopes=True) for own in of]
        value, along_u, along_v = (np.concatenate(x) for x in zip(*found, strict=True))
        return value, along_u, along_v

    def _summed(
        self, c: Any, parity: int, u: Any, v: Any, *, slopes: bool = False
    ) -> tuple[Any, ...]:
        """The sums (F, N) of one of the `series`, with their derivatives in u and v if `slopes`.

        A product of matrices sums over the powers of u^2, `columns`; what it gives for each power
        of v is then summed with its factor, one of the `rows`: v^k, or v^k u where u is odd.
        """
        K, J = c.shape[-2:]
        columns, rows = [_powers(u * u, J)], [_powers(v, K)]
        odd = slice(1 - parity, None, 2)
        if slopes:
            # The derivative of the columns in u; those of the rows in v, and in u.
            columns.append(2 * u * _slopes(columns[0]))
            rows += [_slopes(rows[0]), np.zeros_like(rows[0])]
            rows[2][odd] = rows[0][odd]
        for x in rows[:2]:
            x[odd] = x[odd] * u
        found, phase, point = [], 0, 0
        for count, each in self.runs:
            end, last = phase + count, point + count * each

            def own(x: Any, point: int = point, count: int = count, each: int = each) -> Any:
                """These points' columns or rows (M, N) as (phases, M, 1, points of a phase)."""
                here = x[:, point : point + count * each].reshape(len(x), count, 1, each)
                return here.transpose(1, 2, 0, 3)

            by = [np.matmul(c[phase:end], own(x)) for x in columns]
            total = [by[0] * own(x) for x in rows]
            if slopes:
                total = [total[0], total[2] + by[1] * own(rows[0]), total[1]]
            sums = [x.sum(axis=2).transpose(1, 0, 2).reshape(c.shape[1], -1) for x in total]
            found.append(sums)
            phase, point = end, last
        return tuple(np.concatenate(x, axis=1) for x in zip(*found, strict=True))


def _exponents(c: Any, parity: int) -> tuple[Any, Any]:
    """The powers of v (K, 1) and of u (K, J) in one of a :class:`TorusSeries`' `series`."""
    k, j = (np.arange(n) for n in c.shape[-2:])
    return k[:, None], 2 * j + ((k + parity) % 2)[:, None]


def _slopes(by_power: Any) -> Any:
    """The derivatives (n, N) of powers x^0, x^1, ... from their values."""
    found = np.zeros_like(by_power)
    found[1:] = np.arange(1, len(found))[:, None] * by_power[:-1]
    return found
