"""Data of proofs: steps and sets as arrays and in files, and what is none, for both readers."""

from fractions import Fraction
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest

from rigidpend.orbits.integrate.sum_arrays import SumArray
from rigidpend.routes.certified import proof_data
from rigidpend.routes.certified.family_orbits import FamilyGrid, fitted
from rigidpend.routes.certified.proof_data import MOST_DEGREE, FamilyStep, packed, unpacked
from scripts import check_full_shift, check_proof_data
from scripts.check_certificate import Refused
from tests.routes.certified.offered import STORED, Stored, series


def finer(piece: FamilyStep, by: int = 30) -> FamilyStep:
    """The same step in units that many bits finer, and half a unit of old off in each term."""
    terms = [{at: (w << by) + (1 << by - 1) for at, w in each.items()} for each in piece.terms]
    return FamilyStep(piece.bits + by, piece.half_length, terms)


def test_numbers_of_more_bits_than_a_word_are_stored_whole(stored: Stored) -> None:
    """By both readers, negative ones among them, and of the largest degree."""
    steps = [[finer(piece) for piece in each[:3]] for each in stored.orbits]
    highest: dict[Any, int] = {(0, 0, MOST_DEGREE): 1}
    steps[1] = [*stored.orbits[1][:3], FamilyStep(60, {(0, 0, 0): 1}, [highest] * 6)]
    again = packed(steps)
    assert set(again["family"]) > {0, 1, 5}
    found, theirs = unpacked(again, 5), check_proof_data.steps_of_sets(again, 5)
    for mine, others, wanted in zip(found, theirs, steps, strict=True):
        for one, other, piece in zip(mine, others, wanted, strict=True):
            half = {at: w for at, w in piece.half_length.items() if w}
            assert one == (piece.bits, half, list(piece.terms))
            for k, terms in enumerate(piece.terms):
                assert (other.states[k] - series(terms, piece.bits)).most == 0


def test_noise_at_many_nodes_is_no_term() -> None:
    """Coefficients of high T_k would multiply that of pairs of doubles."""
    grid = FamilyGrid(20, 20, 1)
    u, v, _ = grid.at
    [terms] = fitted(SumArray((u * u * u / 3 + u * v / 7).parts[:, None, None]), 90, grid.sizes)
    # Twice as many units, as of each coefficient of T_0(x).
    assert terms == {(0, 3, 0): round(Fraction(2**91, 3)), (0, 1, 1): round(Fraction(2**91, 7))}


LENGTHS: Any = lambda powers: (powers[:, 0] == 0, 6)  # noqa: E731
IN_TIME: Any = lambda powers: (powers[:, 0] > 0, 6)  # noqa: E731


@pytest.mark.parametrize(
    ("name", "place", "value", "said", "told"),
    [
        # As many as there are, come round again by 2^64, and fewer than none.
        ("terms", slice(4), 2**62, "other terms", "terms are not as many"),
        ("terms", slice(2), [-(10**6), 10**6], "other terms", "not as many as they say"),
        ("bits", 0, -60, "fewer bits than 1", "too many bits"),
        ("powers", (0, 0), MOST_DEGREE + 1, f"more than {MOST_DEGREE}", "or of one too high"),
        ("family", -1, 1, "a step is of no set", "is of no set"),
        ("family", 0, 1, "what is added to a step is", "what is added to a step is"),
        ("coefficients", LENGTHS, 1, "what is added to a step is", "what is added to a step is"),
        ("coefficients", IN_TIME, 1, "depends on time", "depends on time"),
        # The other reader takes units of any order.
        ("bits", -1, -31, "what is added to a step is", ""),
    ],
)
def test_arrays_that_are_no_steps_are_refused(
    stored: Stored, name: str, place: Any, value: Any, said: str, told: str
) -> None:
    """Those of an orbit, of whose last step some are added to another."""
    *first, last = stored.orbits[0][:4]
    again = packed([[*first, finer(last)]])
    again["powers"] = again["powers"].astype(np.int64)
    assert again["family"].tolist() == [0, 0, 0, 0, 1]
    again[name][place(again["powers"]) if callable(place) else place] += value
    with pytest.raises(ValueError, match=said):
        unpacked(again, 1)
    if told:
        with pytest.raises(Refused, match=told):
            check_proof_data.steps_of_sets(again, 1)


