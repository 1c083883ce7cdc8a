"""What goes wrong is one sentence and an exit code, never a traceback; full disks as well."""

import json
import math
import os
import pickle
import shlex
import shutil
import subprocess
import tempfile
from pathlib import Path
from typing import Any
from unittest.mock import Mock

import click
import numpy as np
import pytest
from click.testing import CliRunner

from rigidpend.cli import common
from rigidpend.cli.find import find_command
from rigidpend.config.catalogue import with_remedy
from rigidpend.experiments import UnknownExperiment
from rigidpend.machine import files, workers
from rigidpend.machine.files import Absent, StoreError
from rigidpend.machine.workers import WorkerError
from rigidpend.numbers.checked import ParameterError
from rigidpend.numbers.exact import ExactError
from rigidpend.orbits.integrate import arithmetic
from rigidpend.results import store
from rigidpend.routes.certainty import Contradiction
from rigidpend.routes.certified.proof_data import Undecided
from rigidpend.routes.neighbourhood import NoChange
from rigidpend.routes.symbolic import NoOrbit
from rigidpend.runs import runner
from tests.cli.calls import REFERENCE, UNTRACED, call
from tests.config.samples import SMALL, written
from tests.processes import python

LONG, NEARLY, LONG_WORD = "n" * 300, "n" * 245, "9x" * 40_000
"""A name that no system takes, one with which no longer one can begin, and 80 kB of argument."""

