"""The command line, through real processes in another folder, without a display."""

from __future__ import annotations

import importlib.metadata
import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

import h5py
import pytest
from click.testing import CliRunner

from rigidpend import cli, runner, store
from rigidpend.cli import common
from rigidpend.integrate import engines
from tests.config.samples import SMALL, changed, written

REFERENCE = Path(__file__).resolve().parents[1] / "results" / "reference"
ENVIRONMENT = {name: x for name, x in os.environ.items() if name != "DISPLAY"}

Done = subprocess.CompletedProcess[str]


def call(folder: Path, *arguments: str, backend: str = "nonsense") -> Done:
    """`python -m rigidpend` in a folder, in an environment without a display."""
    done = subprocess.run(
        [sys.executable, "-W", "error", "-m", "rigidpend", *arguments],
        cwd=folder,
        env=ENVIRONMENT | {"MPLBACKEND": backend},
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )
    assert "Traceback" not in done.stderr, done.stderr
    return done


@pytest.fixture(scope="module")
def desk(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A working directory with a small config beside it."""
    folder = tmp_path_factory.mktemp("desk")
    written(folder, SMALL, "small.yaml")
    return folder


@pytest.fixture(scope="module")
def first(desk: Path) -> Done:
    """The first run of fig4, on one processor."""
    return call(desk, "run", "fig4", "-j", "1", "--out", "deep/results")


@pytest.fixture(scope="module")
def result(desk: Path, first: Done) -> Path:
    assert first.returncode == 0, first.stderr
    return desk / "deep" / "results" / "fig4.h5"


def state(path: Path) -> tuple[bytes, int]:
    return path.read_bytes(), path.stat().st_mtime_ns


def test_a_run_says_why_and_what_it_does_on_stderr(first: Done, result: Path) -> None:
    assert first.stdout == ""
    begin, *reports, end = first.stderr.splitlines()
    assert begin.startswith("fig4: computing (no result yet), ")
    assert [line.split()[:4] for line in reports] == [
        ["fig4:", "left:", "63", "orbits,"],
        ["fig4:", "right:", "32", "orbits,"],
    ]
    assert end.startswith(f"fig4: {Path('deep', 'results', 'fig4.h5')} written, ")


def test_what_is_up_to_date_is_left_alone(desk: Path, result: Path) -> None:
    before = state(result)
    done = call(desk, "run", "fig4", "--out", "deep/results")
    assert (done.returncode, done.stdout) == (0, "")
    assert done.stderr == f"fig4: {Path('deep', 'results', 'fig4.h5')} is up to date\n"
    assert state(result) == before


@pytest.fixture(scope="module")
def forced(desk: Path, result: Path) -> Path:
    """The same again by --force on two processors, in another folder."""
    (desk / "forced").mkdir()
    shutil.copy(result, desk / "forced")
    done = call(desk, "run", "fig4", "--force", "-j", "2", "--out", "forced")
    assert done.returncode == 0, done.stderr
    assert done.stderr.startswith("fig4: computing (--force), ")
    return desk / "forced" / "fig4.h5"


def differing(one: Path, two: Path) -> list[str]:
    """The datasets of fig4 that are not the same in two files."""
    with h5py.File(one, "r") as a, h5py.File(two, "r") as b:
        names = [f"data/{array}/{field}" for array in a["data"] for field in a["data"][array]]
        assert len(names) == 14
        return [name for name in names if a[name][:].tobytes() != b[name][:].tobytes()]


def test_symbols_do_not_depend_on_the_jobs(result: Path, forced: Path) -> None:
    assert {name.rpartition("/")[2] for name in differing(result, forced)} <= {"crossing_time"}


def test_no_result_depends_on_the_jobs(result: Path, forced: Path) -> None:
    assert differing(result, forced) == []


def test_a_changed_config_is_run_again_with_the_reason(desk: Path, forced: Path) -> None:
    setting = ("--set", "problem.n_symbols=2", "--set", "numerics.precisions=[53]")
    done = call(desk, "run", "fig4", "--out", "forced", *setting)
    assert done.returncode == 0
    assert done.stderr.startswith("fig4: computing (its config changed), ")
    with h5py.File(forced, "r") as file:
        assert file["data/left/codes"].shape == (2, 63)


def test_a_read_only_folder_of_configs_is_enough(tmp_path: Path) -> None:
    (tmp_path / "configs").mkdir()
    path = written(tmp_path / "configs", SMALL, "mine.yaml")
    path.chmod(0o444)
    (tmp_path / "configs").chmod(0o555)
    done = call(tmp_path, "run", "mine")
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "results" / "mine.h5").is_file()
    assert [x.name for x in (tmp_path / "configs").iterdir()] == ["mine.yaml"]


@pytest.mark.parametrize(
    ("suffix", "start"), [("png", b"\x89PNG"), ("svg", b"<?xml"), ("pdf", b"%PDF")]
)
def test_render_draws_without_a_display(
    desk: Path, result: Path, suffix: str, start: bytes
) -> None:
    given = ("--out", "deep/results", "--format", suffix)
    done = call(desk, "render", "fig4", *given, backend="TkAgg")
    target = Path("deep", "results", f"fig4.{suffix}")
    assert (done.returncode, done.stdout) == (0, "")
    assert done.stderr == f"fig4: {target} drawn\n"
    assert (desk / target).read_bytes().startswith(start)


def test_render_does_not_care_for_the_shell_s_backend(desk: Path, result: Path) -> None:
    assert call(desk, "render", "fig4", "--out", "deep/results").returncode == 0


def test_verify_passes_against_the_reference(desk: Path) -> None:
    done = call(desk, "verify", "fig4", "--reference", str(REFERENCE))
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout == f"fig4: the same as in {REFERENCE / 'fig4.h5'}\n"


def test_verify_fails_against_a_tampered_copy(tmp_path: Path) -> None:
    shutil.copy(REFERENCE / "fig4.h5", tmp_path)
    with h5py.File(tmp_path / "fig4.h5", "a") as file:
        codes = file["data/right/codes"]
        codes[14, 31] = 1 - codes[14, 31]
    done = call(tmp_path, "verify", "fig4", "--reference", ".")
    assert (done.returncode, done.stderr) == (1, "")
    assert done.stdout.splitlines() == [
        "fig4: differs from fig4.h5",
        "  right: codes differ in 1 cells, first [14, 31]",
    ]


def test_describe_prints_what_follows_from_the_parameters(tmp_path: Path) -> None:
    done = call(tmp_path, "describe", "fig4")
    assert (done.returncode, done.stderr) == (0, "")
    rows = dict(line.split(maxsplit=1) for line in done.stdout.splitlines()[1:])
    assert rows["alpha0"].split() == ["1.910633236249019", "rad"]
    assert rows["kappa"].split()[0] == "1.333333333333333"
    assert rows["nu"].split()[0] == "4.442882938158366"
    assert rows["Melnikov"].split()[:4] == ["zeros", "1.563050,", "4.704643", "rad,"]


def test_the_installed_command_is_this_one() -> None:
    [entry] = importlib.metadata.entry_points(group="console_scripts", name="rigidpend")
    assert entry.load() is cli.main


def test_list_names_every_config_with_its_experiment(tmp_path: Path) -> None:
    done = call(tmp_path, "list")
    assert (done.returncode, done.stderr) == (0, "")
    rows = [line.split("\t") for line in done.stdout.splitlines()]
    [path] = [path for name, kind, path in rows if (name, kind) == ("fig4", "route_codes")]
    assert Path(path).is_file()


WRONG = {
    # The command, the exit code, the sentence.
    "unknown config": (("run", "fig"), 2, "fig: no such config; did you mean fig"),
    "unknown key": (
        ("run", "fig4", "--set", "problem.mew=1"),
        2,
        "--set problem.mew=1: problem.mew: unknown key",
    ),
    "no result to draw": (
        ("render", "fig4", "--out", "none"),
        1,
        f"rigidpend: {Path('none', 'fig4.h5')} is not there; call: rigidpend run fig4",
    ),
    "no reference": (
        ("verify", "fig4", "--reference", "none"),
        1,
        f"rigidpend: {Path('none', 'fig4.h5')}: there is no such file",
    ),
    "file for a folder": (
        ("run", "small.yaml", "--out", "small.yaml/sub"),
        1,
        f"rigidpend: {Path('small.yaml', 'sub', 'small.h5')}: small.yaml/sub is not writable",
    ),
}


@pytest.mark.parametrize(("command", "code", "sentence"), WRONG.values(), ids=WRONG)
def test_what_goes_wrong_is_one_sentence_and_an_exit_code(
    desk: Path, command: tuple[str, ...], code: int, sentence: str
) -> None:
    done = call(desk, *command)
    assert (done.returncode, done.stdout) == (code, "")
    last = done.stderr.splitlines()[-1]
    assert last.startswith(sentence)
    # An error of a config stands alone, so that its line begins with its place.
    assert done.stderr.count("rigidpend: ") == (0 if code == common.MISUSED else 1)


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["run"], "Missing argument"),
        (["rn", "fig4"], "No such command 'rn'. Did you mean 'run'?"),
        (["run", "fig4", "-j", "0"], "0 is not in the range"),
        (["run", "fig4", "--out", "small.yaml"], "is a file"),
        (["render", "fig4", "--format", "gif"], "'gif' is not one of 'png', 'svg', 'pdf'"),
    ],
)
def test_wrong_usage_is_exit_code_2(
    desk: Path, monkeypatch: pytest.MonkeyPatch, arguments: list[str], said: str
) -> None:
    monkeypatch.chdir(desk)
    done = CliRunner().invoke(cli.main, arguments)
    assert done.exit_code == 2
    assert said in done.stderr


def failing(monkeypatch: pytest.MonkeyPatch, desk: Path, error: BaseException) -> Any:
    """A run in which the computation fails."""

    def fail(*_: Any, **__: Any) -> None:
        raise error

    monkeypatch.chdir(desk)
    monkeypatch.setattr(runner, "run", fail)
    return CliRunner().invoke(cli.main, ["run", "small.yaml", "--out", "failing"])


@pytest.mark.parametrize(
    ("error", "code", "said"),
    [
        (KeyboardInterrupt(), 130, "interrupted; finished results are kept"),
        (engines.EngineError("no heyoka here"), 3, "rigidpend: no heyoka here"),
        (store.StoreError("x.h5: no room"), 1, "rigidpend: x.h5: no room"),
    ],
)
def test_how_a_run_ended_is_its_exit_code(
    desk: Path, monkeypatch: pytest.MonkeyPatch, error: BaseException, code: int, said: str
) -> None:
    done = failing(monkeypatch, desk, error)
    assert done.exit_code == code
    assert done.stderr.splitlines()[-1] == said


def test_an_error_of_ours_is_exit_code_4_with_a_log(
    desk: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    done = failing(monkeypatch, desk, ZeroDivisionError("mine"))
    assert done.exit_code == common.INTERNAL == 4
    assert "Traceback" not in done.output
    [log] = tmp_path.iterdir()
    said = "rigidpend: internal error: ZeroDivisionError('mine'); please report it with"
    assert done.stderr.splitlines()[-1] == f"{said} {log}"
    assert log.read_text().startswith("Traceback (most recent call last):")
    assert log.read_text().endswith("ZeroDivisionError: mine\n")
    assert "in fail\n" in log.read_text()


@pytest.mark.parametrize("names", [("a.yaml", "sub/a.yaml"), ("fig4", "fig4.yaml")])
def test_two_configs_of_one_name_are_wrong_usage(tmp_path: Path, names: tuple[str, str]) -> None:
    (tmp_path / "sub").mkdir()
    for name in ("a.yaml", "sub/a.yaml", "fig4.yaml"):
        written(tmp_path, SMALL, name)
    done = call(tmp_path, "run", *names)
    stem = Path(names[0]).stem
    assert (done.returncode, done.stdout) == (2, "")
    assert f"{names[1]} would both be stored as {stem}.h5" in done.stderr
    assert not (tmp_path / "results").exists()


def test_list_goes_on_past_a_config_that_is_bad(tmp_path: Path) -> None:
    (tmp_path / "configs").mkdir()
    bad = written(tmp_path / "configs", changed("mu: 0.001", "mu: x", SMALL), "a_bad.yaml")
    written(tmp_path / "configs", SMALL, "z_good.yaml")
    done = call(tmp_path, "list")
    rows = {line.split("\t")[0]: line.split("\t")[1] for line in done.stdout.splitlines()}
    assert done.returncode == 0
    assert rows["a_bad"] == "cannot be used"
    assert rows["z_good"] == "route_codes"
    assert f"{bad.relative_to(tmp_path)}:7:7: problem.mu: " in done.stderr


def test_what_is_not_a_result_of_ours_is_overwritten_only_by_force(tmp_path: Path) -> None:
    written(tmp_path, SMALL, "small.yaml")
    (tmp_path / "results").mkdir()
    target = tmp_path / "results" / "small.h5"
    target.write_bytes(b"mine")
    done = call(tmp_path, "run", "small.yaml")
    assert done.returncode == 1
    assert done.stderr.startswith(f"rigidpend: {target.relative_to(tmp_path)}: ")
    assert done.stderr.endswith("; move it away, or overwrite it with --force\n")
    assert target.read_bytes() == b"mine"
    assert call(tmp_path, "run", "small.yaml", "--force").returncode == 0
    assert store.attributes(target)["name"] == "small"


def test_later_configs_are_checked_before_the_first_is_computed(tmp_path: Path) -> None:
    written(tmp_path, SMALL, "good.yaml")
    written(tmp_path, changed("mu: 0.001", "mu: x", SMALL), "bad.yaml")
    done = call(tmp_path, "run", "good.yaml", "bad.yaml")
    assert done.returncode == 2
    assert done.stderr.startswith("bad.yaml:7:7: problem.mu: ")
    assert not (tmp_path / "results").exists()
