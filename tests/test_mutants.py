"""The mutation runner: what it changes, which tests it asks, and what it takes for a verdict."""

import ast
from pathlib import Path
from typing import Any

import pytest
import yaml

from scripts import mutants, mutations

ROOT = Path(__file__).resolve().parents[1]
CERTAINTY = "rigidpend/routes/certainty.py"


CHANGED = {
    "a == b": ["a != b"],
    "a < b": ["a <= b", "a * 0.5 < b", "a < b * 0.5", "a * 0.99 < b", "a < b * 0.99"],
    "a > 0.0": ["a >= 0.0", "1.0"],
    "a + b": ["a - b"],
    "a // b": ["a * b"],
    "a and b": ["a or b", "b", "a"],
    "not a": ["a"],
    "-a": ["a"],
    "3": ["4", "0"],
    "0.5": ["1.0"],
    "True": ["False"],
    "a = max(a.b, c)": ["min(a.b, c)"],
    "a = np.minimum(a.b, 0.5)": ["np.maximum(a.b, 0.5)", "1.0"],
    "a = np.isnan(a)": ["np.isnan(a) & False"],
    "a = f(a, b.c, d)": ["f(b.c, a, d)"],
    "return a": ["return None"],
    "f(a)": ["None"],
    "a += b": ["a -= b"],
    "if a:\n    b": ["if not a:\n    b"],
    "if a:\n    raise b": ["if not a:\n    raise b", "if False:\n    raise b"],
    "while a:\n    b": ["while not a:\n    b"],
    "MOST = -0.5": ["MOST = -0.5 * 10", "MOST = -0.5 * 0.5", "0.5", "1.0"],
    # Names, texts, and ends that return nothing are left alone.
    **{x: [] for x in ("a", "'word'", "a = f(a)[b]", "a.b", "(a, b)", "return None")},
    # A key loses its parts.
    "key = (a, b)": ["(b,)", "(a,)"],
    "def followed(a):\n    b = [a, b]": ["[b]", "[a]"],
    "c = digest({'a': a, **b})": ["{**b}", "{'a': a}"],
    "c = (a, b)": [],
    # Annotations, decorators, docstrings, what is for types alone and lengths that are equal.
    '@f(3)\ndef f(a: Literal[1]) -> Literal[2]:\n    """Three 3."""\n    b: C[3] = a': [],
    "if TYPE_CHECKING:\n    a = b": [],
    "if CHECKING:\n    a = b": ["if not CHECKING:\n    a = b"],
    "b = zip(a, strict=True)": [],
    "b = sorted(a, reverse=True)": ["False"],
}
"""Code, and what the changes of its places make of each."""


@pytest.mark.parametrize("code", CHANGED)
def test_what_can_be_changed_is_and_nothing_else(code: str) -> None:
    tree = ast.parse(code)
    before = ast.unparse(tree)
    changed = [
        ast.unparse(ast.fix_missing_locations(x))
        for place in mutations.places(tree)
        for x in mutations.changes(place.node, keyed=place.keyed)
    ]
    assert changed == CHANGED[code]
    assert ast.unparse(tree) == before, "the code itself stays"


def test_a_lot_stays_where_other_code_changes_and_a_larger_one_holds_it() -> None:
    here = mutations.mutants(CERTAINTY)
    some = mutations.drawn(here, 20, 1)
    assert len({(x.path, x.place) for x in some}) == 20, "one of a place"
    assert mutations.drawn(here, 30, 1)[:20] == some
    assert mutations.drawn(here, 20, 2) != some
    both = [*here, *mutations.mutants("rigidpend/routes/codes.py")]
    of_both = mutations.drawn(both, len(both), 1)
    assert [x for x in of_both if x.path == CERTAINTY][:20] == some


@pytest.mark.slow
def test_every_declared_mutant_can_be_drawn_with_a_reason_and_a_stale_one_is_told(
    tmp_path: Path,
) -> None:
    reasons = mutations.equivalent()
    assert {mutant.path for mutant in reasons} <= set(mutants.files())
    assert all(reason.endswith(".") for reason in reasons.values())
    mutant, path = mutations.mutants(CERTAINTY)[0], tmp_path / "declared.yaml"
    entry = {"path": mutant.path, "line": mutant.text, "change": mutant.said, "reason": "why"}
    path.write_text(yaml.safe_dump([entry]))
    assert mutations.equivalent(path) == {mutant: "why"}
    stale: list[dict[str, Any]] = [{"line": "no such line"}, {"change": "1  ->  7"}, {"nth": 99}]
    for wrong in stale:
        path.write_text(yaml.safe_dump([entry | wrong]))
        with pytest.raises(ValueError, match="fits no mutant: rigidpend/routes/certainty"):
            mutations.equivalent(path)


