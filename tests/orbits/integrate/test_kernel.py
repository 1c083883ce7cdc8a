"""The kernel: its arithmetic, its notes, and the machine code on disk."""

from __future__ import annotations

import ctypes
import platform
import time
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from rigidpend.machine import cache
from rigidpend.machine.kept import KeptFileWarning
from rigidpend.machine.workers import side_by_side
from rigidpend.mechanics.equations import AlignedCoefficients, aligned
from rigidpend.orbits.integrate import bigint
from rigidpend.orbits.integrate.kernel import machine_code, taylor_step
from rigidpend.orbits.integrate.kernel.lane_numbers import KINDS
from rigidpend.orbits.integrate.kernel.notes import FIELDS, function, width_of_note
from rigidpend.orbits.integrate.kernel.parts import in_parts
from rigidpend.orbits.integrate.kernel.writer import LANES, Writer
from rigidpend.orbits.integrate.states import states_at
from tests.orbits.integrate.problems import fan, find

C = AlignedCoefficients(
    *(Fraction(x) for x in ("0.43", "0.03", "0.04", "0.55", "0.07", "0.06", "0.3", "0.9", "0.8"))
)
STATE = [Fraction(x) for x in ("0.7", "-0.4", "0.2", "0.36", "0.48", "0.8")]


def stepped(bits: int, order: int, steps_taken: int) -> tuple[list[Fraction], Fraction, Any]:
    """State and time after some steps of one orbit, and the notes."""
    parts = KINDS[bits].parts
    state = np.repeat(in_parts(STATE, bits).reshape(6 * parts, 1), LANES, axis=1)
    time = np.zeros((2, LANES))
    parameters = in_parts(C, bits)
    notes = np.zeros((LANES * steps_taken, width_of_note(order, bits)))
    count = function(order, bits)(
        state.ctypes.data,
        LANES,
        time.ctypes.data,
        parameters.ctypes.data,
        1e-5,
        1,
        steps_taken,
        notes.ctypes.data,
    )
    end = [sum(map(Fraction, state[i::6, 0].tolist()), Fraction(0)) for i in range(6)]
    return end, Fraction(time[0, 0]) + Fraction(time[1, 0]), notes[:count]


def by_integers(time: Fraction, bits: int = 500) -> list[Fraction]:
    """The state of the same orbit at a time, in integers of 500 bits."""
    for step in bigint.steps(C, STATE, bits):
        if step.since_begin(time) <= step.length:
            return list(step.at(step.since_begin(time)))
    raise AssertionError


@pytest.mark.parametrize(
    ("bits", "order", "finest"),
    [(53, 20, 2.0**-50), (106, 36, 2.0**-99), (212, 72, 2.0**-205), (424, 146, 2.0**-410)],
)
def test_steps_err_by_rounding_alone(bits: int, order: int, finest: float) -> None:
    """A slip in a single recurrence, or a part of a pair that is lost, is seen here."""
    end, time, _ = stepped(bits, order, 8)
    assert 2 < time < 20
    error = max(abs(a - b) for a, b in zip(end, by_integers(time), strict=True))
    # Eight steps, each of which rounds and lets earlier errors grow a little.
    assert error < 8 * Fraction(finest)


def test_a_lower_order_takes_shorter_steps_and_errs_as_its_tolerance_says() -> None:
    tolerance = 1e-8
    order = taylor_step.order_of(tolerance)
    assert order == 11
    end, time, _ = stepped(53, order, 8)
    error = max(abs(a - b) for a, b in zip(end, by_integers(time), strict=True))
    assert 1e-13 < error < 8 * tolerance


def test_notes_hold_the_series_of_every_step_on_which_M3_changes_its_sign() -> None:
    _, _, notes = stepped(53, 20, 60)
    fields = dict(zip(FIELDS, notes.T, strict=False))
    mine = fields["lane"] == 0
    series = notes[mine][:, len(FIELDS) :].reshape(mine.sum(), 3, 21)
    changed = (series[:, 2, 0] < 0) != (fields["after"][mine] < 0)
    assert changed.sum() >= 3
    for k in np.flatnonzero(changed & (fields["steady"][mine] > 0)):
        at, h = fields["zero"][mine][k], fields["length"][mine][k]
        powers = at ** np.arange(21)
        assert 0 <= at <= h
        np.testing.assert_allclose(
            series[k] @ powers, [fields["Qp"][mine][k], fields["Qm"][mine][k], 0], atol=1e-14
        )
    rate = aligned([float(x) for x in STATE], AlignedCoefficients(*map(float, C)))
    first = notes[0, len(FIELDS) :].reshape(3, 21)
    if fields["time"][0] == 0:
        np.testing.assert_allclose(first[:, 1], rate[:3], rtol=1e-14)


