"""Engine `taylor`: lanes that take one orbit after another."""

from __future__ import annotations

import threading
from typing import Any

import numpy as np
import pytest

from rigidpend.orbits.integrate import Crossings, Outcome, batch
from rigidpend.orbits.integrate.kernel import taylor_step
from rigidpend.orbits.integrate.kernel.writer import LANES
from rigidpend.orbits.integrate.roots import touch
from tests.orbits.integrate.problems import (
    FIG4,
    FREE,
    GENERIC,
    fan,
    find,
    same,
    task,
)


@pytest.mark.parametrize("n", ["one", "fewer", "as many", "more", "many more"])
def test_batch_finds_each_orbit_whatever_the_company(n: str) -> None:
    """Fewer orbits than lanes, and numbers of orbits that the width does not divide."""
    sizes = {"one": 1, "fewer": LANES - 1, "as many": LANES, "more": LANES + 1}
    states = fan(max(1, sizes.get(n, 5 * LANES + 3)))
    found = find(states, "taylor")
    assert found.outcome.tolist() == [Outcome.COMPLETE] * states.shape[1]
    for k in range(0, states.shape[1], 5):
        alone = find(states[:, k : k + 1], "taylor", 64)
        np.testing.assert_allclose(found.time[:, k], alone.time[:, 0], rtol=0, atol=1e-11)
        np.testing.assert_array_equal(found.separatrix[:, k], alone.separatrix[:, 0])


@pytest.mark.parametrize("bits", [53, 64, 113])
def test_runs_keep_nothing_of_the_run_before(bits: int) -> None:
    first = find(fan(2), "taylor", bits)
    find(fan(3, GENERIC), "taylor", bits, body=GENERIC, n_crossings=2)
    find(fan(1, FREE), "taylor", bits, body=FREE, passage_limit=20)
    assert same(find(fan(2), "taylor", bits), first)


@pytest.mark.parametrize("bits", [53, 113])
def test_outcome_out_of_steps_is_failed(bits: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(batch, "MAX_STEPS", 3)
    found = find(fan(3), "taylor", bits)
    assert found.outcome.tolist() == [Outcome.FAILED] * 3
    assert np.isnan(found.time).all()
    monkeypatch.undo()
    assert find(fan(3), "taylor", bits).outcome.tolist() == [Outcome.COMPLETE] * 3


@pytest.mark.parametrize("bits", [53, 106, 212])
def test_steps_are_noted_to_twice_the_depth_of_a_touch_of_the_largest_orbit(bits: int) -> None:
    """So that none is missed which `passages` would not decide, though |M| grows on the way."""
    states = fan(11) * np.geomspace(3, 1, 11)
    run = batch.Batch(task(states, bits), bits, 2.0 ** (1 - bits))
    run.load()
    depths = []

    def kernel(*given: Any) -> int:
        depths.append(given[4])
        return 0

    run.kernel = kernel
    run.carried(8)
    largest = np.linalg.norm(states[:3], axis=0).max()
    assert depths == [pytest.approx(2 * touch(bits) * largest, rel=1e-12)]


@pytest.mark.parametrize("bits", [53, 106, 212])
def test_an_orbit_makes_room_for_the_next(bits: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """Three times as many as are carried at a time, which end after different numbers of steps."""
    states = np.concatenate([fan(8, J1=J1) for J1 in (1e-4, 1e-2, 1e-6)], axis=1)
    whole = find(states, "taylor", bits, n_crossings=2)
    assert whole.outcome.tolist() == [Outcome.COMPLETE] * 24
    monkeypatch.setattr(batch, "TOGETHER", {bits: 8})
    monkeypatch.setattr(batch, "STEPS", {bits: 8})
    assert same(find(states, "taylor", bits, n_crossings=2), whole)


@pytest.mark.parametrize(("bits", "expected"), [(53, 2.0**-40), (106, 2.0**-93), (160, 2.0**-147)])
def test_every_bit_halves_the_tolerance(
    bits: int, expected: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked: list[float] = []
    order_of = taylor_step.order_of

    def noted(tolerance: float) -> int:
        asked.append(tolerance)
        return order_of(tolerance)

    monkeypatch.setattr(taylor_step, "order_of", noted)
    find(fan(1), "taylor", bits, tolerance=2.0**-40, n_crossings=1)
    assert set(asked) == {expected}


def test_threads_that_call_at_once_get_the_results_of_one() -> None:
    alone = {body: find(fan(9, body), "taylor", body=body) for body in (FIG4, GENERIC)}
    found: list[tuple[object, Crossings]] = []

    def call(body: object) -> None:
        for _ in range(5):
            found.append((body, find(fan(9, body), "taylor", body=body)))  # type: ignore[arg-type]

    threads = [threading.Thread(target=call, args=[body]) for body in (FIG4, GENERIC) * 2]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(found) == 20
    assert all(same(record, alone[body]) for body, record in found)  # type: ignore[index]


def test_order_a_coarser_tolerance_errs_more() -> None:
    truth = find(fan(2), "taylor", 64).time
    errors = [
        float(np.abs(find(fan(2), "taylor", tolerance=tolerance).time - truth).max())
        for tolerance in (1e-4, 1e-8, 1e-13)
    ]
    assert errors[0] > 10 * errors[1] > 100 * errors[2]
    assert errors[2] < 1e-11
