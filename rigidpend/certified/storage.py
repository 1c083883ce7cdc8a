"""Certificates as files: what is proven, and the polynomials that prove it.

A certificate is data, and nobody's word: whoever reads it may check it again. To read what is
proven takes no library of its own; only the check needs python-flint.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from rigidpend.certified.steps import MOST_BITS, MOST_TERMS, Step
from rigidpend.results import store
from rigidpend.results.files import CERTIFICATE
from rigidpend.results.layout import FLAG, FLOAT, TEXT, WHOLE, Field, Layout
from rigidpend.results.tree import Data, Loaded

SUFFIX = f"{CERTIFICATE}.h5"
"""Ending of a certificate's name, behind that of its result."""
SYMBOLS, CROSSINGS = ("symbols", "columns"), ("symbols+1", "columns")
"""Dimensions of what belongs to each symbol, and to each crossing."""

FIELDS = {
    "theta2_0": Field(TEXT, ("columns",), "rad", "initial phase of each column, exact"),
    "codes": Field(WHOLE, SYMBOLS, "1", "symbols, row 0 = symbol 1: 0 left, 1 right, 255 unproven"),
    "proven": Field(FLAG, SYMBOLS, "1", "whether the symbol is proven"),
    "crossing_time": Field(
        FLOAT, CROSSINGS, "t' = t s", "times of the crossings of J1 = J2/2, NaN: unproven", True
    ),
    "time_radius": Field(
        FLOAT, CROSSINGS, "t' = t s", "distance of the exact time from it at most", True
    ),
    "bound": Field(
        FLOAT, CROSSINGS, "1", "distance of the exact orbit from the computed one at most", True
    ),
    "separatrix": Field(
        WHOLE, CROSSINGS, "1", "separatrix beside which it lies, 1..4, 0: unproven"
    ),
    "bits": Field(WHOLE, ("columns",), "bit", "bits at the start of the orbit"),
    "reason": Field(TEXT, ("columns",), "", "reason for which the orbit is undecided"),
}
"""Fields that say what is proven."""
PROOF = {
    "steps": Field(WHOLE, ("columns",), "1", "number of steps of each orbit"),
    "half_lengths": Field(
        WHOLE, ("steps",), "2^-32", "half of a step's length in the orbit's time"
    ),
    "step_bits": Field(WHOLE, ("steps",), "bit", "digits behind the point of its coefficients"),
    "terms": Field(WHOLE, ("steps",), "1", "Chebyshev coefficients of each component"),
    "widths": Field(WHOLE, ("coefficients",), "byte", "bytes of each coefficient"),
    "digits": Field(WHOLE, ("bytes",), "1", "coefficients, two's complement, lowest byte first"),
}
"""Fields of the proof: steps of all orbits one after the other, their coefficients as bytes."""
LAYOUT: Layout = {"<arrays>": {**FIELDS, **PROOF}}
"""Layout of a certificate: a group for each array of its result."""


def certificate_of(result: Path) -> Path:
    """File of the certificate beside a result file."""
    return result.with_name(result.stem + SUFFIX)


def is_certificate(file: Path) -> bool:
    """True if the name of a file is that of a certificate."""
    return file.name.endswith(SUFFIX)


def results_in(folder: Path) -> list[Path]:
    """Result files directly in a folder, by name, without the certificates beside them."""
    return sorted(file for file in folder.glob("*.h5") if not is_certificate(file))


def read(path: Path) -> Loaded:
    """A certificate as plain data; what is proven in it is not checked again.

    Raises
    ------
    StoreError
        As `rigidpend.results.store.load`.
    """
    return store.load(path, LAYOUT)


def beside(result: Path) -> Loaded | None:
    """The certificate beside a result file; None where there is none.

    Raises
    ------
    StoreError
        There is one that cannot be read.
    """
    file = certificate_of(result)
    return read(file) if file.exists() else None


