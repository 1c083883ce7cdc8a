"""The kernel: its arithmetic, and the machine code on disk; and the integers that check it."""

import math
import platform
from fractions import Fraction
from itertools import islice
from pathlib import Path
from typing import Any
from unittest.mock import Mock

import numpy as np
import pytest
from numpy.polynomial import Polynomial

from rigidpend.machine.workers import side_by_side
from rigidpend.mechanics.equations import AlignedCoefficients, aligned
from rigidpend.orbits.integrate import bigint, in_unit
from rigidpend.orbits.integrate.kernel import machine_code, taylor_step
from rigidpend.orbits.integrate.kernel.following import carrying, note
from rigidpend.orbits.integrate.kernel.lane_numbers import KINDS, in_parts
from rigidpend.orbits.integrate.kernel.machine_code import LANES, Writer, lanes_for
from rigidpend.orbits.integrate.states import states_at
from tests.orbits.integrate.problems import fan, task

C = AlignedCoefficients(
    *(Fraction(x) for x in ("0.43", "0.03", "0.04", "0.55", "0.07", "0.06", "0.3", "0.9", "0.8"))
)

STATE = [Fraction(x) for x in ("0.7", "-0.4", "0.2", "0.36", "0.48", "0.8")]


def stepped(
    bits: int, order: int, steps_taken: int, begun: list[Fraction] = STATE
) -> tuple[list[Fraction], Fraction, Any]:
    """State and time after some steps of one orbit, and the notes."""
    # Kernels of eight doubles, in the lanes of a single orbit, are compiled for other tests too.
    parts, lanes = KINDS[bits].parts, LANES if bits < 424 else lanes_for(1)
    state = np.repeat(in_parts(begun, bits).reshape(6 * parts, 1), lanes, axis=1)
    time = np.zeros((2, lanes))
    parameters = in_parts(C, bits)
    notes = np.zeros(lanes * steps_taken, note(order, bits))
    carry = carrying(order, bits, lanes)
    count = carry(state, lanes, time, parameters, 1e-5, 1, steps_taken, notes)
    end = [sum(map(Fraction, state[i::6, 0].tolist()), Fraction(0)) for i in range(6)]
    return end, Fraction(time[0, 0]) + Fraction(time[1, 0]), notes[:count]


def off(state: list[Fraction], time: Fraction, bits: int) -> Fraction:
    """How far a state is from that of the same orbit in integers."""
    true = states_at(C, np.array([STATE]).T, [time], bits, engine="scipy")[:, 0, 0]
    return max(abs(a - b) for a, b in zip(state, true, strict=True))


@pytest.mark.parametrize(
    ("bits", "finest"),
    [(53, 2.0**-50), (106, 2.0**-99), (159, 2.0**-152), (212, 2.0**-205), (424, 2.0**-410)],
)
def test_steps_err_by_rounding_alone(bits: int, finest: float) -> None:
    """A slip in a single recurrence, or a part of a pair that is lost, is seen here."""
    end, time, _ = stepped(bits, taylor_step.order_of(2.0 ** (1 - bits)), 8)
    assert 2 < time < 20
    # Eight steps, each of which rounds and lets earlier errors grow a little.
    assert off(end, time, bits + 60) < 8 * Fraction(finest)


@pytest.mark.parametrize("bits", [53, 159])
@pytest.mark.parametrize(("M", "order"), [("1/2", 20), (4, 20), (4, 21)])
def test_a_step_is_the_share_of_the_radius_of_convergence_that_an_order_serves_best(
    M: Any, order: int, bits: int
) -> None:
    """By the last two coefficients, relative to the state where that is above one."""
    assert [taylor_step.order_of(math.exp(-x)) for x in (37.9, 38.1)] == [20, 21]
    begun = [x * Fraction(M) for x in STATE[:3]] + STATE[3:]
    series, c = [Polynomial([float(x)]) for x in begun], AlignedCoefficients(*map(float, C))
    for _ in range(order):
        rates = aligned(series, c)
        series = [
            (x.coef[0] + rate.integ()).cutdeg(order) for x, rate in zip(series, rates, strict=True)
        ]
    norms = np.abs([x.coef for x in series]).max(axis=0)
    radius = min((max(norms[0], 1) / norms[m]) ** (1 / m) for m in (order - 1, order))
    _, length, _ = stepped(bits, order, 1, begun)
    assert float(length) == pytest.approx(radius * math.exp(-2 - 0.7 / (order - 1)), rel=3e-4)
    if bits > 106:
        assert (math.frexp(length)[0] * 2**21).is_integer(), "sums of steps are exact"


