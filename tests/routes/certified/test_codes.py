"""Certified codes: against 113 bits, of configs, and where none is proven."""

import os
import random
from concurrent.futures import ThreadPoolExecutor, wait
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from rigidpend import Body, certify_codes, route_codes
from rigidpend.config import catalogue
from rigidpend.config.complaints import ConfigError
from rigidpend.experiments.full_shift import compute as full_shift
from rigidpend.experiments.route_intervals import compute as route_intervals
from rigidpend.numbers.exact import exact
from rigidpend.results import store
from rigidpend.routes.certified import balls, codes, orbit
from rigidpend.routes.certified.orbit import OrbitChecker, enclosed
from rigidpend.routes.certified.proof_data import Step, Undecided
from rigidpend.routes.problem import RouteProblem
from rigidpend.runs import certificates, loading
from tests.bodies import FIG4 as BODY
from tests.bodies import problem
from tests.cli.calls import REFERENCE
from tests.routes.reference import fig4_left


def by_lot(seed: int) -> tuple[Body, list[str], str, str, int]:
    drawn = random.Random(seed)
    A3 = drawn.randrange(105, 195)
    r = drawn.randrange(0, 20), drawn.randrange(1, 20), 0
    body = Body((2, 1, f"{A3}/100"), r, f"{drawn.randrange(1, 100)}e-4")
    J1_0, h0 = f"1e-{drawn.randrange(3, 12)}", f"{drawn.randrange(100, 300)}/100"
    return body, [f"{drawn.random() * 6.28}"], h0, J1_0, 3


PROVEN = [
    (BODY, ["1/10", "3*pi/40 + 1/100", "47/10"], "1.3342", "1e-8", 3),
    # A column of Fig. 4, left, one of the hardest: 8 symbols of its 15.
    (BODY, ["33/10"], "1.3342", "1e-8", 8),
    (BODY, ["5/4"], "1.3342", "1.4", 2),
    (Body((2, 1, "3/2"), (1, 1, 0), "1e-9"), ["5/4"], "1.3342e-6", "1e-11", 2),
    (Body((2, "3/2", "9/5"), (0, 1, 0), "0.01"), ["5/4"], "10/9", "2.39205e-9", 2),
    (Body((3, 1, "5/2"), (3, 1, 0), "0.05"), ["5/4"], "2", "1e-3", 2),
    # Too thin and heavy for steps as long as those of other bodies.
    (Body((1, "1/100", "199/200"), (2, 1, 0), "1/3"), ["3/10"], "1", "1e-3", 3),
    *map(by_lot, range(2)),
]


@pytest.mark.slow
@pytest.mark.parametrize(("body", "phases", "h0", "J1_0", "n"), PROVEN)
def test_proven_enclose_113_bits(body: Body, phases: list[str], h0: str, J1_0: str, n: int) -> None:
    found = certify_codes(body, phases, h0=h0, J1_0=J1_0, n_symbols=n)
    finer = route_codes(body, phases, h0=h0, J1_0=J1_0, n_symbols=n, precisions=(113,))
    assert found.proven.all()
    assert (found.status, found.reason) == (["proven"] * len(phases), [""] * len(phases))
    assert np.array_equal(found.codes, finer.codes)
    assert np.array_equal(found.separatrix, finer.separatrix)
    # Both are rounded to doubles once or twice; late ones of 113 bits are known to 1e-6.
    off, known = np.abs(found.crossing_time - finer.crossing_time), finer.crossing_time
    assert (off - found.time_radius <= (2 * np.spacing(known) if n < 8 else 1e-6)).all()
    assert found.time_radius.max() < 1e-2
    assert found.bound.max() < 2**-6
    assert found.theta2_0.tolist() == finer.theta2_0.tolist()


def test_the_radius_of_a_time_holds_what_a_double_of_it_rounds() -> None:
    """With many bits nothing else is as large; these two are off by a seventh of one and more."""
    found = certify_codes(BODY, "3/10", h0="1.3342", J1_0="1e-8", n_symbols=1, bits=150)
    assert (found.time_radius > 2.0**-56 * found.crossing_time).all()
    assert (found.time_radius < 2.0**-52 * found.crossing_time).all()