def test_numbers_of_terms_may_be_as_short_as_they_are(stored: Stored) -> None:
    """Bytes hold them, and not the places of the terms."""
    again = packed([stored.orbits[0]])
    short = {**again, "terms": again["terms"].astype(np.uint8)}
    assert unpacked(short, 1) == unpacked(again, 1)


def test_what_is_no_set_is_refused(stored: Stored) -> None:
    """One without a curve, a width or a slope, and what is no number."""
    sets = stored.data["sets"]
    for name, nothing in (("p", np.zeros((4, 0))), *((x, np.zeros(4)) for x in ("a", "b", "l1"))):
        with pytest.raises(ValueError, match="no extent"):
            proof_data.unpacked_quads({**sets, name: nothing})
    for wrong in (np.nan, np.inf):
        with pytest.raises(ValueError, match="not finite"):
            proof_data.unpacked_quads({**sets, "a": np.array([1, 1, 1, wrong])})
    for wrong in (np.nan, np.inf, 0.0):
        with pytest.raises(ValueError, match=r"not finite|no interval"):
            proof_data.unpacked_energies({"shift": 0.0, "spread": wrong})
    assert proof_data.unpacked_energies(None) == (Fraction(0), Fraction(0))


def other(place: str, *given: Any, **how: Any) -> Any:
    """A file with another dataset at a place."""
    return lambda file: (file.pop(place), file.create_dataset(place, *given, **how))


def many(file: Any) -> None:
    """A step of so many terms as cannot be multiplied in minutes."""
    at = np.array(np.unravel_index(np.arange(10001), (40, 40, 40))).T
    values: Any = {"family": [0], "bits": [60], "terms": [len(at)], "powers": at}
    for name, x in {**values, "coefficients": np.ones((len(at), 7), dtype=np.int64)}.items():
        other(f"data/proof/{name}", data=x)(file)


def test_the_largest_proof_of_the_page_is_read_and_one_four_times_as_large_is_not() -> None:
    """That of energies within a thousandth has 2.6e9 products of terms, as the first one here."""

    def steps(terms: int) -> Any:
        at = np.array(np.unravel_index(np.arange(terms), (1, 50, 50))).T
        values: Any = {"family": [0], "bits": [60], "terms": [terms], "powers": at}
        values["coefficients"] = np.ones((terms, 7), dtype=np.int64)
        return check_proof_data.steps_of_sets(values, 1)

    [[step]] = steps(1380)
    assert len(step.states) == 6
    with pytest.raises(Refused, match="more terms than can be multiplied in minutes"):
        steps(2200)


def link(file: Any) -> None:
    del file["data/line/half"]
    file["data/line/half"] = h5py.ExternalLink(str(STORED), "data/line/half")


def texts(file: Any) -> None:
    """Numbers as text, though they are the same."""
    other("data/sets/a", data=[repr(float(x)) for x in file["data/sets/a"]])(file)


def version(x: Any) -> Any:
    """A file of another format."""
    return lambda file: file.attrs.update({"format_version": x})


def says(old: str, new: str) -> Any:
    """A file whose config says something else."""
    return lambda file: other("config", data=file["config"].asstr()[()].replace(old, new))(file)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (link, "is a link to somewhere else"),
        (other("data/sets/a", (1000,), "S1048576", chunks=(1,)), "is too large for the length"),
        (other("data/sets/p", data=np.zeros((4, 21))), "a curve has no coefficients"),
        (texts, "a holds no numbers of its kind"),
        (many, "there are more terms than"),
        (says('"3/2"', '"3/2", "1"'), "A or r is not three numbers"),
        (
            says('"r": [\n      "1",\n      "1",\n      "0"\n    ]', '"r": "110"'),
            "A or r is not three",
        ),
        (says('"mu": "1/1000"', '"weight": "1/1000"'), "lacks something"),
        *((version(x), "its format version is") for x in (2, "1", [1, 1])),
        (says('"1/100000000"', '"-1"'), "J1_0 > 0 is broken"),
    ],
)
def test_a_file_that_is_no_proof_is_refused_at_once(
    change: Any, said: str, tmp_path: Path, capsys: Any
) -> None:
    path = tmp_path / "other.h5"
    path.write_bytes(STORED.read_bytes())
    with h5py.File(path, "r+") as file:
        change(file)
    assert check_full_shift.main([str(path)]) == 1
    assert said in capsys.readouterr().err