def marked(result: Loaded, certificate: Loaded | None) -> Loaded:
    """A result whose arrays of codes have a further field `proven`, where a certificate has it.

    A symbol is marked where the certificate is of the same config and proves this very symbol.
    """
    if certificate is None or any(
        certificate["attributes"].get(key) != result["attributes"].get(key)
        for key in ("config_hash", "experiment")
    ):
        return result
    held = dict(_groups(result["data"]))
    for name, proof, group in _pairs(result, certificate):
        codes = _columns(group["codes"])
        # The config may be the same, and the symbols still of another version: each is compared.
        if proof["codes"].shape == codes.shape:
            proven = proof["proven"] & (proof["codes"] == codes)
            held[name] = {**group, "proven": proven.reshape(group["codes"].shape)}
    data = {**result["data"], "levels": held} if "levels" in result["data"] else held
    return {**result, "data": data}


def contradictions(result: Loaded, certificate: Loaded) -> list[str]:
    """Sentences on certain symbols of a result that a certificate proves to be others."""
    found = []
    for name, proof, group in _pairs(result, certificate):
        codes, certain = _columns(group["codes"]), _columns(group["certain"])
        if proof["codes"].shape != codes.shape:
            found.append(f"{name}: the certificate is of other orbits")
            continue
        held = proof["proven"] & certain
        for symbol, column in np.argwhere(held & (proof["codes"] != codes)):
            found.append(f"{name}: symbol {symbol + 1} of column {column} is proven to be another")
    return found


def _pairs(result: Loaded, certificate: Loaded) -> Iterator[tuple[str, Data, Data]]:
    """Arrays that both have, by name: of the certificate, of the result."""
    groups = _groups(result["data"])
    for name, proof in certificate["data"].items():
        if "codes" in groups.get(name, {}):
            yield name, proof, groups[name]


def _groups(data: Data) -> Data:
    """Groups of a result that may hold arrays of codes."""
    return data.get("levels", data)


def _columns(values: Any) -> Any:
    """Symbols as (symbols, columns), also where a result holds a single route."""
    return values if values.ndim > 1 else values[:, None]


def packed(orbits: Sequence[Sequence[Step]]) -> dict[str, Any]:
    """The steps of orbits as the arrays of `PROOF`."""
    steps = [step for orbit in orbits for step in orbit]
    numbers = [w for step in steps for row in step.series for w in row]
    # With a bit for the sign. Widths differ, for the coefficients of a step decay to nothing.
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


def unpacked(group: Data) -> list[list[Step]]:
    """The steps of orbits from the arrays of `PROOF`, whoever made them.

    Raises
    ------
    StoreError
        The arrays do not fit together.
    """
    numbers = _numbers(group)
    steps = []
    for half, bits, terms in zip(
        *(group[name].tolist() for name in ("half_lengths", "step_bits", "terms")), strict=True
    ):
        # The numbers may be anybody's: they are held to their
        # bounds before memory is taken by them.
        if not (0 < half < 2**62 and 0 < bits <= MOST_BITS and 0 < terms <= MOST_TERMS):
            raise store.StoreError("a step's length, bits or terms are out of range")
        # The range comes first: it ends before zip takes a number too many.
        series = [[w for _, w in zip(range(terms), numbers, strict=False)] for _ in range(6)]
        if len(series[-1]) < terms:
            raise store.StoreError("coefficients are missing")
        steps.append(Step(half, bits, series))
    if next(numbers, None) is not None:
        raise store.StoreError("there are coefficients of no step")
    return _orbits(steps, group["steps"].tolist())


def _orbits(steps: Sequence[Step], counts: Sequence[int]) -> list[list[Step]]:
    if min(counts, default=0) < 0 or sum(counts) != len(steps):
        raise store.StoreError("the steps of the orbits are not as many as there are")
    rest = iter(steps)
    return [[step for _, step in zip(range(n), rest, strict=False)] for n in counts]


def _numbers(group: Mapping[str, Any]) -> Iterator[int]:
    digits, at = group["digits"].astype(np.uint8).tobytes(), 0
    widths = group["widths"].tolist()
    if min(widths, default=1) < 1 or max(widths, default=1) > MOST_BITS // 4:
        raise store.StoreError("the width of a coefficient is out of range")
    if sum(widths) != len(digits):
        raise store.StoreError("the digits are not as many as their widths say")
    for width in widths:
        yield int.from_bytes(digits[at : at + width], "little", signed=True)
        at += width