def test_too_few_bits_are_undecided_and_no_code_is_wrong() -> None:
    found = certify_codes(BODY, "3/10", h0="1.3342", J1_0="1e-8", n_symbols=15, bits=50)
    known = fig4_left()
    column = known.theta2_0.index("0.3")
    proven = found.proven[:, 0]
    assert found.status == ["undecided"]
    assert "bits" in found.reason[0]
    assert 1 <= proven.sum() < 15
    assert np.array_equal(found.codes[proven, 0], known.codes[proven, column])
    assert (found.codes[~proven, 0] == 255).all()
    word = "".join(map(str, found.codes[proven, 0]))
    assert found.words == [f"{word:?<15}"]
    assert repr(found) == f"<proven routes of 1 orbit; 0.3: {found.words[0]}>"
    assert np.isnan(found.crossing_time[-1, 0])


def test_bits_that_do_not_suffice_are_followed_by_more(monkeypatch: pytest.MonkeyPatch) -> None:
    few = certify_codes(BODY, "3/10", h0="1.3342", J1_0="1e-8", n_symbols=2, bits=20)
    assert few.status == ["undecided"]
    assert few.bits[0] == 20 + codes.MARGIN_BITS
    monkeypatch.setattr(codes, "asked_for", lambda *_: (10, 20))
    found = certify_codes(BODY, "3/10", h0="1.3342", J1_0="1e-8", n_symbols=2)
    assert found.proven.all()
    assert found.bits[0] > 20


def test_a_sign_that_few_bits_leave_in_doubt_is_told_by_more(monkeypatch: Any) -> None:
    """So it was with A = (1.944, 1.7256, 1.9169): H4 failed in 178 bits, and 400 proved."""

    class Doubtful(OrbitChecker):
        def take(self, step: Step) -> None:
            if not self.crossings and step.bits < 70:
                raise Undecided("H4: a sign")
            super().take(step)

    monkeypatch.setattr(codes, "OrbitChecker", Doubtful)
    monkeypatch.setattr(codes, "asked_for", lambda *_: (10, 35))
    found = certify_codes(BODY, "3/10", h0="1.3342", J1_0="1e-8", n_symbols=2)
    assert found.proven.all()
    assert found.bits[0] >= 70


@pytest.mark.parametrize(
    ("mu", "J1_0", "n"), [("1e-30", "1e-2", 1), pytest.param(0, "1e-4", 2, marks=pytest.mark.slow)]
)
def test_an_orbit_that_does_not_come_in_time_is_undecided(mu: Any, J1_0: str, n: int) -> None:
    """Over the lower orbit of a body so light, or to the upper one where Qm = 0 stays so."""
    found = certify_codes(
        Body((2, 1, "3/2"), (1, 1, 0), mu), "1", h0="1.3342", J1_0=J1_0, n_symbols=n, bits=40
    )
    assert found.status == ["undecided"]
    assert found.separatrix[:, 0].tolist() == [2, *[0] * n]


@pytest.mark.slow
def test_an_orbit_is_waited_for_from_crossing_to_crossing(monkeypatch: pytest.MonkeyPatch) -> None:
    """In t', though the checker's own unit of M is 2^-10 here, and of time 2^10."""
    light = Body((2, 1, "3/2"), (1, 1, 0), "1e-9")
    of = RouteProblem(light, exact("1.3342e-6"), exact("1e-11"), 1), exact("5/4"), 60
    times = [0.0, *(each.time for each in codes.prove(*of).crossings)]
    longest = float(np.diff(times).max())
    for limit, reason in ((1.01 * longest, ""), (0.9 * longest, f"{0.9 * longest:.4g}")):
        monkeypatch.setattr(codes, "passage_limit", lambda *_, limit=limit: limit)
        assert codes.prove(*of).reason == (reason and f"no crossing within t' = {reason}")


def test_a_start_next_to_J2_is_enclosed_in_as_many_bits_as_that_takes() -> None:
    """Of J2_0 - J1_0, 1e-60 of J2_0 = 1 here, a root is taken: rounded, it may be negative."""
    of = RouteProblem(BODY, exact("2/3"), exact("1 - 1/10**60"), 1)
    Qp = enclosed(of, exact("1"), 8).state[0]
    assert float(Qp) == pytest.approx(8**0.5 / 3 * 2e-30, rel=0.1, abs=0.0)
    given: Any = {"h0": of.h0, "J1_0": of.J1_0, "n_symbols": 1}
    found = certify_codes(BODY, "1", **given)
    assert found.words == route_codes(BODY, "1", **given).words
    few = [step._replace(bits=1) for step in found.steps[0]]
    assert orbit.proof_of(of, exact("1"), few).reason.startswith("H3: ")


