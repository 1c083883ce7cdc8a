"""Reference orbits: precision that falls, tangents, crossings, and differences from them."""

import math
from fractions import Fraction
from itertools import pairwise
from types import SimpleNamespace
from typing import Any
from unittest.mock import Mock

import numpy as np
import pytest

from rigidpend.machine import workers
from rigidpend.machine.signals import Stopped
from rigidpend.mechanics.equations import aligned
from rigidpend.numbers.exact import exact
from rigidpend.orbits.integrate import neighbours
from rigidpend.orbits.integrate.reference_orbit import (
    BLOCK,
    ReferenceOrbit,
    crossings,
    reference_bits,
)
from rigidpend.routes.start import Scales, start, states_exact
from tests.bodies import FIG4, problem
from tests.orbits.integrate.problems import on_separatrix, task

PROBLEM = problem(n_symbols=2)
QUARTER = exact("pi/2")
PHASE, BITS = "4.705696853133541796856", reference_bits(1e-12, 53)


def orbit(phase: str, bits: int, engine: str = "taylor", **changed: Any) -> ReferenceOrbit:
    begin = start(PROBLEM, bits, Scales())
    state, further = states_exact(begin, [exact(phase), exact(phase) + QUARTER], bits).T
    given: dict[str, Any] = {
        "longest": 1e3,
        "engine": engine,
        "bits": bits,
        "tolerance": 2.0**-52,
        **changed,
    }
    return ReferenceOrbit(begin.coefficients, state, further * np.repeat([0, 1], 3), **given)


@pytest.mark.parametrize("engine", ["taylor", "scipy"])
def test_a_stop_ends_each_step(monkeypatch: pytest.MonkeyPatch, engine: str) -> None:
    """By the kernel and in integers: where passages are slow, an orbit has thousands of steps."""
    one = orbit("4.7", 192, engine)
    monkeypatch.setattr(workers, "came", lambda: True)
    with pytest.raises(Stopped):
        one.reaches(1)


def test_the_tangent_is_the_derivative_along_the_phase() -> None:
    """On steps of the same length, for which the two orbits are near enough."""
    one, other = orbit("4.7", 192), orbit("4.7 + 1e-40", 192)
    k = 12
    assert one.reaches(k)
    assert other.reaches(k)
    late = other.points[k].exact_time - one.points[k].exact_time
    rates = aligned(one.points[k].state, one.coefficients)
    states = zip(other.points[k].state, one.points[k].state, rates, strict=True)
    apart = [float((x - y - late * rate) * 10**40) for x, y, rate in states]
    assert np.allclose(one.tangents[k], apart, rtol=1e-9, atol=1e-12)
    assert one.growth[k] == float(one.size(one.tangents[k][:, None])[0])


@pytest.mark.parametrize(("engine", "bits"), [("taylor", 113), ("taylor", 212), ("scipy", 113)])
def test_the_length_of_a_step_is_a_double(engine: str, bits: int) -> None:
    """So that differences are carried exactly as far as the reference."""
    found = orbit("4.7", bits, engine)
    assert found.reaches(7)
    for before, after in pairwise(found.points[:8]):
        assert after.exact_time - before.exact_time == Fraction(after.step) > 0


@pytest.mark.parametrize(("bits", "steps"), [(BITS, 150), (40, 8)])
def test_a_precision_falls_where_growth_has_taken_its_bits_and_no_sooner(
    bits: int, steps: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """And never below that of pairs of doubles."""
    falling = orbit(PHASE, bits)
    advanced = Mock(wraps=falling.advanced)
    monkeypatch.setattr(falling, "advanced", advanced)
    assert falling.reaches(steps)
    growth = np.maximum.accumulate(falling.growth) / falling.growth[0]
    # A block of steps at a time.
    left = [bits - math.log2(x) for x in growth[: BLOCK * advanced.call_count : BLOCK]]
    assert min(left) < 106
    assert (max(left) > 106) is (bits == BITS)
    used = [call.args[1] for call in advanced.call_args_list]
    assert used == [106 if x <= 106 else 212 for x in left]


@pytest.mark.parametrize("J1", [1e-4, 1e-100])
def test_tiny_components_cost_no_bits_while_they_grow_large(
    J1: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Roundings of Qp and gamma3 grow as they do, from 1e-50 on: their relative size stays."""
    used: list[int] = []
    advanced = ReferenceOrbit.advanced

    def noted(self: ReferenceOrbit, state: Any, bits: int) -> Any:
        used.append(bits)
        return advanced(self, state, bits)

    monkeypatch.setattr(ReferenceOrbit, "advanced", noted)
    one = task(on_separatrix(2, FIG4, J1, 0.7)[:, None], 113, n_crossings=1, passage_limit=1e4)
    found = crossings(one, 113, "taylor", 2.0**-52)
    assert found.separatrix[0, 0] == 2
    # Up to the first crossing nothing else has grown by more than a few bits.
    assert set(used) == {212}


def test_an_orbit_that_does_not_cross_ends() -> None:
    """Before the first crossing, which comes after ten units of t', five have passed."""
    short = orbit("4.7", 113, longest=5.0)
    assert short.reaches(8)
    assert not short.reaches(1000)
    assert short.points[-1 - BLOCK].time <= 5 < short.points[-1].time
    assert short.last_below(1e300) == len(short.points) - 1


def test_each_halving_of_the_least_distance_costs_a_bit_and_one_beyond_1_none() -> None:
    at_one = reference_bits(1.0, 53)
    assert at_one >= 53 + 8, "a byte to spare"
    assert [reference_bits(2.0**-k, 53) for k in range(4)] == [at_one + k for k in range(4)]
    assert reference_bits(0.75, 53) == at_one + 1
    assert reference_bits(1.5, 53) == reference_bits(8.0, 53) == at_one
    assert reference_bits(1.0, 64) == at_one + 11


def test_differences_that_are_multiples_of_the_tangent_are_not_integrated() -> None:
    """Those of the farther neighbour stay below what its square would add."""
    reference, shifts = orbit("4.7", 160), np.array([1e-24, -2e-24])
    tangent = reference.tangents[0]
    walk = neighbours.Walk(
        reference,
        np.outer(tangent, shifts),
        shifts,
        n_crossings=2,
        passage_limit=1e3,
        tolerance=1e-14,
    )
    k, small = walk.skip(), 2.0 ** -(53 + neighbours.MARGIN_BITS)
    assert k > 4
    assert reference.growth[k] * 2e-24 < small <= reference.growth[k + 1] * 2e-24
    np.testing.assert_array_equal(walk.differences, np.outer(reference.tangents[k], shifts))


@pytest.mark.parametrize(("size", "last"), [(0.5, 0), (1.5, 0), (2.9, 1), (3.5, 3), (99, 4)])
def test_the_tangent_is_below_a_size_up_to_a_point(size: float, last: int) -> None:
    orbit: Any = SimpleNamespace(growth=[1, 2, 3, 2.5, 9], reaches=lambda k: k < 5)
    assert ReferenceOrbit.last_below(orbit, size) == last