def every_operation(state: Any) -> list[Any]:
    """All that a field may do with numbers, in rates that have closed forms."""
    s, c, e, r, q, p, f, _ = state
    return [
        c,
        0 - s,
        1 + e * 1,
        1 / (2 * r),
        -2 * q * q / 2,
        r * p / (2 * r * r),
        f * state[7],
        1.0,
    ]


def test_any_field_is_followed_to_its_closed_form() -> None:
    """None of its components is larger than one."""
    t, y = 2 / 3, -1 / 7
    root = math.sqrt(1 / 16 + t)
    found = states_at(every_operation, [0, 1, 0, 1 / 4, 1 / 2, 1 / 3, 1 / 3, y], [t])[:, 0]
    # p' = p/(2 r) with r^2 = 1/16 + t.
    true = [math.sin(t), math.cos(t), math.expm1(t), root, 1 / (2 + t), math.exp(root - 1 / 4) / 3]
    true += [math.exp(y * t + t * t / 2) / 3, y + t]
    assert np.abs(found - true).max() < 2.0**-51


def test_orders_share_a_kernel_as_far_as_it_has_room() -> None:
    """Each text takes a tenth of a second or more to compile."""
    assert carrying(31, 53).func is carrying(19, 53).func
    assert carrying(32, 53).func is not carrying(31, 53).func
    for order in (31, 32):
        end, time, _ = stepped(53, order, 3)
        assert off(end, time, 113) < 3 * Fraction(2.0**-50)


def test_machine_code_is_made_once_among_threads_and_kept(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    compiled = Mock(wraps=machine_code.compiled)
    monkeypatch.setattr(machine_code, "folder", lambda: tmp_path / "kernels")
    monkeypatch.setattr(machine_code, "compiled", compiled)
    text = f"define i64 @same(i64 %x) {{\n  ret i64 %x\n}}\n; {Writer().vector}\n"
    for _ in range(2):
        machine_code.ready.cache_clear()
        both = side_by_side(machine_code.function, (), False, [text, text], jobs=2)
        assert [int(f(41)) for f in both] == [41, 41]
    # Threads waited for the one that made it, and the second time it was read.
    compiled.assert_called_once()
    machine_code.ready.cache_clear()


@pytest.mark.slow
def test_every_processor_computes_the_same_bits(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Compiled for a processor without wide vectors and without fused multiplication."""
    order = taylor_step.order_of(1e-8)
    here = stepped(53, order, 12)
    monkeypatch.setattr(machine_code, "folder", lambda: tmp_path)
    plain_one = "x86-64" if platform.machine() in ("x86_64", "AMD64") else "generic"
    monkeypatch.setattr(machine_code, "processor", lambda llvm: (plain_one, ""))
    for cached in (machine_code.ready, carrying):
        cached.cache_clear()
    plain = stepped(53, order, 12)
    for cached in (machine_code.ready, carrying):
        cached.cache_clear()
    assert plain[:2] == here[:2]
    np.testing.assert_array_equal(plain[2], here[2])


@pytest.mark.parametrize("bits", [60, 300])
def test_products_of_whole_series_are_the_sums_of_their_terms(
    bits: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Whole numbers, of which no digit depends on the way."""
    orbits = task(fan(1), 113)
    given = orbits.coefficients, orbits.states[:, 0], bits
    by_products = list(islice(bigint.steps(*given), 2))
    monkeypatch.setattr(bigint, "SHORT", 10**6)
    assert list(islice(bigint.steps(*given), 2)) == by_products


@pytest.mark.parametrize(
    ("momentum", "expected", "of_424_bits"),
    [
        (("1", "-0.5", "0"), "0.5", 1),
        (("0", "0.1", "-5"), 2, 1),
        (("0.2", "0", "0.1"), "0.125", 1),
        (("100", "-30", "0"), 32, 32),
        (("0", "0", "-0.04"), "1/32", "1/32"),
    ],
)
def test_the_unit_is_half_of_a_power_of_two_next_to_the_largest_momentum(
    momentum: tuple[str, ...], expected: str, of_424_bits: str
) -> None:
    """In 424 bits orbits with an |M| near one do without, so that none has another's unit."""
    state = [*map(Fraction, momentum), Fraction(1000), Fraction(-2000), Fraction(3000)]
    for bits, unit in ((None, expected), (212, 1), (424, of_424_bits)):
        assert in_unit(C, state, bits)[0] == Fraction(unit)
