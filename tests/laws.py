"""How often chance is asked: SDRLINK_TRIALS times as often as `make test` does."""

import os

from hypothesis import settings

FACTOR = float(os.environ.get("SDRLINK_TRIALS", "1"))


def trials(n: int) -> int:
    """That many, or more in `make soak` and fewer in `make quick`."""
    return max(1, round(FACTOR * n))


def often(n: int) -> int:
    """That many trials of a rate, or more in `make soak`; fewer would not tell it."""
    return round(max(1.0, FACTOR) * n)


def law(n: int = 100) -> settings:
    """`n` examples of a law: always the same, unless more are wanted than anybody has seen."""
    return settings(derandomize=FACTOR <= 1, deadline=None, max_examples=trials(n))
