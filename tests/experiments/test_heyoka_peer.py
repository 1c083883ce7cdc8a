"""heyoka against the kernel and integers in 113 bits: they share nothing but the field."""

from __future__ import annotations

import functools
from fractions import Fraction
from typing import Any

import numpy as np
import pytest

from rigidpend.experiments.principal_axes import heyoka, offers, typed, working_type
from rigidpend.mechanics.equations import AlignedCoefficients, aligned
from rigidpend.orbits.integrate.states import states_at
from tests.orbits.integrate.problems import GENERIC, fan, needs_heyoka, task

pytestmark = needs_heyoka("it is compared with")

ORBIT = task(fan(1, GENERIC, J1=1e-8), 113, body=GENERIC)
TIMES = [Fraction(1, 2), Fraction(10), Fraction(30)]


def exactly(x: Any) -> Fraction:
    """The value of a number of such a type, as the sum of doubles that it is."""
    total, head, kind = Fraction(0), float(x), type(x)
    while head:
        total, x = total + Fraction(head), x - kind(head)
        head = float(x)
    return total


@functools.cache
def by_heyoka() -> Any:
    """The orbit (3, 6) in 113 bits, by heyoka's own expressions of the field."""
    hy, kind = heyoka(), working_type(113)
    names = hy.make_vars("Qp", "Qm", "M3", "gamma1", "gamma2", "gamma3")
    field = aligned(names, AlignedCoefficients(*(hy.par[i] for i in range(9))))
    integrator = hy.taylor_adaptive(
        list(zip(names, field, strict=True)),
        [typed(x, kind) for x in ORBIT.states[:, 0]],
        pars=[typed(x, kind) for x in ORBIT.coefficients],
        time=kind(0),
        fp_type=kind,
        compact_mode=True,
    )
    grid = np.array([typed(x, kind) for x in [Fraction(0), *TIMES]])
    found = integrator.propagate_grid(grid)[-1][1:]
    return np.vectorize(exactly, otypes=[object])(found)


@pytest.mark.slow
@pytest.mark.parametrize("bits", [113, 212, 224])
def test_fours_of_doubles_and_integers_agree_with_real128(bits: int) -> None:
    if not offers(113):
        pytest.skip("no real128 here")
    found = states_at(ORBIT.coefficients, ORBIT.states, TIMES, bits)[..., 0].T
    off = np.abs(found - by_heyoka())
    # Some sixty steps each round to 2^-113; a passage lets errors grow some hundredfold.
    assert off.max() < Fraction(2) ** -100
    assert off[0].max() < Fraction(2) ** -110


@pytest.mark.parametrize("bits", [64, 113])
def test_numbers_of_its_types_are_given_to_their_last_bit(bits: int) -> None:
    if not offers(bits):
        pytest.skip(f"no type of {bits} bits here")
    made, whole = working_type(bits), 1 + Fraction(1, 2**55) + Fraction(1, 2 ** (bits - 1))
    found = typed(whole, made)
    # Taken away again exactly, what is left is the last bit.
    assert float(found - made(1) - made(2.0**-55)) == 2.0 ** (1 - bits)
    assert exactly(found) == whole


def test_its_own_cache_which_checks_nothing_is_off() -> None:
    assert not heyoka().llvm_state.get_diskcache_enabled()
