"""Certificates: written, read, checked again; what they may ask for, and a proof of work."""

import contextlib
import json
import re
import resource
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any
from unittest.mock import Mock

import numpy as np
import pytest

from rigidpend import Body, certify_codes
from rigidpend.machine import files
from rigidpend.machine.progress import PartDone, tell_nobody
from rigidpend.notebook import StoredResult
from rigidpend.numbers.exact import exact
from rigidpend.results import store
from rigidpend.routes.certified import codes
from rigidpend.routes.certified.proof_data import ORBIT_STEPS, Step
from rigidpend.runs import certificate_files as storage
from rigidpend.runs import certificates, cluster, loading
from scripts import check_certificate
from tests import bodies
from tests.attacks import lot
from tests.cli.calls import call, succeeded
from tests.config.samples import FIG4, TINY, ZOOM, changed, written
from tests.runs.checkers import FILE, by_package, by_script


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    made = tmp_path_factory.mktemp("certified")
    written(made, TINY, "tiny.yaml")
    assert call(made, "run", "tiny.yaml", "--out", ".").returncode == 0
    done = succeeded(made, "certify", "tiny.yaml", "--out", ".", "-j", "1")
    assert done.stdout == "tiny: only: 4 of 4 symbols of 2 orbits proven\n"
    return made


def test_a_certificate_holds_what_is_proven_exactly_of_which_orbits(folder: Path) -> None:
    told = storage.read(folder / FILE)
    group = told["data"]["only"]
    assert [str(x) for x in group["theta2_0"]] == ["1", "1.1"]
    assert set(told["attributes"]) == {"format", "format_version"}
    assert told["config"]["problem"]["n_symbols"] == len(group["codes"]) == 2
    result = store.load(folder / "tiny.h5")["data"]["only"]
    assert np.array_equal(group["codes"], result["codes"])
    assert told["provenance"]["version_python_flint"]
    assert not list(folder.glob(".*"))


def test_an_array_may_have_the_name_that_a_zoom_has_for_all_of_its_own(folder: Path) -> None:
    """Its symbols were neither marked nor compared, and gave no words."""
    told, result = storage.read(folder / FILE), store.load(folder / "tiny.h5")
    for file in (told, result):
        file["data"] = {"levels": file["data"]["only"]}
    assert storage.marked(result, told)["data"]["levels"]["proven"].all()
    words = StoredResult(folder / "tiny.h5", result).words["levels"]
    assert words == ["".join(map(str, column)) for column in told["data"]["levels"]["codes"].T]
    assert storage.contradictions(result, told) == []
    told["data"]["levels"]["codes"][1, 0] ^= 1
    [found] = storage.contradictions(result, told)
    assert found.place == "levels"


