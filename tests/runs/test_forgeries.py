"""Certificates changed in every place: neither checker calls proven what is not."""

import functools
import json
import operator
import random
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest

from rigidpend import Body, certify_codes
from rigidpend.machine.progress import tell_nobody
from rigidpend.results import store
from rigidpend.routes.certified import codes
from rigidpend.runs import certificates, loading
from scripts import check_certificate
from tests.attacks import lot
from tests.config.samples import HEAD, changed, written
from tests.remembered import remembered
from tests.runs.checkers import FILE, Change, altered, by_package, by_script, config_of, stated

TEXT = f"""\
{changed("1e-8", "0.2", HEAD.format(experiment="route_codes", n_symbols=1))}\
  arrays:
    one: {{start: 1, step: 1/10, count: 2}}
    two: {{start: pi/2, step: 1/10, count: 2}}
"""
NONE, THIRD = 255, {"start": "0", "step": "1", "count": 1}


@pytest.fixture(scope="module")
def certificate(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("forged")
    config = loading.load(written(folder, TEXT, "tiny.yaml"))
    [one, two] = certificates.certify(config, folder, jobs=1, report=tell_nobody)
    assert one.proven == two.proven == 2
    return folder / FILE


def claims(file: Path) -> set[tuple[str, str, int, int]]:
    """All that a certificate says to be proven: the problem, a phase, a symbol and its value."""
    found = set()
    with h5py.File(file) as data:
        problem = {key: config_of(data)["problem"][key] for key in ("A", "r", "mu", "h0", "J1_0")}
        for group in data["data"].values():
            phases, symbols = group["theta2_0"][()], group["codes"][()]
            for (row, column), code in np.ndenumerate(symbols):
                if code != NONE:
                    phase = phases[column].decode()
                    found.add((json.dumps(problem), phase, int(row), int(code)))
    return found


@functools.cache
def holds(problem: str, phase: str, row: int, code: int) -> bool:
    """Whether a claim is true: the same steps prove symbols of a body beside theirs too."""
    given = json.loads(problem)
    body = Body(A=given["A"], r=given["r"], mu=given["mu"])
    found = certify_codes(body, phase, h0=given["h0"], J1_0=given["J1_0"], n_symbols=row + 1)
    return bool(found.proven[row, 0]) and int(found.codes[row, 0]) == code


def leaves(tree: Any, place: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    """Places of all that a JSON document holds."""
    if not isinstance(tree, dict | list):
        return
    for key, value in tree.items() if isinstance(tree, dict) else enumerate(tree):
        yield (*place, key)
        yield from leaves(value, (*place, key))


def of_config(config: Any) -> Iterator[tuple[str, Change]]:
    """Each entry gone, each number another one, each with what is no number."""
    for place in leaves(config):
        # Of the other array everything is changed.
        if "one" not in place[:-1]:
            old = functools.reduce(operator.getitem, place, config)
            yield f"config {place} gone", stated(*place)
            yield f"config {place} a list", stated(*place, to=[])
            if isinstance(old, int | str):
                more = old + 1 if isinstance(old, int) else f"{old} + 1/1000000000"
                yield f"config {place} more", stated(*place, to=more)


def of_arrays(file: Any) -> Iterator[tuple[str, Change]]:
    """Each array of a group gone, empty, each kind of element changed, columns exchanged."""
    yield "two gone", lambda file: file["data"].pop("two")
    # A single orbit of all steps, and none left for the second column.
    merged = file["data/two/steps"][()].sum(keepdims=True)
    yield "two merged", replaced("two", "steps", merged)
    yield "two renamed", lambda file: file["data"].move("two", "three")
    for field, node in file["data/two"].items():
        values = node[()]
        first = values * 0 + values[..., :1] if field != "theta2_0" else values[[0, 0]]
        for how, new in {
            "gone": None,
            "empty": values[..., :0],
            "shorter": values[..., :-1],
            "turned": values[..., ::-1],
            "of the other": file["data/one"][field][()],
            "first everywhere": first,
        }.items():
            yield f"{field} {how}", replaced("two", field, new)
        for k in {0, values.shape[-1] // 2, values.shape[-1] - 1}:
            new = values.copy()
            new[..., k] = b"2" if field == "theta2_0" else values[..., k] ^ 1
            yield f"{field} {k} changed", replaced("two", field, new)

    def exchange(file: Any) -> None:
        for old, new in (("one", "three"), ("two", "one"), ("three", "two")):
            file["data"].move(old, new)

    yield "arrays exchanged", exchange


def replaced(name: str, field: str, values: Any) -> Change:
    def change(file: Any) -> None:
        group = file["data"][name]
        attributes = dict(group[field].attrs)
        del group[field]
        if values is not None:
            made = group.create_dataset(field, data=values)
            made.attrs.update({key: attributes[key] for key in ("units", "description")})

    return change


def every_change(certificate: Path) -> list[tuple[str, Change]]:
    with h5py.File(certificate) as file:
        return [*of_config(config_of(file)), *of_arrays(file)]


@pytest.fixture(scope="module", autouse=True)
def once() -> Iterator[None]:
    """A proof is checked once: most changes leave all that it is given as it is."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(codes, "checked_codes", remembered(codes.checked_codes))
        patch.setattr(check_certificate, "prove", remembered(check_certificate.prove))
        yield


def refusals(certificate: Path, target: Path, what: str, change: Change) -> list[bool]:
    """Whether each checker refuses a certificate with a change; one that none refuses is true."""
    other = altered(certificate, target, change)
    said = [by_package(other), by_script(other)]
    assert "\n" not in "".join(said)
    if not all(said):
        true = claims(certificate)
        assert all(x in true or holds(*x) for x in claims(other)), (what, said)
    return list(map(bool, said))


def turned(chance: random.Random) -> Change:
    """Some bits of whole numbers turned over, in any array."""

    def change(file: Any) -> None:
        nodes = [x for each in file["data"].values() for x in each.values() if x.dtype.kind in "iu"]
        for node in chance.choices(nodes, k=chance.randint(1, 3)):
            values = node[()]
            bit = values.dtype.type(1 << chance.randrange(8 * values.itemsize))
            values.reshape(-1)[chance.randrange(values.size)] ^= bit
            node[...] = values

    return change


@pytest.mark.slow
def test_no_change_anywhere_makes_something_false_proven(
    certificate: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    # What is changed here is sound HDF5: that no file harms its reader is shown in tests/attacks.
    monkeypatch.setattr(store, "tried", lambda *_: None)
    with lot.drawn("certificates") as chance:
        bits = [("bits", turned(chance)) for _ in range(lot.trials(4, 0.2))]
        refused = [
            refusals(certificate, tmp_path / FILE, what, change)
            for what, change in [*every_change(certificate), *bits]
        ]
    # Most changes say something else; others change nothing that is claimed.
    assert np.mean(refused, axis=0).min() > 0.6


def column_copied(file: Any) -> None:
    for field in ("theta2_0", "codes", "steps"):
        values = file["data/one"][field][()]
        values[..., 1] = values[..., 0]
        replaced("one", field, values)(file)


def row_copied(file: Any) -> None:
    replaced("one", "codes", file["data/one/codes"][()][[0, 0]])(file)


@pytest.mark.parametrize("checker", [by_package, by_script])
@pytest.mark.parametrize(
    ("change", "said"),
    [
        (stated("problem", "mu", to="1/500"), "one: "),
        (stated("problem", "arrays", "two", "start", to="8/5"), "two: theta2_0 of column 0"),
        (stated("problem", "n_symbols", to=2), "one: "),
        (stated("problem", "arrays", "three", to=THIRD), "three: "),
        (column_copied, "one: theta2_0 of column 1"),
        (row_copied, "its config asks for 1 symbol"),
        (lambda file: (file["data"].pop("two"), file.copy("data/one", "data/two")), "two: "),
        (lambda file: file["data"].pop("two"), "two"),
        (lambda file: file.copy("data/one", "data/more"), "more"),
        (lambda file: file["data/two/steps"].attrs.update(units="deg"), "unit"),
    ],
)
def test_what_is_of_another_config_or_copied_is_refused_at_its_place(
    certificate: Path, tmp_path: Path, change: Change, said: str, checker: Callable[[Path], str]
) -> None:
    assert said in checker(altered(certificate, tmp_path / FILE, change))
