"""Several gateways that hear the same robot: what the operator gets, when, and how often."""

import asyncio
from collections.abc import Iterator
from itertools import pairwise
from math import prod

import numpy as np

from benchmarks.fleet.drive import Drive, drive
from benchmarks.fleet.field import ROBOT, field
from benchmarks.report import Row

PERIOD_S = 0.01
LOSSES = {7: 0.06, 8: 0.22, 9: 0.4}
PLAIN_MS = 0.37
"""What plain Zenoh adds on the machine of the targets, p50."""
HAND_OVER_PERIOD_S = 0.1
HAND_OVER_S = 4.0


def rows(seed: int, quick: bool) -> Iterator[Row]:
    """One, two and three gateways, and a robot that drives from one to the other."""
    n = 300 if quick else 3000
    with field({7: 0.0}, seed, routes=True) as where:
        found = asyncio.run(drive(where, n, PERIOD_S))
    yield from _added(found, "1_gateway", "that is the router, too")
    for gateways in (2, 3):
        losses = dict(list(LOSSES.items())[:gateways])
        with field(losses, seed) as where:
            found = asyncio.run(drive(where, n, PERIOD_S))
        with field(losses, seed, are_plain=True) as where:
            plain = asyncio.run(drive(where, n // 3, PERIOD_S))
        yield from _diversity(found, plain, gateways, n)
    yield _hand_over(seed, quick)


def _diversity(found: Drive, plain: Drive, gateways: int, n: int) -> Iterator[Row]:
    alone = {f"gateway_{each}_alone": 1 - found.loss(each) for each in found.at_gateways}
    independent = 1 - prod(found.loss(each) for each in found.at_gateways)
    pdr = len(found.at_operator) / n
    name = f"{gateways}_gateways"
    yield Row(
        f"pdr_{name}", pdr, "ratio", independent - 0.005, "more", n,
        peers={**alone, "if_losses_are_independent": independent},
        note="724 B at 100 Hz; the target is what independent losses would give, less 0.5 %",
    )  # fmt: skip
    missed = len(found.heard - set(found.at_operator))
    yield Row(
        f"lost_by_{name}", missed, "messages", 0, "less", n,
        note="heard by a gateway's daemon and not brought to the operator",
    )  # fmt: skip
    yield Row(
        f"twice_{name}", _again(found), "messages", 0, "less", n,
        peers={"dropped_by_the_library": found.duplicates,
               "plain_zenoh_pct": 100 * _again(plain) / len(plain.at_operator)},
        note="delivered twice to the operator's program",
    )  # fmt: skip
    yield from _added(found, name, "through a router of its own", plain)


def _again(found: Drive) -> int:
    """Messages that the operator's program got once more."""
    return sum(len(at) - 1 for at in found.at_operator.values())


def _added(found: Drive, name: str, how: str, plain: Drive | None = None) -> Iterator[Row]:
    added, late = found.added_ms(), found.late_ms()
    for label, quantile, target in (("p50", 0.5, 1.0), ("p99", 0.99, 10.0)):
        value = float(np.quantile(added, quantile))
        peers = {"since_the_first_gateway": float(np.quantile(late, quantile))}
        scaled = None
        if plain is not None:
            peers["plain_zenoh"] = float(np.quantile(plain.late_ms(), quantile))
            scaled = value * PLAIN_MS / float(np.median(plain.late_ms()))
        yield Row(
            f"added_ms_{label}_{name}", value, "ms", target, "less", len(added), peers=peers,
            like_for_like=scaled,
            note=f"from the consumers at the gateway that put it to the operator's program, {how}",
        )  # fmt: skip


def _hand_over(seed: int, quick: bool) -> Row:
    """One gateway hears the robot less and less, the other one more and more."""
    n = round((HAND_OVER_S if quick else 5 * HAND_OVER_S) / HAND_OVER_PERIOD_S)
    with field({7: 0.0, 8: 1.0}, seed) as where:

        def move(number: int) -> None:
            share = number / n
            where.air.loss = {(ROBOT, 7): share**2, (ROBOT, 8): (1 - share) ** 2}

        found = asyncio.run(drive(where, n, HAND_OVER_PERIOD_S, move))
    added = found.late_ms()
    longer = [after - before for before, after in pairwise(added)]
    return Row(
        "hand_over_gap_s", 1e-3 * max(longer), "s", HAND_OVER_PERIOD_S, "less", n,
        peers={"heard_by_nobody": len(set(found.sent_at) - found.heard),
               "lost_between": len(found.heard - set(found.at_operator))},
        note="longest pause at the operator, beyond that at the gateways that hear the robot, "
        "while a robot drives from one gateway to the other; target: one period",
    )  # fmt: skip