WRONG = """
run fig | 2 | fig: no such config; did you mean fig
run fig4 --set problem.J3=1 | 2 | --set problem.J3=1: problem.J3: unknown key: J3 is 0, because
run fig4 --set problem.A[0]=3 | 2 | an entry of a list is written problem.A.0=3
run fig4 --set problem.A=2,1,1.5 | 2 | expected a list, got '2,1,1.5'; write [2,1,1.5]
run fig4 --set nsymbols=3 | 2 | unknown key; did you mean problem.n_symbols?
run fig4 --set numerics.engine= | 2 | expected auto, taylor or scipy
run fig4 --set problem.r=[1,1,1] | 2 | gravity turns the body out of every rotation about axis 3
run fig4 fig1 --set problem= | 2 | --set problem=: problem: expected keys
run fig4 fig1 fig2 --set problem.J1_0=1e-9 | 2 | fig2: --set problem.J1_0=1e-9: problem.J1_0: un
run \udcff | 2 | no such config
run \udcfe.yaml | 2 | the name of the file is not text in UTF-8: rename the file
run a\x1bb.yaml | 2 | a?b.yaml: no line can show the name 'a\\x1bb': rename the file
run small.yaml results/../results/small.h5 | 2 | small.h5 would both be stored as small.h5
run fig4 --set problem.\udcff=1 | 2 | problem: input should be a valid string
describe pipe.yaml | 2 | pipe.yaml: not a file
render fig4 --out no | 3 | rigidpend: no/fig4.h5 is not there; call: rigidpend run fig4 --out no
render small.yaml --out no | 3 | no/small.h5 is not there; call: rigidpend run small.yaml --out no
report fig4 --out no | 3 | rigidpend: no/fig4.h5: there is no such file; call: rigidpend run fig4
certify | 2 | give names of configs, or a certificate with --check
certify fig4 --check fig4.h5 | 2 | give names of configs, or a certificate with --check
certify fig1 | 2 | fig1: experiment: the experiment phase_portraits has no route codes to prove
certify fig4_zoom --out no | 3 | call: rigidpend run fig4_zoom
certify --check taken/fig2.h5 | 1 | fig2.h5: neither a certificate, which rigidpend certify writes
certify --check none.h5 | 3 | none.h5: there is no such file
certify --check none.certificate.h5 | 3 | rigidpend: none.certificate.h5: there is no such file
verify small | 3 | results/reference/small.h5: there is no such file; call: rigidpend reference s
verify fig4 --reference none | 3 | rigidpend: none/fig4.h5: there is no such file
run small.yaml --out small.yaml/sub | 1 | is not writable (Not a directory); choose another f
reference small.yaml | 2 | give it with --reason
reference small.yaml --reason '  ' | 2 | give it with --reason
reference small.yaml --reason x --reference small.yaml/sub | 1 | another folder with --reference
run | 2 | Missing argument
rn fig4 | 2 | No such command 'rn'. Did you mean 'run'?
run fig4 -j 0 | 2 | 0 is not in the range
run fig4 -q -v | 2 | --quiet and --verbose exclude each other
run fig4 --out small.yaml | 2 | is a file
run fig4 --out '' | 2 | got empty text
report --to '' | 2 | got empty text
report --to taken/fig2.h5 | 2 | taken/fig2.h5: the name of a page ends in .html
verify fig4 --results no --set problem.mu=0.01 | 2 | --set changes what is computed, and --results c
certify --check '' | 2 | got empty text
find --code 01 --proof '' | 2 | got empty text
run small small --name one | 2 | --name is for one config; several keep their names
run all --name one | 2 | --name is for one config; several keep their names
describe all --resolved | 2 | --resolved prints one config, not all
render fig4 --format gif | 2 | 'gif' is not one of 'png', 'svg', 'pdf'
find fig4 | 2 | Missing option '--code'
find all --code 0 | 2 | find takes one config, not all
find fig1 --code 0 | 2 | find needs one body, one h0 and one J1_0, as in fig4 and fig5
find --code 0a | 2 | symbols are 0 and 1
find --code 01 --near x | 2 | near: 'x' is not understood
find --code 011 --decimals 1 --near 1 | 2 | --decimals lists orbits, and --near chooses one: give o
find --code 01 --code 11 --decimals 1 | 2 | --decimals lists the orbits of one --code,
find --code 01 --decimals 1 --proof x | 2 | --proof proves one orbit of one --code, on this machine
find --code 01 --code 11 --proof x | 2 | --proof proves one orbit of one --code, on this machine
find --code 0 --proof small.yaml/x.orbit.certificate.h5 | 1 | choose another file with --proof
find --code '0^5 1^10' --proof x | 2 | x: the name of a proof ends in .orbit.certificate.h5
find --code '0^5 1^10' | 1 | rigidpend: none exists: passage 1
find --code '0^90 1^3' --decimals 0 | 1 | none of the 7 phases
run small.yaml sub/small.yaml | 2 | sub/small.yaml would both be stored as small.h5
run small.yaml sub/Small.yaml | 2 | both be stored as Small.h5, because some systems ignore c
run route_map --scheduler head | 2 | 'head' is not the address of a scheduler, such as tcp://host:8786
run fig4 --out taken | 1 | taken/fig4.h5: not a readable HDF5 file: not a regular file
render fig4 --out taken | 1 | taken/fig4.h5: not a readable HDF5 file: not a regular file
run fig1 --out taken | 1 | taken/fig1.h5: a folder is in the place of a file: move it away, or rem
render fig2 --out taken | 1 | rigidpend: taken/fig2.png: a folder is in the place of a file: move it
run LONG.yaml | 1 | File name too long
run NEARLY.yaml | 1 | File name too long
run small.yaml --out LONG | 1 | File name too long
run small.yaml --out loop | 1 | loop is not writable (File exists); choose another folder
render fig4 --out LONG | 3 | fig4.h5 is not there
report --out LONG | 1 | File name too long
"""
"""A command, its exit code, and a part of its last line."""


