"""Certificates as files: which orbits they are about, the proven symbols, and the polynomials.

A certificate is data that nobody has to trust: whoever reads it may check it again. Only the check
needs python-flint, reading does not. Its config states the experiment and the whole problem; each
column states its phase and its proven symbols. What follows from the polynomials, such as crossing
times, is not stored, so that no two things in a certificate can disagree.
"""

import contextlib
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from rigidpend.experiments.compare import Difference
from rigidpend.experiments.data import Data, Layout, Loaded, text, whole
from rigidpend.experiments.shared import arrays
from rigidpend.machine import files
from rigidpend.machine.files import CERTIFICATE
from rigidpend.numbers.exact import exact
from rigidpend.numbers.texts import NO_SYMBOL
from rigidpend.results import store
from rigidpend.routes.certified.proof_data import ORBIT_BITS, ORBIT_STEPS, ORBIT_TERMS, Step

SUFFIX = f"{CERTIFICATE}.h5"
"""Ending of a certificate's name, after the name of its result."""
MOST_RATIO = 8
"""Largest number of bytes of arrays for each byte of the file: digits cannot be compressed."""
STEP_BYTES = 128
"""Least number of bytes of the file for each step; the shortest ones have some 300."""
NUMBERS = 1
"""Largest number of coefficients for each byte of the file; ordinary ones take several bytes."""

FIELDS = {
    "theta2_0": text("rad", "initial phase of each column, exact", "columns"),
    "codes": whole(
        "1",
        "symbols, row 0 = symbol 1: 0 left, 1 right, each proven; 255 unproven",
        "symbols",
        "columns",
    ),
}
"""Fields that say which symbols are proven."""
PROOF = {
    "steps": whole("1", "number of steps of each orbit", "columns"),
    "half_lengths": whole("2^-32", "half of a step's length in the orbit's time", "steps"),
    "step_bits": whole("bit", "digits behind the point of its coefficients", "steps"),
    "terms": whole("1", "Chebyshev coefficients of each component", "steps"),
    "widths": whole("byte", "bytes of each coefficient", "coefficients"),
    "digits": whole("1", "coefficients, two's complement, lowest byte first", "bytes"),
}
"""Fields of the proof: steps of all orbits one after the other, their coefficients as bytes."""
LAYOUT: Layout = {"<arrays>": {**FIELDS, **PROOF}}
"""Layout of a certificate: a group for each array of its result."""


def certificate_of(result: Path) -> Path:
    """The file of the certificate beside a result file."""
    return result.with_name(result.stem + SUFFIX)


def is_certificate(file: Path) -> bool:
    """True if the name of a file is that of a certificate."""
    return file.name.endswith(SUFFIX)


def results_in(folder: Path) -> list[Path]:
    """Result files directly in a folder, by name, without the certificates beside them."""
    with contextlib.suppress(FileNotFoundError):
        # Raises an error where the folder cannot be asked; a pattern finds nothing there, from
        # Python 3.13 on.
        folder.stat()
    return sorted(file for file in folder.glob("*.h5") if not is_certificate(file))


