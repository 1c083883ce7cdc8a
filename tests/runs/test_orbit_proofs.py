"""Proofs that an orbit with a given code exists: made, checked by both checkers, and spoilt."""

import json
import shutil
from collections.abc import Callable, Iterator
from fractions import Fraction
from functools import partial
from pathlib import Path
from types import SimpleNamespace
from typing import Any
from unittest.mock import Mock

import h5py
import numpy as np
import pytest

from rigidpend.machine import files
from rigidpend.numbers.checked import ParameterError
from rigidpend.routes.certified import chains, coverings, proof_data, sections
from rigidpend.routes.certified.proof_data import Undecided
from rigidpend.runs import certificates, orbit_proofs
from scripts import check_coverings, check_series
from scripts import check_orbit as script
from scripts.check_certificate import Fails, Refused
from tests.cli.calls import call, succeeded
from tests.experiments.trees import reference
from tests.remembered import inline, remembered
from tests.runs.checkers import Change, stated

CODE = "011"
NAME = f"x{orbit_proofs.SUFFIX}"


@pytest.fixture(scope="module")
def file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("orbit")
    done = succeeded(folder, "find", "fig4", "--code", CODE, "--json", "-j", "1", "--proof", NAME)
    (folder / "found.json").write_text(done.stdout)
    return folder / NAME


@pytest.fixture(scope="module", autouse=True)
def once() -> Iterator[None]:
    """Orbits that are the same in all proofs are followed once by each checker."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(script, "ProcessPoolExecutor", inline)
        for module in (coverings, check_coverings):
            for name in ("arrival", "beginning"):
                patch.setattr(module, name, remembered(getattr(module, name)))
        yield


def said_by_both(file: Path) -> Iterator[tuple[bool, str]]:
    """Whether each checker believes a proof, and what it says."""
    checks: list[Callable[[], Any]] = [
        lambda: certificates.check(file, jobs=1, report=print)[0],
        lambda: script.check(file),
    ]
    for check in checks:
        try:
            yield True, str(check())
        except (files.StoreError, Refused, Fails) as refusal:
            yield False, str(refusal)


def test_sets_too_large_for_their_polynomials_are_told(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As those of nearly symmetric bodies are, whose surfaces doubles hardly tell apart."""
    monkeypatch.setattr(chains, "WIDTH", 1e5)
    done = call(tmp_path, "find", "fig4", "--code", "01", "-j", "1", "--proof", NAME)
    assert done.returncode == 1
    assert "too large: the surfaces are split too little" in done.stderr
    assert not (tmp_path / NAME).exists()


@pytest.mark.slow
def test_both_prove_the_code_of_a_start_beside_the_one_that_was_found(file: Path) -> None:
    found = float(json.loads((file.parent / "found.json").read_text())["theta2_0"])
    for believed, text in said_by_both(file):
        assert believed, text
        assert text.endswith(CODE)
        words = text.split()
        low, high = (float(words[words.index(x) + 1]) for x in ("from", "to"))
        assert low < found < high < low + 1e-3


def test_both_prove_the_code_of_a_start_close_to_the_periodic_orbit(tmp_path: Path) -> None:
    """Its Qp is 2e-10, so that the box in which a start is unique is a small one."""
    setting = "problem.J1_0=1e-20"
    succeeded(tmp_path, "find", "fig4", "--code", "1", "--set", setting, "--proof", NAME)
    for believed, text in said_by_both(tmp_path / NAME):
        assert believed, text
        assert "of A = 2, 1, 3/2; r = 1, 1, 0; mu = 1/1000; h0 = " in text
        assert text.endswith(" 1")