@pytest.fixture(scope="module")
def strange(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a config and twins of it, a pipe, and a folder whose places are taken."""
    desk = tmp_path_factory.mktemp("desk")
    written(desk, SMALL, "small.yaml")
    os.mkfifo(desk / "pipe.yaml")
    (desk / "loop").symlink_to("loop")
    for name in (NEARLY, "\udcfe", "a\x1bb"):
        (desk / f"{name}.yaml").symlink_to("small.yaml")
    for folder in ("sub", "taken", "taken/fig1.h5", "taken/fig2.png"):
        (desk / folder).mkdir()
    for name in ("small", "Small"):
        written(desk / "sub", SMALL, f"{name}.yaml")
    shutil.copy(REFERENCE / "fig2.h5", desk / "taken")
    (desk / "results").mkdir(exist_ok=True)
    shutil.copy(REFERENCE / "fig4.h5", desk / "results" / "small.h5")
    os.mkfifo(desk / "taken" / "fig4.h5")
    return desk


@pytest.mark.parametrize("case", WRONG.strip().splitlines())
def test_what_goes_wrong_is_one_sentence_and_an_exit_code(strange: Path, case: str) -> None:
    command, code, sentence = case.replace("LONG", LONG).replace("NEARLY", NEARLY).split(" | ")
    done = call(strange, *shlex.split(command))
    assert (done.returncode, done.stdout) == (int(code), ""), done
    assert sentence in done.stderr.splitlines()[-1]
    # An error of a config stands alone, so that its line begins with its place.
    assert done.stderr.count("rigidpend: ") == (0 if code == str(common.MISUSED) else 1)


@pytest.mark.parametrize(
    ("command", "code"),
    [("run", 2), ("run fig4 -q -v", 2), ("describe fig", 2), ("find --code 0^5", 1)],
)
def test_what_fails_has_its_document_too(tmp_path: Path, command: str, code: int) -> None:
    done = call(tmp_path, *command.split(), "--json")
    document = json.loads(done.stdout)
    assert document["exit_code"] == done.returncode == code
    assert document["error"] in done.stderr


@pytest.mark.parametrize(
    "command", ["run fig4 -j LONG", "run --LONG", "LONG", "render fig4 --format LONG"]
)
def test_a_complaint_repeats_no_long_argument(tmp_path: Path, command: str) -> None:
    done = call(tmp_path, *command.replace("LONG", LONG_WORD).split())
    assert done.returncode == 2
    assert 0 < len(done.stderr) < 600
    assert "..." in done.stderr


class Ours(ArithmeticError):
    """As a module of the package may derive one."""


CUT = "marshal data too short"
"""What Python says of compiled code that is cut short."""
MEND = f"{CUT}: a full disk cut a file short; remove the folders __pycache__ of rigidpend"
OF_OURS = (
    *(EOFError("x"), FloatingPointError("x"), ZeroDivisionError("x"), OverflowError("x")),
    *(KeyError("x"), ModuleNotFoundError("x", name="rigidpend.x")),
)


@pytest.mark.parametrize(
    ("error", "code", "said"),
    [
        (ExactError("x"), 2, "x"),
        (ParameterError("mu", "x"), 2, "x"),
        (Absent("x"), 3, "x"),
        (arithmetic.EngineError("x"), 3, "x"),
        (ModuleNotFoundError("x", name="dask"), 3, "dask is needed and not installed"),
        *((kind("x"), 1, "x") for kind in (files.StoreError, store.OtherVersion, WorkerError)),
        *((kind("x"), 1, "x") for kind in (NoChange, NoOrbit, Contradiction, Undecided, Ours)),
        (UnknownExperiment("x"), 1, "x"),
        (OSError(28, "no room"), 1, "no room"),
        (
            FileNotFoundError(2, "none"),
            1,
            "the current folder is gone, change to another one: none",
        ),
        (FileNotFoundError(2, "gone", "x" * 1000), 1, f"{'x' * 200}: gone"),
        (MemoryError(), 1, "not enough memory; fewer orbits or fewer --jobs need less"),
        (EOFError(CUT), 4, MEND),
        *((x, 4, f"internal error: {x!r}; please report it with a.log") for x in OF_OURS),
    ],
    ids=lambda x: type(x).__name__,
)
def test_an_error_is_an_exit_code_and_a_sentence(error: Exception, code: int, said: str) -> None:
    """1 failed, 2 wrong values, 3 absent, 4 a fault of ours: as `--help` has them."""
    assert common.exit_code(error) == code
    assert common.sentence(error, lambda _: Path("a.log")) == said


def test_a_library_that_cannot_be_loaded_is_named_with_the_cure(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As where the system lacks what its compiled part needs."""
    broken = "raise ImportError('libm.so: cannot open shared object file')"
    (tmp_path / "brittle.py").write_text(broken)
    monkeypatch.syspath_prepend(tmp_path)
    loads = eval("lambda: __import__('brittle')", {"__name__": "rigidpend.ours"})
    with pytest.raises(ImportError) as caught:
        loads()
    said = "brittle cannot be loaded (libm.so: cannot open shared object file): install it anew"
    assert (common.exit_code(caught.value), common.sentence(caught.value)) == (3, said)


def test_an_error_of_ours_is_in_the_log_with_its_traceback_or_in_a_temporary_file(
    strange: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    monkeypatch.setattr(runner, "run", Mock(side_effect=ZeroDivisionError("mine")))
    for command in ("run small.yaml --out ours", "run small.yaml --out small.yaml/sub", "list"):
        if command == "list":
            monkeypatch.setattr(runner, "plan", Mock(side_effect=KeyError("mine")))
        done = call(strange, *command.split())
        [log] = tmp_path.iterdir() if "ours" not in command else [Path("ours", "small.log")]
        assert done.returncode == common.INTERNAL
        assert done.stderr.splitlines()[-1].endswith(f"please report it with {log}")
        before, _, trace = (
            (strange / log).read_text().partition("Traceback (most recent call last)")
        )
        assert "Error: " in trace
        assert before.count("computing (no result yet)") == command.count("ours")
        assert bool(before) == (not log.is_absolute())
        if log.is_absolute():
            log.unlink()


def test_a_document_is_json_whatever_it_holds() -> None:
    held = {"a": np.array([[1.5, np.nan]]), "b": (math.inf, None, np.bool_(True)), "c": Path("x")}
    done = CliRunner().invoke(click.command("x")(lambda: common.print_json(held)))
    found = json.loads(done.stdout, parse_constant=pytest.fail)
    assert found == {"a": [[1.5, None]], "b": [None, None, True], "c": "x"}


def test_all_codes_are_read_before_the_first_is_searched_for(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(workers, "side_by_side", Mock(side_effect=AssertionError))
    with pytest.raises(ParameterError, match="'2' in a code cannot be read"):
        find_command.main(["--code", "01", "--code", "2"], standalone_mode=False)


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
    assert call(tmp_path, "render", "all", "none.h5").returncode == 3
    named = str(Path("results", "fig1.h5"))
    assert call(tmp_path, "render", named, "all").returncode == 3, "though it is one of all"


def test_an_absent_file_keeps_no_other_from_being_drawn(tmp_path: Path) -> None:
    damaged(tmp_path / "results", "fig1", "fig2")
    good = str(Path("results", "fig2.h5"))
    done = call(tmp_path, "render", "no.h5", "fig3.h5", good)
    told = "no.h5, fig3.h5 are not there; call: rigidpend run fig3 --out ."
    drawn, absent = done.stderr.splitlines()
    assert (drawn, absent) == (f"fig2: {Path('results', 'fig2.png')} drawn", f"rigidpend: {told}")
    assert done.returncode == 3
    done = call(tmp_path, "report", "no.h5", good)
    written = f"{Path('results', 'report.html')} written"
    told = "rigidpend: no.h5: there is no such file"
    assert (done.stderr.splitlines(), done.returncode) == ([told, written], 1)
    done = call(tmp_path, "report", "no.h5", "fig9.h5")
    assert (done.stderr.splitlines(), done.returncode) == ([told, told.replace("no", "fig9", 1)], 3)


def test_more_than_a_few_new_figures_are_drawn_side_by_side(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """To begin the processes is the affair of `workers`, and tested there."""
    names, asked = ["fig1", "fig2", "fig3", "fig4"], []
    damaged(tmp_path / "results", *names)

    def noted(work: Any, given: Any, holds: bool, tasks: Any, jobs: int) -> list[bool]:
        pickle.dumps((work, given, tasks))
        asked.append((given, holds, [x.stem for x in tasks], jobs))
        return [True] * len(tasks)

    monkeypatch.setattr(workers, "cores", lambda: 7)
    monkeypatch.setattr(workers, "side_by_side", noted)
    for few in (names[:3], names):
        assert call(tmp_path, "render", *few).returncode == 0
    (tmp_path / "results" / "fig1.png").touch()
    for again in ((), ("--force",)):
        assert call(tmp_path, "render", *names, *again).returncode == 0
    plain, force = ("png", False), ("png", True)
    assert asked == [
        (plain, True, names[:3], 1),
        *((given, True, names, jobs) for given, jobs in ((plain, 7), (plain, 1), (force, 7))),
    ]


def test_a_result_that_may_not_be_read_is_not_to_be_computed_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As root everything may be read, so the system's answers are replaced."""
    monkeypatch.chdir(tmp_path)
    file = Path("results", "fig4.h5")
    damaged(file.parent, "fig4")
    monkeypatch.setattr(os, "access", lambda *_: False)
    said = with_remedy(StoreError.of(file, "not a readable HDF5 file: Permission denied"))
    assert said.endswith("; you may not read it: ask its owner, or take another copy of it")


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
    # The log is that of a run, which makes no certificate.
    done = call(tmp_path, "certify", "--check", str(Path("results", "mine.certificate.h5")))
    assert done.returncode == 3
    assert done.stderr.endswith("mine.certificate.h5: there is no such file\n")
    (results / "mine.log").unlink()
    # A result is drawn beside itself.
    done = call(tmp_path, "render", "results/mine.h5", "--out", "none")
    assert "; make it anew from its config" in done.stderr
    proof = Path("results", "fig4.certificate.h5")
    (tmp_path / proof).write_bytes(b"")
    done = call(tmp_path, "certify", "--check", str(proof))
    assert "call: rigidpend certify fig4 --force" in done.stderr
    (results / "fig3.h5").mkdir()
    said = call(tmp_path, "render", "fig3").stderr
    assert said.endswith("; a folder is in its place: move that away\n"), "run --force refuses too"


FULL = Path("/dev/full")
needs_full = pytest.mark.skipif(not FULL.exists(), reason="this system has no /dev/full")

KEPT = "rigidpend.machine.cache.KeptFileWarning"


def streams(folder: Path, *arguments: str, **how: Any) -> subprocess.CompletedProcess[str]:
    # What cannot be kept in the user's cache is told by a warning, and is another matter.
    given = ("-W", f"ignore::{KEPT}", "-m", "rigidpend", *arguments)
    # Python 3.11 keeps what of compiled code finds room: later processes would fail.
    return python(folder, *given, env=UNTRACED | {"PYTHONDONTWRITEBYTECODE": "1"}, **how)


@pytest.mark.slow
@needs_full
def test_a_full_stdout_is_one_sentence_and_a_full_stderr_no_reason_not_to_compute(
    small: Path,
) -> None:
    with FULL.open("w") as full:
        done = streams(small, "run", "--help", stdout=full)
        said = done.stderr.splitlines()[-1]
        assert (done.returncode, said) == (1, "rigidpend: No space left on device")
        assert "Exception" not in done.stderr
        assert streams(small, "run", "small.yaml", stderr=full).returncode == 0
    assert (small / "results" / "small.h5").is_file()


@pytest.mark.slow
def test_closed_streams_are_no_reason_not_to_compute(small: Path) -> None:
    done = streams(small, "run", "small.yaml", preexec_fn=lambda: os.closerange(0, 3))
    assert done.returncode == 0
    assert (small / "results" / "small.h5").read_bytes().startswith(b"\x89HDF")


def test_an_error_of_ours_without_room_for_a_log_is_said() -> None:
    full = OSError(28, "No space left on device")
    said = common.sentence(ZeroDivisionError("mine"), Mock(side_effect=full))
    assert said.endswith("please report it; no log could be written: No space left on device")


@pytest.mark.slow
def test_a_reader_that_ends_early_is_no_error(tmp_path: Path) -> None:
    reader, writer = os.pipe()
    os.close(reader)
    done = streams(tmp_path, "describe", "fig4", "--json", stdout=writer)
    os.close(writer)
    assert done.stderr == ""
