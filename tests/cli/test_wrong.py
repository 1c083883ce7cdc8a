"""What goes wrong is one sentence and an exit code, never a traceback."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner

from rigidpend import cli
from rigidpend.cli import common
from rigidpend.machine import workers
from rigidpend.machine.workers import WorkerError
from rigidpend.orbits.integrate import arithmetic
from rigidpend.results import store
from rigidpend.routes.neighbourhood import NoChange
from rigidpend.runs import runner
from tests.cli.calls import ENVIRONMENT, REFERENCE, call
from tests.config.samples import SMALL, written

LONG_WORD = "9x" * 40_000
"""An argument of 80 kB."""

WRONG = """
run fig | 2 | fig: no such config; did you mean fig
run fig4 --set problem.mew=1 | 2 | --set problem.mew=1: problem.mew: unknown key
run fig4 --set problem.J3=1 | 2 | --set problem.J3=1: problem.J3: unknown key: J3 is 0, for M is \
horizontal; with another
describe pipe.yaml | 2 | pipe.yaml: not a file
describe zero.yaml | 2 | zero.yaml: not a file
render fig4 --out no | 3 | rigidpend: no/fig4.h5 is not there; call: rigidpend run fig4 --out no
report fig4 --out no | 3 | rigidpend: no/fig4.h5: there is no such file; call: rigidpend run fig4
certify --check none.certificate.h5 | 3 | rigidpend: none.certificate.h5: there is no such file
verify fig4 --reference none | 3 | rigidpend: none/fig4.h5: there is no such file
run small.yaml --out small.yaml/sub | 1 | rigidpend: small: small.yaml/sub/small.h5: \
small.yaml/sub is not
"""
"""A command, its exit code, and how its sentence begins."""


@pytest.fixture(scope="module")
def strange(desk: Path) -> Path:
    """The desk, with what looks like configs and never ends."""
    os.mkfifo(desk / "pipe.yaml")
    (desk / "zero.yaml").symlink_to("/dev/zero")
    return desk


@pytest.mark.parametrize("case", WRONG.strip().splitlines())
def test_what_goes_wrong_is_one_sentence_and_an_exit_code(strange: Path, case: str) -> None:
    command, code, sentence = case.split(" | ")
    done = call(strange, *command.split())
    assert (done.returncode, done.stdout) == (int(code), "")
    last = done.stderr.splitlines()[-1]
    assert last.startswith(sentence)
    # An error of a config stands alone, so that its line begins with its place.
    assert done.stderr.count("rigidpend: ") == (0 if code == str(common.MISUSED) else 1)


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["run"], "Missing argument"),
        (["rn", "fig4"], "No such command 'rn'. Did you mean 'run'?"),
        (["run", "fig4", "-j", "0"], "0 is not in the range"),
        (["run", "fig4", "-q", "-v"], "--quiet and --verbose exclude each other"),
        (["run", "fig4", "--out", "small.yaml"], "is a file"),
        (["describe", "all", "--resolved"], "--resolved prints one config, not all"),
        (["find", "all", "--code", "0"], "find is about one config, not all"),
        (["completion", "csh"], "'csh' is not one of 'bash', 'zsh', 'fish'"),
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


def failing(monkeypatch: pytest.MonkeyPatch, desk: Path, error: BaseException, out: str) -> Any:
    """A run in which the computation fails."""

    def fail(*_: Any, **__: Any) -> None:
        raise error

    monkeypatch.chdir(desk)
    monkeypatch.setattr(runner, "run", fail)
    return CliRunner().invoke(cli.main, ["run", "small.yaml", "--out", out])


def test_a_library_that_cannot_be_loaded_is_named_with_the_cure(
    desk: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As where the system lacks what its compiled part needs."""
    broken = "raise ImportError('libm.so: cannot open shared object file')"
    (tmp_path / "brittle.py").write_text(broken)
    monkeypatch.syspath_prepend(tmp_path)
    ours = {"__name__": "rigidpend.ours"}
    monkeypatch.setattr(runner, "run", eval("lambda *_, **__: __import__('brittle')", ours))
    monkeypatch.chdir(desk)
    done = CliRunner().invoke(cli.main, ["run", "small.yaml", "--out", "brittle"])
    said = "brittle cannot be loaded (libm.so: cannot open shared object file): install it anew"
    assert (done.exit_code, done.stderr.splitlines()[-1]) == (3, f"rigidpend: small: {said}")


class Ours(ArithmeticError):
    """As a module of the package may derive one."""


