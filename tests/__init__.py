"""The tests. Comparisons in `strategies` explain their failures as those in a test do."""

import pytest

pytest.register_assert_rewrite("tests.strategies")
