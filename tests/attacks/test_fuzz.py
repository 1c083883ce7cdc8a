"""Fuzzed result files: each is a sentence or data, soon, in bounded memory."""

from __future__ import annotations

import multiprocessing
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

import pytest

from rigidpend.results import damage
from tests.attacks import fuzz, lot

SECONDS, MEGABYTES = damage.ALLOWANCE + 1.0, 500
"""What one file may take of the processor, a reader that hangs included, and of memory."""
FUZZED = lot.trials(16)
"""Number of files of each kind; one takes some 50 ms."""


@pytest.mark.slow
def test_a_fuzzed_file_is_a_sentence_or_data(tmp_path: Path) -> None:
    """Whether it is sealed anew or not."""
    # In a fresh process: the peak counts all that a process ever started, and what it inherits.
    with ProcessPoolExecutor(1, multiprocessing.get_context("spawn")) as fresh:
        given = [tmp_path] * 2, [FUZZED] * 2, [lot.SEED + 1] * 2, (True, False)
        both = list(fresh.map(fuzz.watched, *given))
    for found, peak in both:
        said = [each for each, _ in found]
        assert all(x.isprintable() for x in said), lot.SEED
        assert all(not x or x.startswith(f"{tmp_path}") for x in said), lot.SEED
        assert any(said)
        assert not all(said)
        assert max(seconds for _, seconds in found) < SECONDS
        assert peak < MEGABYTES
