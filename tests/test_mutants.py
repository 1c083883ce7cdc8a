"""The mutation runner: what it changes, where, and what it leaves alone."""

from __future__ import annotations

import ast
import random
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import pytest
import yaml

from scripts import mutants, mutations

ROOT = Path(__file__).resolve().parents[1]
CERTAINTY = "rigidpend/routes/certainty.py"
STATES = "rigidpend/orbits/integrate/states.py"


@pytest.mark.parametrize(
    ("before", "after"),
    [
        ("a < b", "a <= b"),
        ("a == b", "a != b"),
        ("a + b", "a - b"),
        ("a // b", "a * b"),
        ("a and b", "a or b"),
        ("not a", "a"),
        ("-a", "a"),
        ("3", "4"),
        ("0.5", "1.0"),
        ("0.0", "1.0"),
        ("True", "False"),
    ],
)
def test_an_expression_is_changed(before: str, after: str) -> None:
    node = ast.parse(before, mode="eval").body
    changed, said = mutations.changed(node) or (node, "")
    assert ast.unparse(changed) == after
    assert said == f"{before}  ->  {after}"
    assert ast.unparse(node) == before, "the node itself stays"


@pytest.mark.parametrize(
    ("before", "after"),
    [
        ("return a", "return None"),
        ("f(a)", "None"),
        ("a += 1", "a -= 1"),
        ("if a:\n    b", "if not a:\n    b"),
        ("while a:\n    b", "while not a:\n    b"),
    ],
)
def test_a_statement_is_changed(before: str, after: str) -> None:
    [node] = ast.parse(before).body
    change = mutations.changed(node)
    assert change
    assert ast.unparse(change[0]) == after


@pytest.mark.parametrize("text", ["a", "'word'", "f(a)[b]", "a.b", "return", "return None"])
def test_names_texts_and_ends_that_return_nothing_are_left_alone(text: str) -> None:
    [node] = ast.parse(text).body
    assert mutations.changed(node.value if isinstance(node, ast.Expr) else node) is None


def test_annotations_and_docstrings_are_left_alone() -> None:
    tree = ast.parse('def f(a: Literal[1]) -> Literal[2]:\n    """Three 3."""\n    b: C[3] = a\n')
    assert list(mutations.places(tree)) == []
    assert list(mutations.places(ast.parse("if TYPE_CHECKING:\n    a = 1\n"))) == []
    assert len(list(mutations.places(ast.parse("if CHECKING:\n    a = 1\n")))) == 2


def test_every_module_that_is_named_has_tests_that_are_there() -> None:
    named = {"bounds", "compare", "regression", "coordinates", "equations", "routes", "integrate"}
    assert {Path(room).stem for room in mutants.TESTS if "integrate/" not in room} == named
    assert all((ROOT / room).exists() for room in mutants.TESTS)
    assert (
        mutants.room_of("rigidpend/orbits/integrate/states.py")[0]
        == "rigidpend/orbits/integrate/states.py"
    )
    assert mutants.room_of("rigidpend/orbits/integrate/batch.py")[0] == "rigidpend/orbits/integrate"
    for path in mutants.files():
        tests = *mutants.quick_of(path), *mutants.room_of(path)[1]
        assert all((ROOT / test).exists() for test in tests)
    for name in mutants.QUICK:
        assert any(path.startswith(name) for path in mutants.files()), name
    assert all((ROOT / test).exists() for test in mutants.WIDE)
    for test in mutants.SLOW:
        file, _, function = test.partition("::")
        assert f"def {function.partition('[')[0]}" in (ROOT / file).read_text()


def declared(folder: Path, *entries: dict[str, Any]) -> Path:
    """A file that declares some mutants to be equivalent."""
    path = folder / "declared.yaml"
    path.write_text(yaml.safe_dump(list(entries)))
    return path


def entry_of(mutant: mutations.Mutant, **others: Any) -> dict[str, Any]:
    line = (ROOT / mutant.path).read_text().splitlines()[mutant.line - 1].strip()
    return {"path": mutant.path, "line": line, "change": mutant.said, "reason": "why"} | others


