"""Runs: what is up to date and why not, what a result holds, what a failure leaves."""

from __future__ import annotations

import importlib.metadata
import json
import shutil
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest

from rigidpend.experiments.data.compare import Difference
from rigidpend.experiments.route_codes import compute as route_codes
from rigidpend.machine import code_hash
from rigidpend.orbits.integrate import engines
from rigidpend.results import store
from rigidpend.runs import loading, provenance, regression, runner
from tests.config.samples import FIG4, SMALL, changed, written


def quiet(_: str) -> None:
    """Reports go nowhere."""


def run(loaded: loading.LoadedConfig, folder: Path) -> Path:
    planned = runner.plan(loaded, folder, force=True)
    runner.run(planned, jobs=1, report=quiet)
    return planned.target


@pytest.fixture
def loaded(tmp_path: Path) -> loading.LoadedConfig:
    return loading.load(written(tmp_path, SMALL, "small.yaml"))


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The result of the small config, computed once; not to be changed."""
    folder = tmp_path_factory.mktemp("made")
    return run(loading.load(written(folder, SMALL, "small.yaml")), folder)


@pytest.fixture
def out(tmp_path: Path, made: Path) -> Path:
    """A folder with a copy of the result."""
    folder = tmp_path / "out"
    folder.mkdir()
    shutil.copyfile(made, folder / made.name)
    return folder


def test_the_first_run_has_no_result_yet(loaded: loading.LoadedConfig, tmp_path: Path) -> None:
    planned = runner.plan(loaded, tmp_path / "none")
    assert planned.reason == "no result yet"
    assert planned.target == tmp_path / "none" / "small.h5"
    assert not (tmp_path / "none").exists()


def test_what_was_run_is_up_to_date(loaded: loading.LoadedConfig, out: Path) -> None:
    assert runner.plan(loaded, out).reason == ""


def test_comments_and_layout_leave_a_result_up_to_date(tmp_path: Path, out: Path) -> None:
    text = changed("mu: 0.001", "mu: 1e-3  # as in the paper", SMALL)
    loaded = loading.load(written(tmp_path, text, "small.yaml"))
    assert runner.plan(loaded, out).reason == ""


def test_force_is_a_reason_of_its_own(loaded: loading.LoadedConfig, out: Path) -> None:
    assert runner.plan(loaded, out, force=True).reason == "--force"


def test_a_changed_config_is_the_reason(tmp_path: Path, out: Path) -> None:
    loaded = loading.load(written(tmp_path, SMALL, "small.yaml"), ["problem.mu=0.002"])
    assert runner.plan(loaded, out).reason == "its config changed: problem.mu from 0.001 to 0.002"


def test_changed_code_is_the_reason(
    loaded: loading.LoadedConfig, out: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    copy = tmp_path / "rigidpend"
    shutil.copytree(code_hash.PACKAGE, copy, ignore=shutil.ignore_patterns("__pycache__"))
    monkeypatch.setattr(code_hash, "PACKAGE", copy)
    assert runner.plan(loaded, out).reason == ""
    with (copy / "mechanics" / "equations.py").open("a", encoding="utf-8") as file:
        file.write("\nX = 1\n")
    # As another process finds it.
    code_hash._looked_up.cache_clear()
    assert runner.plan(loaded, out).reason == "the code that computes it changed"


def test_another_engine_is_the_reason(
    loaded: loading.LoadedConfig, out: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    other = {"taylor": "scipy", "scipy": "taylor"}[engines.default_engine()]
    monkeypatch.setattr(engines, "default_engine", lambda: other)
    monkeypatch.setattr(engines, "check_engine", lambda engine: engine)
    assert runner.plan(loaded, out).reason == "the engine changed"


def test_another_version_of_the_engine_is_the_reason(
    loaded: loading.LoadedConfig, out: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(importlib.metadata, "version", lambda _: "0.0")
    assert runner.plan(loaded, out).reason == "the engine changed"


def test_all_reasons_are_said(tmp_path: Path, out: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(importlib.metadata, "version", lambda _: "0.0")
    loaded = loading.load(written(tmp_path, SMALL, "small.yaml"), ["problem.mu=0.002"])
    assert runner.plan(loaded, out).reason == (
        "its config changed: problem.mu from 0.001 to 0.002; the engine changed"
    )


@pytest.mark.slow
@pytest.mark.parametrize("content", [b"", b"words", b"\x89HDF\r\n\x1a\n"])
def test_a_file_that_cannot_be_read_is_not_overwritten(
    loaded: loading.LoadedConfig, out: Path, content: bytes
) -> None:
    (out / "small.h5").write_bytes(content)
    assert "not a readable HDF5 file" in refusal(loaded, out)


def test_another_program_s_file_is_not_overwritten(loaded: loading.LoadedConfig, out: Path) -> None:
    with h5py.File(out / "small.h5", "w") as file:
        file["data"] = [1, 2]
    assert "an HDF5 file, but not a result of rigidpend" in refusal(loaded, out)


def test_a_damaged_result_is_not_overwritten(loaded: loading.LoadedConfig, out: Path) -> None:
    content = (out / "small.h5").read_bytes()
    (out / "small.h5").write_bytes(content[:-100])
    assert "not a readable HDF5 file" in refusal(loaded, out)


def refusal(loaded: loading.LoadedConfig, out: Path) -> str:
    """What is said of a target that is not ours; it stays as it is, but for --force."""
    target = out / "small.h5"
    before = target.read_bytes(), target.stat().st_mtime_ns
    with pytest.raises(store.StoreError) as caught:
        runner.plan(loaded, out)
    text = str(caught.value)
    assert text.startswith(f"{target}: ")
    assert text.endswith("; move it away, or overwrite it with --force")
    assert (target.read_bytes(), target.stat().st_mtime_ns) == before
    planned = runner.plan(loaded, out, force=True)
    assert planned.reason == "--force"
    assert (target.read_bytes(), target.stat().st_mtime_ns) == before
    runner.run(planned, jobs=1, report=quiet)
    assert runner.plan(loaded, out).reason == ""
    return text


def test_another_format_version_is_the_reason(loaded: loading.LoadedConfig, out: Path) -> None:
    with h5py.File(out / "small.h5", "a") as file:
        file.attrs["format_version"] = store.FORMAT_VERSION + 1
    before = (out / "small.h5").read_bytes()
    planned = runner.plan(loaded, out)
    assert planned.reason == "its result has another format version"
    assert (out / "small.h5").read_bytes() == before
    runner.run(planned, jobs=1, report=quiet)
    assert runner.plan(loaded, out).reason == ""


def test_a_result_says_what_it_was_made_from(loaded: loading.LoadedConfig, made: Path) -> None:
    planned = runner.plan(loaded, made.parent)
    with store.opened(made) as file:
        attributes = dict(file.attrs)
        assert attributes.pop("precisions").tolist() == [53]
        assert attributes.pop("seconds") > 0
        assert attributes.pop("tolerance") == engines.DEFAULT_TOLERANCE[planned.engine]
        assert attributes == {
            "format": "rigidpend",
            "format_version": 1,
            "name": "small",
            "figure": loaded.content.figure,
            "experiment": "route_codes",
            **planned.fingerprint,
            "doubt": "",
        }
        assert json.loads(file["config"].asstr()[()]) == loaded.resolved()
        expected = set(provenance.provenance())
        assert set(file["provenance"].attrs) == expected


SHAPES: dict[str, Any] = {
    "theta2_0": (lambda n: (n,), np.float64),
    "codes": (lambda n: (15, n), np.uint8),
    "certain": (lambda n: (15, n), np.bool_),
    "bits": (lambda n: (n,), np.uint16),
    "crossing_time": (lambda n: (16, n), np.float64),
    "separatrix": (lambda n: (16, n), np.uint8),
    "melnikov_zeros": (lambda _: (2,), np.float64),
}


@pytest.fixture(scope="module")
def fig4(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The result of the shipped config."""
    return run(loading.load(FIG4), tmp_path_factory.mktemp("fig4"))


