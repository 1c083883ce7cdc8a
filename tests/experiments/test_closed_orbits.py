"""The experiment `closed_orbits`: counts, averages, verification, results told apart."""

import math
from typing import Any
from unittest.mock import Mock

import numpy as np
import pytest

from rigidpend.experiments.closed_orbits import compute as closed_orbits
from rigidpend.experiments.closed_orbits.draw import tables
from rigidpend.machine.progress import PartDone
from rigidpend.routes.symbolic import NoOrbit
from rigidpend.routes.symbolic.closed import closed, closing
from tests.experiments.trees import asked, computed, shared_reference, unlike_stored
from tests.routes.symbolic.fig4 import level

SMALL = ["problem.longest=5", "problem.verified=2", "problem.symbols=1000"]


@pytest.fixture(scope="module")
def data() -> Any:
    told = list[Any]()
    found = computed(asked("closed_orbits", *SMALL), report=told.append)
    assert [x.share for x in told if isinstance(x, PartDone)] == [0.25, 0.5, 0.75, 1.0]
    return found


def test_shorter_words_have_what_is_stored_of_them(data: Any) -> None:
    """Fewer of them are verified, and the random orbit is a shorter one."""
    few = {"words": data["orbits"]["word"], "longest": range(5), "lengths": range(5)}
    kept = {key: np.arange(len(x)) for key, x in (few | {"points": data["places"]["of"]}).items()}
    verified = {f"orbits/{x}" for x in ("closing", "closing_expected")}
    assert unlike_stored("closed_orbits", data, kept) == verified | {
        f"averages/{x}" for x in ("long_orbit", "long_orbit_error")
    }


def test_orbits_close_and_averages_agree_with_the_long_orbit(data: Any) -> None:
    orbits = data["orbits"]
    verified = np.isfinite(orbits["closing"])
    assert verified.sum() == 4
    assert (orbits["closing"][verified] < orbits["closing_expected"][verified]).all()
    assert orbits["alone"].max() < 1e-11
    averages = data["averages"]
    off = np.abs(averages["mean"][1:] - averages["long_orbit"])
    assert (off < 4 * averages["long_orbit_error"]).all()


@pytest.mark.parametrize(
    ("half_turns", "helps"),
    [(5, "allow more half rotations"), (500, "give passages fewer"), (1000, "take fewer")],
)
def test_a_word_without_an_orbit_is_named_with_what_helps(half_turns: int, helps: str) -> None:
    said = rf"no orbit of 0 with half_turns = {half_turns}: [^;]*[:;] .*{helps}[^;]*$"
    with pytest.raises(NoOrbit, match=said):
        computed(asked("closed_orbits", *SMALL, f"problem.half_turns={half_turns}"))


@pytest.mark.parametrize("half_turns", [32, 200])
def test_passages_too_long_for_doubles_are_refused_with_how_long_they_may_be(
    half_turns: int,
) -> None:
    short = [*SMALL, "problem.longest=2", "problem.verified=0"]
    with pytest.raises(NoOrbit, match=r"^passage \d takes so long .* half rotations") as refused:
        computed(asked("closed_orbits", *short, f"problem.half_turns={half_turns}"))
    most = int(str(refused.value).rpartition("; with ")[2].split()[0])
    assert 25 < most < 32
    orbits = computed(asked("closed_orbits", *short, f"problem.half_turns={most}"))["orbits"]
    assert orbits["alone"].max() < 1e-3
    with pytest.raises(NoOrbit, match="takes so long"):
        closing(closed(level(), (0,), most + 4))


def test_a_word_that_cannot_be_verified_is_refused_before_a_longer_one_is_sought(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """And before any orbit is integrated."""
    sought = list[int]()

    def noted(level: Any, word: tuple[int, ...], half_turns: int) -> Any:
        sought.append(len(word))
        return closed(level, word, half_turns)

    monkeypatch.setattr(closed_orbits, "closed", noted)
    monkeypatch.setattr(closed_orbits, "closing", Mock(side_effect=AssertionError))
    long = "problem.half_turns=28", "problem.longest=5", "problem.verified=5"
    with pytest.raises(NoOrbit, match="which verifies nothing: verify shorter words"):
        computed(asked("closed_orbits", *SMALL, *long))
    assert max(sought) == 3
    # Not verified, they are found.
    sought.clear()
    monkeypatch.setattr(closed_orbits, "passages", Mock(side_effect=KeyError))
    with pytest.raises(KeyError):
        computed(asked("closed_orbits", *SMALL, *long, "problem.verified=0"))
    assert max(sought) == 5


def test_an_orbit_that_integration_leaves_is_no_result(monkeypatch: pytest.MonkeyPatch) -> None:
    once = np.array([True, False]), np.zeros(2)
    monkeypatch.setattr(closed_orbits, "passages", lambda _: once)
    with pytest.raises(ArithmeticError, match=r"integration leaves the orbit of 0$"):
        computed(asked("closed_orbits", *SMALL))


@pytest.mark.parametrize(("mu", "h"), [("1e-5", "0.013342"), ("0.2", "266.84")])
def test_the_long_orbit_is_found_in_any_units(mu: str, h: str, data: Any) -> None:
    """Energies of other units count the angle on the surface from elsewhere: same problem."""
    averages = computed(asked("closed_orbits", *SMALL, f"problem.mu={mu}", f"problem.h={h}"))
    for name, value in data["averages"].items():
        assert averages["averages"][name] == pytest.approx(value, rel=1e-6)


def test_the_error_of_the_long_orbit_is_that_of_the_mean_of_its_ten_parts(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Of growths 0, 1, ..., 999 the parts have the means 49.5, 149.5, ..."""
    monkeypatch.setattr(closed_orbits, "stretching", lambda _: np.arange(1000.0))
    averages = computed(asked("closed_orbits", *SMALL, "problem.longest=1"))["averages"]
    assert averages["long_orbit"] == 499.5
    assert averages["long_orbit_error"] == pytest.approx(100 * math.sqrt(11 / 12), rel=1e-14, abs=0)


def test_a_stable_orbit_has_the_sign_of_its_trace(monkeypatch: pytest.MonkeyPatch) -> None:
    traces = {(0,): 1.0, (1,): -1.0}
    monkeypatch.setattr(
        closed_orbits, "closed", lambda *of: closed(*of)._replace(trace=traces[of[1]])
    )
    orbits = computed(asked("closed_orbits", *SMALL, "problem.longest=1"))["orbits"]
    assert orbits["stable"].tolist() == [True, True]
    assert orbits["positive"].tolist() == [True, False]


def test_words_of_up_to_four_symbols_have_a_row_each() -> None:
    """Of eight words up to rotation, four are of even length and two orbits each."""
    [table, _] = tables(shared_reference("closed_orbits"))
    words = ["0", "1", "01", "10", "001", "011", "0001", "0010", "0011", "0110", "0111", "1011"]
    assert [row[0] for row in table.rows] == words
