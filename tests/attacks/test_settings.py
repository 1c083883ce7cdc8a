"""Settings that would work for ever, take all memory or leave their folder: refused in a line."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest

import rigidpend
from rigidpend.config.complaints import ConfigError
from rigidpend.machine.files import LARGEST
from rigidpend.numbers.checked import ParameterError
from rigidpend.numbers.exact import FINEST, ExactError, exact
from rigidpend.routes.phases import Phases
from rigidpend.runs import loading
from tests.attacks import lot
from tests.config.samples import SMALL, refused, written

TOWER = "((((pi**64)**64)**64)**64)"
SECONDS, LINE = 2.0, 800
"""What a refusal may take of the processor, and how long a line may be, its place included."""

HARD = {
    "sine of a tower": f"sin({TOWER})",
    "cosine in a root": f"sqrt(cos({TOWER}))",
    "tangent of a tower by one": f"tan(1/(1/{TOWER}))",
    "a tower": TOWER,
    "one over a tower": f"1/{TOWER}",
    "many small arcs": " + ".join(["atan(1e-5000)"] * 200),
    "many small arcs less as many": " - ".join(["atan(1e-5000)"] * 65),
    "arcs in arcs": "atan(" * 200 + "1e-5000" + ")" * 200,
    "many long turns": " + ".join(["sin(1e4999)"] * 300),
}


@contextmanager
def at_once() -> Iterator[None]:
    begun = time.process_time()
    yield
    assert time.process_time() - begun < SECONDS


@pytest.mark.parametrize("text", HARD.values(), ids=HARD)
def test_an_expression_that_would_never_end_is_refused_at_once(text: str) -> None:
    with at_once(), pytest.raises(ExactError) as caught:
        float(exact(text))
    assert len(str(caught.value)) < 400


@pytest.mark.parametrize(
    "text",
    [
        " + ".join(["sin(2**60)"] * 64),
        " + ".join(["atan(1e-4999)"] * 64),
        "sin(1e3000) + 1",
        "atan(pi**64**1) - atan(1e-5000)",
    ],
    ids=["turns", "arcs", "long turn", "both"],
)
def test_what_may_be_written_is_computed_soon(text: str) -> None:
    with at_once():
        assert float(exact(text)) < 100


@pytest.mark.parametrize(
    ("setting", "said"),
    [
        (f"problem.mu=sin({TOWER})", "an angle beyond"),
        (f"problem.arrays.only.start={TOWER}", "beyond 2**"),
        (f"problem.mu={'1+' * 1900}1+", "is not a number"),
        (f"problem.{'a.' * 30_000}b=1", "more than 32 keys inside each other"),
        (f"{'x' * 100_000}=1", "unknown key"),
        (f"numerics.precisions=[{FINEST + 1}]", f"from 53 to {FINEST}"),
        ("numerics.precisions=[9936]", f"from 53 to {FINEST}"),
    ],
    ids=["sine", "tower", "long", "deep", "long key", "precision", "known precision"],
)
def test_a_setting_that_cannot_be_is_refused_at_once_in_a_line(
    tmp_path: Path, setting: str, said: str
) -> None:
    path = written(tmp_path, SMALL)
    with at_once():
        complaints = [str(each) for each in refused(path, [setting])]
    assert any(said in each for each in complaints), complaints
    assert all(len(each) < LINE for each in complaints)


def test_the_highest_precision_is_one_that_numbers_have(tmp_path: Path) -> None:
    path = written(tmp_path, SMALL)
    assert loading.load(path, [f"numerics.precisions=[53, {FINEST}]"])
    # Guard bits of the engine and of the number itself are left.
    assert exact("3*pi/40").at(FINEST + 200) > 0


def test_products_are_bounded_by_the_memory_that_they_need(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = written(tmp_path, SMALL)
    small = ["problem.arrays.only.count=10000000", "problem.n_symbols=15"]
    assert loading.load(path, small)
    large = ["problem.arrays.only.count=1000000", "problem.n_symbols=1000"]
    [complaint] = refused(path, large)
    needed, most = 3 * 11 * 1001e6 / 1e9, 3 * LARGEST / 1e9
    said = (
        "1000000 columns of 1000 symbols need about "
        f"{needed:.3g} GB of memory, and {most:.2g} GB is the most"
    )
    assert complaint.message == said
    # From Python too, before the first of them is made exact, which takes a minute for all.
    monkeypatch.setattr(Phases, "exactly", None)
    body = rigidpend.Body(A=(2, 1, "3/2"), r=(1, 1, 0), mu="0.001")
    for function in (rigidpend.route_codes, rigidpend.certify_codes):
        with pytest.raises(ParameterError, match=said):
            function(body, np.zeros(10**6), h0="1.3342", J1_0="1e-8", n_symbols=1000)


PIECES = [*"aZ9_.,=+-~/\\ :*?\0\n", "..", ".certificate", ".h5", "é", "all"]


def test_any_name_stays_in_its_folder_or_is_refused(tmp_path: Path) -> None:
    config, refused = written(tmp_path, SMALL), list[str]()
    with lot.drawn("names") as chance:
        for _ in range(lot.trials(60)):
            name = "".join(chance.choices(PIECES, k=chance.randrange(1, 6)))
            try:
                [[found]] = loading.load_swept([config], name=name)
            except ConfigError as error:
                refused.append(str(error))
                continue
            target = tmp_path / f"{found.name}.h5"
            assert target.parent.resolve() == target.resolve().parent == tmp_path.resolve()
            assert not target.name.casefold().endswith(".certificate.h5")
            target.write_bytes(b"")
            assert target.stem == name
            target.unlink()
    assert refused
    assert max(map(len, refused)) < 400
