"""Results under names of others, values of all kinds in configs, names of all kinds, by lot."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from rigidpend import render
from rigidpend.config import catalogue
from rigidpend.config.complaints import ConfigError
from rigidpend.results import store
from rigidpend.runs import loading, runner
from tests.attacks import lot
from tests.attacks.craft import REFERENCE
from tests.config.samples import SMALL, written

KEYS = [
    *("A", "r", "mu", "h0", "J1_0", "n_symbols", "only"),
    *("start", "step", "count", "precisions", "experiment", "figure"),
]
VALUES = [
    *("", "~", "null", "true", "0", "-0", "-1", "1e-400", "1e400", "0.1#c", "0.1 #c", "1_000"),
    *("[]", "{}", "[[]]", "{a: 1}", "[1, 2]", "[1, 2, 3]", "[53, 54]", "[64, 53]", "[9001]"),
    *("'1'", '"0.5"', "&a 1", "*a", "!!int 1", "0x10", "0o7", "1:30", "2024-01-01", ".5", "5."),
    *("nan", ".inf", "pi", "1/0", "sin(1e9)", "2**64", "1e5001", "x" * 9000, "- 1", "٣", "1 2"),
]
"""What YAML or a reader of numbers may take for something else."""
PIECES = [*"aZ9_.,=+-~/\\ :*?\0\n", "..", "con", "NUL", "com1", ".certificate", ".h5", "é", "all"]


def test_any_value_of_any_key_loads_or_is_refused_in_short_lines(tmp_path: Path) -> None:
    with lot.drawn("values") as chance:
        for _ in range(lot.trials(40)):
            key, value = chance.choice(KEYS), chance.choice(VALUES)
            head, _, rest = SMALL.partition(f"{key}: ")
            # What stands to the end of its line, or of its entry in a mapping in one line.
            ended = min(rest.find(end) for end in ",}\n" if end in rest)
            old = rest.find("]") + 1 if rest[0] == "[" else ended
            text = f"{head}{key}: {value}{rest[old:]}"
            said = ""
            try:
                loading.load(written(tmp_path, text))
            except ConfigError as error:
                said = str(error)
            assert all(len(line) < 700 for line in said.splitlines()), (key, value[:40])
            assert "Traceback" not in said


def test_any_name_stays_in_its_folder_or_is_refused(tmp_path: Path) -> None:
    config, refused = written(tmp_path, SMALL), list[str]()
    with lot.drawn("names") as chance:
        for _ in range(lot.trials(60)):
            name = "".join(chance.choices(PIECES, k=chance.randrange(1, 6)))
            try:
                [group] = loading.load_groups([config], name=name)
            except ConfigError as error:
                refused.append(str(error))
                continue
            target = tmp_path / f"{group.members[0].name}.h5"
            assert target.parent.resolve() == target.resolve().parent == tmp_path.resolve()
            assert not target.name.casefold().endswith(".certificate.h5")
            target.write_bytes(b"")
            assert target.stem == name
            target.unlink()
    assert refused
    assert max(map(len, refused)) < 400


@pytest.mark.slow
def test_a_result_under_another_name_is_never_taken_for_that_result(tmp_path: Path) -> None:
    stored = {path.stem: path for path in sorted(REFERENCE.glob("*.h5"))}
    known = {name: path for name, path in catalogue.known().items() if name in stored}
    with lot.drawn("exchanged results") as chance:
        for _ in range(lot.trials(6, 0.05)):
            mine, other = chance.sample(sorted(known), 2)
            shutil.copyfile(stored[other], tmp_path / f"{mine}.h5")
            config = loading.load(known[mine])
            try:
                said = runner.plan(config, tmp_path).reason
            except store.StoreError as error:
                said = str(error)
            assert said, (mine, other)
            # Drawn, it says whose result it is: by its own name.
            shown = render.captions.bodies(store.load(tmp_path / f"{mine}.h5"))
            assert shown == render.captions.bodies(store.load(stored[other]))
