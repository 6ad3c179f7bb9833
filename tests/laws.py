"""Number of random trials: SDRLINK_TRIALS times as many as in `make test`."""

import os

from hypothesis import settings

FACTOR = float(os.environ.get("SDRLINK_TRIALS", "1"))


def trials(n: int) -> int:
    """`n` trials, or more in `make soak` and fewer in `make quick`."""
    return max(1, round(FACTOR * n))


def often(n: int) -> int:
    """`n` trials of a rate, or more in `make soak`; never fewer, which would not show the rate."""
    return round(max(1.0, FACTOR) * n)


def law(n: int = 100) -> settings:
    """`n` examples of a law: always the same ones, unless new ones are requested."""
    return settings(derandomize=FACTOR <= 1, deadline=None, max_examples=trials(n))
