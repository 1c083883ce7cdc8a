"""Orbits at given times: tolerance, direction of time, agreement of the engines."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from scipy.special import ellipj, ellipk

from rigidpend import Body
from rigidpend.mechanics.equations import aligned, aligned_coefficients
from rigidpend.orbits.integrate import ends, sample, sample_orbits
from rigidpend.orbits.integrate.kernel import machine_code, samples
from rigidpend.orbits.integrate.kernel.writer import FEW, LANES
from tests.orbits.integrate.problems import (
    ENGINES,
    FIG4,
    GENERIC,
    fan,
    on_separatrix,
)

K2 = 0.9
TIMES = np.linspace(0, 4 * ellipk(K2), 30)
TOLERANCES = (1e-4, 1e-6, 1e-8, 1e-10, 1e-12)


def rotor(state: Any, m: Any) -> tuple[Any, Any]:
    """x = 2 am(t, k): x'' = -k^2 sin(x), whose exact solution SciPy knows."""
    return state[1], -K2 * m.sin(state[0])


def error(engine: str, tolerance: float | None) -> float:
    _, _, dn, amplitude = ellipj(TIMES, K2)
    found = sample(rotor, [0.0, 2.0], TIMES, engine=engine, tolerance=tolerance)
    return float(np.abs(found - [2 * amplitude, 2 * dn]).max())


@pytest.mark.parametrize("engine", ENGINES)
def test_order_error_follows_the_tolerance(engine: str) -> None:
    errors = [error(engine, tolerance) for tolerance in TOLERANCES]
    for tolerance, found in zip(TOLERANCES, errors, strict=True):
        assert found < 200 * tolerance
    # A hundredth of the tolerance leaves at most a tenth of the error; a coarse one shows.
    assert all(finer < coarser / 10 for coarser, finer in pairwise(errors))
    assert errors[0] > 1e-7


@pytest.mark.parametrize("engine", ENGINES)
def test_order_default_tolerance_is_the_finest(engine: str) -> None:
    assert error(engine, None) < {"taylor": 1e-13, "scipy": 5e-12}[engine]


@pytest.mark.parametrize("engine", ENGINES)
def test_invariant_return_in_time_gives_the_start_again(engine: str) -> None:
    numbers = aligned_coefficients(GENERIC.angles(), math)
    begin = on_separatrix(2, GENERIC, 0.2, 1.0)
    field: Any = lambda state, m: aligned(state, numbers)  # noqa: E731
    there = sample(field, begin, np.linspace(2, 9, 5), engine=engine)
    back = sample(field, there[:, -1], np.linspace(9, 2, 5), engine=engine)
    assert there.shape == back.shape == (6, 5)
    np.testing.assert_array_equal(there[:, 0], begin)
    np.testing.assert_allclose(back, there[:, ::-1], rtol=0, atol=1e-10)


def test_agrees_engines_on_an_arc_through_all_components() -> None:
    numbers = aligned_coefficients(GENERIC.angles(), math)
    begin = np.array([0.5, 0.2, -0.4, 0.48, 0.6, 0.64])
    times = np.linspace(0, 12, 25)
    taylor, scipy = (
        sample(lambda state, m: aligned(state, numbers), begin, times, engine=engine)
        for engine in ("taylor", "scipy")
    )
    np.testing.assert_allclose(taylor, scipy, rtol=0, atol=2e-11)


@pytest.mark.parametrize("engine", ENGINES)
def test_refuses_to_pass_a_singularity(engine: str) -> None:
    """x' = x^2 from x = 1 ends at t = 1; the second equation keeps the field plural."""
    with pytest.raises(ArithmeticError, match="ended early"):
        sample(lambda x, m: (x[0] * x[0], x[0]), [1.0, 0.0], [0.0, 0.5, 2.0], engine=engine)


