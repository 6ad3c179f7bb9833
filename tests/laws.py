"""Number of random trials: a fifth of them in `make test`, all in `make test-long`.

`SDRLINK_TRIALS` is the share; `make soak` and `make fuzz` set it far above 1.
"""

import math
import os
from collections.abc import Iterable
from typing import Any

import pytest
from hypothesis import settings

USUAL = 0.2
FACTOR = float(os.environ.get("SDRLINK_TRIALS", USUAL))
FEWEST = 5
"""Examples of a law, at least, unless it names fewer itself."""


def trials(n: int) -> int:
    """The share of `n` trials that this run makes."""
    return max(min(n, FEWEST), round(FACTOR * n))


def often(n: int) -> int:
    """A third of `n` trials of a rate, or all, or more; `at_most` gives the bound for them."""
    return max(1, round(n * _share()))


def at_most(n: int) -> int:
    """The bound of a count over `often` trials that is `n` over all of them.

    Fewer trials vary more: the bound keeps 1.7 standard deviations. A third of the trials of a rate
    with a bound of 9 in 300 finds a loss of 2 dB near the knee, all of them one of 1 dB.
    """
    share = _share()
    slack = math.sqrt(3 * share * n) if share < 1 else 0.0
    return math.ceil(share * n + slack)


def law(n: int = 100) -> settings:
    """`n` examples of a law: always the same ones, unless new ones are requested.

    A fault that one example in 50 shows is found by 200 of them with 98 %, by a fifth with 55 %;
    the long tier makes up for that each night.
    """
    return settings(derandomize=FACTOR <= 1, deadline=None, max_examples=trials(n))


def one_in(n: int, cases: Iterable[Any]) -> list[Any]:
    """One of `n` cases of a grid stays where it is; the long tier has all of them."""
    return [
        case if i % n == 0 else _later(*case if isinstance(case, tuple) else (case,))
        for i, case in enumerate(cases)
    ]


def _later(*values: Any) -> Any:
    return pytest.param(*values, marks=pytest.mark.long)


def _share() -> float:
    return max(FACTOR, 1 / 3)
