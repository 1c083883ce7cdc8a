"""What a result was made from: which changes of code and config count, and which do not."""

import ast
import datetime
import json
import platform
import shutil
import subprocess
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any
from unittest.mock import Mock

import llvmlite
import pytest
import scipy

import rigidpend
from rigidpend import experiments
from rigidpend.machine import code_hash
from rigidpend.numbers.exact import exact
from rigidpend.runs import loading, provenance
from tests.config.samples import FIG4, TEXT, changed, written
from tests.processes import python


@pytest.fixture
def edited(monkeypatch: pytest.MonkeyPatch) -> dict[str, bytes]:
    """The package's source files by their places, to be changed; they are what is hashed."""
    every = dict(code_hash.sources(str(code_hash.PACKAGE)).files)

    def sources(_: str) -> code_hash.Sources:
        return code_hash.Sources(every, repr(hash(frozenset(every.items()))))

    monkeypatch.setattr(code_hash, "sources", sources)
    return every


def config_hash(path: Path, *settings: str) -> str:
    return provenance.config_hash(loading.load(path, settings).resolved())


@pytest.mark.parametrize(
    ("experiment", "place"),
    [
        ("phase_portraits", "experiments/phase_portraits/schema.py"),
        ("heteroclinic_cycle", "routes/__init__.py"),
    ],
)
def test_code_hash_notices_values_in_what_is_imported_but_no_comment_docstring_or_layout(
    edited: dict[str, bytes], experiment: str, place: str
) -> None:
    source, found = edited[place].decode(), []
    function = f"{source}\nif True:\n    def f(x):\n        return x\n"
    documented = f'{source}\nif True:\n    def f(x):\n        """The same."""\n        return x\n'
    laid_out = ast.unparse(ast.parse(source)).replace("\n", "\n\n")
    texts = [source, laid_out, f'"""Other."""\n# A comment.\n{source}\n"""Of a name."""\n']
    texts += [function, documented]
    texts += [f"{source}\nX = {value}\n" for value in ("1", "2", "'one'", "'two'")]
    for text in texts:
        edited[place] = text.encode()
        found.append(provenance.code_hash(experiment))
    assert found[0] == found[1] == found[2]
    assert found[3] == found[4]
    assert len({found[0], *found[4:]}) == 6


@pytest.mark.parametrize(
    ("place", "block"),
    [
        ("extra.py", "{}"),
        ("extra/__init__.py", "{}"),
        ("extra.py", "try:\n    pass\nexcept ValueError:\n    {}"),
        ("extra.py", "try:\n    pass\nfinally:\n    {}"),
        ("extra.py", "for _ in ():\n    pass\nelse:\n    {}"),
        ("extra.py", "match 1:\n    case 1:\n        {}"),
        ("extra.py", "class Extra:\n    def extra(self):\n        with self:\n            {}"),
    ],
)
def test_code_hash_follows_a_new_import_in_any_block(
    edited: dict[str, bytes], place: str, block: str
) -> None:
    edited["routes/start.py"] += f"\n{block.format('from rigidpend import extra')}\n".encode()
    found = set()
    for value in (b"1", b"2"):
        edited[place] = b"X = " + value
        found.add(provenance.code_hash("route_codes"))
    assert len(found) == 2