def read(path: Path) -> Loaded:
    """A certificate as plain data, whose proofs are not checked here.

    StoreError as `rigidpend.results.store.load`; also where the file says something that no
    certificate says, or has more steps or coefficients than its length allows.
    """
    loaded, outline = store.load_outlined(path, LAYOUT, ratio=MOST_RATIO)
    _check_words(path, outline)
    # Compressed zeros could otherwise claim many steps in a small file.
    length = path.stat().st_size
    for what, most in (("half_lengths", length // STEP_BYTES), ("widths", NUMBERS * length)):
        count = sum(group[what].size for group in loaded["data"].values())
        if count > most:
            said = "steps" if what == "half_lengths" else "coefficients"
            claim = f"{count} {said}, and a certificate of {length} bytes has {most} at most"
            raise files.StoreError.of(path, claim)
    return loaded


def _check_words(path: Path, outline: Mapping[str, Mapping[str, Any]]) -> None:
    """Refuse attributes that are not those of the layout: they could state another unit."""
    for place, found in outline.items():
        # Names in brackets are of the outline, not of the file.
        told = {name: x for name, x in found.items() if not name.startswith("(")}
        expected: Mapping[str, Any] = {}
        match place.split("/")[1:]:
            case ["provenance"]:
                continue
            case [""]:
                expected = {"format": told.get("format"), "format_version": store.FORMAT_VERSION}
            case ["config"]:
                expected = store.OF_CONFIG.meaning
            case ["data", _, name]:
                expected = {**FIELDS, **PROOF}[name].meaning
        if told != expected:
            wrong = min(key for key in {*told, *expected} if told.get(key) != expected.get(key))
            said = f"{place}: its attribute {wrong} is not a certificate's"
            raise files.StoreError.of(path, said)


def beside(result: Path) -> Loaded | None:
    """The certificate beside a result file; None where there is none."""
    file = certificate_of(result)
    return read(file) if file.exists() else None


def marked(result: Loaded, certificate: Loaded | None) -> Loaded:
    """A result whose arrays of codes have a further field `proven`, where there is a certificate.

    A symbol is marked if the certificate is of the same problem and the same phases, and proves
    this very symbol.
    """
    if certificate is None or not _same_problem(result, certificate):
        return result
    held = dict(groups := arrays(result["data"]))
    for name, proof, group in _pairs(result, certificate):
        # Even of the same problem the result may be another version's: each symbol is compared.
        if not _unlike(proof, group):
            codes = _columns(group["codes"])
            proven = (proof["codes"] == codes) & (codes != NO_SYMBOL)
            held[name] = {**group, "proven": proven.reshape(group["codes"].shape)}
    data = held if groups is result["data"] else {**result["data"], "levels": held}
    return {**result, "data": data}


def contradictions(result: Loaded, certificate: Loaded) -> list[Difference]:
    """Symbols that a result calls certain and that are proven to be others, the stored ones."""
    if not _same_problem(result, certificate):
        other = ": the certificate is of another problem; prove this one, or remove it"
        return [Difference("config", certificate["config"], result["config"], words=other)]
    found = []
    for name, proof, group in _pairs(result, certificate):
        proven, codes, certain = proof["codes"], *(_columns(group[x]) for x in ("codes", "certain"))
        if unlike := _unlike(proof, group):
            words = f": the certificate is of {unlike}"
            found.append(Difference(name, proven.shape, codes.shape, words=words))
            continue
        for at in map(tuple, np.argwhere((proven != NO_SYMBOL) & certain & (proven != codes))):
            words = f": symbol {at[0] + 1} of column {at[1]} is proven to be another"
            found.append(Difference(name, proven[at], codes[at], words=words))
    return found


def count(certificate: Loaded) -> int:
    """The number of symbols that a certificate claims to prove."""
    return sum(int((x["codes"] != NO_SYMBOL).sum()) for x in certificate["data"].values())


def _same_problem(result: Loaded, certificate: Loaded) -> bool:
    """True if a certificate is of a result's experiment and problem.

    The result's numerics and the name of its figure do not count: proofs are of the exact problem.
    """
    given = result["config"]
    return certificate["config"] == {key: given.get(key) for key in ("experiment", "problem")}


def _unlike(proof: Data, group: Data) -> str:
    """Words on what tells a certificate's columns from a result's; empty if they are the same."""
    if proof["codes"].shape != _columns(group["codes"]).shape:
        return "other orbits"
    stated = [exact(str(x)) for x in proof["theta2_0"]]
    # The phases of a zoom are too near each other for doubles; their centre is stored exactly.
    if "centre" in group:
        return "" if exact(str(group["centre"])) == centre(proof) else "another centre"
    doubles = np.array([float(x) for x in stated])
    return "" if np.array_equal(doubles, np.atleast_1d(group["theta2_0"])) else "other phases"


def centre(proof: Data) -> Any:
    """The middle of an array's phases, exact, radians; ExactError where one is no number."""
    first, last = (exact(str(proof["theta2_0"][k])) for k in (0, -1))
    return (first + last) / 2


def _pairs(result: Loaded, certificate: Loaded) -> Iterator[tuple[str, Data, Data]]:
    """Arrays that both have: name, group of the certificate, group of the result."""
    groups = arrays(result["data"])
    for name, proof in certificate["data"].items():
        if "codes" in groups.get(name, {}):
            yield name, proof, groups[name]


def _columns(values: Any) -> Any:
    """Symbols as (symbols, columns), also if a result holds a single route."""
    return values if values.ndim > 1 else values[:, None]


def packed(orbits: Sequence[Sequence[Step]]) -> dict[str, Any]:
    """The steps of orbits as the arrays of `PROOF`."""
    steps = [step for orbit in orbits for step in orbit]
    numbers = [w for step in steps for row in step.series for w in row]
    # Whole bytes for the digits and a sign bit. Widths differ because coefficients decay.
    widths = [(w.bit_length() + 8) // 8 for w in numbers]
    digits = b"".join(
        w.to_bytes(width, "little", signed=True) for w, width in zip(numbers, widths, strict=True)
    )
    return {
        "steps": np.array([len(orbit) for orbit in orbits], dtype=np.uint32),
        "half_lengths": np.array([step.half_length for step in steps], dtype=np.uint64),
        "step_bits": np.array([step.bits for step in steps], dtype=np.uint16),
        "terms": np.array([len(step.series[0]) for step in steps], dtype=np.uint16),
        "widths": np.array(widths, dtype=np.uint16),
        "digits": np.frombuffer(digits, dtype=np.uint8),
    }


BOUNDS = {
    "steps": ("number of steps of an orbit", 0, ORBIT_STEPS),
    "half_lengths": ("half-length of a step", 1, 2**62),
    "step_bits": ("number of bits of a step", 1, ORBIT_BITS),
    "terms": ("number of terms of a step", 1, ORBIT_TERMS),
    "widths": ("width of a coefficient", 1, ORBIT_BITS // 4),
}
"""Name, least and largest value of the numbers of a proof.

A half-length is positive, as the theorem of `docs/certified.md` asks."""


def unpacked(group: Data) -> list[list[Step]]:
    """The steps of orbits from the arrays of `PROOF`; StoreError where these do not fit."""
    # The numbers may be anybody's: they are held to their bounds before they take up memory.
    numbers = {name: _whole(group[name], *bounds) for name, bounds in BOUNDS.items()}
    counts, halves, bits, terms, widths = numbers.values()
    for what, found, expected in (
        ("steps are not as many as the orbits say", halves.size, counts.sum()),
        ("coefficients are not as many as the steps say", widths.size, 6 * terms.sum()),
        ("digits are not as many as their widths say", group["digits"].size, widths.sum()),
    ):
        if found != expected:
            raise files.StoreError(f"{what}: {found}, not {expected}")
    content, ends = group["digits"].astype(np.uint8).tobytes(), widths.cumsum().tolist()
    places = zip([0, *ends], ends, strict=False)
    each = (int.from_bytes(content[a:b], "little", signed=True) for a, b in places)
    steps = (
        Step(half, fine, [[next(each) for _ in range(n)] for _ in range(6)])
        for half, fine, n in zip(halves.tolist(), bits.tolist(), terms.tolist(), strict=True)
    )
    return [[next(steps) for _ in range(n)] for n in counts.tolist()]


def _whole(values: Any, what: str, least: int, most: int) -> Any:
    """Integers of any type as int64; StoreError where one is beyond its bounds."""
    # Compared before the cast, which would let large unsigned numbers wrap around.
    if values.size and not (least <= values.min() and values.max() <= most):
        wrong = values[(values < least) | (values > most)][0]
        raise files.StoreError(f"the {what} is {wrong}, not {least} to {most}")
    return values.astype(np.int64)