@pytest.mark.parametrize("bits", [53, 106, 212])
def test_an_orbit_comes_out_the_same_in_any_company(bits: int) -> None:
    together = find(fan(19), "taylor", bits)
    for k in (0, 7, 18):
        alone = find(_one(fan(19), k), "taylor", bits)
        np.testing.assert_array_equal(alone.time[:, 0], together.time[:, k])


def _one(states: Any, k: int) -> Any:
    if isinstance(states, list):
        return [states[k]]
    return np.asarray(states)[:, k : k + 1]


def test_parts_of_a_number_add_up_to_it() -> None:
    third = Fraction(1, 3)
    high, low = in_parts([third], 106)[:, 0].tolist()
    assert high == 1 / 3
    assert abs(Fraction(high) + Fraction(low) - third) < Fraction(2) ** -107


def identity() -> str:
    code = Writer()
    return f"define i64 @same(i64 %x) {{\n  ret i64 %x\n}}\n; {code.vector}\n"


def test_machine_code_is_kept_and_a_damaged_file_made_anew(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(machine_code, "folder", lambda: tmp_path / "kernels")
    made: list[str] = []
    compiled = machine_code.compiled

    def counted(llvm: Any, machine: Any, text: str) -> bytes:
        made.append(text)
        time.sleep(0.01)
        return compiled(llvm, machine, text)

    monkeypatch.setattr(machine_code, "compiled", counted)

    def fresh() -> int:
        machine_code.ready.cache_clear()
        return int(machine_code.function(identity(), "same", ctypes.c_int64)(41))

    # Threads that ask for the same code wait for the one that makes it.
    machine_code.ready.cache_clear()
    text = identity()
    both = side_by_side(
        machine_code.function, ("same", ctypes.c_int64), False, [text, text], jobs=2
    )
    assert [int(f(41)) for f in both] == [41, 41]
    assert len(made) == 1
    assert fresh() == 41
    assert len(made) == 1, "the second time it was read"
    [file] = (tmp_path / "kernels").iterdir()
    whole = file.read_bytes()
    for place in (3, len(whole) // 2, len(whole) - 1):
        spoilt = bytearray(whole)
        spoilt[place] ^= 16
        file.write_bytes(spoilt)
        before = len(made)
        with pytest.warns(KeptFileWarning, match=str(tmp_path)):
            assert fresh() == 41
        assert len(made) == before + 1
        assert file.read_bytes() == whole, "and the file is mended"
    file.write_bytes(whole[:-7])
    with pytest.warns(KeptFileWarning):
        assert fresh() == 41
    machine_code.ready.cache_clear()


def test_a_folder_that_cannot_be_written_costs_no_more_than_a_compilation(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    blocked = tmp_path / "file"
    blocked.write_text("")
    monkeypatch.setattr(machine_code, "folder", lambda: blocked / "kernels")
    machine_code.ready.cache_clear()
    cache.tell_once.cache_clear()
    with pytest.warns(KeptFileWarning, match="nothing can be kept"):
        assert machine_code.function(identity(), "same", ctypes.c_int64)(7) == 7
    machine_code.ready.cache_clear()


@pytest.mark.parametrize("sense", [1, -1])
def test_samples_are_those_of_integers_and_of_nobody_elses_lane(sense: int) -> None:
    c = AlignedCoefficients(*map(float, C))
    states = np.array([[float(x) * (1 + 0.01 * k) for k in range(11)] for x in STATE])
    times = sense * np.array([0.0, 1e-3, 0.2, 0.3, 5.0, 9.5])
    found = states_at(c, states, times, engine="taylor")
    alone = states_at(c, states[:, 9:10], times, engine="taylor")
    np.testing.assert_array_equal(found[..., 9:10], alone)
    np.testing.assert_array_equal(found[:, 0], states)
    if sense > 0:
        for k in (2, 5):
            truth = [float(x) for x in by_integers(Fraction(times[k]))]
            np.testing.assert_allclose(found[:, k, 0], truth, rtol=0, atol=1e-14)
    back = states_at(c, found[:, -1], times[::-1] - times[-1], engine="taylor")
    np.testing.assert_allclose(back[:, -1], states, rtol=0, atol=1e-13)


@pytest.mark.slow
@pytest.mark.parametrize("bits", [53, 106, 212])
def test_every_processor_computes_the_same_bits(
    bits: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Compiled for a processor without wide vectors and without fused multiplication."""
    order = taylor_step.order_of(1e-8)
    here = stepped(bits, order, 40)
    monkeypatch.setattr(machine_code, "folder", lambda: tmp_path)
    monkeypatch.setattr(machine_code, "processor", lambda llvm: (plain_processor(), ""))
    for cached in (machine_code.ready, function):
        cached.cache_clear()
    plain = stepped(bits, order, 40)
    for cached in (machine_code.ready, function):
        cached.cache_clear()
    assert plain[:2] == here[:2]
    np.testing.assert_array_equal(plain[2], here[2])


def plain_processor() -> str:
    return "x86-64" if platform.machine() in ("x86_64", "AMD64") else "generic"
