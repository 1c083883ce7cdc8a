"""Limits of what may be asked for, each from both sides: what is allowed, and one more or less."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest

from rigidpend import certify_codes, find_orbit
from rigidpend.experiments.route_zoom import draw
from rigidpend.orbits.return_map import return_map, storage
from rigidpend.routes.certified import codes
from rigidpend.routes.symbolic import closed, find, follow, levels
from tests.bodies import FIG4

START: dict[str, Any] = {"h0": "1.3342", "J1_0": "1e-8"}


class Reached(Exception):
    """What begins where an argument is accepted."""


def reached(*_: Any, **__: Any) -> Any:
    raise Reached


LIMITS: dict[str, tuple[Callable[[int], Any], int, int]] = {
    "bits of a map": (lambda n: return_map(FIG4, h="1.3342", bits=n), 53, 9000),
    "digits of a phase": (lambda n: find_orbit(FIG4, "01", **START, digits=n), 10, 200),
    "symbols of a code": (lambda n: find_orbit(FIG4, "0" * n, **START), 1, 10_000),
    "bits of a proof": (
        lambda n: certify_codes(FIG4, ["1"], **START, n_symbols=1, bits=n),
        *(8, 4096),
    ),
    "symbols of a word": (lambda n: closed.closed_orbit(FIG4, "0" * n, h="1.3342"), 1, 60),
    "symbols of round phases": (
        lambda n: follow.round_phases(FIG4, "0" * n, **START, decimals=1),
        *(1, 50),
    ),
    "decimals": (lambda n: follow.round_phases(FIG4, "01", **START, decimals=n), 0, 4),
}


@pytest.mark.parametrize(("call", "least", "most"), LIMITS.values(), ids=LIMITS)
def test_an_argument_is_accepted_up_to_its_limits_and_not_beyond(
    call: Callable[[int], Any], least: int, most: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(storage, "kept", reached)
    monkeypatch.setattr(find, "surface", reached)
    monkeypatch.setattr(codes, "side_by_side", reached)
    monkeypatch.setattr(levels, "return_map", reached)
    monkeypatch.setattr(follow, "route_codes", reached)
    for allowed in (least, most):
        with pytest.raises(Reached):
            call(allowed)
    for beyond in (least - 1, most + 1):
        with pytest.raises(ValueError, match=r"must|at most|symbol"):
            call(beyond)


@pytest.mark.parametrize(
    ("step", "shown"),
    [(1.1, "1.235"), (0.9, "1.2346"), (1e-3, "1.234568"), (500.0, "1.23"), (5e4, "1.23")],
)
def test_a_centre_is_shown_to_a_hundredth_of_its_step_and_two_digits_at_least(
    step: float, shown: str
) -> None:
    assert draw.decimals_of({"step": step, "centre": "1.23456789"}) == shown
