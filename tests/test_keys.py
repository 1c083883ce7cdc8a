"""Keys under which something is kept: each of what it follows from makes another key."""

from collections.abc import Callable
from functools import partial
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import llvmlite.binding as llvm
import pytest

from rigidpend import Body
from rigidpend.config import catalogue
from rigidpend.numbers.exact import exact
from rigidpend.orbits.integrate.kernel import machine_code
from rigidpend.orbits.return_map import return_map, storage
from rigidpend.orbits.return_map.build import SECOND, WITH_THETA3
from rigidpend.runs import certificates, loading
from tests.bodies import FIG4

H = exact("1.3342")


def assert_complete(key: Callable[..., Any], **inputs: tuple[Any, Any]) -> None:
    """Each of two values of an input makes a key of its own, and the same inputs make the same."""
    given = {name: value for name, (value, _) in inputs.items()}
    keys = [key(**given), *(key(**{**given, name: x}) for name, (_, x) in inputs.items())]
    for k, one in enumerate(keys):
        alike = [name for name, other in zip(["", *inputs], keys, strict=True) if other == one]
        assert len(alike) == 1, f"the key does not hold {alike[-1] if k == 0 else alike}"
    assert key(**given) == keys[0]


class Asked(Exception):
    """A key that was asked for, in the place of what would be made."""

    def __init__(self, key: Any, *_: Any) -> None:
        self.key = key


def asked(by: Callable[[], Any]) -> Any:
    with pytest.raises(Asked) as caught:
        by()
    return caught.value.key


def refuse(*arguments: Any) -> Any:
    """What keeps something, where only the last argument but the content is of interest."""
    raise Asked(arguments[1])


def test_of_a_return_map(monkeypatch: pytest.MonkeyPatch) -> None:
    """And of each field of its design."""
    task, other = ("low", "high", "bits"), SECOND._replace(narrower=8)

    def key(A: Any, r: Any, mu: Any, code: str, **given: Any) -> bytes:
        monkeypatch.setattr(storage, "package_digest", lambda: code)
        asked = {name: given.pop(name) for name in task}
        return storage.map_key(Body(A, r, mu), **asked, design=WITH_THETA3._replace(**given))

    assert_complete(
        key,
        A=((2, 1, "1.5"), (2, 1, "1.6")),
        r=((1, 1, 0), (1, 2, 0)),
        mu=("0.001", "0.002"),
        code=("a", "b"),
        low=(H, exact("1.3341")),
        high=(H, exact("1.3343")),
        bits=(53, 64),
        **dict(zip(WITH_THETA3._fields, zip(WITH_THETA3, other, strict=True), strict=True)),
    )


@pytest.mark.slow
def test_of_a_map_s_program_for_orbits() -> None:
    made = return_map(FIG4, h="1.3342", bits=64)
    sizes = {"least_Qp": (1e-4, 2e-4), "most_Qp": (1e-3, 2e-3)}
    assert_complete(lambda **x: id(made.program(**x)), bits=(53, 106), **sizes)


def test_of_machine_code(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("rigidpend.machine.cache.load", refuse)

    def key(text: str, triple: str, cpu: str, features: str, version: Any) -> bytes:
        machine = SimpleNamespace(triple=triple)
        target = SimpleNamespace(create_target_machine=lambda **_: machine)
        monkeypatch.setattr(llvm.Target, "from_default_triple", lambda: target)
        monkeypatch.setattr(machine_code, "processor", lambda _: (cpu, features))
        monkeypatch.setattr(llvm, "llvm_version_info", version)
        return asked(lambda: machine_code.function(text))

    versions = (1, 2), (1, 3)
    named = {name: (name, f"other {name}") for name in ("text", "triple", "cpu", "features")}
    assert_complete(key, version=versions, **named)


def test_of_the_parts_of_a_certificate(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(certificates, "Parts", refuse)
    problem = object()
    certify = partial(certificates.certify, jobs=1, report=lambda _: None)

    def key(mu: str, phase: str, code: str) -> str:
        config = loading.load(catalogue.known()["fig4"], [f"problem.mu={mu}"])
        monkeypatch.setattr(certificates, "orbits", lambda *_: {"left": (problem, [exact(phase)])})
        monkeypatch.setattr(certificates, "code_hash_of", lambda _: code)
        return asked(lambda: certify(config, tmp_path))

    assert_complete(key, mu=("1e-3", "2e-3"), phase=("1", "2"), code=("a", "b"))
