"""The mutation runner: what it changes, which tests it asks, and what it takes for a verdict."""

from __future__ import annotations

import ast
import re
from pathlib import Path
from typing import Any

import pytest
import yaml

from scripts import mutants, mutations, reached

ROOT = Path(__file__).resolve().parents[1]
CERTAINTY = "rigidpend/routes/certainty.py"
NOTHING = reached.Reach({}, {})


@pytest.mark.parametrize(
    ("before", "after"),
    [
        ("a == b", ["a != b"]),
        ("a < b", ["a <= b", "a * 0.5 < b", "a < b * 0.5", "a * 0.99 < b", "a < b * 0.99"]),
        ("a > 0", ["a >= 0"]),
        ("a + b", ["a - b"]),
        ("a // b", ["a * b"]),
        ("a and b", ["a or b", "b", "a"]),
        ("not a", ["a"]),
        ("-a", ["a"]),
        ("3", ["4", "0"]),
        ("0.5", ["1.0"]),
        ("0.0", ["1.0"]),
        ("True", ["False"]),
        ("max(a.b, 1)", ["min(a.b, 1)"]),
        ("np.minimum(a, b)", ["np.maximum(a, b)"]),
        ("np.isnan(a)", ["np.isnan(a) & False"]),
        ("f(a, b.c, d)", ["f(b.c, a, d)"]),
    ],
)
def test_an_expression_is_changed(before: str, after: list[str]) -> None:
    node = ast.parse(before, mode="eval").body
    assert [ast.unparse(x) for x in mutations.changes(node)] == after
    assert ast.unparse(node) == before, "the node itself stays"


@pytest.mark.parametrize(
    ("before", "after"),
    [
        ("return a", ["return None"]),
        ("f(a)", ["None"]),
        ("a += 1", ["a -= 1"]),
        ("if a:\n    b", ["if not a:\n    b"]),
        ("if a:\n    raise b", ["if not a:\n    raise b", "if False:\n    raise b"]),
        ("while a:\n    b", ["while not a:\n    b"]),
        ("MOST = 2 ** (-6)", ["MOST = 2 ** (-6) * 10", "MOST = 2 ** (-6) * 0.5"]),
    ],
)
def test_a_statement_is_changed(before: str, after: list[str]) -> None:
    [node] = ast.parse(before).body
    assert [ast.unparse(ast.fix_missing_locations(x)) for x in mutations.changes(node)] == after


@pytest.mark.parametrize("text", ["a", "'word'", "f(a)[b]", "a.b", "(a, b)", "return None"])
def test_names_texts_and_ends_that_return_nothing_are_left_alone(text: str) -> None:
    [node] = ast.parse(text).body
    assert not list(mutations.changes(node.value if isinstance(node, ast.Expr) else node))


@pytest.mark.parametrize(
    ("text", "without"),
    [
        ("key = (a, b)", ["(b,)", "(a,)"]),
        ("def followed(a):\n    return [a, b]", ["[b]", "[a]"]),
        ("c = digest({1: a, **b})", ["{**b}", "{1: a}"]),
        ("c = (a, b)", []),
    ],
)
def test_a_key_loses_its_parts(text: str, without: list[str]) -> None:
    found = [
        ast.unparse(x)
        for place in mutations.places(ast.parse(text))
        for x in mutations.changes(place.node, keyed=place.keyed)
        if isinstance(x, ast.Tuple | ast.List | ast.Dict)
    ]
    assert found == without


def test_annotations_decorators_and_docstrings_are_left_alone() -> None:
    annotated = '@f(3)\ndef f(a: Literal[1]) -> Literal[2]:\n    """Three 3."""\n    b: C[3] = a'
    for text, changed in (
        (annotated, 0),
        ("if TYPE_CHECKING:\n    a = 1\n", 0),
        ("if CHECKING:\n    a = 1\n", 2),
        ("b = zip(a, strict=True)", 0),
        ("b = sorted(a, reverse=True)", 1),
    ):
        every = mutations.places(ast.parse(text))
        assert sum(len(list(mutations.changes(place.node))) for place in every) == changed


def test_numbers_of_a_drawing_are_taste() -> None:
    of_drawing = mutations.mutants("rigidpend/experiments/route_codes/draw.py")
    assert of_drawing
    assert not any(re.match(r"[\d.]+  ->", x.said) for x in of_drawing)


def test_the_source_has_the_one_change_that_is_said() -> None:
    text = (ROOT / CERTAINTY).read_text()
    for mutant in mutations.mutants(CERTAINTY)[::40]:
        plain, slip = (mutations.source(text, x) for x in (None, mutant))
        assert plain != slip
        assert len(set(plain.splitlines()) ^ set(slip.splitlines())) <= 2, str(mutant)


