"""Reading YAML: what is refused, and where, before any meaning is looked at."""

import re
from pathlib import Path

import pytest

from rigidpend.config import complaints, reader
from rigidpend.config.complaints import ConfigError
from rigidpend.runs import loading
from tests.config.samples import FIG4, TEXT, changed, complaint, refused, written


@pytest.mark.parametrize("opening", ["[", "{a: ", "- "])
def test_nesting_is_bounded(tmp_path: Path, opening: str) -> None:
    closing, most = {"[": "]", "{a: ": "}", "- ": "x"}[opening], reader.MOST_DEPTH
    for depth in (most + 2, 200):
        [problem] = refused(written(tmp_path, opening * depth + closing * depth))
        assert "deeper" in problem.message or "not YAML" in problem.message
        assert problem.origin.line == 1
    tree = reader.parse("[" * most + "x" + "]" * most, "given").tree
    for _ in range(most):
        [tree] = tree
    assert tree == "x"


def test_a_huge_file_is_not_parsed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("yaml.parse", None)
    path = written(tmp_path, TEXT + "#" * reader.MOST_BYTES)
    [problem] = refused(path)
    assert (
        str(problem)
        == f"{path}: larger than {reader.MOST_BYTES} bytes, the most that a config may have"
    )


KEYS = "expected keys: experiment, problem"
NO_CONFIGS: dict[str | bytes, str] = {
    b"\x89HDF\r\n\x1a\n\0\0\0": ":1:1: not text in UTF-8",
    bytes(range(256)): ":2:1: not text in UTF-8",
    TEXT.encode("utf-16"): ":1:1: not text in UTF-8",
    TEXT.replace("none", "öde").encode("latin-1"): ":10:1: not text in UTF-8",
    **{f"{x}\n": f":1:1: {KEYS}\n    {x}\n    ^" for x in ("words", '"quoted"', "true")},
    "- a\n- b\n": f":1:1: {KEYS}\n    - a\n    ^",
    **dict.fromkeys(("# a\n", ""), f": {KEYS}"),
}
"""Contents of files, and what is said behind their path."""


@pytest.mark.parametrize("text", NO_CONFIGS, ids=range(len(NO_CONFIGS)))
def test_what_holds_no_keys_is_refused_with_its_line(tmp_path: Path, text: str | bytes) -> None:
    path = written(tmp_path, text)
    [problem] = refused(path)
    assert str(problem) == f"{path}{NO_CONFIGS[text]}"
    absent, folder = (refused(x)[0] for x in (tmp_path / "none.yaml", tmp_path))
    assert str(absent) == f"{tmp_path / 'none.yaml'}: cannot be read: No such file or directory"
    assert str(folder) == f"{tmp_path}: cannot be read: Is a directory"


@pytest.mark.parametrize("end", ["\r\n", "\r"])
def test_line_ends_of_other_systems_keep_the_places_and_a_mark_of_order_does_no_harm(
    tmp_path: Path, end: str
) -> None:
    text = changed("mu: 0.001", "mu: x")
    path = written(tmp_path, text.replace("\n", end))
    [problem] = refused(path)
    assert str(problem) == complaint(path, text, "x ", "problem.mu", problem.message)
    marked = b"\xef\xbb\xbf" + TEXT.replace("\n", end).encode()
    assert loading.load(written(tmp_path, marked)).content == loading.load(FIG4).content


def test_scalars_stay_text_but_for_true_false_and_null() -> None:
    given = "[1e-10, 0.1, no, yes, True, 1:30, 0o7, 'true', \"null\", true, false, null, ~, ]"
    assert reader.parse(given, "given").tree == [
        *("1e-10", "0.1", "no", "yes", "True", "1:30", "0o7", "true", "null"),
        *(True, False, None, None),
    ]


