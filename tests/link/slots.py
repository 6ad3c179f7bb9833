"""Airs with `tdma`."""

from random import Random

from sdrlinkd.link.access import CLOCK_ERROR_S
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
    return access._slot_s, access._guard_s


def places(air, root):
    """(owner of the slot, time within the slot, burst) by the clock of the robot `root`."""
    node, nodes = air.nodes[root], air.params.nodes
    slot_s, _ = lengths_s(air)
    for burst in air.bursts:
        since = node.clock(burst.begin) - node.access._origin
        number = (since + CLOCK_ERROR_S) // slot_s
        yield nodes[int(number) % len(nodes)], since - number * slot_s, burst
