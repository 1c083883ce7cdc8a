"""States at given times and at first crossings: tolerance, engines and numbers, integrals."""

import functools
import math
from fractions import Fraction
from itertools import pairwise
from typing import Any
from unittest.mock import Mock

import numpy as np
import pytest
from scipy.special import ellipj, ellipk

from rigidpend.mechanics.equations import AlignedCoefficients, aligned_coefficients, on_section
from rigidpend.numbers.exact import context, fraction
from rigidpend.orbits.integrate import WEIGHTS, bigint, states
from rigidpend.orbits.integrate.kernel import following, machine_code
from rigidpend.orbits.integrate.kernel.machine_code import FEW_LANES, LANES
from rigidpend.orbits.integrate.states import at_crossings, first_crossings, states_at
from rigidpend.orbits.precision import precision
from tests.orbits.integrate.problems import ENGINES, FIG4, FREE, GENERIC, WAYS, by, fan, find, task

K2 = 0.9
TOLERANCES = (1e-4, 1e-6, 1e-8, 1e-10, 1e-12)
TASK = task(fan(3, GENERIC, J1=0.1), 106, body=GENERIC)
DURATIONS = np.array([[Fraction("0.5"), Fraction("2.25"), Fraction(1)]])
C: Any = aligned_coefficients(GENERIC.angles(), math)
both_engines = pytest.mark.parametrize("engine", ENGINES)


def rotor(state: Any) -> tuple[Any, ...]:
    """x = 2 am(t, k): x'' = -k^2 sin(x), whose exact solution SciPy knows; x, x', sin x, cos x."""
    _, speed, sin, cos = state
    return speed, -K2 * sin, cos * speed, -sin * speed


def rotors(x: Any, speed: Any) -> Any:
    """States of rotors."""
    return np.array([x, speed, np.sin(x), np.cos(x)])


def error(engine: str, tolerance: float | None) -> float:
    """Of two rotors alike, each at times of its own, forwards and backwards."""
    times = np.linspace(0, 4 * ellipk(K2), 30)[:, None] * [1, -0.5]
    _, _, dn, amplitude = ellipj(times, K2)
    begin = rotors(np.zeros(2), np.full(2, 2.0))
    found = states_at(rotor, begin, times, engine=engine, tolerance=tolerance)[:2]
    return float(np.abs(found - [2 * amplitude, 2 * dn]).max())


@both_engines
def test_order_error_follows_the_tolerance(engine: str) -> None:
    errors = [error(engine, tolerance) for tolerance in TOLERANCES]
    for tolerance, found in zip(TOLERANCES, errors, strict=True):
        assert found < 200 * tolerance
    # A hundredth of the tolerance leaves at most a tenth of the error; a coarse one shows.
    assert all(finer < coarser / 10 for coarser, finer in pairwise(errors))
    assert errors[0] > 1e-7
    assert error(engine, None) < {"taylor": 1e-13, "scipy": 5e-12}[engine], "the finest serves"


@both_engines
def test_refuses_to_pass_a_singularity(engine: str) -> None:
    """x' = x^2 from x = 1 ends at t = 1; the second equation keeps the field plural."""
    with pytest.raises(ArithmeticError, match="ended early"):
        states_at(lambda x: (x[0] * x[0], x[0]), [1.0, 0.0], [0.5, 2.0], engine=engine)


def test_each_orbit_keeps_every_bit_whatever_the_company(monkeypatch: pytest.MonkeyPatch) -> None:
    """More orbits than lanes and than a call takes, both ways in time, each with its own end."""
    monkeypatch.setattr(states, "TOGETHER", 16)
    n = 21
    begin, until = rotors(np.linspace(0, 3, n), np.linspace(1, 2, n)), np.linspace(-3, 4, n)
    together = states_at(rotor, begin, until[None])[:, 0]
    alone = [states_at(rotor, begin[:, k], until[[k]])[:, 0] for k in range(n)]
    np.testing.assert_array_equal(together, np.stack(alone, axis=1))