def test_sources_are_the_same_wherever_the_package_is(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    here = code_hash.sources(str(code_hash.PACKAGE)), provenance.code_hash("exponents")
    monkeypatch.setattr(code_hash, "PACKAGE", tmp_path / "deep" / "rigidpend")
    shutil.copytree(Path(rigidpend.__file__).parent, code_hash.PACKAGE)
    assert (code_hash.sources(str(code_hash.PACKAGE)), provenance.code_hash("exponents")) == here
    changed = code_hash.PACKAGE / "notebook.py"
    changed.write_bytes(changed.read_bytes() + b"\n")
    code_hash.sources.cache_clear()
    assert code_hash.package_digest() != here[0].digest


IMPORTED = """
import importlib, json, sys
own = lambda: [name for name in sys.modules if name.split(".")[0] == "rigidpend"]
found = {}
for experiment in sys.argv[1:]:
    for name in own():
        del sys.modules[name]
    for part in ("schema", "compute"):
        importlib.import_module(f"rigidpend.experiments.{experiment}.{part}")
    found[experiment] = [sys.modules[name].__spec__.origin for name in own()]
print(json.dumps(found))
"""


def test_no_folder_hides_what_an_import_from_it_runs() -> None:
    # Names that a folder imports only when they are asked for would be missing from the hash.
    lazy = [
        file.relative_to(code_hash.PACKAGE).as_posix()
        for file in code_hash.PACKAGE.rglob("*.py")
        if "\ndef __getattr__" in file.read_text()
    ]
    assert lazy == ["__init__.py"]


DRAWING = ("/draw.py", "bench/report.py")
"""Files of an experiment that compute nothing."""


@pytest.mark.slow
def test_two_threads_never_parse_code_at_the_same_time(
    edited: dict[str, bytes], monkeypatch: pytest.MonkeyPatch
) -> None:
    """As in a worker of a cluster: Python 3.11 fails where they do."""
    busy, parse = threading.Lock(), ast.parse

    def alone(source: bytes, mode: str) -> Any:
        assert busy.acquire(blocking=False)
        try:
            time.sleep(0.01)
            return parse(source, mode=mode)
        finally:
            busy.release()

    places = [f"made_{k}.py" for k in range(8)]
    edited.update({place: f"x = {place!r}".encode() for place in places})
    with monkeypatch.context() as patch, ThreadPoolExecutor(2) as pool:
        patch.setattr(ast, "parse", alone)
        numbers = [pool.submit(exact, f"{k} + sqrt(1234567)") for k in range(8)]
        found = list(pool.map(lambda place: code_hash.needed([code_hash.inside(place)]), places))
        assert [float(each.result()) for each in numbers] == pytest.approx(range(1111, 1119), 1e-3)
    assert all(place in needed for place, needed in zip(places, found, strict=True))


def test_code_hash_counts_what_python_imports_and_nothing_that_draws() -> None:
    # Some that prove nothing: each takes as long as a start of the program.
    some = "asymptotic_orbits", "herpolhodes", "route_map"
    told = python(Path.cwd(), "-c", IMPORTED, *some).stdout
    for experiment, origins in json.loads(told).items():
        folder = code_hash.inside("experiments", experiment)
        parts = [folder / f"{part}.py" for part in ("schema", "compute")]
        counted = set(code_hash.needed(parts))
        reached = {Path(x).relative_to(code_hash.PACKAGE).as_posix() for x in origins if x}
        assert f"experiments/{experiment}/compute.py" in reached
        assert reached <= counted
        others = [f"experiments/{name}/" for name in experiments.names() if name != experiment]
        apart = ("cli/", "render/", "routes/certified/", "notebook.py", *others)
        assert not [x for x in counted if x.startswith(apart) or x.endswith(DRAWING)]


def test_each_file_is_parsed_once_and_what_is_found_is_kept(
    edited: dict[str, bytes], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    for place in edited:
        edited[place] += b"\n# Not known yet.\n"
    monkeypatch.setattr(ast, "parse", parse := Mock(wraps=ast.parse))
    names = "phase_portraits", "heteroclinic_cycle"
    found = [*map(provenance.code_hash, names)]
    sources = [call.args[0] for call in parse.call_args_list]
    assert len(sources) == len({*sources}) > 10
    # As in a later process, which knows the digest of all.
    monkeypatch.setattr(code_hash, "needed", None)
    assert [*map(provenance.code_hash, names)] == found


LAID_OUT = "\n".join(line.partition("#")[0].rstrip() for line in TEXT.splitlines())
MOVED = LAID_OUT.replace("  mu: 0.001\n", "").replace("  h0:", "  mu: 0.001\n\n  h0:")


@pytest.mark.parametrize(
    "text",
    [
        MOVED.replace("[2, 1, 1.5]", "\n    - 2\n    - 1\n    - 1.5"),
        changed("mu: 0.001", "mu: 1e-3"),
        changed("mu: 0.001", "mu: '0.00100'"),
        changed("[2, 1, 1.5]", "[2.0, 1, 3/2]"),
        changed("n_symbols: 15", "n_symbols: 30/2"),
        changed("n_symbols: 15\n", "\n"),
        changed("engine: auto ", ""),
        TEXT[: TEXT.index("numerics:")],
    ],
)
def test_config_hash_is_the_same_for_the_same_values(tmp_path: Path, text: str) -> None:
    """Comments, layout, order, and the file's name do not count."""
    assert text != TEXT
    assert config_hash(written(tmp_path, text, "other.yaml")) == config_hash(FIG4)


@pytest.mark.parametrize(
    "setting",
    [
        "problem.mu=0.0010000000000000000000000001",
        "problem.n_symbols=16",
        "problem.arrays.left.count=64",
        "problem.arrays.right.start=0.23561944901923448",
        "numerics.engine=scipy",
        "numerics.precisions=[53]",
    ],
)
def test_config_hash_notices_every_value(setting: str) -> None:
    assert config_hash(FIG4, setting) != config_hash(FIG4)


def test_provenance_says_what_ran_where_and_when_as_far_as_it_is_known(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    found = provenance.provenance()
    for library in ("rigidpend", "numpy", "scipy", "mpmath", "h5py", "python"):
        assert found[f"version_{library}"][0].isdigit()
    made = datetime.datetime.fromisoformat(found["created"])
    assert abs(datetime.datetime.now(datetime.UTC) - made) < datetime.timedelta(minutes=1)
    assert all(isinstance(value, str) and value for value in found.values())
    assert provenance.engine_name("scipy") == f"scipy (scipy {scipy.__version__})"
    assert provenance.engine_name("taylor") == f"taylor (llvmlite {llvmlite.__version__})"
    monkeypatch.setenv("PATH", "")
    assert provenance.provenance()["commit"] == "unknown"


@pytest.mark.parametrize("told", ["model name\t: A processor 3 GHz\nflags\t\t: fpu sse2\n", ""])
def test_the_processor_is_named_as_the_system_tells_it(
    told: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Where there is no such file, or no such line in it, Python says what it knows."""

    def read(*_: object) -> str:
        if not told:
            raise FileNotFoundError
        return told

    monkeypatch.setattr(Path, "read_text", read)
    monkeypatch.setattr(platform, "processor", lambda: "")
    monkeypatch.setattr(platform, "machine", lambda: "arm64")
    assert provenance.processor_model() == ("A processor 3 GHz" if told else "arm64")


def test_the_commit_is_that_of_the_own_source_tree(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def git(*arguments: str) -> str:
        command = ["git", "-C", str(tmp_path), "-c", "user.name=x", "-c", "user.email=x@x"]
        done = subprocess.run([*command, *arguments], capture_output=True, text=True, check=True)
        return done.stdout.strip()

    (tmp_path / "file").touch()
    git("init", "-q")
    git("add", "file")
    git("commit", "-q", "-m", "another's")
    other = git("rev-parse", "--short=12", "HEAD")
    own = provenance.commit_here()
    monkeypatch.setenv("GIT_DIR", str(tmp_path / ".git"))
    monkeypatch.setenv("GIT_WORK_TREE", str(tmp_path))
    assert provenance.commit_here() == own
    monkeypatch.delenv("GIT_DIR")
    monkeypatch.delenv("GIT_WORK_TREE")
    # Installed into a folder of somebody's repository, it has no commit of its own.
    inner = tmp_path / "lib" / "site-packages" / "rigidpend"
    inner.mkdir(parents=True)
    monkeypatch.setattr(provenance, "PACKAGE", inner)
    assert provenance.commit_here() == "unknown"
    # In a checkout of its own it has, with a mark once a file is changed.
    monkeypatch.setattr(provenance, "PACKAGE", tmp_path / "lib")
    assert provenance.commit_here() == other
    (tmp_path / "file").write_text("changed")
    assert provenance.commit_here() == f"{other}+"