@pytest.mark.parametrize(
    ("error", "code", "said"),
    [
        (KeyboardInterrupt(), 130, "interrupted; finished results are kept"),
        (arithmetic.EngineError("no heyoka here"), 3, "rigidpend: small: no heyoka here"),
        (
            ModuleNotFoundError("No module named 'dask'", name="dask"),
            3,
            "rigidpend: small: dask is needed and not installed",
        ),
        (store.StoreError("x.h5: no room"), 1, "rigidpend: small: x.h5: no room"),
        (store.OtherVersion("x.h5: old"), 1, "rigidpend: small: x.h5: old"),
        (WorkerError("killed"), 1, "rigidpend: small: killed"),
        (NoChange("nothing changes"), 1, "rigidpend: small: nothing changes"),
        (Ours("does not converge"), 1, "rigidpend: small: does not converge"),
        (
            MemoryError(),
            1,
            "rigidpend: small: not enough memory; fewer orbits or fewer --jobs need less",
        ),
    ],
)
def test_how_a_run_ended_is_its_exit_code(
    desk: Path, monkeypatch: pytest.MonkeyPatch, error: BaseException, code: int, said: str
) -> None:
    done = failing(monkeypatch, desk, error, "failing")
    assert done.exit_code == code
    assert done.stderr.splitlines()[-1] == said


@pytest.mark.parametrize(
    "error",
    [
        ZeroDivisionError("mine"),
        OverflowError("mine"),
        KeyError("mine"),
        ModuleNotFoundError("No module named 'rigidpend.x'", name="rigidpend.x"),
    ],
)
def test_an_error_of_ours_is_exit_code_4_with_its_traceback_in_the_log(
    desk: Path, monkeypatch: pytest.MonkeyPatch, error: Exception
) -> None:
    done = failing(monkeypatch, desk, error, "ours")
    assert done.exit_code == common.INTERNAL == 4
    assert "Traceback" not in done.output
    log = Path("ours", "small.log")
    said = f"rigidpend: small: internal error: {error!r}; please report it with {log}"
    assert done.stderr.splitlines()[-1] == said
    text = (desk / log).read_text()
    assert "Traceback (most recent call last):" in text
    assert "in fail\n" in text
    assert text.index("computing (no result yet)") < text.index("Traceback")


