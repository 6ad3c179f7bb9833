"""All rows: `python -m benchmarks.defaults`."""

import sys
from collections.abc import Iterator, Sequence
from random import Random

from benchmarks.defaults.team import Drive, Flow, drive
from benchmarks.report import Drawing, Row, exactly, main
from sdrlinkd.modem import Airtimes
from sdrlinkd.wire import equal_payload

BEGIN_S = 1.0
ODOM, IMAGE, CLOUD = "nav_msgs/msg/Odometry", "sensor_msgs/msg/Image", "sensor_msgs/msg/PointCloud2"
MCS = 3
BIG = ((IMAGE, 200_000, 5.0), (IMAGE, 1_000_000, 2.0), (CLOUD, 3_000_000, 10.0))
"""Type, bytes and messages per s of topics that alone exceed the channel's 5.8 Mbit/s."""
BEFORE = {"200kB": (23.6, 15438.0, 16745.0), "1MB": (64.2, 12155.0, 15479.0)}
"""Odometry's delivery in %, p50 and p99 in ms, before topics shared the air fairly."""


def measure(seed: int, quick: bool) -> Iterator[Row | Drawing]:
    """Measure all rows; `quick` takes a fifth of the time."""
    yield from exactly(_rows(seed, quick))


def _rows(seed: int, quick: bool) -> Iterator[Row]:
    duration_s = 4.0 if quick else 20.0
    for kind, size, hz in BIG:
        # At least two of them take as long as that at half of the channel's rate.
        yield from _beside(kind, size, hz, max(duration_s, size / 150_000), seed)
    yield from _large(seed)
    yield from _alone(seed)


def _beside(kind: str, size: int, hz: float, duration_s: float, seed: int) -> Iterator[Row]:
    """Odometry beside a topic that wants more than the channel carries."""
    rng = Random(seed)
    odom = Flow("odom", ODOM, 724, _times(30.0, duration_s, rng))
    big = Flow("big", kind, size, _times(hz, duration_s, rng))
    until_s = BEGIN_S + duration_s
    found = drive([odom, big], until_s, seed)
    said, name = found.outcomes, _sized(size)
    due = [n for n, at in enumerate(odom.times) if at < until_s - 1]
    arrived = 100 * sum(n in said["odom"].ages_s for n in due) / len(due)
    note, n = _told(found), len(due)
    before = BEFORE.get(name, ())
    peers = [{"before": each} for each in before] or [{}, {}, {}]
    yield Row(f"odom_beside_{name}_pct", arrived, "%", 100, "more", n, peers[0], note=note)
    for share, target, peer in ((0.5, 20.0, peers[1]), (0.99, 60.0, peers[2])):
        age_ms = 1e3 * said["odom"].quantile_s(share)
        row = f"odom_beside_{name}_p{100 * share:.0f}_ms"
        yield Row(row, age_ms, "ms", target, "less", n, peer, note=note)
    rest = _capacity_bit_s(found) - 8 * odom.size * 30.0
    carried = 8 * size * len(said["big"].ages_s) / duration_s
    yield Row(f"big_{name}_of_the_rest_pct", 100 * carried / rest, "%", 90, "more", 1, note=note)


def _large(seed: int) -> Iterator[Row]:
    """Messages that take longer on the air than their lifespan."""
    for size, hz, is_reliable in ((400_000, 0.35, False), (1_500_000, 0.35, True)):
        times = [BEGIN_S + i / hz for i in range(4)]
        flow = Flow("big", CLOUD, size, times, is_reliable)
        found = drive([flow], times[-1] + 10, seed)
        arrived = len(found.outcomes["big"].ages_s)
        offer = "reliable" if is_reliable else "best_effort"
        yield Row(f"{_sized(size)}_{offer}", arrived, "of 4", 4, "more", 4, note=_told(found))


def _alone(seed: int) -> Iterator[Row]:
    """One message on an idle link."""
    for size in (50_000, 400_000, 800_000, 1_500_000):
        found = drive([Flow("big", IMAGE, size, [BEGIN_S + 0.2])], 20.0, seed)
        (age_s,) = found.outcomes["big"].ages_s.values() or (float("inf"),)
        share = 100 * 8 * size / age_s / _capacity_bit_s(found)
        yield Row(f"alone_{_sized(size)}_pct", share, "%", 90, "more", 1, note=_told(found))


def _times(hz: float, duration_s: float, rng: Random) -> Sequence[float]:
    first = BEGIN_S + rng.random() / hz
    return [first + i / hz for i in range(int(hz * duration_s))]


def _capacity_bit_s(found: Drive) -> float:
    """What bursts of the longest length carry, back to back, in bit/s of messages."""
    config = found.setup.config
    airtimes = Airtimes(config.modem, config.link.pdu_size)
    n = airtimes.most_pdus(config.modem.mcs, config.modem.max_burst_s)
    octets = n * equal_payload(config.link.pdu_size, 1)
    return 8 * octets / airtimes.airtime_s(config.modem.mcs, n)


def _sized(size: int) -> str:
    return f"{size // 1_000_000}MB" if size % 1_000_000 == 0 else f"{size // 1000}kB"


def _told(found: Drive) -> str:
    modem = found.setup.config.modem
    return f"files of init; overridden: {modem.rate_hz / 1e6:g} Msps, MCS {modem.mcs}"


if __name__ == "__main__":
    sys.exit(main("defaults", measure))