def test_a_lot_stays_where_other_code_changes_and_a_larger_one_holds_it() -> None:
    here = mutations.mutants(CERTAINTY)
    some = mutations.drawn(here, 20, 1)
    assert len({(x.path, x.place) for x in some}) == 20, "one of a place"
    assert mutations.drawn(here, 30, 1)[:20] == some
    assert mutations.drawn(here, 20, 2) != some
    both = [*here, *mutations.mutants("rigidpend/routes/codes.py")]
    of_both = mutations.drawn(both, len(both), 1)
    assert [x for x in of_both if x.path == CERTAINTY][:20] == some


def declared(folder: Path, **changed: Any) -> Path:
    """A file that declares a mutant to be equivalent."""
    mutant = mutations.mutants(CERTAINTY)[0]
    entry = {"path": mutant.path, "line": mutant.text, "change": mutant.said, "reason": "why"}
    (folder / "declared.yaml").write_text(yaml.safe_dump([entry | changed]))
    return folder / "declared.yaml"


def test_a_declared_mutant_is_found_by_its_line_and_its_change(tmp_path: Path) -> None:
    found = mutations.equivalent(declared(tmp_path))
    assert found == {mutations.mutants(CERTAINTY)[0]: "why"}


@pytest.mark.parametrize("stale", [{"line": "no such line"}, {"change": "1  ->  7"}, {"nth": 99}])
def test_an_entry_that_fits_no_mutant_is_an_error(tmp_path: Path, stale: dict[str, Any]) -> None:
    with pytest.raises(ValueError, match="fits no mutant: rigidpend/routes/certainty"):
        mutations.equivalent(declared(tmp_path, **stale))


def test_every_declared_mutant_is_one_that_can_be_drawn_and_has_a_reason() -> None:
    reasons = mutations.equivalent()
    assert {mutant.path for mutant in reasons} <= set(mutants.files())
    assert all(reason.endswith(".") for reason in reasons.values())


def test_the_nearest_tests_reach_the_line_the_shortest_first() -> None:
    mutant = next(x for x in mutations.mutants(CERTAINTY) if x.statement != x.text)
    own, other = "tests/routes/test_certainty.py::test_", "tests/x.py::test_"
    seconds = {f"{own}a": 2.5, f"{other}b": 1, f"{own}c": 1, f"{other}d": mutants.NEAR - 4}
    reach = {mutant.statement: [*seconds][:3], "": [*seconds]}
    known = reached.Reach(seconds, {CERTAINTY: reach})
    assert mutants.nearest(mutant, known) == [f"{own}c", f"{own}a", f"{other}b"]
    assert mutants.nearest(mutant._replace(statement="another"), known)[3:] == []
    assert mutants.nearest(mutant, NOTHING) == []


def test_the_rest_are_the_other_files_of_the_mirrored_folder() -> None:
    own = "tests/routes/test_certainty.py"
    rest = mutants.around(mutations.mutants(CERTAINTY)[0], [own])
    assert own not in rest
    assert "tests/routes/test_codes.py" in rest


@pytest.mark.parametrize(
    ("answers", "found", "slips"),
    [
        (["test_a", ""], ("killed", "test_a"), [True, False]),
        (["test_a", "test_a", "", ""], ("survived", ""), [True, False, True, True]),
        (["test_a", "test_a", "test_a"], ("untold", "test_a"), [True, False, True]),
        (["", "test_b", ""], ("killed", "test_b"), [True, True, False]),
        (["", ""], ("survived", ""), [True, True]),
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
    desk = mutants.Desk(tmp_path / "desk", 1, NOTHING, 7.0, quick=False)
    verdict = desk.judge(mutant)
    assert (verdict.found, verdict.by) == found
    assert seen == slips
    copy = tmp_path / "desk" / "0" / CERTAINTY
    assert copy.read_text() == mutations.source(plain), "it is undone"


def test_verdicts_are_kept_and_the_last_one_counts(tmp_path: Path) -> None:
    kept, mutant = tmp_path / "new" / "verdicts.txt", mutations.mutants(CERTAINTY)[0]
    for found in ("open", "killed"):
        mutants.Verdicts(kept).add(mutant, mutants.Verdict(found, "test_a", 3.0))
    assert mutants.Verdicts(kept) == {str(mutant): ("killed", "test_a", 3.0)}


def test_the_share_is_of_those_that_were_judged(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    chosen = mutations.mutants(CERTAINTY)[:6]
    verdicts = mutants.Verdicts(tmp_path / "kept")
    for mutant, found in zip(chosen, ["killed", "timeout", "survived", "killed"], strict=False):
        verdicts.add(mutant, mutants.Verdict(found, "", 1.0))
    assert mutants.told(chosen, verdicts, {chosen[4]: "why"}) == 75
    said = capsys.readouterr().out
    assert "| routes | 6 | 1 | 2 | 1 | 1 | 0 | 0 | 1 |" in said
    assert "75.0 % killed of 4 that were judged" in said
    assert said.count("survived: ") == 1
    assert f"survived: {chosen[2].line}: {chosen[2]}" in said
