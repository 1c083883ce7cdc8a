"""Faults of the program in a drawing are seen; values that cannot be drawn are a sentence."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Any

import pytest

from rigidpend import render
from rigidpend.experiments.route_codes import draw
from rigidpend.machine.files import StoreError
from rigidpend.render import report
from tests.cli.calls import REFERENCE, call

FAULTS = (NameError, TypeError, AttributeError, ImportError, AssertionError)


@pytest.fixture
def result(tmp_path: Path) -> Path:
    return Path(shutil.copy(REFERENCE / "fig4.h5", tmp_path / "fig4.h5"))


def failing(monkeypatch: pytest.MonkeyPatch, error: Exception, what: str = "draw") -> None:
    """Let drawing fail, or the tables of a report whose picture is there."""

    def fail(_: Any) -> Any:
        raise error

    monkeypatch.setattr(draw, what, fail)


def test_a_fault_of_the_program_is_no_fault_of_the_file(
    monkeypatch: pytest.MonkeyPatch, result: Path
) -> None:
    assert not any(issubclass(fault, render.OF_VALUES) for fault in FAULTS)
    error = TypeError("x")
    with monkeypatch.context() as patch:
        failing(patch, error)
        for task in (
            lambda: report.build([result]),
            lambda: render.render([result], result.with_suffix(".png")),
        ):
            with pytest.raises(type(error)):
                task()
    failing(monkeypatch, error, "tables")
    monkeypatch.setattr(render, "image", lambda *_: PIXEL)
    with pytest.raises(type(error)):
        report.build([result])


PIXEL = (Path(render.__file__).parents[2] / "results" / "gallery" / "fig2.png").read_bytes()


def test_values_that_cannot_be_drawn_are_a_sentence(
    monkeypatch: pytest.MonkeyPatch, result: Path
) -> None:
    values = (ValueError, ZeroDivisionError, IndexError)
    assert all(issubclass(kind, render.OF_VALUES) for kind in values)
    error = IndexError("x")
    with monkeypatch.context() as patch:
        failing(patch, error)
        with pytest.raises(render.Undrawable, match="cannot be drawn: "):
            render.render([result], result.with_suffix(".png"))
    failing(monkeypatch, error, "tables")
    monkeypatch.setattr(render, "image", lambda *_: PIXEL)
    with pytest.raises(StoreError, match=r"cannot be shown: .*; call: rigidpend run fig4"):
        report.build([result])


def test_a_fault_is_told_as_one(monkeypatch: pytest.MonkeyPatch, result: Path) -> None:
    failing(monkeypatch, NameError("name 'axis' is not defined"))
    done = call(result.parent, "render", "fig4.h5")
    assert done.returncode == 4
    assert "internal error: NameError" in done.stderr
