"""Signals that are held: they wait, then do what they do otherwise."""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from typing import Annotated

import pytest
from pydantic import PlainSerializer

from rigidpend.config.schema import Part
from rigidpend.run.signals import Terminated, held, termination


@pytest.fixture(autouse=True)
def as_in_the_foreground() -> Iterator[None]:
    """Where tests are started in the background, Ctrl-C is ignored: not so in these."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


def test_an_interruption_waits_for_the_end_of_what_must_not_be_disturbed() -> None:
    done = []

    def disturbed() -> None:
        with held():
            signal.raise_signal(signal.SIGINT)
            done.append("all")

    with pytest.raises(KeyboardInterrupt):
        disturbed()
    assert done == ["all"]
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


def test_sigterm_waits_too_and_then_unwinds() -> None:
    done = []

    def disturbed() -> None:
        with termination(), held():
            signal.raise_signal(signal.SIGTERM)
            done.append("all")

    with pytest.raises(Terminated):
        disturbed()
    assert done == ["all"]
    assert signal.getsignal(signal.SIGTERM) is signal.SIG_DFL


@pytest.mark.parametrize(
    ("number", "stop"), [(signal.SIGINT, KeyboardInterrupt), (signal.SIGTERM, Terminated)]
)
def test_a_stop_while_a_config_is_written_is_a_stop(
    number: signal.Signals, stop: type[BaseException]
) -> None:
    def stopped(x: int) -> int:
        signal.raise_signal(number)
        return x

    class Stopped(Part):
        x: Annotated[int, PlainSerializer(stopped)] = 1

    with termination(), pytest.raises(stop):
        Stopped().model_dump(mode="json")


def test_other_threads_are_let_alone() -> None:
    found = []

    def work() -> None:
        with held():
            found.append(signal.getsignal(signal.SIGINT))

    thread = threading.Thread(target=work)
    thread.start()
    thread.join()
    assert found == [signal.default_int_handler]
