"""heyoka against the kernel: other equations of the same routes, and 113 bits of the same field."""

import functools
import pickle
from fractions import Fraction
from typing import Any

import numpy as np
import pytest

from rigidpend.experiments import principal_axes
from rigidpend.experiments.principal_axes import heyoka, typed, working_type
from rigidpend.mechanics.equations import AlignedCoefficients, aligned
from rigidpend.numbers.exact import exact
from rigidpend.orbits.integrate.states import states_at
from rigidpend.routes.codes import route_codes
from rigidpend.routes.problem import RouteProblem
from tests.orbits.integrate.problems import FIG4, GENERIC, fan, needs_heyoka, task
from tests.routes.reference import fig4_left


@pytest.mark.slow
@needs_heyoka("orbits in principal axes")
@pytest.mark.parametrize("bits", [53, 113])
def test_agrees_the_left_array_of_fig_4(bits: int) -> None:
    phases = [exact(f"{k}/10") for k in (1, 17, 40)]
    problem = RouteProblem(FIG4, exact("1.3342"), exact("1e-8"), 6)
    expected = fig4_left().codes[:6, [1, 17, 40]]
    assert np.array_equal(principal_axes.codes(problem, phases, bits=bits, jobs=1), expected)


@pytest.mark.slow
@needs_heyoka("orbits in principal axes")
def test_agrees_another_body_and_the_jobs_change_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    phases: Any = np.array([0.3, 1.9, 4.4])
    problem = RouteProblem(GENERIC, exact("1.3"), exact("1e-3"), 4)
    expected = route_codes(GENERIC, phases, h0="1.3", J1_0="1e-3", n_symbols=4).codes
    # Processes would take a second each to begin; what they are given they can be sent.
    monkeypatch.setattr(
        principal_axes,
        "side_by_side",
        lambda work, given, _, parts, jobs: [
            pickle.loads(pickle.dumps(work))(*pickle.loads(pickle.dumps((part, *given))))
            for part in parts
        ],
    )
    for jobs in (1, 2):
        found = principal_axes.codes(problem, phases, bits=53, jobs=jobs)
        assert np.array_equal(found, expected)


@needs_heyoka("orbits in principal axes")
def test_where_an_orbit_does_not_cross_in_time_there_is_no_symbol(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    problem = RouteProblem(FIG4, exact("1.3"), exact("1e-3"), 2)
    monkeypatch.setattr(principal_axes, "passage_limit", lambda *_: 1.0)
    assert principal_axes.codes(problem, [0.3], bits=53, jobs=1).tolist() == [[255], [255]]


def test_a_crossing_lies_beside_the_nearest_separatrix_modulo_4_pi() -> None:
    places = np.array([-1.0, 1.0, 5.0, 7.0])
    theta1 = np.array([[1.2, -1.4, np.nan], [4 * np.pi + 6.8, 5.1 - 4 * np.pi, 4 * np.pi - 1.2]])
    assert principal_axes.beside(theta1, places).tolist() == [[2, 1, 0], [4, 3, 1]]


ORBIT = task(fan(1, GENERIC, J1=1e-8), 113, body=GENERIC)
TIMES = [Fraction(1, 2), Fraction(10), Fraction(30)]


def exactly(x: Any) -> Fraction:
    """The value of a number of such a type, as the sum of doubles that it is."""
    head = float(x)
    return Fraction(head) + (exactly(x - type(x)(head)) if head else 0)


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


@needs_heyoka("it is compared with")
@pytest.mark.slow
@pytest.mark.parametrize("bits", [113, 212, 224])
def test_fours_of_doubles_and_integers_agree_with_real128(bits: int) -> None:
    if not working_type(113):
        pytest.skip("no real128 here")
    found = states_at(ORBIT.coefficients, ORBIT.states, TIMES, bits)[..., 0].T
    off = np.abs(found - by_heyoka())
    # Some sixty steps each round to 2^-113; a passage lets errors grow some hundredfold.
    assert off.max() < Fraction(2) ** -100
    assert off[0].max() < Fraction(2) ** -110


@needs_heyoka("it is compared with")
@pytest.mark.parametrize("bits", [64, 113])
def test_numbers_of_its_types_are_given_to_their_last_bit(bits: int) -> None:
    if not working_type(bits):
        pytest.skip(f"no type of {bits} bits here")
    made, whole = working_type(bits), 1 + Fraction(1, 2**55) + Fraction(1, 2 ** (bits - 1))
    found = typed(whole, made)
    # Taken away again exactly, what is left is the last bit.
    assert float(found - made(1) - made(2.0**-55)) == 2.0 ** (1 - bits)
    assert exactly(found) == whole


@needs_heyoka("it is compared with")
def test_its_own_cache_which_checks_nothing_is_off() -> None:
    assert not heyoka().llvm_state.get_diskcache_enabled()
