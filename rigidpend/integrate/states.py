"""States of one orbit at given times, in any precision: exact numbers in, exact numbers out."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from typing import Any

import numpy as np

from rigidpend.equations import AlignedCoefficients
from rigidpend.integrate import FINEST_TOLERANCE, default_engine, has_own_type
from rigidpend.integrate.arcs import arcs
from rigidpend.numbers.exact import context


def states_at(
    coefficients: AlignedCoefficients,
    state: Sequence[Fraction],
    times: Sequence[Fraction],
    bits: int,
) -> list[list[Fraction]]:
    """The aligned components of an orbit at times t', ascending from 0, which is not among them.

    Parameters
    ----------
    coefficients : AlignedCoefficients
        Fractions.
    state : 6 Fractions
        At time 0.
    times : sequence of Fraction
    bits : int
        Working precision, more than 53.

    Returns
    -------
    list of 6 Fractions for each of the times

    Raises
    ------
    ArithmeticError
        The orbit did not reach the last of the times.
    """
    if default_engine() == "taylor" and has_own_type("taylor", bits):
        return _in_series(coefficients, state, times, bits)
    m = context(bits)

    def number(x: Fraction) -> Any:
        return m.mpf(x.numerator) / x.denominator

    found = arcs(
        AlignedCoefficients(*map(number, coefficients)),
        np.array([[number(x)] for x in state], dtype=object),
        np.array([number(x) for x in times], dtype=object),
        bits,
    )
    return [[_fraction(x, m.mpf) for x in row] for row in found[:, :, 0].T]


def _in_series(
    coefficients: AlignedCoefficients,
    state: Sequence[Fraction],
    times: Sequence[Fraction],
    bits: int,
) -> list[list[Fraction]]:
    from rigidpend.integrate.compiled import begin, borrowed, typed, working_type

    kind = working_type(bits)
    with borrowed(_ExactSampler, bits) as sampler:
        begin(sampler.integrator, kind, coefficients, state)
        grid = np.array([kind(0), *(typed(t, kind) for t in times)])
        found = sampler.integrator.propagate_grid(grid)[-1]
    if len(found) != len(grid):
        raise ArithmeticError("an orbit did not reach the last of the times")
    return [[_fraction(x, kind) for x in row] for row in found[1:]]


class _ExactSampler:
    """An integrator of one orbit, without events, at the finest tolerance."""

    def __init__(self, bits: int) -> None:
        from rigidpend.integrate.compiled import stepper

        self.integrator = stepper(bits, FINEST_TOLERANCE["taylor"])


def _fraction(x: Any, kind: Any) -> Fraction:
    """A number of any type, exactly, as a sum of doubles."""
    total, rest = Fraction(0), x
    while head := float(rest):
        total, rest = total + Fraction(head), rest - kind(head)
    return total