def test_where_no_log_can_be_written_it_is_a_temporary_file(
    desk: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    done = failing(monkeypatch, desk, ZeroDivisionError("mine"), "small.yaml/sub")
    [log] = tmp_path.iterdir()
    assert done.stderr.splitlines()[-1].endswith(f"please report it with {log}")
    assert log.read_text().startswith("Traceback (most recent call last):")
    assert log.read_text().endswith("ZeroDivisionError: mine\n")


def test_an_error_outside_of_a_run_is_logged_too(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(*_: Any, **__: Any) -> None:
        raise ZeroDivisionError("mine")

    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    monkeypatch.setattr(runner, "recalled", fail)
    done = CliRunner().invoke(cli.main, ["list"])
    assert done.exit_code == 4
    [log] = tmp_path.iterdir()
    assert str(log) in done.stderr


@pytest.mark.slow
def test_a_reader_that_ends_early_is_no_error(tmp_path: Path) -> None:
    with subprocess.Popen(
        [sys.executable, "-m", "rigidpend", "describe", "all"],
        cwd=tmp_path,
        env=ENVIRONMENT,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
    ) as process:
        assert process.stdout is not None
        assert process.stderr is not None
        process.stdout.close()
        said = process.stderr.read()
    assert said == b""


def test_a_name_that_is_no_text_is_a_sentence_too(tmp_path: Path) -> None:
    for arguments in (("run", "\udcff"), ("run", "fig4", "--set", "problem.\udcff=1")):
        done = call(tmp_path, *arguments)
        assert done.returncode == 2
        assert done.stderr.count("\n") == 1


def test_one_written_config_is_enough_to_see_every_fault(tmp_path: Path) -> None:
    text = SMALL.replace("mu: 0.001", "mu: *a").replace("A: [2, 1, 1.5]", "A: [1, 2, 1.5]")
    text = text.replace("r: [1, 1, 0]", "r: [1, 1, 1]\n  r: 3").replace("n_symbols", "n_symbls")
    done = call(written(tmp_path, text, "x.yaml").parent, "run", "x.yaml", "--set", "numerics.x=1")
    places = [line.split(": ")[:2] for line in done.stderr.splitlines() if line[:1] != " "]
    assert places == [
        ["--set numerics.x=1", "numerics.x"],
        ["x.yaml:5:6", "problem.A"],
        ["x.yaml:6:6", "problem.r"],
        ["x.yaml:7:3", "problem.r"],
        ["x.yaml:8:7", "problem.mu"],
        ["x.yaml:11:3", "problem.n_symbls"],
    ]


@pytest.mark.parametrize(
    "arguments",
    [
        ("run", "fig4", "-j", LONG_WORD),
        ("run", f"--{LONG_WORD}"),
        (LONG_WORD,),
        ("render", "fig4", "--format", LONG_WORD),
        ("certify", "--check", LONG_WORD),
    ],
    ids=["number", "option", "command", "choice", "certificate"],
)
def test_a_complaint_repeats_no_long_argument(tmp_path: Path, arguments: tuple[str, ...]) -> None:
    done = call(tmp_path, *arguments)
    assert done.returncode in (1, 2, 3)
    assert 0 < len(done.stderr) < 600
    assert "..." in done.stderr


@pytest.mark.parametrize("place", ["fig1.h5", "fig1.png"])
def test_a_folder_in_the_place_of_a_file_is_said_to_be_in_the_way(
    tmp_path: Path, place: str
) -> None:
    """No advice that leads nowhere: --force writes over no folder."""
    (tmp_path / "results").mkdir()
    shutil.copy(REFERENCE / "fig1.h5", tmp_path / "results")
    (tmp_path / "results" / place).unlink(missing_ok=True)
    (tmp_path / "results" / place).mkdir()
    done = call(tmp_path, "run" if place == "fig1.h5" else "render", "fig1")
    assert done.returncode == 1
    mend = "a folder is in the place of a file: move it away, or remove it if it is not needed"
    assert done.stderr == f"rigidpend: results/{place}: {mend}\n"


def damaged(results: Path, *names: str) -> None:
    """References in a folder of results, the first of them cut short."""
    results.mkdir()
    for name in names:
        shutil.copy(REFERENCE / f"{name}.h5", results)
    os.truncate(results / f"{names[0]}.h5", 1000)


def test_one_bad_result_keeps_no_other_from_being_drawn(tmp_path: Path) -> None:
    results = tmp_path / "results"
    damaged(results, "fig1", "fig2")
    done = call(tmp_path, "render", "all")
    drawn, absent = f"fig2: {Path('results', 'fig2.png')} drawn", "rigidpend run asymptotic_orbits "
    bad, good, last = done.stderr.splitlines()
    assert bad.startswith(f"rigidpend: {Path('results', 'fig1.h5')}: not a readable HDF5 file: ")
    assert bad.endswith("; call: rigidpend run fig1 --force")
    assert (good, done.returncode) == (drawn, 1)
    assert f"; call: {absent}" in last
    # What nobody asked for by name is no failure, unless there is nothing at all.
    (results / "fig1.h5").unlink()
    assert call(tmp_path, "render", "all").returncode == 0
    assert call(tmp_path, "render", "fig2", "fig1").returncode == 3
    assert call(tmp_path, "render", "all", "--out", "none").returncode == 3


@pytest.mark.slow
def test_many_figures_are_drawn_side_by_side_and_a_bad_one_fails(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    damaged(tmp_path / "results", "fig1", "fig2", "fig4")
    monkeypatch.setattr("rigidpend.cli.render.FEW", 2)
    monkeypatch.setattr(workers, "cores", lambda: 2)
    assert call(tmp_path, "render", "all").returncode == 1
    assert {x.name for x in tmp_path.glob("results/*.png")} == {"fig2.png", "fig4.png"}


def test_a_damaged_result_is_said_with_its_remedy_by_whoever_reads_it(tmp_path: Path) -> None:
    results = tmp_path / "results"
    damaged(results, "fig1", "fig2")
    (results / "fig1.h5").rename(results / "mine.h5")
    (results / "mine.log").write_text("rigidpend run fig1 --name mine\n")
    mend = f"; the first line of {Path('results', 'mine.log')} has the command that made it: add"
    for command in (("report",), ("verify", "results/mine.h5"), ("describe", "mine")):
        done = call(tmp_path, *command)
        assert done.returncode == 1
        assert done.stderr.count(mend) == 1, command
    assert mend in (results / "report.html").read_text().replace("&#x27;", "'")
    (results / "mine.log").unlink()
    assert "; make it anew by the config" in call(tmp_path, "render", "mine").stderr
    proof = results / "fig4.certificate.h5"
    proof.write_bytes(b"")
    assert (
        "call: rigidpend certify fig4 --force"
        in call(tmp_path, "certify", "--check", str(proof.relative_to(tmp_path))).stderr
    )
