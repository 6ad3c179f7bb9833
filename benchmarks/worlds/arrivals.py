"""Messages that robots have to send, and when."""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from sdrlinkd.link import AS_CONFIGURED, Overrides


class Arrival(NamedTuple):
    """A message that a robot has to send from `at` on."""

    at: float
    topic_id: int
    payload: bytes
    overrides: Overrides = AS_CONFIGURED


def poisson(
    rng: np.random.Generator,
    topic_id: int,
    per_s: float,
    size: int,
    duration_s: float,
    overrides: Overrides = AS_CONFIGURED,
) -> Iterator[Arrival]:
    """Messages of `size` bytes that come at random times."""
    at = 0.0
    while per_s:
        at += rng.exponential(1 / per_s)
        if at >= duration_s:
            return
        yield Arrival(at, topic_id, b"\0\1\0\0" + rng.bytes(size - 4), overrides)
