"""The experiment `asymptotic_orbits`: counts, codes, sampled orbits, results told apart."""

import math
import re
from fractions import Fraction
from typing import Any

import numpy as np
import pytest

from rigidpend.experiments.asymptotic_orbits import DIGIT, SAMPLED, compute
from rigidpend.experiments.asymptotic_orbits.draw import address, phase_text
from rigidpend.experiments.plots import decimals
from rigidpend.machine.progress import PartDone
from rigidpend.routes.codes import route_codes
from rigidpend.routes.symbolic import NoOrbit
from tests.bodies import FIG4
from tests.cli.calls import REFERENCE
from tests.experiments.trees import asked, computed, shared_reference, unlike_stored

SMALL = ["problem.symbols=2", "problem.columns=60"]


@pytest.fixture(scope="module")
def data() -> Any:
    parts: list[str] = []
    found = computed(asked("asymptotic_orbits", *SMALL), parts)
    assert parts == [f"symbols.{n}.0000000" for n in range(3)]
    return found


@pytest.mark.parametrize(
    ("body", "too_few"),
    [
        # With 9 some orbits of two symbols are found, and none of one.
        ((), 1),
        (("problem.A=[3,1.9,2.2]", "problem.mu=0.0023", "problem.symbols=1"), 10),
    ],
)
def test_half_rotations_that_are_too_few_are_refused_with_the_least_number_that_suffices(
    body: tuple[str, ...], too_few: int
) -> None:
    def found(half_turns: int) -> Any:
        given = *SMALL, *body, "problem.drawn=0", f"problem.half_turns={half_turns}"
        return computed(asked("asymptotic_orbits", *given))

    said = rf"no orbit with 1 symbol has only .* = {too_few} half rotations: allow (\d+), or fewer"
    with pytest.raises(NoOrbit, match=said) as refused:
        found(too_few)
    least = int(re.findall(r"allow (\d+)", str(refused.value))[0])
    assert least > too_few
    enough = found(least)
    assert all(len(orbits["theta2_0"]) for orbits in enough["orbits"].values())
    assert not enough["drawn"]
    with pytest.raises(NoOrbit, match=f"allow {least}, or fewer symbols"):
        found(least - 1)


def test_where_no_number_of_half_rotations_suffices_none_is_named() -> None:
    """The surfaces at downward crossings are not split in the Hess case."""
    hess = "problem.symbols=1", "problem.r=[1, sqrt(2), 0]", "problem.drawn=0"
    with pytest.raises(NoOrbit, match=r"= 10 half rotations: allow fewer symbols$"):
        computed(asked("asymptotic_orbits", *hess))


def test_all_is_as_it_is_stored_but_the_plane(data: Any) -> None:
    """Which has fewer columns."""
    assert unlike_stored("asymptotic_orbits", data, {}) == {"plane/theta2_0"}


@pytest.mark.parametrize("size", [11, 21])
def test_parts_of_any_size_are_the_same_and_tell_their_share(
    size: int, data: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of two symbols there are 22 orbits."""
    monkeypatch.setattr(compute, "PART", {106: size})
    told, parts, one = list[Any](), list[str](), asked("asymptotic_orbits", *SMALL)
    found = computed(one, parts, report=told.append)
    assert len(parts) == sum(math.ceil(len(x["theta2_0"]) / size) for x in data["orbits"].values())
    assert unlike_stored("asymptotic_orbits", found, {}) == {"plane/theta2_0"}
    shares = [x.share for x in told if isinstance(x, PartDone)]
    assert (np.diff(shares) > 0).all()
    assert len(shares) == len(parts)
    assert shares[-1] == pytest.approx(1, abs=1e-12)


@pytest.mark.parametrize("times", [Fraction(1, 512), Fraction(256)])
def test_orbits_are_the_same_in_other_units(times: Fraction, data: Any) -> None:
    """Actions are so many times as large, energies by its square, and t' as much smaller."""
    given = [
        f"problem.{name}={value}*{times**power}"
        for name, value, power in (("mu", "0.001", 2), ("h", "1.3342", 2), ("J1_0", "1e-8", 1))
    ]
    few = "problem.symbols=0", "problem.columns=10", "problem.drawn=1"
    other = computed(asked("asymptotic_orbits", *few, *given))
    found, same = (x["orbits"]["0"] for x in (other, data))
    np.testing.assert_array_equal(found["theta2_0"], same["theta2_0"])
    np.testing.assert_allclose(found["theta2_0_rest"], same["theta2_0_rest"], rtol=0, atol=DIGIT)
    drawn, same = (x["drawn"]["0"] for x in (other, data))
    np.testing.assert_allclose(drawn["t"] * float(times), same["t"], rtol=1e-13, atol=1e-12)
    np.testing.assert_allclose(drawn["theta3"], same["theta3"], rtol=0, atol=SAMPLED)


def test_symbols_change_at_the_orbits(data: Any) -> None:
    """By integration from Fig. 4's starts, with J1_0 so small that they lie on the surface.

    On the way from 1e-24 to 1e-8 theta2 advances by the same as the orbit's own does.
    """
    assert data["plane"]["codes"].shape == (3, 60), "a row more than the longest codes have"
    middles = (np.arange(60) + 0.5) * np.pi / 30
    np.testing.assert_allclose(data["plane"]["theta2_0"], middles, rtol=1e-15)
    for n in (0, 1):
        orbits = data["orbits"][str(n)]
        beside = (orbits["theta2_0"][:2, None] + [-2e-2, 2e-2]).ravel()
        seen = route_codes(FIG4, beside, h0="1.3342", J1_0="1e-8", n_symbols=n + 1).codes
        np.testing.assert_array_equal(seen[:n], np.repeat(orbits["word"][:, :2], 2, axis=1))
        assert (seen[n, ::2] != seen[n, 1::2]).all()


def test_thirty_digits_are_shown(data: Any) -> None:
    orbits = data["orbits"]["1"]
    high, rest = float(orbits["theta2_0"][0]), float(orbits["theta2_0_rest"][0])
    shown = phase_text(orbits, 0)
    assert abs(Fraction(shown) - Fraction(high) - Fraction(rest)) <= Fraction(1, 2 * 10**29)
    assert decimals(Fraction(0.5) - Fraction(2) ** -60, 5) == "0.50000"
    assert len(shown) == 31
    assert 0 < abs(rest) < 1e-15
    assert address(data["orbits"]["2"], 0)[0] in "ab"


def test_the_page_says_by_how_much_the_map_alone_errs() -> None:
    page = (REFERENCE.parents[1] / "docs" / "addresses.md").read_text()
    [told] = re.findall(r"the map alone errs by\s+\$(\S+)\\cdot10\^\{-14\}\$ at most", page)
    orbits = shared_reference("asymptotic_orbits")["data"]["orbits"]
    moved = max(np.abs(each["moved"]).max() for each in orbits.values())
    assert moved <= 1e-14 * float(told) < 1.1 * moved
