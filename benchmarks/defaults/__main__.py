"""All rows: `python -m benchmarks.defaults`."""

import argparse
import json
import sys
from collections.abc import Collection, Iterator, Sequence
from pathlib import Path
from random import Random

from benchmarks.defaults.team import Drive, Flow, drive
from benchmarks.report import Row, main
from sdrlinkd.modem import Airtimes
from sdrlinkd.wire import equal_payload

BEGIN_S = 1.0
ODOM, IMAGE, CLOUD = "nav_msgs/msg/Odometry", "sensor_msgs/msg/Image", "sensor_msgs/msg/PointCloud2"
ODOM_SIZE, ODOM_HZ = 724, 30.0
BIG = ((IMAGE, 200_000, 5.0), (IMAGE, 1_000_000, 2.0), (CLOUD, 3_000_000, 10.0))
"""Type, bytes and messages per s of topics that alone exceed the channel's 5.8 Mbit/s."""
LEAST_BIT_S = 1.2e6
"""Rate at which one message of such a topic is to arrive within the drive."""
LATE_S = 1.0
"""Time in s before the end of a drive from which on messages need not arrive."""


def measure(seed: int, quick: bool, before: Path | None = None) -> Iterator[Row]:
    """Measure all rows; `quick` drives for a fifth of the time."""
    known = {} if before is None else _values(before)
    for row in _rows(seed, 4.0 if quick else 20.0):
        row.exact = True
        row.peers = {"before": known[row.name]} if row.name in known else {}
        yield row


def _values(path: Path) -> dict[str, float]:
    """The rows of an earlier run, which printed --json."""
    return {row["name"]: row["value"] for row in json.loads(path.read_text())["rows"]}


def _rows(seed: int, duration_s: float) -> Iterator[Row]:
    for kind, size, hz in BIG:
        yield from _beside(kind, size, hz, max(duration_s, 8 * size / LEAST_BIT_S), seed)
    yield from _large(seed)
    yield from _alone(seed)


def _beside(kind: str, size: int, hz: float, duration_s: float, seed: int) -> Iterator[Row]:
    """Odometry beside a topic that wants more than the channel carries."""
    rng = Random(seed)
    odom = Flow("odom", ODOM, ODOM_SIZE, _times(ODOM_HZ, duration_s, rng))
    big = Flow("big", kind, size, _times(hz, duration_s, rng))
    until_s = BEGIN_S + duration_s
    found = drive([odom, big], until_s, seed)
    name, ages_s = _sized(size), found.ages_s["odom"]
    due = [n for n, at in enumerate(odom.times) if at < until_s - LATE_S]
    arrived = 100 * sum(n in ages_s for n in due) / len(due)
    note, n = _told(found), len(due)
    yield Row(f"odom_beside_{name}_pct", arrived, "%", 100, "more", n, note=note)
    for share, target in ((0.5, 20.0), (0.99, 60.0)):
        row = f"odom_beside_{name}_p{100 * share:.0f}_ms"
        age_ms = 1e3 * _quantile(ages_s.values(), share)
        yield Row(row, age_ms, "ms", target, "less", n, note=note)
    rest = _capacity_bit_s(found) - 8 * ODOM_SIZE * ODOM_HZ
    carried = 8 * size * len(found.ages_s["big"]) / duration_s
    yield Row(f"big_{name}_of_the_rest_pct", 100 * carried / rest, "%", 90, "more", 1, note=note)


def _large(seed: int) -> Iterator[Row]:
    """Messages that take longer on the air than their lifespan."""
    for size, hz, is_reliable in ((400_000, 0.35, False), (1_500_000, 0.35, True)):
        times = [BEGIN_S + i / hz for i in range(4)]
        found = drive([Flow("big", CLOUD, size, times, is_reliable)], times[-1] + 10, seed)
        arrived = len(found.ages_s["big"])
        offer = "reliable" if is_reliable else "best_effort"
        yield Row(f"{_sized(size)}_{offer}", arrived, "of 4", 4, "more", 4, note=_told(found))


def _alone(seed: int) -> Iterator[Row]:
    """One message on an idle link."""
    for size in (50_000, 400_000, 800_000, 1_500_000):
        found = drive([Flow("big", IMAGE, size, [BEGIN_S])], 20.0, seed)
        age_s = found.ages_s["big"].get(0, float("inf"))
        share = 100 * 8 * size / age_s / _capacity_bit_s(found)
        yield Row(f"alone_{_sized(size)}_pct", share, "%", 90, "more", 1, note=_told(found))


def _times(hz: float, duration_s: float, rng: Random) -> Sequence[float]:
    first = BEGIN_S + rng.random() / hz
    return [first + i / hz for i in range(int(hz * duration_s))]


def _quantile(values: Collection[float], share: float) -> float:
    ordered = sorted(values)
    return ordered[min(len(ordered) - 1, int(share * len(ordered)))] if ordered else float("inf")


def _capacity_bit_s(found: Drive) -> float:
    """What bursts of the longest length carry, back to back, in bit/s of messages."""
    modem, pdu_size = found.config.modem, found.config.link.pdu_size
    airtimes = Airtimes(modem, pdu_size)
    n = airtimes.most_pdus(modem.mcs, modem.max_burst_s)
    return 8 * n * equal_payload(pdu_size, 1) / airtimes.airtime_s(modem.mcs, n)


def _sized(size: int) -> str:
    return f"{size // 1_000_000}MB" if size % 1_000_000 == 0 else f"{size // 1000}kB"


def _told(found: Drive) -> str:
    modem = found.config.modem
    return f"{modem.rate_hz / 1e6:g} Msps as init writes it; overridden: MCS {modem.mcs}"


def _options() -> argparse.ArgumentParser:
    own = argparse.ArgumentParser(add_help=False)
    own.add_argument("--before", type=Path, help="what --json printed before, to show beside")
    return own


if __name__ == "__main__":
    sys.exit(main("defaults", measure, _options()))