def test_all_that_settings_and_schema_refuse_is_said_at_once(tmp_path: Path) -> None:
    text = changed("mu: 0.001", "mu: x")
    text = changed("engine: auto", "engine: turbo", changed("count: 63", "count: x", text))
    text = changed("r: [1, 1, 0]", "r: [1, 1, 1]", changed("A: [2, 1,", "A: [1, 2,", text))
    settings = "numerics.x=1", "problem.n_symbols=1/2", "problem.A.3=*a", "no"
    found = refused(written(tmp_path, text), settings)
    origins = [f"--set {settings[k]}" for k in (2, 3, 1, 0)]
    assert [str(x.origin) for x in found[:4]] == origins
    said = [(x.origin.line, ".".join(map(str, x.place)), x.message[:11]) for x in found[4:]]
    assert said == [
        (6, "problem.A", "A1 > A3 > A"),
        (7, "problem.r", "r3 = 0 is b"),
        (8, "problem.mu", "'x' is not "),
        (13, "problem.arrays.left.count", "'x' is not "),
        (17, "numerics.engine", "expected au"),
    ]
    text = changed("experiment: route_codes", "experiment: x")
    wrong = [str(x.origin) for x in refused(written(tmp_path, text), ["numerics=*a"])]
    assert wrong == ["--set numerics=*a", f"{tmp_path / 'given.yaml'}:3:13"]


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("a: [1, 2\nb: 3\n", "t:2:2: not YAML: expected ',' or ']', but got ':'.* in line 1$"),
        ("a: 1\nb: 'x\nc: 2\n", "t:4:1: not YAML: found unexpected end.* begins in line 2$"),
        (
            "a:\n  b: 1\n c: 2\n",
            "t:3:2: not YAML: expected <block end>.*: lines of one part must begin in one column$",
        ),
        ("a: [1\n", "t:2:1: not YAML: .* begins in line 1$"),
        ("a: [1 }\n", "t:1:7: not YAML: expected ',' or ']', but got '}'$"),
        ("a: *a\nb: c: d\n", "t:1:4: a: anchors and aliases"),
        ("a: 1\nb: \a\n", "t:2:1: not YAML: unacceptable character #x0007"),
    ],
)
def test_what_is_no_yaml_is_said_with_the_line_where_it_begins(text: str, told: str) -> None:
    with pytest.raises(ConfigError) as caught:
        reader.parse(text, "t")
    assert re.match(told, str(caught.value), re.MULTILINE)


@pytest.mark.parametrize("value", ['"\\0"', '"\\e[31m"', '"\\ud800"', '"\\x7f"', '"\\x9f"'])
def test_control_characters_reach_neither_results_nor_the_terminal(
    tmp_path: Path, value: str
) -> None:
    path = written(tmp_path, changed('figure: "4"', f"figure: {value}"))
    [problem] = refused(path)
    assert problem.message.startswith("a value with control characters: '")
    assert str(problem).isascii()
    [in_key] = refused(written(tmp_path, changed("  mu:", f"  {value}:")))
    assert in_key.message == "a key must be a plain word"
    assert "\x1b" not in str(in_key)


@pytest.mark.parametrize("blank", [150, 900])
def test_a_long_line_is_shown_around_the_place(tmp_path: Path, blank: int) -> None:
    text = changed("[2, 1, 1.5]", f"[{'2, ' * 300}x, {'2, ' * 300}2]")
    path = written(tmp_path, text.replace("r: [1", "r: [" + " " * blank + "y"))
    last = refused(path)[-1]
    said, line, caret = str(last).splitlines()
    assert len(line) <= 4 + complaints.MOST_LINE
    assert line[caret.index("^")] == "y"
    assert caret.index("^") == 4 + complaints.MOST_LINE // 2, "with what stands before it"
    assert len(said) < 500


@pytest.mark.parametrize(
    ("text", "blanks"),
    [('{"日Ａ": *a}', " " * 9), ('["a\tb", *a]', " " * 3 + "\t" + " " * 4)],
)
def test_a_caret_stands_below_wide_characters_and_tabs(text: str, blanks: str) -> None:
    with pytest.raises(ConfigError) as caught:
        reader.parse(text, "given")
    assert str(caught.value).splitlines()[1:] == [f"    {text}", f"    {blanks}^"]


def test_many_faults_are_counted(tmp_path: Path) -> None:
    text = TEXT + "".join(f"key{i}: 1\n" for i in range(100))
    with pytest.raises(ConfigError, match=r"\nand 80 more$") as caught:
        loading.load(written(tmp_path, text))
    assert len(caught.value.complaints) == 100
    assert str(caught.value).count("unknown key") == complaints.MOST_SHOWN


def test_the_number_of_values_is_bounded(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(reader, "MOST_VALUES", 4)
    assert reader.parse("[1, 2, 3]", "given").tree == ["1", "2", "3"]
    with pytest.raises(ConfigError, match="more than 4 values"):
        reader.parse("[1, 2, 3, 4]", "given")