@pytest.mark.slow
def test_parts_meet_and_ends_are_rounded_outward(
    file: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Four sources are two parts of two, each with the first of the next."""
    monkeypatch.setattr(orbit_proofs, "AT_ONCE", 2)
    ends = Fraction("0.1234567891"), Fraction("0.1234567899")
    monkeypatch.setattr(sections, "phases", lambda *_: tuple(map(float, ends)))
    where = SimpleNamespace(low=round(ends[0] * (1 << check_series.DIGITS)), above=ends[1])
    monkeypatch.setattr(script, "phases", lambda *_: where)
    for believed, text in said_by_both(file):
        assert believed, text
        assert "from 0.123456789 to 0.123456790 " in text


def at(place: str, index: Any, value: Callable[[Any], Any]) -> Change:
    """A change of a number in an array of the proof; in its middle where no place is given."""

    def change(file: Any) -> None:
        node = file[f"data/{place}"]
        where = (len(node) // 2, 0) if index is None else index
        node[where] = value(node[where])

    return change


def longer(file: Any) -> None:
    bits = file["data/proof/bits"][()]
    del file["data/proof/bits"]
    file["data/proof/bits"] = np.concatenate((bits, bits))


def fractions(file: Any) -> None:
    bits = file["data/proof/bits"][()] + 0.5
    del file["data/proof/bits"]
    file["data/proof/bits"] = bits


@pytest.mark.slow
@pytest.mark.parametrize(
    ("change", "reason"),
    [
        (stated("code", to="010"), "the code is 011|symbol 3"),
        (stated("code", to="0111"), "4 symbols|as many symbols"),
        (stated("code", to="01x"), "the code is 011|its code is none"),
        (stated("problem", "J1_0", to="0"), "J1_0"),
        (stated("problem", "J1_0", to="1.001e-8"), "C1"),
        (at("energies/spread", (), lambda _: 0.0), "energies"),
        (at("energies/shift", (), lambda x: x + 1e-7), "C"),
        (
            at("energies/spread", (), lambda x: x / 2),
            "C6: the energies of its starts|C6: energies along the line",
        ),
        # A set too wide, one too flat, one of the other section, a step of another set.
        (at("sets/a", 2, lambda x: x * 1e4), "C"),
        (at("sets/b", 2, lambda x: x / 1e3), "C"),
        (at("sets/rising", 2, lambda x: not x), "C6: the next set is not one"),
        (at("proof/family", -1, lambda _: 0), "C|out of order"),
        (longer, "another shape than the rest|not as many as they say"),
        (fractions, "bits does not hold whole numbers|another shape or kind"),
        (at("proof/coefficients", None, lambda x: x + (1 << 30)), "C"),
    ],
)
def test_what_is_changed_proves_nothing(
    file: Path, change: Change, reason: str, tmp_path: Path
) -> None:
    copy = tmp_path / NAME
    shutil.copy(file, copy)
    with h5py.File(copy, "r+") as opened:
        change(opened)
    for believed, text in said_by_both(copy):
        assert not believed, text
        assert any(each in text for each in reason.split("|")), text


def test_steps_of_some_sets_are_those_of_all() -> None:
    proof = reference("full_shift")["data"]["proof"]
    parts = [proof_data.of_some(proof, 5, range(*ends)) for ends in ((0, 2), (2, 5))]
    assert [x for p, n in zip(parts, (2, 3), strict=True) for x in proof_data.unpacked(p, n)] == (
        proof_data.unpacked(proof, 5)
    )
    joined = proof_data.joined(parts, (2, 3))
    assert all(np.array_equal(joined[name], proof[name]) for name in joined)
    with pytest.raises(ValueError, match="other terms than are stored"):
        proof_data.of_some({**proof, "terms": proof["terms"] + 1}, 5, range(1))


@pytest.mark.parametrize("end", [True, False])
def test_links_are_made_from_the_last_on_each_to_cover_the_next(
    monkeypatch: pytest.MonkeyPatch, end: bool
) -> None:
    """With the polynomials that prove the next one, in more bits where the first do not."""
    asked = Mock(side_effect=[None, Undecided("C6"), None])
    monkeypatch.setattr(chains, "prove_link", asked)
    links: list[Any] = [
        SimpleNamespace(start=k, setting=SimpleNamespace(numbers=-k), pieces=partial(pow, 10 + k))
        for k in (1, 2, 3)
    ]
    monkeypatch.setattr(chains, "MORE_BITS", (1, 2))
    links[2].pieces = lambda: 13
    found: Any = chains.linked([*links[:2], None if end else links[2]])
    assert found == [11**2, 12]
    after = None if end else (3, 13)
    assert [call.args for call in asked.mock_calls] == [
        (-2, (2, 12), after),
        (-1, (1, 11), (2, 12)),
        (-1, (1, 11**2), (2, 12)),
    ]


def test_a_proof_has_a_name_by_which_it_is_known(tmp_path: Path) -> None:
    with pytest.raises(ParameterError, match=r"a proof ends in \.orbit\.certificate\.h5"):
        orbit_proofs.prepare(tmp_path / "x.h5")
