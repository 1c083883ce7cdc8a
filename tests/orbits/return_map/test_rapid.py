"""Rapid passages against those in full, by the kernel and by arrays, in doubles and in pairs."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from rigidpend.machine.signals import Stopped
from rigidpend.orbits.integrate.kernel.writer import LANES
from rigidpend.orbits.return_map import (
    ReturnMap,
    SectionPoint,
    kernel,
    return_map,
)
from rigidpend.orbits.return_map.charts import at_energies, look_up
from rigidpend.orbits.return_map.itinerary import enter, follow
from rigidpend.orbits.return_map.precision import in_pairs, precision
from rigidpend.orbits.return_map.rapid import Rapid
from rigidpend.orbits.return_map.terms import evaluated, nested, significant
from tests.orbits.integrate.problems import FIG4, GENERIC

ENERGIES = ("1.3332", "1.3352")
N = 200
LEAST, MOST = 1e-5, 3e-4
BITS = [53, 64]


@pytest.fixture(scope="module", params=[FIG4, GENERIC], ids=["Fig. 4", "generic"])
def made(request: pytest.FixtureRequest) -> ReturnMap:
    return return_map(request.param, h=ENERGIES, bits=64 if in_pairs(64) else 53)


def points(made: ReturnMap, rising: bool) -> tuple[Any, Any, Any]:
    random = np.random.default_rng(3 + rising)
    width = float(made.charts[rising].forward.width)
    return (
        random.uniform(-width / 3, width / 3, N),
        random.uniform(0, 6.28, N),
        random.uniform(-1, 1, N),
    )


def energy(made: ReturnMap, e: Any) -> Any:
    within = made.normal_form.energies
    return within.centre + within.half_width * precision(made.bits).array(e)


def started(made: ReturnMap, bits: int, least: float = LEAST, most: float = MOST) -> Rapid:
    a = precision(made.bits)
    return made.rapid(bits, a.number(least), a.number(most))


@pytest.mark.slow
@pytest.mark.parametrize("rising", [True, False])
@pytest.mark.parametrize("bits", BITS)
def test_agrees_a_rapid_passage_with_the_full_one(made: ReturnMap, rising: bool, bits: int) -> None:
    d, chi, e = points(made, rising)
    fast = started(made, bits)
    found, inside = fast.passage(rising, fast.a.array(np.stack((d, chi, e))))
    a = precision(made.bits)
    point = SectionPoint(rising, a.array(d), a.array(chi))
    full = made.at(energy(made, e)).passage(point, backward=not rising, slopes=True)
    both = inside & full.inside
    assert both.mean() > 0.9
    assert (inside == full.inside).mean() > 0.99
    assert ((found[3] > 0) == (full.symbol == 1))[both].all()
    grown = (1 + np.abs(a.floats(full.slopes)).max(axis=(0, 1))) * 2.0**-bits
    late = np.abs(found[2] - full.time).astype(float)
    turned = np.abs(np.exp(1j * (found[1] - full.point.chi).astype(float)) - 1)
    apart = np.abs(found[0] - full.point.d).astype(float)
    assert (late < 300 * grown)[both].all()
    # Whole turns are taken from angles in doubles here.
    assert (turned < 100 * grown + 4e-15)[both].all()
    assert (apart < 10 * grown)[both].all()


@pytest.mark.parametrize("bits", BITS)
def test_agrees_rapid_itineraries_with_full_ones(made: ReturnMap, bits: int) -> None:
    random, a, fast = np.random.default_rng(9), precision(made.bits), started(made, bits)
    phase, e = random.uniform(0, 6.28, N), random.uniform(-1, 1, N)
    Qp = 1.3e-4
    found = fast.follow(fast.a.array(Qp + 0 * phase), fast.a.array(phase), fast.a.array(e), 4)
    level = made.at(energy(made, e))
    full = follow(level, enter(level, a.number(Qp), a.array(phase)), 4)
    both = (found.separatrix != 0).all(axis=0) & full.inside.all(axis=0)
    assert both.mean() > 0.95
    assert (found.separatrix == full.separatrix)[:, both].all()
    late = np.abs(found.time - full.time.astype(float))[:, both]
    assert np.quantile(late[0], 1) < 1e-13
    assert np.quantile(late[-1], 0.9) < 1e-9


def test_agrees_starts_of_an_interval_with_those_of_a_point(made: ReturnMap) -> None:
    wide, narrow = started(made, 53), started(made, 53, 2e-4, 2e-4)
    phase = np.linspace(0, 6, N)
    rows = (np.full(N, 2e-4), phase, 0.3 + 0 * phase)
    for one, other in zip(wide.enter(*rows), narrow.enter(*rows), strict=True):
        np.testing.assert_allclose(one.astype(float), other.astype(float), rtol=0, atol=2e-13)


@pytest.mark.parametrize("bits", [53, 64])
@pytest.mark.parametrize("ends", [(LEAST, MOST), (1.3e-4, 1.3e-4)], ids=["interval", "point"])
def test_agrees_the_kernel_with_arrays(
    made: ReturnMap, bits: int, ends: tuple[float, float]
) -> None:
    random, fast = np.random.default_rng(8), started(made, bits, *ends)
    # Not a multiple of the lanes, and one orbit alone must not hang on its neighbours.
    n = 83
    phase, e = (fast.a.array(x) for x in (random.uniform(0, 6.28, n), random.uniform(-1, 1, n)))
    Qp = fast.a.array(np.full(n, 1.3e-4))
    compiled, arrays = (way(Qp, phase, e, 6) for way in (fast.follow, fast.interpreted))
    alone = fast.follow(Qp[4:5], phase[4:5], e[4:5], 6)
    assert np.array_equal(alone.time[:, 0], compiled.time[:, 4])
    assert bits > 53 or not np.array_equal(compiled.time[-1], arrays.time[-1]), "the same code"
    assert (compiled.separatrix == arrays.separatrix).all()
    late = np.abs(compiled.time - arrays.time)
    # Doubles store times of 10 with roundings of 2e-15; each passage makes errors grow tenfold.
    assert np.nanmax(late[0]) < 3e-14
    assert np.nanquantile(late[-1], 0.8) < (1e-9 if bits == 53 else 1e-12)


def test_the_kernel_tells_orbits_beyond_the_tables(made: ReturnMap) -> None:
    fast = started(made, 53)
    inside = np.full(3, 1.3e-4)
    phase, e = np.array([1.0, 2.0, 3.0]), np.array([0.0, 1e6, 0.0])
    with np.errstate(over="ignore", invalid="ignore"):
        found, arrays = (way(inside, phase, e, 3) for way in (fast.follow, fast.interpreted))
    assert (found.separatrix == arrays.separatrix).all()
    assert (found.separatrix[-1] == 0).tolist() == [False, True, False]
    assert np.isnan(found.time[-1]).tolist() == [False, True, False]


@pytest.mark.parametrize("which", [0, 1])
def test_order_what_is_left_out_of_a_table_is_below_its_threshold(
    made: ReturnMap, which: int
) -> None:
    table, (d, chi, e) = made.charts[1][which], points(made, True)
    a = precision(made.bits)
    x = d / np.abs(d).max() * float(table.width)
    weights = made.normal_form.energies.basis(energy(made, e), a)
    full = look_up(table, at_energies(table, weights), a.array(x), a.array(chi), a)[:3]
    kept = significant(table, 2.0**-40)
    few = np.stack(evaluated(kept, nested(kept), a.array(x), a.array(chi), a.array(e), np))
    scale = np.abs(table.values.astype(float)).max(axis=(0, 1))[:3, None]
    off = (np.abs(few - full) / scale).astype(float).max()
    assert 2.0**-46 < off < 2.0**-36
    assert (kept.values != 0).sum() < 0.3 * kept.values.size


def test_orbits_beyond_the_tables_are_told(made: ReturnMap) -> None:
    fast = started(made, 53)
    width = float(made.charts[1].forward.width)
    rows = np.array([[0.1 * width, 1.1 * width, 30 * width], [1.0, 1.0, 1.0], [0.0, 0.0, 0.0]])
    assert fast.passage(True, rows)[1].tolist() == [True, False, False]


@pytest.mark.parametrize("bits", BITS)
def test_the_kernel_follows_in_pieces_between_which_it_may_be_stopped(
    made: ReturnMap, bits: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    random, fast, asked = np.random.default_rng(11), started(made, bits), [0]
    phase, e = (fast.a.array(x) for x in (random.uniform(0, 6.28, 20), random.uniform(-1, 1, 20)))
    given = fast.a.array(2e-4 + 0 * phase), phase, e, 6
    whole = fast.follow(*given)

    def count(most: int) -> None:
        asked[0] += 1
        if asked[0] == most:
            raise Stopped

    monkeypatch.setattr(kernel, "AT_ONCE", 2 * LANES)
    monkeypatch.setattr(kernel, "check_stop", lambda: count(0))
    for one, other in zip(fast.follow(*given), whole, strict=True):
        np.testing.assert_array_equal(one, other)
    # Three groups of orbits, each two crossings at a time.
    assert asked == [12]
    monkeypatch.setattr(kernel, "check_stop", lambda: count(14))
    with pytest.raises(Stopped):
        fast.follow(*given)
