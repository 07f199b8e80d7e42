"""Counting of comparisons in tests over random examples."""

import pytest
from hypothesis import given, settings, strategies as st

from tests.comparisons import at_least, compared


@at_least(2)
@settings(max_examples=5)
@given(number=st.integers(0, 10**6))
def of_numbers_below(bound, number):
    if number < bound:
        compared()


def test_examples_that_all_end_early_fail():
    of_numbers_below(10**6 + 1)
    with pytest.raises(AssertionError, match="0 examples were compared, expected at least 2"):
        of_numbers_below(0)