def test_a_result_has_the_documented_layout(fig4: Path) -> None:
    with h5py.File(fig4, "r") as file:
        assert set(file) == {"config", "provenance", "data"}
        assert list(file["data"]) == ["left", "right"]
        assert {"commit", "created", "processor"} <= set(file["provenance"].attrs)
        for name, n in (("left", 63), ("right", 32)):
            group = file["data"][name]
            assert set(group) == set(SHAPES)
            for field, (shape, kind) in SHAPES.items():
                assert (group[field].shape, group[field].dtype) == (shape(n), kind), field
                assert group[field].attrs["units"]
                assert group[field].attrs["description"]


def test_a_result_holds_the_arrays_of_fig4(fig4: Path) -> None:
    with h5py.File(fig4, "r") as file:
        left, right = file["data/left"], file["data/right"]
        np.testing.assert_allclose(left["theta2_0"], np.arange(63) / 10, atol=1e-15)
        expected = 3 * np.pi / 40 + np.arange(32) / 100
        np.testing.assert_allclose(right["theta2_0"], expected, atol=1e-15)
        for group in (left, right):
            codes, separatrix = group["codes"][:], group["separatrix"][:]
            assert group["certain"][:].all()
            assert set(np.unique(codes)) == {0, 1}
            assert separatrix.min() >= 1
            assert separatrix.max() <= 4
            # On separatrix 2 at the start; then down, up, down ...: the graph of Fig. 2.
            assert (separatrix[0] == 2).all()
            assert ((separatrix[:-1] + separatrix[1:]) % 2 == 1).all()
            assert (np.diff(group["crossing_time"][:], axis=0) > 0).all()
            assert set(group["bits"][:]) <= {53, 106, 160}


