"""Values that no argument means: each public function works, or refuses them in one sentence."""

from __future__ import annotations

import inspect
import itertools
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import rigidpend
from rigidpend.numbers.checked import ParameterError
from rigidpend.orbits.return_map.build import FIRST

BODY = rigidpend.Body(A=(2, 1, "3/2"), r=(1, 1, 0), mu="0.001")
START = {"h0": "1.3342", "J1_0": "1e-8"}
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
    "return_map": {"body": BODY, "h": "1.3342", "bits": 53, "design": FIRST},
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
