"""Configs of any content and settings that would work for ever: loaded, or refused in a line."""

import random
import re
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest
from hypothesis import strategies as st

import rigidpend
from rigidpend.config import catalogue, reader
from rigidpend.config.complaints import ConfigError
from rigidpend.machine.files import MOST_BYTES, afford
from rigidpend.numbers.checked import ParameterError
from rigidpend.numbers.exact import FINEST_BITS, ExactError, exact
from rigidpend.routes.phases import Phases
from rigidpend.runs import loading
from tests.attacks import lot
from tests.config.samples import FIG4, SMALL, TEXT, refused, written
from tests.strategies import examples

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


SOON = {
    "turns": " + ".join(["sin(2**60)"] * 64),
    "arcs": " + ".join(["atan(1e-4999)"] * 64),
    "long turn": "sin(1e3000) + 1",
    "both": "atan(pi**64**1) - atan(1e-5000)",
}


@pytest.mark.parametrize("text", SOON.values(), ids=SOON)
def test_what_may_be_written_is_computed_soon(text: str) -> None:
    with at_once():
        assert float(exact(text)) < 100


CANNOT_BE = {
    "sine": (f"problem.mu=sin({TOWER})", "an angle beyond"),
    "tower": (f"problem.arrays.only.start={TOWER}", "beyond 2**"),
    "long": (f"problem.mu={'1+' * 1900}1+", "is not a number"),
    "deep": (f"problem.{'a.' * 30_000}b=1", "more than 32 keys inside each other"),
    "long key": (f"{'x' * 100_000}=1", "unknown key"),
    "precision": (f"numerics.precisions=[{FINEST_BITS + 1}]", f"from 53 to {FINEST_BITS}"),
    "known precision": ("numerics.precisions=[9936]", f"from 53 to {FINEST_BITS}"),
}


@pytest.mark.parametrize(("setting", "said"), CANNOT_BE.values(), ids=CANNOT_BE)
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
    assert loading.load(path, [f"numerics.precisions=[53, {FINEST_BITS}]"])
    # Guard bits of the engine and of the number itself are left.
    assert exact("3*pi/40").at(FINEST_BITS + 200) > 0