def test_the_stored_config_can_be_run_again(made: Path, tmp_path: Path) -> None:
    with store.opened(made) as file:
        # JSON is YAML.
        path = written(tmp_path, file["config"].asstr()[()], "small.yaml")
    assert runner.plan(loading.load(path), made.parent).reason == ""


def test_what_cannot_be_written_is_not_computed(
    loaded: loading.LoadedConfig, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def compute(*_: Any) -> Any:
        raise AssertionError("computed in vain")

    monkeypatch.setattr(route_codes, "compute", compute)
    (tmp_path / "file").touch()
    planned = runner.plan(loaded, tmp_path / "file" / "sub")
    with pytest.raises(store.StoreError, match="choose another folder with --out"):
        runner.run(planned, jobs=1, report=quiet)


@pytest.mark.parametrize("error", [KeyboardInterrupt, RuntimeError])
def test_a_run_that_ends_early_leaves_the_old_result(
    loaded: loading.LoadedConfig,
    out: Path,
    monkeypatch: pytest.MonkeyPatch,
    error: type[BaseException],
) -> None:
    before = (out / "small.h5").read_bytes()

    def compute(*_: Any) -> Any:
        raise error

    monkeypatch.setattr(route_codes, "compute", compute)
    with pytest.raises(error):
        runner.run(runner.plan(loaded, out, force=True), jobs=1, report=quiet)
    assert [path.name for path in out.iterdir()] == ["small.h5"]
    assert (out / "small.h5").read_bytes() == before


def test_verify_finds_no_difference_from_what_was_run(
    loaded: loading.LoadedConfig, made: Path
) -> None:
    assert regression.verify(loaded, made, jobs=1) == []


def test_verify_finds_a_changed_symbol(loaded: loading.LoadedConfig, out: Path) -> None:
    with h5py.File(out / "small.h5", "a") as file:
        codes = file["data/only/codes"]
        codes[1, 2] = 1 - codes[1, 2]
    [found] = regression.verify(loaded, out / "small.h5", jobs=1)
    assert isinstance(found, Difference)
    assert found.place == "only/codes[1, 2]"
    assert {found.stored, found.computed} == {0, 1}


def test_verify_says_that_the_config_is_another(tmp_path: Path, made: Path) -> None:
    path = written(tmp_path, SMALL, "small.yaml")
    found = regression.verify(loading.load(path, ["problem.n_symbols=2"]), made, jobs=1)
    assert [text.partition(":")[0] for text in found] == [
        "config/problem/n_symbols",
        "only/codes",
    ]
    assert found[0].endswith(": stored 3, computed 2")
    assert found[1].endswith(": shape (3, 5) stored, (2, 5) computed")


def test_verify_leaves_the_stored_result_alone(loaded: loading.LoadedConfig, out: Path) -> None:
    before = (out / "small.h5").read_bytes(), (out / "small.h5").stat().st_mtime_ns
    regression.verify(loaded, out / "small.h5", jobs=1)
    assert before == ((out / "small.h5").read_bytes(), (out / "small.h5").stat().st_mtime_ns)
    assert [path.name for path in out.iterdir()] == ["small.h5"]


def test_verify_names_a_stored_result_that_is_absent(
    loaded: loading.LoadedConfig, tmp_path: Path
) -> None:
    with pytest.raises(store.StoreError, match="there is no such file"):
        regression.verify(loaded, tmp_path / "none.h5", jobs=1)


def test_verify_without_the_engine_says_so(
    loaded: loading.LoadedConfig, made: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def absent(_: str) -> str:
        raise engines.EngineError("engine 'taylor' is not installed")

    monkeypatch.setattr(engines, "check_engine", absent)
    with pytest.raises(engines.EngineError):
        regression.verify(loaded, made, jobs=1)


def test_a_result_whose_name_differs_in_case_only_is_not_made(tmp_path: Path) -> None:
    config = loading.load(written(tmp_path, SMALL, "small.yaml"))
    (tmp_path / "Small.h5").write_bytes(b"another")
    with pytest.raises(store.StoreError, match=r"Small\.h5 is there, and some systems take both"):
        runner.plan(config, tmp_path)
    # Where both are there, the system tells them apart.
    (tmp_path / "small.h5").write_bytes(b"this one")
    assert runner.plan(config, tmp_path, force=True).reason
