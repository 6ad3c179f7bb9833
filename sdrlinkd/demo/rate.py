"""Finds the sample rate that this machine sustains, measured with the demonstration itself."""

import time
from collections.abc import Callable
from dataclasses import replace
from typing import NamedTuple

from sdrlinkd.adapters import first_seconds, paced
from sdrlinkd.client import Publisher
from sdrlinkd.demo.folder import run_folder
from sdrlinkd.demo.links import Options, write_config
from sdrlinkd.demo.load import LoadOf
from sdrlinkd.demo.nodes import Consumer, daemon, snapshot_of
from sdrlinkd.demo.source import Source
from sdrlinkd.demo.trace import Trace

RATES_HZ = (5e6, 2e6, 1e6, 5e5)
MEASURE_S = 2.0
MOST_BUSY = 2 / 3
"""Largest load of the daemon's busiest thread, as a share of the time; the rest is reserve."""
MOST_AIR = 0.8
"""Largest share of airtime; with more, messages would wait longer for the channel than for the CPU.
"""


class Tried(NamedTuple):
    """A tried sample rate in Hz, with the shares of time in which the CPU and the air are busy."""

    rate_hz: float
    busy: float
    air: float


class Found(NamedTuple):
    """The chosen sample rate in Hz, and all tried ones."""

    rate_hz: float
    tried: list[Tried]

    @property
    def is_enough(self) -> bool:
        """Whether the chosen rate leaves a third of the CPU time free."""
        return any(each.busy <= MOST_BUSY for each in self.tried)


Measure = Callable[[Source, Options], Tried]


def tried_out(source: Source, options: Options) -> Tried:
    """Try a rate: a daemon sends the first seconds of `source` to itself over a noisy channel."""
    trace = Trace({topic.name: topic.type for topic in source.registry.topics})
    with run_folder() as folder:
        config = write_config(folder / "node", source, options, "both", folder)
        with daemon(config) as process, Consumer(config.parent, trace):
            load, began = LoadOf(process.pid), time.monotonic()
            with Publisher(config.parent) as publisher:
                messages = first_seconds(source.messages(), MEASURE_S * options.speed)
                for message in paced(messages, options.speed):
                    publisher.send(message.topic, message.cdr, type=message.type)
            time.sleep(max(0.0, began + MEASURE_S - time.monotonic()))
            sent = snapshot_of(config.parent).carrier.counters["samples_sent"]
            span_s = time.monotonic() - began
            return Tried(options.rate_hz, load.read().busy, sent / options.rate_hz / span_s)


def find_rate(source: Source, options: Options, measure: Measure = tried_out) -> Found:
    """The highest of RATES_HZ that leaves a third of the CPU time free, or else the most.

    Lower rates at which the channel would be too full are not tried.
    """
    tried: list[Tried] = []
    for rate_hz in RATES_HZ:
        if tried and tried[0].air * tried[0].rate_hz / rate_hz > MOST_AIR:
            break
        tried.append(measure(source, replace(options, link="ofdm", rate_hz=rate_hz)))
        if tried[-1].busy <= MOST_BUSY:
            return Found(rate_hz, tried)
    return Found(min(tried, key=lambda each: each.busy).rate_hz, tried)
