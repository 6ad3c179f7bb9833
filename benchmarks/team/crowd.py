"""Robots that all hear each other: all but one have more to send than the air carries."""

from itertools import combinations
from typing import Literal, NamedTuple

import numpy as np

from benchmarks.team.teams import RATE_HZ, Flow, Policy, Team
from sdrlinkd.config import ModemParams
from sdrlinkd.wire import BROADCAST

Class = Literal["urgent", "latency", "default", "bulk"]

MODEM = ModemParams(rate_hz=RATE_HZ, mcs=3, block_s=1e-4)
"""With blocks as short as a radio needs that reacts within a millisecond."""
PDU_SIZE = 512
FILLING = 470
"""Bytes of a message that fills a PDU."""
PROBE = 64
PROBES_PER_S = 10.0
OFFERED_MBPS = 9.0
"""What the others want to send together, on an air that carries 6 Mbit/s."""
FILL_S, BEGIN_S, REST_S = 1.5, 3.0, 0.2
"""When the others begin, when the probes do, and how long the last ones have."""


class Waited(NamedTuple):
    """How long the messages of one robot took, in s, and what all robots carried in Mbit/s."""

    delays_s: list[float]
    mdr: float
    n: int
    carried_mbps: float
    control: float
    """Airtime of control, as a share of the time."""

    @property
    def p99_s(self) -> float:
        """Of the messages that came, 99 % took no longer."""
        return float(np.quantile(self.delays_s, 0.99))

    @property
    def longest_s(self) -> float:
        """The longest time that a message took."""
        return max(self.delays_s)


def wait_beside(
    policy: Policy, n: int, others: Class, one: Class, seed: int, duration_s: float
) -> Waited:
    """`n` robots: one sends messages of class `one` at random, the others fill the air."""
    ids = range(1, n + 1)
    period_s = (n - 1) * 8 * FILLING / (1e6 * OFFERED_MBPS)
    flows = [
        Flow(
            "probe", n, BROADCAST, PROBE, 1 / PROBES_PER_S, round(2 * duration_s * PROBES_PER_S),
            BEGIN_S, counted_at=1, qos=one, is_random=True,
        )
    ]  # fmt: skip
    flows += [
        Flow(
            "filling", src, BROADCAST, FILLING, period_s,
            round(1.2 * (BEGIN_S + duration_s - FILL_S) / period_s), FILL_S,
            counted_at=n, qos=others, is_random=True,
        )
        for src in ids[:-1]
    ]  # fmt: skip
    pairs = list(combinations(ids, 2))
    team = Team(ids, pairs, flows, seed, policy, PDU_SIZE, modem=MODEM)
    end_s = BEGIN_S + duration_s
    team.simulation.run(BEGIN_S)
    before_s = team.control_s()
    team.simulation.run(end_s)
    control = (team.control_s() - before_s) / duration_s
    probe, *filling = team.heard
    carried = sum(
        8 * each.flow.size for each in filling for at in each.at.values() if BEGIN_S < at <= end_s
    )
    team.simulation.run(end_s + REST_S)
    sent = {number for number, at in enumerate(probe.sent_at) if at <= end_s}
    delays_s = [at - probe.sent_at[number] for number, at in probe.at.items() if number in sent]
    mbps = 1e-6 * carried / duration_s
    mdr = len(delays_s) / len(sent)
    return Waited(delays_s, mdr, len(sent), mbps, control)