def lonely(path: str) -> mutations.Mutant:
    """A mutant that its line and change tell from all others of a file."""
    every = mutations.mutants(path)
    return next(x for x in every if len(mutations.Entry(**entry_of(x)).fits()) == 1)


def twins(path: str) -> list[mutations.Mutant]:
    """Mutants of a file that are of one line and one change."""
    return next(
        found
        for x in mutations.mutants(path)
        if len(found := mutations.Entry(**entry_of(x)).fits()) > 1
    )


def test_a_declared_mutant_is_found_by_its_line_and_its_change(tmp_path: Path) -> None:
    mutant = lonely(CERTAINTY)
    assert mutations.equivalent(declared(tmp_path, entry_of(mutant))) == {mutant: "why"}


@pytest.mark.parametrize("stale", [{"line": "no such line"}, {"change": "1  ->  7"}, {"nth": 2}])
def test_an_entry_that_fits_no_mutant_is_an_error(tmp_path: Path, stale: dict[str, Any]) -> None:
    entry = entry_of(lonely(CERTAINTY), **stale)
    with pytest.raises(ValueError, match="fits 0 mutants, not one: rigidpend/routes/certainty"):
        mutations.equivalent(declared(tmp_path, entry))


def test_an_entry_that_fits_several_says_which(tmp_path: Path) -> None:
    first, second, *_ = twins(STATES)
    with pytest.raises(ValueError, match=r"fits \d mutants, not one"):
        mutations.equivalent(declared(tmp_path, entry_of(second)))
    chosen = [entry_of(first, nth=1), entry_of(second, nth=2)]
    assert list(mutations.equivalent(declared(tmp_path, *chosen))) == [first, second]


def test_every_declared_mutant_is_one_that_can_be_drawn_and_has_a_reason() -> None:
    reasons = mutations.equivalent()
    assert {mutant.path for mutant in reasons} <= set(mutants.files())
    assert all(reason.endswith(".") for reason in reasons.values())


def test_the_share_is_of_those_that_are_not_equivalent(capsys: pytest.CaptureFixture[str]) -> None:
    chosen = mutations.mutants(CERTAINTY)[:5]
    verdicts = mutants.Verdicts(None)
    for mutant, found in zip(chosen, ["killed", "timeout", "survived", "killed"], strict=False):
        verdicts.add(mutant, found)
    assert mutants.told(chosen, verdicts, {chosen[4]: "why"}) == 75
    said = capsys.readouterr().out
    assert "1 declared equivalent" in said
    assert "75.0 % killed of the 4 that are not equivalent" in said
    assert "60.0 % killed of all 5 that were drawn" in said
    assert f"equivalent: {chosen[4]}: why" in said
    assert said.count("survived: ") == 1
    assert f"survived: {chosen[2]}" in said


