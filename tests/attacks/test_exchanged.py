"""Names of all kinds, and kept files under names of others or damaged, by lot."""

from __future__ import annotations

import os
import random
import shutil
import subprocess
import time
from pathlib import Path

import numpy as np
import pytest

from rigidpend.config.complaints import ConfigError
from rigidpend.machine import cache
from rigidpend.results import store
from rigidpend.runs import loading
from tests.attacks import lot
from tests.cli.calls import UNTRACED
from tests.config.samples import HEAD, SMALL, written
from tests.processes import python
from tests.runs.test_faults import ZOOM

PIECES = [*"aZ9_.,=+-~/\\ :*?\0\n", "..", ".certificate", ".h5", "é", "all"]


def test_any_name_stays_in_its_folder_or_is_refused(tmp_path: Path) -> None:
    config, refused = written(tmp_path, SMALL), list[str]()
    with lot.drawn("names") as chance:
        for _ in range(lot.trials(60)):
            name = "".join(chance.choices(PIECES, k=chance.randrange(1, 6)))
            try:
                [[found]] = loading.load_swept([config], name=name)
            except ConfigError as error:
                refused.append(str(error))
                continue
            target = tmp_path / f"{found.name}.h5"
            assert target.parent.resolve() == target.resolve().parent == tmp_path.resolve()
            assert not target.name.casefold().endswith(".certificate.h5")
            target.write_bytes(b"")
            assert target.stem == name
            target.unlink()
    assert refused
    assert max(map(len, refused)) < 400


MAP = f"""\
{HEAD.format(experiment="route_map", n_symbols=20)}\
  theta2_0: {{ends: [0, 2*pi], count: 1001}}
  rows: {{axis: log10_J1_0, ends: [-10, -5], count: 8}}

numerics:
  precisions: [53]
"""
"""Orbits for which two maps are made, of neighbouring energies."""


def with_cache(folder: Path) -> dict[str, str]:
    return UNTRACED | {"XDG_CACHE_HOME": str(folder / "cache")}


def rerun(folder: Path) -> subprocess.CompletedProcess[str]:
    """Both runs once more, where what is damaged is told by warnings, and no error."""
    command = ("-W", "default", "-m", "rigidpend", "run", "map.yaml", "zoom.yaml")
    return python(folder, *command, env=with_cache(folder))


def all_kept(folder: Path) -> list[Path]:
    return sorted(
        path
        for within in ("cache", "results/.zoom.parts")
        for path in (folder / within).rglob("*")
        if path.is_file()
    )


@pytest.fixture(scope="module")
def desk(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A zoom in parts, two maps, kernels, and undisturbed results."""
    found = tmp_path_factory.mktemp("desk")
    for name, text in (("zoom", ZOOM), ("map", MAP)):
        written(found, text, f"{name}.yaml")
    program = """
import runpy
from rigidpend.runs.parts import Parts
Parts.drop = lambda parts: None
runpy.run_module("rigidpend", run_name="__main__", alter_sys=True)
"""
    # They are made for the user's cache, and those that the runs use copied from there.
    kept, users = found / "cache" / "rigidpend", cache.folder()
    kept.mkdir(parents=True)
    for name in ("kernels", "maps"):
        (users / name).mkdir(parents=True, exist_ok=True)
        (kept / name).symlink_to(users / name)
    begun = time.time()
    done = python(found, "-c", program, "run", "map.yaml", "zoom.yaml", env=with_cache(found))
    assert done.returncode == 0, done.stderr
    for name in ("kernels", "maps"):
        (kept / name).unlink()
        (kept / name).mkdir()
        for path in (users / name).glob("[!.]*"):
            # What is loaded is touched.
            if path.stat().st_mtime >= begun:
                shutil.copy(path, kept / name)
    (found / "undisturbed").mkdir()
    for path in (found / "results").glob("*.h5"):
        path.rename(found / "undisturbed" / path.name)
    shutil.rmtree(found / "results" / ".map.parts")
    kinds = [path.relative_to(found).parts[-2] for path in all_kept(found)]
    assert kinds.count("maps") >= 2
    assert kinds.count("kernels") >= 2
    assert sum(path.suffix == ".kept" for path in all_kept(found)) == 4
    return found


def disturb(path: Path, other: Path, chance: random.Random) -> str:
    """Change a kept file, or exchange it with another; what was done."""
    content, how = path.read_bytes(), chance.choice(["flip", "cut", "exchange", "copy", "empty"])
    how = chance.choice([how, how, "gone", "pipe", "folder", "link"])
    if how == "exchange":
        path.write_bytes(other.read_bytes())
        other.write_bytes(content)
    elif how in ("flip", "cut", "copy", "empty"):
        place = chance.randrange(len(content)) if content else 0
        flipped = bytearray(content)
        flipped[place : place + 1] = bytes(
            x ^ 1 << chance.randrange(8) for x in content[place:][:1]
        )
        changed = {"flip": bytes(flipped), "cut": content[:place], "empty": b""}
        path.write_bytes(changed.get(how, other.read_bytes()))
    else:
        path.unlink()
        if how == "pipe":
            os.mkfifo(path)
        elif how == "folder":
            path.mkdir()
        elif how == "link":
            path.symlink_to(other)
    return how


@pytest.mark.slow
def test_kept_files_that_are_damaged_or_exchanged_change_no_result(
    desk: Path, tmp_path: Path
) -> None:
    """Maps, kernels, plans and parts: what does not fit is told and made again."""
    with lot.drawn("kept files") as chance:
        for index in range(lot.trials(1, 0.02)):
            folder = tmp_path / str(index)
            shutil.copytree(desk, folder)
            done = []
            for _ in range(chance.choice([1, 2, 4])):
                mine, other = chance.sample([x for x in all_kept(folder) if not x.is_symlink()], 2)
                done.append((disturb(mine, other, chance), mine, other))
            end = rerun(folder)
            assert "Traceback" not in end.stderr
            for how, path, _ in done:
                if how == "folder" and path.suffix == ".kept":
                    # It may hold anything: whose it is, is asked.
                    assert f"{path.name}: a folder is in the place of a file: move" in end.stderr
                    path.rmdir()
                    end = rerun(folder)
            assert end.returncode == 0, (done, end.stderr)
            for each in ("map", "zoom"):
                one, two = (folder / where / f"{each}.h5" for where in ("results", "undisturbed"))
                np.testing.assert_equal(store.load(one)["data"], store.load(two)["data"], str(done))
            assert not list((folder / "results").glob(".*"))
            shutil.rmtree(folder)
