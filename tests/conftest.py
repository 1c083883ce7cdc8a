"""What is imported once for all tests is looked through for garbage once, and garbage seldom."""

import gc

import pytest


@pytest.hookimpl(trylast=True)
def pytest_collection_finish() -> None:
    """Leave all that is there now alone, here and in the processes that are forked from here."""
    gc.collect()
    gc.freeze()
    # As commands have it: collections among live arrays and figures took a twentieth of all tests.
    gc.set_threshold(200_000)
