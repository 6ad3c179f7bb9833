"""The paper's chain of robots, with its joystick: both ways over relays, on one channel."""

from itertools import pairwise
from random import Random
from typing import NamedTuple

from benchmarks.team.teams import GOOD_DB, Flow, Policy, Team

PDU_SIZE = 288
"""The least size at which an image fits into 255 fragments, nearly."""
LASER_S, IMAGE_S, JOYSTICK_S = 0.02, 0.3, 0.1
BEGIN_S, REST_S = {3: 4.0, 5: 8.0}, 1.5
"""When the flows begin, by the number of robots: they have found their routes by then."""


class Carried(NamedTuple):
    """What became of the three flows, in order: laser, image, joystick.

    `asked` counts the PDUs that robots asked each other for, of `pdus` that they forwarded.
    """

    mdr: tuple[float, ...]
    mean_s: tuple[float, ...]
    sent: tuple[int, ...]
    asked: int
    pdus: int


def carry(
    policy: Policy, seed: int, duration_s: float, n: int = 3, load: float = 1.0,
    snr_db: float = GOOD_DB,
) -> Carried:  # fmt: skip
    """Send laser and images from robot 1 to `n`, and the joystick back, for `duration_s`.

    `load` is a part of the paper's rates.
    """
    rng, begins_s = Random(seed), BEGIN_S[n]

    def flow(name: str, src: int, dst: int, size: int, period_s: float, qos: str) -> Flow:
        begin_s, period_s = begins_s + rng.uniform(0, 0.02), period_s / load
        count = round(duration_s / period_s)
        return Flow(name, src, dst, size, period_s, count, begin_s, qos=qos)  # type: ignore[arg-type]

    flows = [
        flow("laser", 1, n, 1024, LASER_S, "latency"),
        flow("image", 1, n, 65536, IMAGE_S, "bulk"),
        flow("joystick", n, 1, 64, JOYSTICK_S, "urgent"),
    ]
    robots = range(1, n + 1)
    team = Team(robots, [*pairwise(robots)], flows, seed, policy, PDU_SIZE, snr_db=snr_db)
    team.simulation.run(begins_s + duration_s + REST_S)
    return Carried(
        tuple(heard.mdr for heard in team.heard),
        tuple(sum(heard.delays_s) / max(1, len(heard.delays_s)) for heard in team.heard),
        tuple(heard.flow.n for heard in team.heard),
        sum(team.repeats(node).asked for node in team.ids),
        sum(team.forwarded(node) for node in team.ids),
    )