def test_verdicts_that_are_kept_are_those_of_this_code(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    kept = tmp_path / "new" / "verdicts.txt"
    mutant = mutations.mutants(CERTAINTY)[0]
    mutants.Verdicts(kept).add(mutant, "open")
    mutants.Verdicts(kept).add(mutant, "killed")
    assert mutants.Verdicts(kept) == {str(mutant): "killed"}
    monkeypatch.setattr(mutants, "files", lambda: [STATES])
    with pytest.raises(SystemExit, match="on other code"):
        mutants.Verdicts(kept)


@pytest.mark.parametrize(("again", "judged"), [((), [1, 3, 4]), (("--again",), [1, 2, 3, 4])])
def test_a_run_that_was_stopped_goes_on_where_it_was(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    again: Sequence[str],
    judged: Sequence[int],
) -> None:
    monkeypatch.setattr(mutants, "files", lambda: [CERTAINTY])
    every = mutations.mutants(CERTAINTY)
    chosen = random.Random(3).sample(every, 6)
    verdicts = mutants.Verdicts(tmp_path / "kept")
    for mutant, found in zip(chosen, ["killed", "open", "survived"], strict=False):
        verdicts.add(mutant, found)
    asked: list[mutations.Mutant] = []

    def run(open_: list[mutations.Mutant], _: int, __: float, known: mutants.Verdicts) -> None:
        asked.extend(open_)
        for mutant in open_:
            known.add(mutant, "killed")

    monkeypatch.setattr(mutants, "run", run)
    monkeypatch.setattr(mutants, "equivalent", lambda: {chosen[5]: "why"})
    options = ["--seed=3", "--count=6", "--least=81", f"--keep={tmp_path / 'kept'}"]
    monkeypatch.setattr("sys.argv", ["mutants", *options, *again])
    assert mutants.main() == (0 if again else 1), "4 of 5, or all"
    assert asked == [chosen[k] for k in judged]
    assert f"6 of {len(every)} mutants, {len(judged)} to be judged" in capsys.readouterr().out


def desk(folder: Path, monkeypatch: pytest.MonkeyPatch, *paths: str) -> mutants.Desk:
    """A desk whose copy holds these files only, with compiled code and a map of the code as is."""
    monkeypatch.setattr(mutants, "COPIED", ())
    made = mutants.Desk(folder, 1, 7.0)
    for path in paths:
        (folder / "0" / path).parent.mkdir(parents=True, exist_ok=True)
        (folder / "0" / path).write_text((ROOT / path).read_text())
        for test in mutants.quick_of(path):
            (folder / "0" / test).parent.mkdir(parents=True, exist_ok=True)
            (folder / "0" / test).touch()
    for kind in ("maps", "kernels"):
        (folder / "compiled" / "rigidpend" / kind).mkdir(parents=True)
    return made


@pytest.mark.parametrize(
    ("path", "kinds"), [(STATES, ["kernels"]), (CERTAINTY, ["kernels", "maps"])]
)
def test_a_mutant_is_alone_with_what_it_compiles_and_is_undone(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, path: str, kinds: list[str]
) -> None:
    mutant, calls = mutations.mutants(path)[0], []
    made = desk(tmp_path, monkeypatch, path)
    quick, room = mutants.quick_of(path), mutants.room_of(path)[1]

    def passes(folder: Path, tests: Any, cache: Path, limit: float, *, wide: bool) -> bool:
        assert (folder / path).read_text() == mutations.source(mutant)
        assert cache != made.compiled
        calls.append((tests, limit, wide, sorted(x.name for x in (cache / "rigidpend").iterdir())))
        (cache / "rigidpend" / "of the mutant").mkdir(exist_ok=True)
        return not wide

    monkeypatch.setattr(mutants, "passes", passes)
    made.limits = {room: 11.0, mutants.WIDE: 12.0}
    assert made.judge(mutant) == "open"
    assert made.judge(mutant, wide=True) == "killed"
    first, second, last = calls
    assert first == (quick, 11.0, False, kinds)
    assert second == (room, 11.0, False, sorted([*kinds, "of the mutant"]))
    assert last == (mutants.WIDE, 12.0, True, kinds), "nothing of the call before"
    assert (tmp_path / "0" / path).read_text() == (ROOT / path).read_text()
    assert made.free.qsize() == 1


def test_who_survives_his_own_tests_sits_through_the_wide_ones(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    first, second, third = mutations.mutants(CERTAINTY)[:3]
    judged, measured = [], []

    def judge(_: Any, mutant: mutations.Mutant, *, wide: bool) -> str:
        judged.append((mutant, wide))
        return "survived" if wide else "killed" if mutant == second else "open"

    monkeypatch.setattr(mutants, "COPIED", ())
    monkeypatch.setattr(mutants.Desk, "judge", judge)
    monkeypatch.setattr(mutants.Desk, "measure", lambda _, tests: measured.append(tests))
    verdicts = mutants.Verdicts(None)
    verdicts.add(third, "open")
    mutants.run([first, second, third], 1, 0, verdicts)
    assert judged == [(first, False), (second, False), (first, True), (third, True)]
    assert measured == [mutants.room_of(CERTAINTY)[1], mutants.WIDE]
    found = {str(first): "survived", str(second): "killed", str(third): "survived"}
    assert verdicts == found
