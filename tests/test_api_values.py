"""Values that no argument means, and limits: each is refused in one sentence, or works."""

import inspect
import itertools
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import rigidpend
from rigidpend import certify_codes, find_orbit
from rigidpend.experiments.route_zoom import draw
from rigidpend.numbers.checked import ParameterError
from rigidpend.orbits.return_map import return_map, storage
from rigidpend.orbits.return_map.build import FIRST
from rigidpend.routes.certified import codes
from rigidpend.routes.symbolic import closed, find, follow, levels
from tests.bodies import FIG4 as BODY

START: dict[str, Any] = {"h0": "1.3342", "J1_0": "1e-8"}
ORBIT: dict[str, Any] = {"body": BODY, "theta2_0": "1", **START}
LADDER = {"n_symbols": 1, "precisions": (53,)}
CALLS: dict[str, dict[str, Any]] = {
    "Body": {"A": (2, 1, 1.5), "r": (1, 1, 0), "mu": "0.001"},
    "address_of": {**ORBIT, **LADDER},
    "certify_codes": {**ORBIT, "n_symbols": 1, "bits": 60, "jobs": 1},
    "find_orbit": {"body": BODY, "code": "0", **START, "near": None, "digits": 28},
    "load": {"source": "fig4"},
    "orbit": {**ORBIT, "time": 1.0, "step": 0.5, "engine": None},
    "plot": {"result": "fig4"},
    "return_map": {"body": BODY, "h": "1.3342", "bits": 53, "design": FIRST, "budget": 1.0},
    "route_codes": {
        **ORBIT,
        **LADDER,
        "engine": None,
        "tolerance": None,
        "jobs": 1,
        "method": "integration",
    },
    "run": {
        "name": "fig4",
        "settings": None,
        "folder": "results",
        "called": None,
        "jobs": None,
        "progress": None,
    },
    "theory": {"body": BODY, "h0": "1.3342", "J1_0": None},
}
"""Every public function and type that takes arguments, with arguments that are right."""
WRONG: list[Any] = [
    *(None, "", "x", "a\0b", "1" * 5000, b"1", True, object(), float, len),
    *(-1, 10**12, 10**5000, 10**9, 1e12, 1e300, float("nan"), float("inf"), 1j),
    *([], (), {}, [None], ["x"], [[1.0, 2.0]], {"a": 1}, (10**9,), (53, 54)),
    *(np.array([]), np.zeros((2, 2)), np.array([1j]), np.array(["a"]), np.ma.masked),
]
SAID = {
    "called": "--name",
    "name": "config",
    "settings": "a=1",
    "folder": "results",
    "source": "results/",
    "result": "results/",
    "code": "symbols are 0 and 1",
}
"""What a message has where not the name of the argument."""
SLOW = {"address_of", "certify_codes", "orbit", "return_map", "run"}
"""What takes seconds to import, or to compute where a value is right."""


def meant(argument: str, value: Any) -> bool:
    """True for what the argument means and what takes seconds to compute."""
    if argument in ("h0", "h", "near"):
        return value is None or (type(value) in (int, float) and 0 < abs(value) < 1e400)
    if argument == "budget":
        return isinstance(value, int | float)
    if argument == "jobs":
        return value is None or (type(value) is int and value > 0)
    if argument == "settings":
        return value is None or (isinstance(value, dict) and not value)
    if argument == "progress":
        return value is None or callable(value)
    return argument == "code" and isinstance(value, str) and set(value) == {"1"}


@pytest.mark.parametrize(
    "name", [pytest.param(x, marks=[pytest.mark.slow] * (x in SLOW)) for x in CALLS]
)
def test_a_value_works_or_is_refused_in_one_sentence(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    monkeypatch.chdir(tmp_path)
    refused = 0
    for argument, value in itertools.product(CALLS[name], WRONG):
        if meant(argument, value):
            continue
        where, said = f"{name}({argument}={type(value).__name__})", ""
        try:
            getattr(rigidpend, name)(**{**CALLS[name], argument: value})
        except (ValueError, RuntimeError) as error:
            # Raised again unless of the package's own kinds: Python's say that a program failed.
            if not type(error).__module__.startswith("rigidpend."):
                raise AssertionError(where) from error
            said = str(error)
            refused += 1
        assert said.isprintable(), (where, said)
        assert len(said) < 600, (where, said)
        assert not said or argument in said or SAID.get(argument, argument) in said, (where, said)
    assert refused > 10 * len(CALLS[name])


def test_every_public_name_is_tried() -> None:
    records = {"CertifiedCodes", "FoundOrbit", "RouteCodes", "StoredResult"}
    assert set(CALLS) == set(rigidpend.__all__) - records
    for name, given in CALLS.items():
        if name not in ("run", "theory", "return_map"):
            assert set(given) <= set(inspect.signature(getattr(rigidpend, name)).parameters)


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"time": 1e9}, "takes 1.8e+10 samples, 6.3e+03 GB of memory; 2000000"),
        ({"time": 1e12, "step": 1e12}, "takes 3e+11 rotations of the pendulum, about 9e+06 s"),
        ({"time": 0}, "time must be a number above 0, got 0.0"),
        ({"time": 1, "step": 0}, "step must be a number above 0, got 0.0"),
    ],
)
def test_an_orbit_that_never_ends_is_refused_with_what_it_would_take(
    given: dict[str, Any], said: str
) -> None:
    with pytest.raises(ParameterError, match=re.escape(said)):
        rigidpend.orbit(**ORBIT, **given)


class Reached(Exception):
    """What begins where an argument is accepted."""


def reached(*_: Any, **__: Any) -> Any:
    raise Reached


LIMITS: dict[str, tuple[Callable[[int], Any], int, int]] = {
    "bits of a map": (lambda n: return_map(BODY, h="1.3342", bits=n), 53, 9000),
    "digits of a phase": (lambda n: find_orbit(BODY, "01", **START, digits=n), 10, 200),
    "symbols of a code": (lambda n: find_orbit(BODY, "0" * n, **START), 1, 10_000),
    "bits of a proof": (
        lambda n: certify_codes(BODY, ["1"], **START, n_symbols=1, bits=n),
        *(8, 4096),
    ),
    "symbols of a word": (lambda n: closed.closed_orbit(BODY, "0" * n, h="1.3342"), 1, 60),
    "symbols of round phases": (
        lambda n: follow.round_phases(BODY, "0" * n, **START, decimals=1),
        *(1, 50),
    ),
    "decimals": (lambda n: follow.round_phases(BODY, "01", **START, decimals=n), 0, 4),
}


@pytest.mark.parametrize(("call", "least", "most"), LIMITS.values(), ids=LIMITS)
def test_an_argument_is_accepted_up_to_its_limits_and_not_beyond(
    call: Callable[[int], Any], least: int, most: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(storage, "kept_map", reached)
    monkeypatch.setattr(find, "orbits_of", reached)
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
