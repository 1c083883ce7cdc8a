"""Compiled integrators are kept apart by all that they follow from, and checked before use."""

from __future__ import annotations

import os
import platform
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from rigidpend.machine import cache
from rigidpend.machine.kept import KeptFileWarning
from rigidpend.orbits.integrate import compile_cache, compiled
from tests.orbits.integrate.problems import needs_heyoka

INTEL = "model name\t: A processor 3 GHz\nflags\t\t: fpu sse2 avx2 avx512f"
PLAIN = "model name\t: A processor 3 GHz\nflags\t\t: fpu sse2"


@pytest.fixture
def integrators(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The folder of compiled integrators, in a cache of the test's own."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    return tmp_path / "rigidpend" / "integrators"


def pendulum(**options: Any) -> Any:
    hy = compiled.heyoka()
    x, v = hy.make_vars("x", "v")
    return hy.taylor_adaptive([(x, v), (v, -hy.sin(x))], [0.1, 0.2], **{"tol": 1e-9, **options})


def moved(integrator: Any) -> Any:
    integrator.propagate_until(3.0)
    return integrator.state.copy()


@needs_heyoka("the cache of its integrators")
def test_heyoka_s_own_cache_which_checks_nothing_is_off() -> None:
    assert not compiled.heyoka().llvm_state.get_diskcache_enabled()


@needs_heyoka("the cache of its integrators")
def test_a_kept_integrator_is_the_compiled_one(integrators: Path) -> None:
    first = pendulum()
    [path] = integrators.iterdir()
    written = path.stat().st_ino
    again = pendulum()
    assert [path] == list(integrators.iterdir())
    assert path.stat().st_ino == written
    assert np.array_equal(moved(first), moved(again))
    # What is kept is the integrator before it was used.
    assert pendulum().time == 0


@needs_heyoka("the cache of its integrators")
def test_each_difference_has_an_integrator_of_its_own(
    integrators: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    pendulum()
    pendulum(tol=1e-10)
    pendulum(compact_mode=True)
    monkeypatch.setattr(compile_cache, "processor_key", lambda: "another")
    pendulum()
    assert len(list(integrators.iterdir())) == 4


@needs_heyoka("the cache of its integrators")
@pytest.mark.slow
def test_another_process_finds_the_integrators_of_this_one(integrators: Path) -> None:
    every = (53, *(bits for bits in (64, 113) if bits in _types()), 160)
    for bits in every:
        compiled.to_crossings(bits, 1e-15)
    before = {path.name for path in integrators.iterdir()}
    assert len(before) == len(every)
    code = f"""from rigidpend.orbits.integrate.compiled import to_crossings
for bits in {every}: to_crossings(bits, 1e-15)"""
    subprocess.run([sys.executable, "-c", code], env=dict(os.environ), check=True)
    assert {path.name for path in integrators.iterdir()} == before


def _types() -> tuple[int, ...]:
    from rigidpend.orbits.integrate.taylor import precisions

    return precisions()


@needs_heyoka("the cache of its integrators")
@pytest.mark.parametrize("place", [0, 0.3, 0.6, 0.9, -1])
def test_damaged_code_is_never_run(integrators: Path, place: float) -> None:
    """In bytes anywhere, the digest's own included."""
    expected = moved(pendulum())
    [path] = integrators.iterdir()
    content = bytearray(path.read_bytes())
    content[int(place * len(content)) if place >= 0 else -2] ^= 4
    path.write_bytes(content)
    with pytest.warns(KeptFileWarning, match=rf"^{path}: damaged; it is made again$"):
        again = pendulum()
    assert np.array_equal(moved(again), expected)
    assert path.read_bytes() != bytes(content)
    # It was made anew: nothing is left to warn of.
    assert np.array_equal(moved(pendulum()), expected)


@needs_heyoka("the cache of its integrators")
def test_what_calls_back_is_not_kept(integrators: Path) -> None:
    """A copy from the cache would call a copy of the function, not the caller's own."""
    hy, seen = compiled.heyoka(), []
    x, _ = hy.make_vars("x", "v")
    for _ in range(2):
        event = hy.nt_event(x, callback=lambda *_: seen.append(1))
        pendulum(nt_events=[event]).propagate_until(20.0)
    assert len(seen) > 4
    assert not integrators.exists()


@needs_heyoka("the cache of its integrators")
def test_where_nothing_can_be_kept_all_is_compiled(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "file").touch()
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "file"))
    cache._tell_once.cache_clear()
    with pytest.warns(KeptFileWarning, match="nothing can be kept"):
        assert np.isfinite(moved(pendulum())).all()


def test_the_key_differs_by_the_flags_of_the_processor_alone(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    keys = []
    for processor in (INTEL, PLAIN, INTEL):
        monkeypatch.setattr(compile_cache, "_processor", lambda said=processor: said)
        compile_cache.processor_key.cache_clear()
        keys.append(compile_cache.processor_key())
    compile_cache.processor_key.cache_clear()
    assert keys[0] == keys[2] != keys[1]


def test_processor_model_is_read_from_what_the_system_tells(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(compile_cache, "_processor", lambda: INTEL)
    assert compile_cache.processor_model() == "A processor 3 GHz"


def test_processor_is_told_without_proc(monkeypatch: pytest.MonkeyPatch) -> None:
    def missing(*_: object) -> str:
        raise FileNotFoundError

    monkeypatch.setattr(Path, "read_text", missing)
    monkeypatch.setattr(platform, "machine", lambda: "arm64")
    assert "arm64" in compile_cache._processor()
    assert compile_cache.processor_model()