@pytest.mark.slow
@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("n", [1, 3, 19])
def test_agrees_orbits_side_by_side_with_each_alone(n: int, engine: str) -> None:
    """More orbits than lanes and fewer; upwards and downwards in time."""
    numbers = aligned_coefficients(GENERIC.angles(), math)
    begin = fan(n, GENERIC, J1=0.1)
    for times in (np.linspace(1, 9, 5), np.linspace(9, 1, 5)):
        together = sample_orbits(numbers, begin, times, engine=engine)
        assert together.shape == (6, 5, n)
        np.testing.assert_array_equal(together[:, 0], begin)
        for k in {0, n // 2, n - 1}:
            alone = sample(lambda x, m: aligned(x, numbers), begin[:, k], times, engine="scipy")
            np.testing.assert_allclose(together[..., k], alone, rtol=0, atol=1e-9)


@pytest.mark.parametrize("engine", ENGINES)
def test_orbits_side_by_side_keep_nothing_of_the_body_before(engine: str) -> None:
    times = np.linspace(0, 5, 3)

    def run(body: Body) -> Any:
        return sample_orbits(
            aligned_coefficients(body.angles(), math), fan(2), times, engine=engine
        )

    first, other, again = run(GENERIC), run(FIG4), run(GENERIC)
    np.testing.assert_array_equal(first, again)
    assert np.abs(first - other).max() > 1e-3


@pytest.mark.parametrize("engine", ENGINES)
def test_order_orbits_side_by_side_err_more_by_a_coarser_tolerance(engine: str) -> None:
    numbers = aligned_coefficients(GENERIC.angles(), math)
    truth, fine, coarse = (
        sample_orbits(numbers, fan(3), [0.0, 9.0], engine=engine, tolerance=tolerance)
        for tolerance in (None, 1e-9, 1e-4)
    )
    assert np.abs(coarse - truth).max() > 10 * np.abs(fine - truth).max() > 0


@pytest.mark.parametrize("engine", ENGINES)
def test_two_times_end_as_a_grid_does(engine: str) -> None:
    """Without a grid the end is a step's; in one it comes from inside a step."""
    numbers = aligned_coefficients(GENERIC.angles(), math)
    for times in (np.linspace(1, 9, 5), np.linspace(9, 1, 5)):
        between = sample_orbits(numbers, fan(3), times, engine=engine)
        alone = sample_orbits(numbers, fan(3), times[[0, -1]], engine=engine)
        np.testing.assert_array_equal(alone[:, 0], between[:, 0])
        np.testing.assert_allclose(alone[:, 1], between[:, -1], rtol=0, atol=1e-10)


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("n", [1, 2, 8, 19])
def test_agrees_each_orbit_at_its_end_with_elliptic_functions(n: int, engine: str) -> None:
    times = np.linspace(-2.0, 5.0, n)
    found = ends(rotor, np.repeat([[0.0], [2.0]], n, axis=1), times, engine=engine)
    _, _, dn, amplitude = ellipj(times, K2)
    np.testing.assert_allclose(found, [2 * amplitude, 2 * dn], rtol=0, atol=1e-11)


@pytest.mark.parametrize("engine", ENGINES)
def test_ends_stay_where_no_time_passes_and_follow_the_tolerance(engine: str) -> None:
    begin = np.array([[0.1, 0.3], [2.0, 1.0]])
    found = ends(rotor, begin, [0.0, 3.0], engine=engine)
    np.testing.assert_array_equal(found[:, 0], begin[:, 0])
    coarse = ends(rotor, begin, [0.0, 3.0], engine=engine, tolerance=1e-3)
    assert 1e-9 < np.abs(coarse - found).max() < 1e-1
    assert ends(rotor, np.empty((2, 0)), [], engine=engine).shape == (2, 0)


@pytest.mark.parametrize("engine", ENGINES)
def test_ends_refuse_to_pass_a_singularity(engine: str) -> None:
    with pytest.raises(ArithmeticError):
        ends(lambda x, m: (x[0] * x[0], x[0]), np.ones((2, 1)), [2.0], engine=engine)


def test_fields_that_differ_by_numbers_alone_share_their_code(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    compiled: list[str] = []
    genuine = machine_code.function

    def counted(text: str, *more: Any) -> Any:
        compiled.append(text)
        return genuine(text, *more)

    monkeypatch.setattr(machine_code, "function", counted)

    def grows(rate: float) -> float:
        field: Any = lambda x, m: (rate * x[0] / 2, x[1] + 3 * x[0] * x[1])  # noqa: E731
        return float(sample(field, [1.0, 0.0], [0.0, 1.0], engine="taylor")[0, -1])

    found = [grows(k / 64) for k in range(2, 30)]
    np.testing.assert_allclose(found, np.exp(np.arange(2, 30) / 128), rtol=1e-14)
    assert len(set(compiled)) <= 1


def elementary(state: Any, m: Any) -> list[Any]:
    """Every operation that a field may have, on rates that have closed forms."""
    s, c, e, r, q, p = state
    return [c, 0 - s, e * 1, 1 / (2 * m.sqrt(r * r)), -q * q / 1, 2 * m.exp(-p / 2) - m.cos(0 * s)]


def test_a_field_of_every_operation_agrees_with_its_closed_form() -> None:
    times = np.linspace(0.0, 1.5, 7)
    start = [0.0, 1.0, 1.0, 1.0, 0.5, 0.0]
    found = sample(elementary, start, times, engine="taylor")
    t = times
    # p' = 2 exp(-p/2) - 1: with y = exp(p/2), y' = 1 - y/2.
    exact_p = 2 * np.log(2 - np.exp(-t / 2))
    expected = [np.sin(t), np.cos(t), np.exp(t), np.sqrt(1 + t), 0.5 / (1 + 0.5 * t), exact_p]
    np.testing.assert_allclose(found, expected, rtol=2e-15, atol=2e-15)


def test_whole_powers_of_either_sign_agree_with_their_closed_forms() -> None:
    def powers(state: Any, _: Any) -> list[Any]:
        a, b, c, d = state
        return [a**-2, b**-1, c**0, d**3]

    t = np.linspace(0.0, 0.4, 5)
    found = sample(powers, np.ones(4), t, engine="taylor")
    expected = [np.cbrt(1 + 3 * t), np.sqrt(1 + 2 * t), 1 + t, 1 / np.sqrt(1 - 2 * t)]
    np.testing.assert_allclose(found, expected, rtol=4e-15)


def products(state: Any, m: Any) -> list[Any]:
    """Sines, cosines and quotients of expressions, powers, differences from numbers."""
    x, y, z = state
    return [
        m.sin(x * y) / (1 + z * z) + 0.1 * m.cos(x) ** 2,
        2 - m.exp(-x * x) * m.sqrt(1 + y**2) - (y - 3) / (2 + x * x),
        (x - y) ** 3 / 4 - z / 3 + 1 / (1 + x**2),
    ]


def test_a_field_of_nested_functions_agrees_with_the_other_engine() -> None:
    times = np.linspace(0.0, 3.0, 9)
    taylor, scipy = (sample(products, [0.3, -0.2, 0.5], times, engine=e) for e in ENGINES)
    np.testing.assert_allclose(taylor, scipy, rtol=0, atol=2e-12)
    # The system does not stand still.
    assert np.abs(np.diff(scipy)).min() > 1e-3


def test_a_field_with_another_function_is_refused_by_name() -> None:
    with pytest.raises(AttributeError, match="must do without tan"):
        sample(lambda x, m: (m.tan(x[0]),), [0.1], [0.0, 1.0], engine="taylor")


def test_ends_of_many_orbits_are_those_of_each_alone() -> None:
    """More orbits than lanes, both ways in time, each with an end of its own."""
    n = 21
    begin, until = np.stack((np.linspace(0, 3, n), np.linspace(1, 2, n))), np.linspace(-3, 4, n)
    together = ends(rotor, begin, until, engine="taylor")
    alone = [ends(rotor, begin[:, [k]], until[[k]], engine="taylor")[:, 0] for k in range(n)]
    np.testing.assert_array_equal(together, np.stack(alone, axis=1))


def test_two_orbits_take_narrow_vectors_and_keep_every_bit(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    numbers, times = aligned_coefficients(GENERIC.angles(), math), np.linspace(1, 9, 5)
    taken: list[int] = []
    real = samples.function

    def watched(*given: Any, lanes: int) -> Any:
        taken.append(lanes)
        return real(*given, lanes=lanes)

    monkeypatch.setattr(samples, "function", watched)
    three, two = (sample_orbits(numbers, fan(3)[:, :n], times, engine="taylor") for n in (3, 2))
    assert taken == [LANES, FEW]
    np.testing.assert_array_equal(three[..., :2], two)


@pytest.mark.parametrize("engine", ENGINES)
def test_sample_of_one_time_is_the_start(engine: str) -> None:
    found = sample(lambda x, m: (x[0],), [2.0], [0.5], engine=engine)
    assert found.tolist() == [[2.0]]


@pytest.mark.parametrize("engine", ENGINES)
def test_sample_takes_a_field_of_one_component(engine: str) -> None:
    found = sample(lambda x, m: (x[0],), [1.0], [0.0, 1.0], engine=engine)
    assert found[0, -1] == pytest.approx(math.e, rel=1e-12)


@pytest.mark.parametrize("times", [[], [0.0, 0.0], [0.0, 2.0, 1.0], [[0.0, 1.0]]])
def test_sample_refuses_times_without_a_direction(times: list[float]) -> None:
    with pytest.raises(ValueError, match="ascends or descends"):
        sample(lambda x, m: (x[0],), [1.0], times)


@pytest.mark.parametrize("tolerance", [0, -1e-9, math.nan, math.inf])
def test_no_tolerance_but_one_above_0_is_taken(tolerance: float) -> None:
    state, times = np.array([0.1, 0.2]), np.array([0.0, 1.0])
    said = f"tolerance must be a number above 0, got {tolerance}"
    with pytest.raises(ValueError, match=said):
        sample(rotor, state, times, tolerance=tolerance)
    with pytest.raises(ValueError, match=said):
        ends(rotor, state[:, None], times[1:], tolerance=tolerance)
    with pytest.raises(ValueError, match=said):
        sample_orbits(
            aligned_coefficients(FIG4.angles(), math), np.ones((6, 1)), times, tolerance=tolerance
        )