@both_engines
def test_where_no_time_passes_orbits_stay_and_none_are_none(engine: str) -> None:
    begin = rotors(np.array([0.1, 0.3]), np.array([2.0, 1.0]))
    found = states_at(rotor, begin, [[0.0, 3.0]], engine=engine)
    np.testing.assert_array_equal(found[:, 0, 0], begin[:, 0])
    assert states_at(rotor, np.empty((4, 0)), np.empty((1, 0)), engine=engine).shape == (4, 1, 0)
    assert states_at(lambda x: (x[0],), [2.0], [0.0], engine=engine).tolist() == [[2.0]]


def test_fields_that_differ_by_numbers_alone_share_their_code(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    compiled = Mock(wraps=machine_code.function)
    monkeypatch.setattr(machine_code, "function", compiled)

    def grows(rate: float) -> float:
        field: Any = lambda x: (rate * x[0] / 2, x[1] + 3 * x[0] * x[1])  # noqa: E731
        return float(states_at(field, [1.0, 0.0], [1.0])[0, 0])

    found = [grows(k / 64) for k in range(2, 30)]
    np.testing.assert_allclose(found, np.exp(np.arange(2, 30) / 128), rtol=1e-14)
    assert len({call.args for call in compiled.call_args_list}) <= 1


@pytest.mark.parametrize(
    ("kernel", "followed"),
    [
        ("sampling", lambda begin: states_at(C, begin, np.linspace(1, 9, 5))),
        ("carrying", lambda begin: find(begin, "taylor", n_crossings=1).time),
    ],
)
def test_few_orbits_take_narrow_vectors_and_keep_every_bit(
    kernel: str, followed: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    watched = Mock(wraps=getattr(following, kernel))
    monkeypatch.setattr(following, kernel, watched)
    more, few = (followed(fan(FEW_LANES + 1)[:, :n]) for n in (FEW_LANES + 1, FEW_LANES))
    assert [call.args[-1] for call in watched.call_args_list] == [LANES, FEW_LANES]
    np.testing.assert_array_equal(more[..., :FEW_LANES], few)


@pytest.mark.parametrize(
    ("times", "more", "said"),
    [
        *(
            (times, {}, "ascends or descends from 0")
            for times in ([], [0.0, 0.0], [2.0, 1.0], [-1.0, 1.0], [1.0, 1.0], 3.0)
        ),
        ([[1.0, -2.0], [2.0, 1.0]], {}, "ascends or descends from 0"),
        *(
            ([1.0], {"tolerance": x}, f"tolerance must be a number above 0, got {x}")
            for x in (0, -1e-9, math.nan, math.inf)
        ),
        ([1.0], {"bits": 106}, "106 bits follow the aligned field alone"),
    ],
)
def test_what_is_refused_names_its_reason(times: Any, more: Any, said: str) -> None:
    with pytest.raises(ValueError, match=said):
        states_at(lambda x: (x[0],), np.ones((1, 2)), times, **more)


def given(bits: int, sense: int, n: int = 3) -> tuple[AlignedCoefficients, Any, Any]:
    """Coefficients, states and times of so many bits; the times are no doubles."""
    a = precision(bits)
    exact = aligned_coefficients(GENERIC.angles(bits + 32), context(bits + 32))
    c = AlignedCoefficients(*map(a.number, exact))
    times = sense * a.array([1, 2, 5]) * a.number(7) / a.number(9)
    return c, a.array(fan(n, GENERIC, J1=0.1)) / a.number(3), times


@pytest.mark.parametrize(("bits", "sense"), [(106, 1), (160, -1)])
def test_sums_of_doubles_agree_with_integers(bits: int, sense: int) -> None:
    c, begin, times = given(bits, sense)
    found = states_at(c, begin, times, bits)
    assert found.shape == (6, 3, 3)
    exactly = np.frompyfunc(fraction, 1, 1)
    numbers = AlignedCoefficients(*map(fraction, c)), exactly(begin[:, 1:2]), exactly(times)
    expected = states_at(*numbers, bits + 40, engine="scipy")
    # Components are below one: a unit in the last place, most of it the result's own rounding.
    assert np.abs(exactly(found[..., 1:2]) - expected).max() < Fraction(2) ** -bits
    if bits == 106:
        coarse = states_at(c, begin, times, bits, tolerance=1e-12)
        assert 1e-22 < np.abs(exactly(coarse[..., 1:2]) - expected).max() < 1e-9


@pytest.mark.parametrize("bits", [106, 212])
def test_a_time_beside_a_double_is_met_as_if_one_went_on_from_there(bits: int) -> None:
    """Half an ulp of 200 is 2^-46: nothing of it is lost, nor of its powers."""
    (c, begin, _), a = given(bits, 1), precision(bits)
    double, late = a.number(200), a.number(7 * 2.0**-49)
    found = states_at(c, begin, a.array([double + late]), bits)[:, 0]
    there = states_at(c, begin, a.array([double]), bits)[:, 0]
    expected = states_at(c, there, a.array([late]), bits)[:, 0]
    assert float(abs(found - there).max()) > 2.0**-49
    assert float(abs(found - expected).max()) < 2.0 ** (2 - bits)


@both_engines
def test_each_orbit_of_fractions_is_carried_on_for_its_own_time(engine: str) -> None:
    """By any number of threads, and of the same bits whatever the body before."""
    begin, bits, jobs = TASK.states, 106, 2 if engine == "taylor" else 1
    other = task(fan(3), 106, body=FIG4).coefficients
    found, unlike, again = (
        states_at(c, begin, DURATIONS, bits, jobs=n, engine=engine)
        for c, n in ((TASK.coefficients, jobs), (other, 1), (TASK.coefficients, 1))
    )
    assert (unlike != found).all()
    assert (found == again).all()
    for k, time in enumerate(DURATIONS[0]):
        expected = states_at(TASK.coefficients, begin[:, [k]], [time], 120, engine="scipy")
        assert np.abs(found[..., [k]] - expected).max() < 200 * Fraction(2) ** -bits


@pytest.mark.slow
def test_invariant_the_length_of_gamma_walks_by_roundings_and_does_not_drift() -> None:
    """With parameters in front of products it drifts: by 14 standard errors of these orbits."""
    coefficients: Any = aligned_coefficients(FIG4.angles(), math)
    starts = fan(128, FIG4, J1=1e-8)
    found = states_at(coefficients, starts, np.array([0.0, 1e4]), tolerance=2.0**-52)
    begun, ended = ((found[3:, k].astype(np.longdouble) ** 2).sum(axis=0) for k in (0, 1))
    drift = (ended - begun) / 2
    assert 1e-15 < drift.std() < 2e-14
    assert abs(drift.mean()) < 4 * drift.std() / math.sqrt(drift.size)


def first(engine: str, bits: int, limit: float = 200.0, n: int = 1) -> Any:
    """Of Fractions, or of doubles."""
    orbits = task(fan(2)[:, :n], 53 if (engine, bits) == ("taylor", 53) else 212)
    return first_crossings(orbits.coefficients, orbits.states, limit, **by(engine, bits))


@functools.cache
def crossed(engine: str, bits: int) -> tuple[Fraction, list[Fraction]]:
    """Time and state of the crossing, in rational numbers."""
    times, states = first(engine, bits)
    return Fraction(times[0]), list(map(Fraction, states[:, 0]))


@pytest.mark.slow
@pytest.mark.parametrize(("engine", "bits"), WAYS)
def test_agrees_with_230_bit_integers_and_the_first_of_all_crossings(
    engine: str, bits: int
) -> None:
    (time, state), (then, there) = crossed(engine, bits), crossed("scipy", 230)
    unit = Fraction(1, 2**bits)
    assert max(abs(a - b) for a, b in zip(state, there, strict=True)) < 200 * unit
    assert abs(time - then) < 20_000 * unit
    # The distance from the separatrix keeps its relative precision.
    assert abs(state[1] - there[1]) < 2 * unit < abs(there[1]) < Fraction(1, 200)
    assert abs(state[2]) < 8 * unit, "M3 vanishes"
    start = task(fan(2), 212).states[:, 0]
    before, after = (sum(x * x for x in gamma[3:]) for gamma in (start, state))
    assert abs(after - before) < 200 * unit
    assert find(fan(2)[:, :1], engine, bits, n_crossings=1).time[0, 0] == pytest.approx(
        float(time), rel=1e-13
    )


@pytest.mark.parametrize(("engine", "bits"), WAYS[:3] + WAYS[-1:])
def test_where_one_orbit_does_not_cross_in_time_there_is_none(engine: str, bits: int) -> None:
    early, late = sorted(map(float, first("taylor", 53, n=2)[0]))
    assert late - early > 1e-6
    assert first(engine, bits, (early + late) / 2, n=2) is None


def test_crossings_are_sought_until_none_is_late_and_what_is_left_is_told() -> None:
    given, ways = task(fan(3), 88)[:2], by("taylor", 88)
    exact = first_crossings(*given, 200.0, **ways)
    assert exact is not None
    times = exact[0].astype(float) - np.array([1e-3, 0.0, 0.0])
    once, settled = (at_crossings(*given, times, late=late, **ways) for late in (1.0, 1e-12))
    # M3 bends by as much on the way.
    assert once[2][0] == pytest.approx(1e-3, rel=1e-2)
    assert np.abs(once[2][1:]).max() < 1e-12
    assert np.abs(settled[2]).max() < 1e-12
    assert float(settled[0][0] - once[0][0]) == pytest.approx(1e-3, rel=1e-9)


def test_order_of_a_crossing_beside_a_state_is_the_third_in_the_time_between() -> None:
    there, off = np.array([0.9, 0.2, 0.0, 0.4, -0.6, 0.7]), np.array([0.02, 0.04])
    end, late = on_section(states_at(C, there, off), C)
    assert end[2].tolist() == [0, 0]
    near, far = np.abs([*(end - there[:, None])[[0, 1, 3, 4, 5]], late + off]).T
    assert far.max() < 1e-4
    assert min(far / near) > 7.5


def test_crossings_in_many_bits_are_the_same_in_far_units_of_M_and_by_two_threads() -> None:
    """Beyond 212 bits the kernel has a unit of M of its own, and time in its inverse."""
    orbits, unit, off = task(fan(3), 424), Fraction(2**20), 1e-3 * 2.0**-20
    c, states = orbits[:2]
    exact = first_crossings(c, states, 200.0, **by("taylor", 424))
    assert exact is not None
    heavier = c._replace(**{x: getattr(c, x) * unit**2 for x in WEIGHTS})
    begun = np.array([*(states[:3] * unit), *states[3:]])
    given = heavier, begun, (exact[0].astype(float) - 1e-3) / float(unit)
    late = 2.0**-400 / float(unit)
    times, there, left = at_crossings(*given, late=late, **by("taylor", 424, jobs=2))
    assert np.abs(left).max() < late
    assert np.abs(times * unit - exact[0]).max() < Fraction(2) ** -395
    assert np.abs(there[:3] / unit - exact[1][:3]).max() < Fraction(2) ** -395
    assert np.abs(there[3:] - exact[1][3:]).max() < Fraction(2) ** -395
    ended, went_on, again = (
        at_crossings(*given, late=x, **by("taylor", 424)) for x in (1.1 * off, 0.9 * off, late)
    )
    assert ended[2] == pytest.approx(off, rel=1e-2)
    assert np.abs(went_on[2]).max() < off / 100
    assert (again[0] == times).all()
    assert (again[1] == there).all()


def test_engine_scipy_computes_in_integers(monkeypatch: pytest.MonkeyPatch) -> None:
    # The kernel alone takes numbers in parts.
    monkeypatch.setattr(states, "in_parts", None)
    assert first("scipy", 80) is not None
    with pytest.raises(TypeError):
        first("taylor", 80)


def test_a_step_in_integers_along_a_steady_rotation_is_one_long() -> None:
    """Where series end in zeros a longer step loses digits, and a shorter one is not needed."""
    c = AlignedCoefficients(*map(fraction, aligned_coefficients(FREE.angles(200), context(150))))
    rotation = [Fraction(x) for x in (0, 0, "6/5", 0, 0, 1)]
    step = next(bigint.steps(c, rotation, 150))
    assert 1 - 2.0 ** (1 - bigint.LENGTH_BITS) <= step.length / 2.0**step.P <= 1
