"""All rows: `python -m benchmarks.repeats`."""

import argparse
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

from benchmarks.repeats.losses import Losses, in_bursts, independent, recorded
from benchmarks.repeats.ours import Outcomes, Pair, Traffic
from benchmarks.repeats.peers import block_code, nak_repeat
from benchmarks.report import Row, main
from sdrlinkd.link import Overrides, Qos

ODOM = 0.01, 100
"""Period in s and size in bytes of most messages."""
IMAGE = 1.0, 40_000
SHORT_LIFE_S = 0.05
K = 16
"""Messages of a block of the block code."""


def measure(seed: int, quick: bool, data: Path | None = None) -> Iterator[Row]:
    """Measure all rows; `quick` takes a tenth of the messages."""
    n = 3000 if quick else 30_000
    odom = Traffic(n, *ODOM)
    yield _row(
        "delivered_in_0.3s_5pct_bursts", odom, lambda: in_bursts(0.05, seed), seed, 0.3, 99.9
    )
    yield _row(
        "delivered_in_1s_20pct_bursts", odom, lambda: in_bursts(0.2, seed), seed, 1.0, 99.0,
        share=0.3,
    )  # fmt: skip
    yield _row(
        "delivered_in_0.3s_5pct_random", odom, lambda: independent(0.05, seed), seed, 0.3, None
    )
    yield _images(n // 100, seed)
    yield _twice(n * 2, seed)
    if data is not None:
        yield _row(
            "delivered_in_0.3s_orbit_2_to_10pct", odom,
            lambda: recorded(data, 0.02, 0.1, seed), seed, 0.3, None,
        )  # fmt: skip
        yield _row(
            "delivered_in_1s_orbit_10_to_40pct", odom,
            lambda: recorded(data, 0.1, 0.4, seed), seed, 1.0, None, share=0.3,
        )  # fmt: skip


def _row(
    name: str, traffic: Traffic, losses: Callable[[], Losses], seed: int, limit_s: float,
    target: float | None, share: float = 0.05,
) -> Row:  # fmt: skip
    ours = Pair(traffic, losses(), seed, share=share).run()
    none = Pair(traffic, losses(), seed, share=0.0).run()
    # As many packets of the code as our repeats and questions take.
    n_code = K + max(1, round(K * (ours.air_share / none.air_share - 1)))
    block = block_code(traffic, losses(), K, n_code)
    nak = nak_repeat(traffic, losses(), seed)
    return Row(
        f"{name}_pct", ours.within(limit_s), "%", target, "more", traffic.n,
        peers={
            "no_repeats": none.within(limit_s),
            f"block_code_{K}_{n_code}": block.within(limit_s),
            "nak_rfc3208": nak.within(limit_s),
            "p99_ms": _p99_ms(ours),
            "p99_ms_nak_rfc3208": _p99_ms(nak),
            "air_pct": 100 * ours.air_share,
            "repeats_pct": 100 * ours.repeats_share,
        },
        note=f"100 messages/s; repeat.share = {share:g}", exact=True,
    )  # fmt: skip


def _images(n: int, seed: int) -> Row:
    traffic = Traffic(n, *IMAGE)
    ours = Pair(traffic, independent(0.02, seed), seed).run()
    none = Pair(traffic, independent(0.02, seed), seed, share=0.0).run()
    return Row(
        "images_delivered_2pct_random_pct", ours.within(2.0), "%", 99.9, "more", n,
        peers={
            "no_repeats": none.within(2.0), "air_pct": 100 * ours.air_share,
            "repeats_pct": 100 * ours.repeats_share,
        },
        note="images of 40 kB in 165 fragments, without parity", exact=True,
    )  # fmt: skip


def _twice(n: int, seed: int) -> Row:
    """Share of urgent messages lost where each burst fades on its own."""
    overrides = Overrides(qos=Qos.URGENT, lifespan_s=SHORT_LIFE_S)
    traffic = Traffic(n, *ODOM, overrides)
    ours, none = (
        Pair(traffic, independent(0.007, seed), seed, twice=twice, by_burst=True).run()
        for twice in (True, False)
    )
    return Row(
        "urgent_lost_twice_pct", 100 - ours.within(SHORT_LIFE_S), "%", 0.02, "less", n,
        peers={"once": 100 - none.within(SHORT_LIFE_S), "air_pct": 100 * ours.air_share},
        note="0.7 % of the bursts are lost; lifespan 50 ms", exact=True,
    )  # fmt: skip


def _p99_ms(outcomes: Outcomes) -> float:
    took = sorted(outcomes.took_s.values())
    return 1e3 * took[min(len(took) - 1, int(0.99 * len(took)))]


def _options() -> argparse.ArgumentParser:
    own = argparse.ArgumentParser(add_help=False)
    own.add_argument(
        "--data", type=Path, help="folder with orbit_links_rssi.npz, a recorded testbed"
    )
    return own


if __name__ == "__main__":
    sys.exit(main("repeats", measure, _options()))