def test_a_module_is_mirrored_by_a_file_and_a_drawing_by_its_picture() -> None:
    mutant = mutations.mutants(CERTAINTY)[0]
    [own_file] = mutants.own(mutant)
    assert own_file == "tests/routes/test_certainty.py"
    inner = mutant._replace(path="rigidpend/experiments/splitting/compute.py")
    [of_folder] = mutants.own(inner)
    assert of_folder == "tests/experiments/test_splitting.py"
    # A folder without tests of its own has those above.
    rest = mutants.around(inner, [of_folder])
    assert (of_folder in rest, "tests/experiments/test_results.py" in rest) == (False, True)
    rest = mutants.around(mutant._replace(path="rigidpend/notebook.py"), [])
    assert {"tests/test_keys.py", "tests/cli/test_run.py"} < {*rest} - {*mutants.OF_TEXT} == {*rest}
    [picture] = mutants.own(mutant._replace(path="rigidpend/experiments/stress/draw.py"))
    assert picture.endswith("::test_a_figure_is_that_of_the_gallery[stress]")
    rest = mutants.around(mutant, [own_file])
    assert (own_file in rest, "tests/routes/test_codes.py" in rest) == (False, True)


@pytest.mark.parametrize(
    ("answers", "found", "slips"),
    [
        (["test_a", ""], ("killed", "test_a"), [True, False]),
        (["test_a", "test_a", *[""] * 4], ("survived", ""), [True, False, *[True] * 4]),
        (["test_a", "test_a", "test_a"], ("untold", "test_a"), [True, False, True]),
        (["", "test_b", ""], ("killed", "test_b"), [True, True, False]),
        ([""] * 4, ("survived", ""), [True] * 4),
        ([None, ""], ("timeout", ""), [True, False]),
        ([None, None], ("untold", ""), [True, False]),
    ],
)
def test_a_verdict_is_held_against_the_code_as_it_is(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    answers: list[str | None],
    found: Any,
    slips: list[bool],
) -> None:
    """A test counts that fails with the mutant, and passes where the file is but written anew."""
    mutant, plain = mutations.mutants(CERTAINTY)[0], (ROOT / CERTAINTY).read_text()
    sources, seen = iter(answers), list[bool]()

    def copied(folder: Path) -> Path:
        (folder / CERTAINTY).parent.mkdir(parents=True)
        (folder / CERTAINTY).write_text(mutations.source(plain))
        return folder

    def failing(folder: Path, *_: Any) -> str | None:
        seen.append((folder / CERTAINTY).read_text() == mutations.source(plain, mutant))
        return next(sources)

    monkeypatch.setattr(mutants, "copied", copied)
    monkeypatch.setattr(mutants, "failing", failing)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "none"))
    desk = mutants.Desk(tmp_path / "desk", 1, 7.0, quick=False)
    verdict = desk.judge(mutant)
    assert (verdict.found, verdict.by) == found
    assert seen == slips
    copy = tmp_path / "desk" / "0" / CERTAINTY
    assert copy.read_text() == mutations.source(plain), "it is undone"


def test_verdicts_are_kept_and_the_share_is_of_those_that_were_judged(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    chosen = mutations.mutants(CERTAINTY)[:6]
    verdicts = mutants.Verdicts(tmp_path / "new" / "kept")
    # The last one counts.
    verdicts.add(chosen[0], mutants.Verdict("open", "", 3.0))
    for mutant, found in zip(chosen, ["killed", "timeout", "survived", "killed"], strict=False):
        verdicts.add(mutant, mutants.Verdict(found, "test_a", 3.0))
    assert mutants.Verdicts(verdicts.kept) == verdicts
    assert mutants.told(chosen, verdicts, {chosen[4]: "why"}) == 75
    said = capsys.readouterr().out
    counts = "2 killed, 1 survived, 1 timeout; 1 equivalent"
    assert f"75.0 % killed of 4 that were judged: {counts}" in said
    assert said.count("survived: ") == 1
    assert f"survived: {chosen[2].line}: {chosen[2]}" in said
