"""When an end sends what: topics at a fixed rate, time requests at random moments."""

import random

from benchmarks.peers.latency.job import FIRST_TOPIC, REQUEST, Job

WARMUP_REQUESTS_HZ = 100.0
"""High enough for the paper's filter to get its 500 samples soon."""
REQUESTS_HZ = 10.0
"""The rate of MAVROS."""


def schedule(job: Job) -> list[tuple[float, int, int]]:
    """The schedule in order of time: (s after the start, kind, number).

    Each topic has its own phase, drawn from the seed. Requests have a random time within their
    period, because in runs as short as these, timers do not drift through each other as they do in
    flight.
    """
    rng = random.Random(f"{job.seed} {job.side}")
    period = 1 / job.rate_hz
    sends: list[tuple[float, int, int]] = []
    for topic in range(FIRST_TOPIC, FIRST_TOPIC + job.n_topics):
        phase = rng.random() * period
        count = job.n_warmup + job.n_counted
        sends += [(phase + number * period, topic, number) for number in range(count)]
    at, number = 0.0, 0
    while at < job.warmup_s + job.seconds:
        gap = 1 / (WARMUP_REQUESTS_HZ if at < job.warmup_s else REQUESTS_HZ)
        sends.append((at + rng.random() * gap, REQUEST, number))
        at, number = at + gap, number + 1
    return sorted(sends)
