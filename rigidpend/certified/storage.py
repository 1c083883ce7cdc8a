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
from rigidpend.results.layout import FLAG, FLOAT, TEXT, WHOLE, Field, Layout
from rigidpend.results.tree import Data, Loaded

SUFFIX = ".certificate.h5"
SYMBOLS, CROSSINGS = ("symbols", "columns"), ("symbols+1", "columns")

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
LAYOUT: Layout = {"<arrays>": {**FIELDS, **PROOF}}


def certificate_of(result: Path) -> Path:
    """File of the certificate beside a result file."""
    return result.with_name(result.stem + SUFFIX)


def is_certificate(file: Path) -> bool:
    """True if the name of a file is that of a certificate."""
    return file.name.endswith(SUFFIX)


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
    same = certificate and all(
        certificate["attributes"].get(key) == result["attributes"].get(key)
        for key in ("config_hash", "experiment")
    )
    if not certificate or not same:
        return result
    data, arrays = dict(result["data"]), _arrays(result["data"])
    held = dict(data["levels"]) if "levels" in data else data
    for name, proof in certificate["data"].items():
        if name in arrays and proof["codes"].shape == arrays[name]["codes"].shape:
            proven = proof["proven"] & (proof["codes"] == arrays[name]["codes"])
            held[name] = {**arrays[name], "proven": proven}
    return {**result, "data": {**data, "levels": held} if "levels" in data else held}


def contradictions(result: Loaded, certificate: Loaded) -> list[str]:
    """Sentences on certain symbols of a result that a certificate proves to be others."""
    found, arrays = [], _arrays(result["data"])
    for name, proof in certificate["data"].items():
        if name not in arrays or proof["codes"].shape != arrays[name]["codes"].shape:
            found.append(f"{name}: the certificate is of other orbits")
            continue
        held = proof["proven"] & arrays[name]["certain"]
        for symbol, column in np.argwhere(held & (proof["codes"] != arrays[name]["codes"])):
            found.append(f"{name}: symbol {symbol + 1} of column {column} is proven to be another")
    return found


def _arrays(data: Data) -> Data:
    """The arrays of codes of a result."""
    return data.get("levels", data)


def packed(orbits: Sequence[Sequence[Step]]) -> dict[str, Any]:
    """The steps of orbits as the arrays of `PROOF`."""
    steps = [step for orbit in orbits for step in orbit]
    numbers = [w for step in steps for row in step.series for w in row]
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
        if not (0 < half < 2**62 and 0 < bits <= MOST_BITS and 0 < terms <= MOST_TERMS):
            raise store.StoreError("a step's length, bits or terms are out of range")
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
