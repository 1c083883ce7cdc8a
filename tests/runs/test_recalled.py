"""What plans remember: states are recalled for the same bytes by the same package."""

from __future__ import annotations

import shutil
from dataclasses import asdict, replace
from pathlib import Path

import pytest

from rigidpend.machine import cache, files
from rigidpend.runs import loading, provenance, runner
from tests.config.samples import SMALL, written


@pytest.fixture
def made(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A config with its result, where no earlier process has remembered anything."""
    monkeypatch.setattr(cache, "folder", lambda: tmp_path / "cache")
    config = loading.load(written(tmp_path, SMALL, "small.yaml"))
    planned = runner.plan(config, tmp_path, force=True)
    runner.run(planned, jobs=1, report=lambda _: None)
    return planned.target


def plan(folder: Path, *settings: str) -> runner.Plan:
    path = folder / "small.yaml"
    return runner.plan_kept(loading.load(path, settings), path, folder, settings)


def state(folder: Path, *settings: str) -> runner.State | None:
    return runner.recalled(folder / "small.yaml", folder, settings)


def edit(folder: Path, mu: str) -> None:
    config = folder / "small.yaml"
    config.write_text(config.read_text().replace("mu: 0.001", f"mu: {mu}"))


def test_a_state_is_recalled_as_it_was_found(made: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    folder = made.parent
    assert state(folder) is None
    planned = plan(folder)
    left = folder / ".small.h5.abc.part"
    left.write_bytes(b"half")
    found = state(folder)
    assert found is not None
    assert not left.exists()
    assert asdict(found) == {name: getattr(planned, name) for name in asdict(found)}
    assert found.reason == ""
    # Other engines, another package, and other bytes of a memory, tell nothing.
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(provenance, "version", lambda _: "0.0")
        assert state(folder) is None
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(runner, "package_digest", lambda: "other")
        assert state(folder) is None
    for path in (folder / "cache" / "plans").iterdir():
        path.write_bytes(files.sealed(b"[1]"))
    with pytest.warns(cache.KeptFileWarning):
        assert state(folder) is None


def test_another_text_other_settings_another_name_and_another_result_are_not_recalled(
    made: Path,
) -> None:
    folder = made.parent
    plan(folder)
    assert state(folder, "problem.mu=0.002") is None
    assert plan(folder, "problem.mu=0.002").reason.startswith("its config changed")
    again = state(folder, "problem.mu=0.002")
    assert again is not None
    assert again.reason.startswith("its config changed")
    shutil.copy(folder / "small.yaml", folder / "con.yaml")
    shutil.copy(made, folder / "con.h5")
    assert runner.recalled(folder / "con.yaml", folder) is None
    # One that a name of one's own made is another result.
    config = replace(loading.load(folder / "small.yaml"), name="con")
    runner.plan_kept(config, folder / "small.yaml", folder)
    assert runner.recalled(folder / "con.yaml", folder) is None
    content = bytearray(made.read_bytes())
    content[len(content) // 2] ^= 1
    made.write_bytes(content)
    assert state(folder) is None
    with pytest.raises(files.StoreError, match="damaged"):
        plan(folder)
    made.unlink()
    assert plan(folder).reason == "no result yet"
    assert state(folder) is not None
    (folder / "Small.h5").write_bytes(b"")
    assert state(folder) is None
    edit(folder, "0.003")
    assert state(folder) is None