def test_products_are_bounded_by_what_a_result_holds(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = written(tmp_path, SMALL)
    small = ["problem.arrays.only.count=10000000", "problem.n_symbols=15"]
    assert loading.load(path, small)
    large = ["problem.arrays.only.count=1000000", "problem.n_symbols=1000"]
    [complaint] = refused(path, large)
    said = (
        "1000000 columns of 1000 symbols make a result of about 11 GB, and "
        f"{MOST_BYTES / 1e9:.3g} GB is the most"
    )
    assert complaint.message == said
    afford("all", MOST_BYTES // 11, 11, "as much as is read")
    with pytest.raises(ParameterError, match=r"more make a result of about 2\.15 GB, and 2\.15 GB"):
        afford("all", MOST_BYTES // 11 + 1, 11, "more")
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


Load = Callable[..., bool]

PATIENCE = 5.0
"""Seconds of this process that no config may take; the slowest takes a few tenths."""
FUZZED = lot.trials(150)
"""Number of mutated configs; a load takes some 7 ms."""
MUCH = 30_000
"""Characters that no complaint may have."""


VALUES = [
    *("nan", ".nan", "inf", "-.inf", "1e400", "1e-400", "1e5000", "-1", "0", "-0.0", "1/0", "0/0"),
    *("no", "yes", "on", "null", "~", "true", "false", "auto", "''", '""', "'1'", "1:30", "0x1F"),
    *("1_000", "٣", "½", "1j", "1e", "e1", ".", "+", "--1", "pi", "-pi", "sqrt(-1)", "tan(pi/2)"),
    *("2**-2000", "9**9**9", "(((1)))", "sin(" * 60 + "1" + ")" * 60, "9" * 400, "0." + "3" * 400),
    *("&a 1", "*a", "!!float 1", "!x 1", "<<", "---", "...", "# c", "a: b", "- a", "[", "]", "{"),
    *('"\\0"', '"\\ud800"', '"\\e[31m"', "\x07", "\u2028", "\ufeff", "日本", "a" * 300, "a b"),
    *("scipy", "taylor", "tailor", "route_codes", "gamma0", "left", "fig4", "mu", "? a", "[a]"),
    *("", "[]", "{}", "[1]", "[1, 2, 3]", "[[1, 2, 3]]", "{a: 1}", "{'': []}", f"{['1'] * 99}"),
    *("{start: 0, step: 1, count: 1e9}", "[[[[[[1]]]]]]"),
]
"""What may be written where something else belongs."""
WORD, ROW = re.compile(r"[^\s,:\[\]{}]+"), re.compile(r"^.*\n", re.MULTILINE)
PLACES = [
    *("problem", "problem.A", "problem.A.1", "problem.A.7", "problem.mu", "problem.mu.x"),
    *("problem..mu", "problem.x", "problem.arrays", "problem.arrays.left", "problem.n_symbols"),
    *("problem.arrays.x.count", "numerics.precisions", "numerics.precisions.0", "numerics.engine"),
    *("figure", "experiment", "A", "x", "7"),
]
"""Keys of settings, or nearly."""


def mutated(text: str, chance: random.Random) -> str:
    """A text with one to four words replaced or exchanged, or lines doubled or left out."""
    for _ in range(chance.randint(1, 4)):
        kind = chance.choice([WORD, WORD, ROW])
        old, other = chance.choices([*kind.finditer(text)], k=2)
        words = [chance.choice(VALUES), f"{old[0]} ", f"{old[0]}x", other[0], f"[{old[0]}]"]
        new = chance.choice(words if kind is WORD else ["", 2 * old[0], other[0]])
        text = text[: old.start()] + new + text[old.end() :]
    return text


def without_comments(path: Path) -> str:
    return re.sub(r"(^|\s)#.*", "", path.read_text(encoding="utf-8"))


@pytest.fixture(scope="module")
def loads(tmp_path_factory: pytest.TempPathFactory) -> Load:
    """Whether a content loads with settings; whatever is raised comes through, but ConfigErrors."""
    path = tmp_path_factory.mktemp("fuzz") / "given.yaml"

    def attempt(content: bytes, settings: Sequence[str] = ()) -> bool:
        path.write_bytes(content)
        begun = time.process_time()
        try:
            loading.load(path, settings)
        except ConfigError as error:
            said = str(error)
        else:
            said = ""
        # What measures coverage slows every line.
        assert time.process_time() - begun < PATIENCE * (8 if sys.gettrace() else 1)
        assert len(said) < MUCH
        assert said == "" or said.startswith(("--set ", str(path)) if settings else str(path))
        assert all(x.isprintable() or x in "\n\t" for x in said), said
        return not said

    return attempt


@examples(50, content=st.binary(max_size=60) | st.text(max_size=60).map(str.encode))
def test_any_content_is_refused(loads: Load, content: bytes) -> None:
    assert not loads(content)


@pytest.mark.slow
def test_mutated_configs_and_any_settings_load_or_are_refused(loads: Load) -> None:
    texts, loaded = [*map(without_comments, catalogue.known().values())], 0
    with lot.drawn("mutated configs") as chance:
        for _ in range(FUZZED):
            text = mutated(chance.choice(texts), chance)
            loaded += loads(text.encode("utf-8", "surrogatepass"))
            if chance.random() < 1 / 3:
                pairs = zip(chance.choices(PLACES, k=2), chance.choices(VALUES, k=2), strict=True)
                loads(FIG4.read_bytes(), [f"{place}={value}" for place, value in pairs])
    # Some changes do no harm: the mutations are near enough to what is right.
    assert FUZZED / 140 < loaded < FUZZED / 1.75


@pytest.mark.slow
def test_the_largest_files_are_refused_in_time(loads: Load) -> None:
    much = reader.MOST_BYTES * 9 // 10 - len(TEXT)
    assert not loads(TEXT.replace("2, 1, 1.5", "[]," * (much // 3)).encode())
    for unit in ("k:\n", "{}\n", "--- \n", "- \n", "[", "*a ", "&a ", "'", '"\\x'):
        assert not loads((TEXT + unit * (much // len(unit))).encode())
