"""What is imported once for all tests is looked through for garbage once, and garbage seldom."""

import gc
import os

import pytest

# Linear algebra has a thread for each core: beside other workers, and in matrices as small as
# here, these spend their time in waiting for each other. Read where NumPy is loaded.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
# As commands have it: collections took a fifteenth of the time of five files, and take half; while
# tests are imported they took a tenth.
gc.set_threshold(200_000)


@pytest.hookimpl(trylast=True)
def pytest_collection_finish() -> None:
    """Leave all that is there now alone, here and in the processes that are forked from here."""
    gc.collect()
    gc.freeze()