NOTHING = "sqrt(sin(pi)*sin(pi))"
"""Zero, the root of what cancels: a ball of it contains negative numbers in any bits."""


@pytest.mark.parametrize(
    ("mu", "h0", "phase"),
    [
        ("1/1000", "4/3", NOTHING),
        ("1/1000", f"4/3 + {NOTHING}", "1"),
        (f"1/1000 + {NOTHING}", "4/3", "1"),
    ],
)
def test_a_start_that_no_bits_tell_is_undecided(mu: str, h0: str, phase: str) -> None:
    body = Body((2, 1, "3/2"), (1, 1, 0), mu)
    found = certify_codes(body, phase, h0=h0, J1_0="1e-3", n_symbols=1)
    of, step = RouteProblem(body, exact(h0), exact("1e-3"), 1), Step(1, 60, [[0]] * 6)
    assert found.status == ["undecided"]
    for reason in (*found.reason, orbit.proof_of(of, exact(phase), [step]).reason):
        assert reason.startswith("H1: the start cannot be told in ")


def test_no_orbits_are_no_trouble_and_one_takes_a_step_at_least() -> None:
    assert codes.asked_for(problem(n_symbols=2), 1e-3, exact("3/10"))[0] == 1
    found = certify_codes(BODY, [], h0="1.3342", J1_0="1e-8", n_symbols=2)
    assert (found.codes.shape, found.status) == ((2, 0), [])


@pytest.mark.parametrize(
    "prove", [codes.proven_codes, codes.checked_codes, full_shift.compute, route_intervals.compute]
)
def test_one_thread_at_a_time_proves(prove: Any) -> None:
    """As in a worker of a cluster that has several: they share the precision of Arb."""
    nothing = [None] * (
        5 if prove is codes.proven_codes else 4 if prove is codes.checked_codes else 2
    )
    with ThreadPoolExecutor(1) as pool:
        # It fails at once, when all is imported.
        assert pool.submit(prove, *nothing).exception(60) is not None
        with balls.one_at_a_time:
            waiting = pool.submit(prove, *nothing)
            assert wait([waiting], 0.5).not_done
        assert waiting.exception(60) is not None


def test_proofs_leave_the_environment_as_it_was(monkeypatch: pytest.MonkeyPatch) -> None:
    given, absent, other = codes.THREADS
    monkeypatch.setenv(given, "3")
    monkeypatch.setenv(other, "2")
    monkeypatch.delenv(absent, raising=False)
    codes.checked_codes(problem(), [], [], 1)
    assert [os.environ.get(name) for name in codes.THREADS] == ["3", None, "2"]


# ---- The orbits of the shipped configs.


def orbits(name: str) -> Any:
    return certificates.orbits(loading.load(catalogue.known()[name]), REFERENCE)


def test_those_of_fig4_are_its_grids() -> None:
    found = orbits("fig4")
    assert {name: len(phases) for name, (_, phases) in found.items()} == {"left": 63, "right": 32}
    assert found["left"][1][3].text == "0 + ((1/10) * 3)"
    assert float(found["right"][1][31]) == pytest.approx(3 * np.pi / 40 + 0.31, abs=1e-15)


@pytest.mark.slow
def test_the_published_orbits_of_fig5_begin_as_they_are_stored() -> None:
    stored = store.load(REFERENCE / "fig5.h5")["data"]
    for name, (of, phases) in orbits("fig5").items():
        assert of.n_symbols == len(stored[name]["codes"])
        found = certify_codes(of.body, phases, h0=of.h0, J1_0=of.J1_0, n_symbols=1)
        assert found.proven.all()
        for proven, known in ((found.codes, "codes"), (found.separatrix, "separatrix")):
            assert np.array_equal(proven[:, 0], stored[name][known][: len(proven)])
        away = np.abs(found.crossing_time[:, 0] - stored[name]["crossing_time"][:2])
        assert (away <= found.time_radius[:, 0] + 1e-6).all()


def test_too_many_orbits_are_refused(tmp_path: Path) -> None:
    loaded = loading.load(
        catalogue.known()["fig4"], ["problem.arrays.left.count=2001", "problem.n_symbols=2"]
    )
    with pytest.raises(ConfigError, match="holds at most 2000"):
        certificates.orbits(loaded, tmp_path)