def test_it_is_checked_again_without_integration(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("rigidpend.routes.certified.approximation.Approximation", None)
    monkeypatch.setattr("rigidpend.orbits.integrate.crossings", None)
    done = succeeded(folder, "certify", "--check", FILE, "-j", "1", "--json")
    [[found]] = json.loads(done.stdout).values()
    assert found == {"array": "only", "orbits": 2, "symbols": 4, "proven": 4, "undecided": []}


class Proving(Exception):
    """A proof that begins."""


@pytest.mark.parametrize(
    ("setting", "code", "moved", "force", "anew"),
    [
        ("problem.mu=0.001", "", 0, False, False),
        ("problem.J1_0=1e-9", "", 0, False, True),
        ("figure=4", "x", 0, False, True),
        # As where the centres of a zoom, which only its result tells, are others.
        ("figure=4", "", 1, False, True),
        ("figure=4", "", 0, True, True),
    ],
)
def test_only_other_orbits_or_other_code_are_proven_anew_with_parts_of_their_own(
    folder: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    setting: str,
    code: str,
    moved: int,
    force: bool,
    anew: bool,
) -> None:
    """Unless it is asked for: then what an interrupted proof has finished counts."""
    path = written(tmp_path, TINY, "tiny.yaml")
    own, config = (loading.load(path, given) for given in ([], [setting]))
    monkeypatch.setattr(certificates, "Parts", parts := Mock(side_effect=Proving))
    with pytest.raises(Proving):
        certificates.certify(own, tmp_path, jobs=1, report=tell_nobody)
    (tmp_path / FILE).write_bytes((folder / FILE).read_bytes())
    of = certificates.orbits(config, tmp_path)
    orbits = {
        name: (problem, [x + moved for x in phases]) for name, (problem, phases) in of.items()
    }
    monkeypatch.setattr(certificates, "orbits", lambda *_: orbits)
    if code:
        monkeypatch.setattr(certificates, "code_hash_of", lambda _: code)
    told: list[str] = []
    with pytest.raises(Proving) if anew else contextlib.nullcontext():
        certificates.certify(config, tmp_path, jobs=1, report=told.append, force=force)
    assert ["is up to date" in line for line in told] == [True] * (not anew)
    keys = {call.args[1] for call in parts.call_args_list}
    assert len(keys) == 1 + (anew and not force)


def test_each_orbit_that_is_not_wholly_proven_is_named_with_its_reason() -> None:
    symbols = np.array([[0, 1, 255], [1, 255, 255]], dtype=np.uint8)
    group = {"codes": symbols, "theta2_0": np.array(["1", "1.1", "1.2"])}
    [told] = certificates.summaries({"only": group}, {"only": ["", "few bits", "no start"]})
    assert (told.orbits, told.symbols, told.proven) == (3, 6, 3)
    assert told.undecided == [
        "column 1, theta2_0 = 1.1: 1 of 2 symbols; then few bits",
        "column 2, theta2_0 = 1.2: 0 of 2 symbols; then no start",
    ]


@pytest.mark.slow
@pytest.mark.parametrize(("first", "then", "left"), [(1, 2, [1]), (2, 1, []), (0, 2, [1])])
def test_what_one_process_several_or_a_cluster_have_begun_others_finish(
    folder: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    first: int,
    then: int,
    left: list[int],
) -> None:
    """One keeps each orbit by itself, several keep some together, a cluster in any order.

    None is proven again.
    """
    config = loading.load(written(tmp_path, TINY, "tiny.yaml"))

    def stop(line: str) -> None:
        if isinstance(line, PartDone) and "orbits" in line:
            raise Proving

    def lost(*given: Any) -> Any:
        *_, parts, pieces, _ = given
        parts.keep(pieces[1].name, pieces[1].compute)
        raise Proving

    monkeypatch.setattr(cluster, "computed", lost)
    how: Any = {"jobs": first} if first else {"jobs": 2, "scheduler": "head:8786"}
    with pytest.raises(Proving):
        certificates.certify(config, tmp_path, report=stop, **how)
    monkeypatch.setattr(codes, "proven_codes", proven := Mock(wraps=codes.proven_codes))
    certificates.certify(config, tmp_path, jobs=then, report=tell_nobody)
    assert [len(call.args[1]) for call in proven.call_args_list] == left
    ours, whole = (storage.read(x / FILE)["data"]["only"] for x in (tmp_path, folder))
    assert ours["theta2_0"].tolist() == whole["theta2_0"].tolist()


def test_steps_survive_packing() -> None:
    step = Step(3 << 30, 70, [[(-1) ** j * (1 << 9 * j) - i for j in range(5)] for i in range(6)])
    orbits = [[step], [], [step, step._replace(bits=9)]]
    assert storage.unpacked(storage.packed(orbits)) == orbits


@pytest.mark.slow
def test_both_checkers_prove_a_zoom_by_a_factor_of_many_digits(tmp_path: Path) -> None:
    """As it is kept: a quotient of whole numbers."""
    path = written(tmp_path, changed("factor: 4", "factor: 4.000000000000001", ZOOM), "tiny.yaml")
    few = ("--set", "problem.levels=2", "--set", "problem.count=3")
    for command in ("run", "certify"):
        succeeded(tmp_path, command, path.name, *few, "--out", ".", "-j", "1")
    file = tmp_path / FILE
    assert len(storage.read(file)["config"]["problem"]["factor"]) > 20
    done = succeeded(tmp_path, "certify", "--check", file.name)
    assert done.stdout.count("3 of 3 symbols of 3 orbits proven") == 2
    *_, last = check_certificate.check(file)
    assert last == "proven: 6 symbols, all that the certificate claims"


@pytest.mark.parametrize("place", ["start", "step"])
def test_a_number_of_a_grid_is_one_by_itself(place: str) -> None:
    """Not only between brackets."""
    grid = {"start": "0", "step": "1", "count": 1, place: "0) + (1"}
    problem = {"experiment": "route_codes", "problem": {"arrays": {"one": grid}}}
    with pytest.raises(check_certificate.Refused, match="is no number"):
        check_certificate.phases_of(problem, {})


def test_the_config_of_another_experiment_is_refused_by_its_name() -> None:
    own, other = ({"experiment": x, "mu": y} for x, y in (("fig", "1/1000"), ("word", "0.001")))
    check_certificate.check_against(own, own | {"mu": "0.001"})
    said = "experiment is fig, and word in the config given"
    with pytest.raises(check_certificate.Refused, match=said):
        check_certificate.check_against(own, other)


def test_symbols_are_marked_and_held_against_their_own_proof_alone(folder: Path) -> None:
    certificate = storage.read(folder / FILE)
    stated = certificate["config"] | {"figure": "", "numerics": {"precisions": [53]}}

    def told(group: Any, proof: Any = certificate, where: str = "data", **config: Any) -> Any:
        """What is marked in an array, or level, of a result, and what contradicts its proof."""
        data = {"only": group} if where == "data" else {where: {"only": group}}
        result: Any = {"config": {**stated, **config}, "data": data}
        marked = storage.marked(result, proof)["data"]
        marks = marked.get(where, marked)["only"].get("proven")
        said = storage.contradictions(result, proof)
        return None if marks is None else marks.tolist(), said

    codes = certificate["data"]["only"]["codes"].copy()
    only = {"codes": codes, "certain": codes < 2, "theta2_0": np.array([1, 1.1])}
    assert told(only) == ([[True, True], [True, True]], [])
    other = {**only, "theta2_0": np.array([1, 1.7])}
    assert told(other) == (None, ["only: the certificate is of other phases"])
    for of_others in (
        {"problem": stated["problem"] | {"mu": "1/500"}},
        {"experiment": "exponents"},
    ):
        [another] = told(only, **of_others)[1]
        assert "another problem" in another
    assert told(only, problem={})[0] is None
    codes[1, 0] ^= 1
    said = ["only: symbol 2 of column 0 is proven to be another"]
    assert told(only) == ([[True, True], [False, True]], said)
    assert told({**only, "certain": codes > 1})[1] == []
    # What neither knows is not proven.
    proven, unknown = certificate["data"]["only"], {"codes": codes * 0 + 255}
    nothing = {**certificate, "data": {"only": {**proven, **unknown}}}
    assert told({**only, **unknown}, nothing) == ([[False, False], [False, False]], [])
    assert told(only, nothing) == ([[False, False], [False, False]], [])
    # A single route, and a level of a zoom, which is told by its centre to the last digit.
    single = {"codes": proven["codes"][:, :1], "theta2_0": proven["theta2_0"][:1]}
    one = {**certificate, "data": {"only": single}}
    route = {"codes": codes[:, 0], "certain": np.ones(2, dtype=bool), "theta2_0": np.float64(1)}
    assert told(route, one) == ([True, False], said)
    level = {"codes": codes[:, 0], "certain": route["certain"], "centre": "1"}
    assert told(level, one, "levels") == ([True, False], said)
    level["centre"] = f"1.{30 * '0'}1"
    assert told(level, one, "levels") == (None, ["only: the certificate is of another centre"])


SETTINGS = ["problem.n_symbols=1", "problem.arrays={one: {start: 0, step: 1, count: 1}}"]
RESOLVED = loading.load(FIG4, SETTINGS).resolved()
CONFIG = {key: RESOLVED[key] for key in ("experiment", "problem")}


def bomb(steps: int, terms: int) -> dict[str, Any]:
    """The fields of a certificate of many steps that are all zeros, which compress to nothing."""
    made = {
        "theta2_0": np.array([b"0"]),
        "codes": np.array([[0]], dtype=np.uint8),
        "steps": np.array([steps], dtype=np.uint32),
        "half_lengths": np.full(steps, 1 << 20, dtype=np.uint64),
        "step_bits": np.full(steps, 60, dtype=np.uint16),
        "terms": np.full(steps, terms, dtype=np.uint16),
        "widths": np.ones(6 * steps * terms, dtype=np.uint16),
        "digits": np.zeros(6 * steps * terms, dtype=np.uint8),
    }
    assert made.keys() == {*storage.FIELDS, *storage.PROOF}
    return made


def stored(folder: Path, fields: dict[str, Any]) -> Path:
    store.write(folder / FILE, storage.LAYOUT, {"one": fields}, {}, CONFIG, {})
    return folder / FILE


@contextlib.contextmanager
def little_memory() -> Iterator[None]:
    """Half a gigabyte, and not more, besides what this process has."""
    before = resource.getrlimit(resource.RLIMIT_AS)
    used = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
    resource.setrlimit(resource.RLIMIT_AS, (used + 2**29, before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_AS, before)


@pytest.mark.slow
def test_a_bomb_is_refused_before_it_takes_memory(tmp_path: Path) -> None:
    """Some kilobytes, of which millions of numbers would be made: in lists, a gigabyte."""
    with lot.drawn("bombs") as chance:
        drawn = [round(10 ** chance.uniform(3.5, 6)) for _ in range(lot.trials(0, 0.005))]
    # Many steps of one term, many of both, and some by lot.
    for steps, terms in [(1_000_000, 1), (4_000, 500), *((n, 2_000_000 // n) for n in drawn)]:
        path = stored(tmp_path, bomb(steps, terms))
        assert path.stat().st_size < 2**20
        for checker in (by_package, by_script):
            with little_memory():
                said = checker(path)
            assert re.search("too large|steps|coefficients|size allows", said)


@pytest.mark.parametrize("checker", [by_package, by_script])
def test_more_than_its_bytes_can_hold_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, checker: Callable[[Path], str]
) -> None:
    most = stored(tmp_path, bomb(1000, 1)).stat().st_size / 128
    for share, refused in ((0.95, False), (1.05, True)):
        said = checker(stored(tmp_path, bomb(round(share * most), 1)))
        assert (f"{share * most:.0f} steps" in said) is refused
    monkeypatch.setattr(store, "LEAST_BYTES", 0)
    monkeypatch.setattr(check_certificate, "SPARE", 0)
    noise = np.random.default_rng(1).integers(256, size=10**6, dtype=np.uint8)
    for times, refused in ((7.5, False), (8.5, True)):
        digits = np.zeros(round(times * noise.size), dtype=np.uint8)
        digits[: noise.size] = noise
        said = checker(stored(tmp_path, {**bomb(1, 1), "digits": digits}))
        assert ("too large" in said) is refused


def test_numbers_that_no_prover_takes_are_refused_with_their_names(tmp_path: Path) -> None:
    with pytest.raises(files.StoreError, match=r"300000 coefficients, .* at most"):
        storage.read(stored(tmp_path, bomb(50, 1000)))
    good = bomb(2, 3)
    for name, wrong, said in (
        ("steps", ORBIT_STEPS + 1, f"number of steps of an orbit is {ORBIT_STEPS + 1}"),
        ("half_lengths", 2**63, "half-length"),
        ("half_lengths", 0, "half-length"),
        ("step_bits", 60_000, "bits of a step is 60000, not 1 to 4096"),
        ("terms", 0, "terms of a step is 0"),
        ("terms", 4097, "terms of a step is 4097"),
        ("widths", 0, "width of a coefficient is 0"),
        ("widths", 1025, "width of a coefficient is 1025"),
    ):
        bad = {**good, name: good[name] * 0 + good[name].dtype.type(wrong)}
        with pytest.raises(files.StoreError, match=said):
            storage.unpacked(bad)
    assert len(storage.unpacked(good)[0]) == 2


@pytest.mark.slow
def test_work_without_hope_is_not_begun_and_its_size_is_said() -> None:
    # Beside a symmetric body a passage takes thousands of units of time, and so of bits.
    body = Body(A=("1.8869", "0.943", "1.886"), r=(1, 1, 0), mu="0.001")
    found = certify_codes(body, ["3.8153"], h0="0.11", J1_0="1e-40", n_symbols=2)
    assert found.status == ["undecided"]
    assert "asks for about" in found.reason[0]
    assert "times the work that an orbit may take" in found.reason[0]
    assert not found.proven.any()


def test_a_proof_ends_where_its_work_is_spent(monkeypatch: pytest.MonkeyPatch) -> None:
    """Lines on the way name a phase of a grid by one number."""
    lines: list[str] = []
    monkeypatch.setattr(codes, "MOST_WORK", 4 * 60**2)
    monkeypatch.setattr(codes, "LINE_SECONDS", 0.0)
    phases = iter([exact("0") + exact("1/10") * 16])
    found = certify_codes(
        bodies.FIG4, phases, h0="1.3342", J1_0="1e-8", n_symbols=2, bits=60, report=lines.append
    )
    assert found.status == ["undecided"]
    assert "no more work than these" in found.reason[0]
    assert lines
    assert all(x.startswith("theta2_0 = 1.6: step ") and " to go" in x for x in lines)


@pytest.mark.parametrize(
    ("steps", "said"),
    [
        # A third of 1000^2 for each step, and 2.5 microseconds for each of these.
        (100, ["x: about 100 steps of up to 1000 bits, which may take 83 s"]),
        (6000, ["x: about 6000 steps of up to 1000 bits, which may take 83 min"]),
        (50, []),
        (6500, []),
    ],
)
def test_a_long_proof_says_beforehand_what_it_takes(steps: int, said: list[str]) -> None:
    """One of half a minute is not long, and one of two hours is not begun."""
    lines: list[str] = []
    codes.ProofProgress("x", steps, 1000, lines.append)
    assert lines == said


def test_what_is_left_follows_from_what_was_done(monkeypatch: pytest.MonkeyPatch) -> None:
    clock = iter([0.0, 10.0, 11.0, 30.0])
    monkeypatch.setattr("time.monotonic", lambda: next(clock))
    lines: list[str] = []
    # Bits fall to nothing, so that 30 steps from 100 bits cost a third of 30 x 100^2.
    seen = codes.ProofProgress("x", 30, 100, lines.append)
    assert all(seen.step(100) for _ in range(3))
    assert lines == [
        "x: step 1 of about 30, 100 bits left, about 90 s to go",
        "x: step 3 of about 30, 100 bits left, about 70 s to go",
    ]
