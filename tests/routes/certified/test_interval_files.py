"""Files of intervals: checked whole from the command line, spoilt, and as the page tells of one."""

from __future__ import annotations

import re
import shutil
from collections.abc import Iterator
from fractions import Fraction
from pathlib import Path

import h5py
import pytest

from rigidpend.experiments.route_intervals import compute
from rigidpend.results import store
from rigidpend.routes.certified import intervals
from rigidpend.runs import certificates
from scripts import check_intervals as script
from scripts.check_certificate import Fails
from tests.cli.calls import REFERENCE, call
from tests.remembered import Inline, remembered

PAGE = Path(__file__).parents[3] / "docs" / "full-shift.md"
SHORT = (
    *("--set", "problem.n_symbols=1", "--set", "problem.halvings=3"),
    # So long a way before the first crossing takes time alone.
    *("--set", "problem.J1_0=1/2", "--name", "short"),
)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a result of one symbol on intervals of 2 pi/8, half of which have it."""
    found = tmp_path_factory.mktemp("intervals")
    done = call(found, "run", "fig4_intervals", *SHORT, "--out", ".", "-j", "1")
    assert done.returncode == 0, done.stderr
    return found


@pytest.fixture(scope="module", autouse=True)
def once() -> Iterator[None]:
    """Intervals that are the same in all files are proven once by each checker."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(compute, "cores", lambda: 1)
        patch.setattr(script, "ProcessPoolExecutor", Inline)
        for module, name in ((intervals, "symbols"), (script, "prove")):
            patch.setattr(module, name, remembered(getattr(module, name)))
        yield


@pytest.mark.slow
def test_a_whole_file_is_checked_again(folder: Path) -> None:
    [said] = certificates.check(folder / "short.h5", jobs=1, report=print)
    words = "1 symbol, the same on each interval, of all starts on 1/2 of the line"
    assert str(said).startswith(f"proven: {words}")
    [told] = script.check(folder / "short.h5")
    assert told.endswith("1 on 1/2, 0.5")


@pytest.mark.slow
@pytest.mark.parametrize("how", ["a symbol", "a coefficient"])
def test_a_spoilt_file_is_not_proven(how: str, folder: Path) -> None:
    file = folder / "spoilt.h5"
    shutil.copy(folder / "short.h5", file)
    with h5py.File(file, "r+") as content:
        if how == "a symbol":
            codes = content["data/intervals/codes"]
            proven = int((codes[0] != 255).argmax())
            codes[0, proven] = 1 - codes[0, proven]
        else:
            # The first of Q+ of the first step.
            content["data/proof/coefficients"][0, 0] += 1 << 50
    with pytest.raises(store.StoreError, match="undecided"):
        certificates.check(file, jobs=1, report=print)
    with pytest.raises(Fails):
        list(script.check(file))


def test_the_page_tells_the_shares_of_the_reference() -> None:
    with h5py.File(REFERENCE / "fig4_intervals.h5") as content:
        shares = [Fraction(float(x)) for x in content["data/shares"]]
        count = len(content["data/intervals/place"])
    head = r"^\| `n_symbols` \| `halvings` .*\n.*\n"
    row = re.search(head + r"\| 2 \| 5 \|(.*)\|", PAGE.read_text(encoding="utf-8"), re.MULTILINE)
    assert row
    told = [x.strip() for x in row[1].split("|")]
    assert [Fraction(x) for x in told[: len(shares)]] == shares
    assert told[3] == str(count)
