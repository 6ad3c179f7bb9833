"""The paper's chain of three robots, with its joystick: both ways over a relay, on one channel."""

from random import Random
from typing import NamedTuple

from benchmarks.team.teams import Flow, Policy, Team

LINKS = ((1, 2), (2, 3))
PDU_SIZE = 288
"""The least size at which an image fits into 255 fragments, nearly."""
LASER_S, IMAGE_S, JOYSTICK_S = 0.02, 0.3, 0.1
BEGIN_S, REST_S = 4.0, 1.5


class Carried(NamedTuple):
    """What became of the three flows, in order: laser, image, joystick."""

    mdr: tuple[float, ...]
    mean_s: tuple[float, ...]
    sent: tuple[int, ...]


def carry(policy: Policy, seed: int, duration_s: float) -> Carried:
    """Send laser and images from robot 1 to 3, and the joystick back, for `duration_s`."""
    rng = Random(seed)

    def flow(name: str, src: int, dst: int, size: int, period_s: float, qos: str) -> Flow:
        begin_s = BEGIN_S + rng.uniform(0, 0.02)
        n = round(duration_s / period_s)
        return Flow(name, src, dst, size, period_s, n, begin_s, qos=qos)  # type: ignore[arg-type]

    flows = [
        flow("laser", 1, 3, 1024, LASER_S, "latency"),
        flow("image", 1, 3, 65536, IMAGE_S, "bulk"),
        flow("joystick", 3, 1, 64, JOYSTICK_S, "urgent"),
    ]
    team = Team((1, 2, 3), LINKS, flows, seed, policy, PDU_SIZE)
    team.simulation.run(BEGIN_S + duration_s + REST_S)
    return Carried(
        tuple(heard.mdr for heard in team.heard),
        tuple(sum(heard.delays_s) / max(1, len(heard.delays_s)) for heard in team.heard),
        tuple(heard.flow.n for heard in team.heard),
    )
