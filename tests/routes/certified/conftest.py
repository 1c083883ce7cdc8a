"""The stored full shift and the orbits of its sets, followed once by each checker."""

import pytest

from scripts import check_series
from scripts.check_certificate import Interval
from tests.routes.certified.offered import Stored


@pytest.fixture(autouse=True)
def digits() -> None:
    Interval.digits = check_series.DIGITS


@pytest.fixture(scope="session")
def stored() -> Stored:
    return Stored()
