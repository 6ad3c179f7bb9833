"""Bursts that were handed over and have not left yet."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from backends import GAP, TxBurst
from backends.testing import Outstanding
from tests.laws import law


@law(100)
@given(
    st.lists(
        st.tuples(
            st.integers(-10, 3000),
            st.integers(0, 400),
            st.none() | st.integers(0, 300),
            st.integers(0, 300),
        ),
        max_size=30,
    )
)
def test_any_bursts_are_placed_one_after_another(asked):
    outstanding = Outstanding()
    now, free_from = 0, 0
    for start, n, slack, later in asked:
        now += later
        placed = outstanding.place(
            TxBurst(start, np.zeros(n, np.complex64), None if slack is None else start + slack), now
        )
        if slack is not None and start + slack < max(now, free_from):
            assert placed is None
            continue
        assert placed == max(start, now, free_from)
        free_from = placed + n + GAP
