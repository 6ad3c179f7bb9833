"""Two gateways over a wide-area network, beside a plain bridge to Zenoh over the same one."""

import asyncio
from collections.abc import Iterator
from contextlib import ExitStack

import numpy as np

from benchmarks.fleet.drive import drive, plain_operator
from benchmarks.fleet.field import field, start_plain
from benchmarks.report import Row

PERIOD_S = 0.02
LOSSES = {7: 0.06, 8: 0.22}
WAN_MS = 40.0


def rows(seed: int, quick: bool) -> Iterator[Row]:
    """The same messages, brought by both kinds of bridges at once."""
    n = 200 if quick else 2000
    came: dict[int, list[float]] = {}
    with field(LOSSES, seed, WAN_MS) as where, ExitStack() as stack:
        for gateway in where.gateways:
            start_plain(stack, gateway, where.folders[gateway], where.far_endpoint)
        stack.enter_context(plain_operator(where.endpoint, came))
        found = asyncio.run(drive(where, n, PERIOD_S))
    ours, plain = (
        found.late_ms(),
        [1e3 * (at[0] - found.first_at(number)) for number, at in came.items()],
    )
    note = f"two gateways, each {WAN_MS:g} ms from the router; 724 B at 50 Hz"
    yield Row(
        "wan_pdr", len(found.at_operator) / n, "ratio", None, "more", n,
        peers={"plain_zenoh": len(came) / n}, note=note,
    )  # fmt: skip
    twice = sum(len(at) - 1 for at in found.at_operator.values())
    yield Row(
        "wan_twice", twice, "messages", 0, "less", n,
        peers={"plain_zenoh": sum(len(at) - 1 for at in came.values())},
        note="delivered twice to the operator's program",
    )  # fmt: skip
    over_wan = len(found.at_operator) + found.duplicates
    yield Row(
        "wan_copies", over_wan / len(found.at_operator), "per message", None, "less", n,
        peers={"plain_zenoh": sum(map(len, came.values())) / len(came)},
        note="copies of each message that crossed the network",
    )  # fmt: skip
    for label, quantile in (("p50", 0.5), ("p90", 0.9), ("p99", 0.99)):
        yield Row(
            f"wan_late_ms_{label}", float(np.quantile(ours, quantile)), "ms", None, "less", n,
            peers={"plain_zenoh": float(np.quantile(plain, quantile))},
            note="from the first gateway's own consumers to the operator's program",
        )  # fmt: skip
