"""How long a flow over several hops is away after its relay dies."""

from math import inf
from random import Random
from typing import NamedTuple

from benchmarks.team.teams import Flow, Team
from sdrlinkd.wire import BROADCAST

LINKS = ((1, 2), (1, 3), (2, 4), (3, 4), (4, 5))
"""Robot 1 reaches 4 through 2 or 3, and 5 behind it."""
FIRST, LAST = 1, 5
PERIOD_S, SIZE = 0.02, 100
BEGIN_S, DIES_S, END_S = 3.0, 8.0, 14.0


class Healed(NamedTuple):
    """What became of the flow; times in s."""

    back_s: float
    """From the relay's death until the first message that was sent after it has come."""
    lost: int
    """Messages that never came, of `sent`."""
    sent: int
    control_share: float


def heal(seed: int, *, to_all: bool) -> Healed:
    """Let the relay in use die, and return what happened."""
    flow = Flow(
        "odom", FIRST, BROADCAST if to_all else LAST, SIZE, PERIOD_S,
        round((END_S - 1.0 - BEGIN_S) / PERIOD_S), begin_s=BEGIN_S + 1e-3 * (seed % 20),
        counted_at=LAST,
    )  # fmt: skip
    dies_s = DIES_S + Random(seed).uniform(0, 0.5)
    team = Team(range(1, 6), LINKS, [flow], seed)
    team.simulation.run(dies_s)
    (relay,) = team.forwarded_by(FIRST, FIRST, flow.dst)
    team.simulation.silence(relay, 2 * END_S)
    team.simulation.run(END_S)
    (heard,) = team.heard
    back = [at for number, at in heard.at.items() if heard.sent_at[number] > dies_s]
    return Healed(
        min(back, default=inf) - dies_s, flow.n - len(heard.at), flow.n,
        team.control_share(),
    )  # fmt: skip
