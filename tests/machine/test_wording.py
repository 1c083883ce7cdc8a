"""Sentences on the command line."""

import warnings

import pytest

from rigidpend.machine.wording import say_warnings


def test_a_warning_is_said_once_whatever_is_caught_between(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(warnings, "showwarning", warnings.showwarning)
    said = list[str]()
    with warnings.catch_warnings():
        warnings.simplefilter("default")
        say_warnings(said.append)
        for text in ("slow", "slow", "long"):
            warnings.warn(text, UserWarning, stacklevel=1)
            # By which Python forgets what it has said.
            with warnings.catch_warnings():
                pass
    assert said == [f"rigidpend: warning: {text}" for text in ("slow", "long")]
