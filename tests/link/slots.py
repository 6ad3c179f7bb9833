"""Airs with `tdma`."""

from random import Random

from sdrlinkd.link import Qos, Sensed
from sdrlinkd.link.access import CLOCK_ERROR_S, Wish
from tests.link.air import Air
from tests.link.radios import params

LONGEST_S = 0.004
SETTLED_S = 4.5
"""Time by which all robots know the schedule."""


def make_air(n, traits, seed, reuse=False, ppm=20.0, **more):
    """Robots 1 to n, switched on within a second, with crystals off by ±`ppm` at most."""
    rng = Random(seed)
    ids = list(range(1, n + 1))
    rng.shuffle(ids)
    joins = {each: rng.uniform(0, 1) for each in ids}
    ppms = {each: rng.choice((-ppm, ppm, rng.uniform(-ppm, ppm))) for each in ids}
    return Air(
        ids, params("tdma", ids, reuse=reuse), traits, seed, LONGEST_S,
        joins=joins, ppm=ppms, beacons=True, **more,
    )  # fmt: skip


def lengths_s(air):
    """(slot, guard) in s."""
    access = next(iter(air.nodes.values())).access
    return access.slot_s, access.guard_s


def schedule_of(access):
    """The check of its times that a robot with this policy announces, here from 9 s on."""
    access.slot(Wish(9.0, Qos.URGENT, 0.001, Sensed(9.0)))
    return access.frame(9.0).schedule


def places(air, root):
    """(owner of the slot, time within the slot, burst) by the clock of the robot `root`."""
    node, nodes = air.nodes[root], air.params.nodes
    slot_s, _ = lengths_s(air)
    for burst in air.bursts:
        since = 1e-6 * node.access.frame(node.clock(burst.begin)).phase_us
        number = (since + CLOCK_ERROR_S) // slot_s
        yield nodes[int(number) % len(nodes)], since - number * slot_s, burst
