"""All rows: `python -m benchmarks.defaults`."""

import argparse
import json
import sys
from collections.abc import Collection, Iterator, Sequence
from math import inf
from pathlib import Path
from random import Random
from statistics import pstdev
from typing import Literal

from backends import Outage
from benchmarks.defaults.daemons import RATE, Ages, drive_daemons
from benchmarks.defaults.fairness import fairness_rows
from benchmarks.defaults.team import LISTENER, SENDER, Air, Drive, Flow, drive
from benchmarks.report import Row, main
from sdrlinkd.modem import Airtimes
from sdrlinkd.wire import equal_payload

BEGIN_S = 1.0
ODOM, IMAGE, CLOUD = "nav_msgs/msg/Odometry", "sensor_msgs/msg/Image", "sensor_msgs/msg/PointCloud2"
ODOM_SIZE, ODOM_HZ = 724, 30.0
BIG = ((IMAGE, 200_000, 5.0), (IMAGE, 1_000_000, 2.0), (CLOUD, 3_000_000, 10.0))
"""Type, bytes and messages per s of topics that alone exceed the channel's 5.8 Mbit/s."""
SCAN, TWIST, STRING = "sensor_msgs/msg/LaserScan", "geometry_msgs/msg/Twist", "std_msgs/msg/String"
LASER_SIZE, LASER_HZ, PICTURE_SIZE, PICTURE_S = 1024, 50.0, 64_000, 0.15
LASERS = 25
"""Lasers between two pauses."""
LEARNED_WITHIN = 4
"""Messages after which the laser is to be foreseen again."""
LARGE: tuple[tuple[int, Literal["reliable", "best_effort"]], ...] = (
    (400_000, "best_effort"), (1_500_000, "reliable"),
)  # fmt: skip
LARGE_HZ = 0.35
HALF_DUPLEX = Air(is_half_duplex=True)
SEED_AIRS = {
    "1ch": HALF_DUPLEX, "1ch_both": HALF_DUPLEX, "full_duplex": Air(),
    "1ch_adaptive": Air(None, is_half_duplex=True),
    "1ch_sealed": Air(is_half_duplex=True, is_sealed=True),
}  # fmt: skip
LONG_S = 20.0
DAEMONS_MCS = 6
"""64QAM 3/4, which carries as much at 2 Msps as 16QAM 1/2 at 5 Msps."""
DAEMONS_TOLD = f"as init writes it; overridden: {RATE}, MCS {DAEMONS_MCS}, fixed"
NAV2 = (
    ("odom", ODOM, ODOM_SIZE, ODOM_HZ, 99.5),
    ("tf", "tf2_msgs/msg/TFMessage", 250, 30.0, 99.5),
    ("joints", "sensor_msgs/msg/JointState", 400, 20.0, 99.5),
    ("scan", SCAN, 2900, 10.0, 99.5),
    ("camera", "sensor_msgs/msg/CompressedImage", 15_000, 5.0, 99.5),
    ("costmap", "nav_msgs/msg/OccupancyGrid", 3700, 2.0, None),
)
"""Topic, type, bytes and messages per s of a robot that navigates, 1.2 Mbit/s in all; and the
target of those that arrive, in %."""
NAV2_STATES = ("odom", "tf", "joints", "scan")
NAV2_ROBOTS, NAV2_P99_MS = 3, 150.0
SETTLED_S = 4.0
"""Time in s from which robots know the MCS for each other, and, sealed, that they are there."""
PACED = Air(None, is_half_duplex=True, react_s=3e-3, rate=RATE)
"""The air of whole daemons: a radio in real time reacts within 3 ms."""
LEAST_BIT_S = 1.2e6
"""Rate at which one message of such a topic is to arrive within the drive."""
LATE_S = 1.0
"""Time in s before the end of a drive from which on messages need not arrive."""


def measure(seed: int, quick: bool, before: Path | None = None) -> Iterator[Row]:
    """Measure all rows; `quick` drives for a fifth of the time."""
    known = {} if before is None else _values(before)
    duration_s = 4.0 if quick else 20.0
    for row in _rows(seed, duration_s):
        row.exact = True
        row.peers = {"before": known[row.name]} if row.name in known else {}
        yield row
    yield from _whole(duration_s)


def _values(path: Path) -> dict[str, float]:
    """The rows of an earlier run, which printed --json."""
    return {row["name"]: row["value"] for row in json.loads(path.read_text())["rows"]}


def _rows(seed: int, duration_s: float) -> Iterator[Row]:
    for kind, size, hz in BIG:
        yield from _beside(kind, size, hz, max(duration_s, 8 * size / LEAST_BIT_S), seed)
    yield from _large(seed)
    yield from _alone(seed)
    yield from _seed_workload(seed, duration_s)
    yield from _pauses(seed, 10 if duration_s < LONG_S else 100)
    yield from _outage(seed)
    yield from _depths(seed)
    flows = _nav2_flows(duration_s, seed)
    until_s = SETTLED_S + duration_s
    found = drive(flows, until_s, seed, PACED)
    yield from _nav2("nav2", flows, found.ages_s, until_s, f"reacts in 3 ms; {_told(found)}")
    yield from fairness_rows(seed, 30 if duration_s < LONG_S else 300)


def _whole(duration_s: float) -> Iterator[Row]:
    """Three of these rows with whole daemons in real time, on as many cores as there are."""
    odom = Flow("odom", ODOM, ODOM_SIZE, _times(ODOM_HZ, duration_s, Random(1)))
    kind, size, hz = BIG[0]
    big = Flow("big", kind, size, _times(hz, duration_s, Random(2)))
    note = f"two daemons and a hub, {DAEMONS_TOLD}"
    ages = drive_daemons([odom, big], DAEMONS_MCS)
    n, ages_s = len(odom.times), ages["odom"]
    yield Row("daemons_odom_beside_200kB_pct", 100 * len(ages_s) / n, "%", 100, "more", n,
              note=note)  # fmt: skip
    for share, target in ((0.5, 20.0), (0.99, 60.0)):
        age_ms = 1e3 * _quantile(ages_s.values(), share)
        yield Row(f"daemons_odom_beside_200kB_p{100 * share:.0f}_ms", age_ms, "ms", target, "less",
                  n, note=note)  # fmt: skip
    size, offer = LARGE[0]
    times = [BEGIN_S + i / LARGE_HZ for i in range(4)]
    ages = drive_daemons([Flow("big", CLOUD, size, times, offer)], DAEMONS_MCS, 5.0)
    yield Row(f"daemons_{_sized(size)}_{offer}", len(ages["big"]), "of 4", 4, "more", 4, note=note)
    flows = _nav2_flows(duration_s, 5)
    note = f"{NAV2_ROBOTS} daemons and a hub, as init writes it; overridden: {RATE}"
    yield from _nav2("daemons_nav2", flows, drive_daemons(flows, None), inf, note)
    note = f"two daemons and a hub, {DAEMONS_TOLD}"
    laser = Flow("scan", SCAN, LASER_SIZE, _times(LASER_HZ, duration_s, Random(3)))
    image = Flow("image", IMAGE, PICTURE_SIZE, _times(1 / PICTURE_S, duration_s, Random(4)))
    ages = drive_daemons([laser, image], DAEMONS_MCS)
    lasers_s, images_s = ages["scan"].values(), ages["image"].values()
    n, m = len(laser.times), len(image.times)
    for row, value, unit in (
        ("laser_ms", 1e3 * _mean(lasers_s), "ms"),
        ("laser_std_ms", 1e3 * pstdev(lasers_s or [0.0]), "ms"),
        ("laser_p99_ms", 1e3 * _quantile(lasers_s, 0.99), "ms"),
        ("laser_pct", 100 * len(lasers_s) / n, "%"), ("image_ms", 1e3 * _mean(images_s), "ms"),
        ("image_pct", 100 * len(images_s) / m, "%"),
    ):  # fmt: skip
        yield Row(f"daemons_{row}", value, unit, None, "more" if unit == "%" else "less",
                  n if "laser" in row else m, note=note)  # fmt: skip


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
    for size, offer in LARGE:
        times = [BEGIN_S + i / LARGE_HZ for i in range(4)]
        found = drive([Flow("big", CLOUD, size, times, offer)], times[-1] + 10, seed)
        arrived = len(found.ages_s["big"])
        yield Row(f"{_sized(size)}_{offer}", arrived, "of 4", 4, "more", 4, note=_told(found))


def _alone(seed: int) -> Iterator[Row]:
    """One message on an idle link."""
    for size in (50_000, 400_000, 800_000, 1_500_000):
        found = drive([Flow("big", IMAGE, size, [BEGIN_S])], 20.0, seed)
        age_s = found.ages_s["big"].get(0, float("inf"))
        share = 100 * 8 * size / age_s / _capacity_bit_s(found)
        yield Row(f"alone_{_sized(size)}_pct", share, "%", 90, "more", 1, note=_told(found))


def _seed_workload(seed: int, duration_s: float) -> Iterator[Row]:
    """Pound's laser and image from one of two robots to the other, or from both."""
    for name, air in SEED_AIRS.items():
        begin_s = SETTLED_S if air.is_sealed else BEGIN_S
        laser, image, *others = [
            Flow(
                f"{topic}_{robot}",
                kind,
                size,
                _times(hz, duration_s, Random(seed), begin_s),
                sender=robot,
            )
            for robot in ((SENDER, LISTENER) if name == "1ch_both" else (SENDER,))
            for topic, kind, size, hz in (
                ("scan", SCAN, LASER_SIZE, LASER_HZ),
                ("image", IMAGE, PICTURE_SIZE, 1 / PICTURE_S),
            )
        ]
        until_s = begin_s + duration_s
        found = drive([laser, image, *others], until_s, seed, air)
        lasers_s, images_s = found.ages_s[laser.name], found.ages_s[image.name]
        due = [i for i, at in enumerate(image.times) if at < until_s - LATE_S]
        arrived = 100 * sum(i in images_s for i in due) / len(due)
        has_target = name == "1ch"
        for row, value, unit, target in (
            ("laser", 1e3 * _mean(lasers_s.values()), "ms", 4.5),
            ("laser_std", 1e3 * pstdev(lasers_s.values()), "ms", 1.0),
            ("laser_p99", 1e3 * _quantile(lasers_s.values(), 0.99), "ms", None),
            ("image", 1e3 * _mean(images_s.values()), "ms", 170.0),
            ("image_pct", arrived, "%", 99.9),
        ):
            better: Literal["more", "less"] = "more" if unit == "%" else "less"
            n = len(due) if "image" in row else len(lasers_s)
            yield Row(f"{row}_{name}", value, unit, target if has_target else None, better, n,
                      note=_told(found))  # fmt: skip


def _pauses(seed: int, n_pauses: int) -> Iterator[Row]:
    """The same workload, whose laser pauses once for 22 s, or again and again."""
    rng = Random(seed)
    many_s = [10 ** rng.uniform(-1, 1.5) for _ in range(n_pauses)]
    for name, pauses_s in (("22s", [22.0]), ("random_pauses", many_s)):
        times, before, after = list[float](), set[int](), set[int]()
        at = BEGIN_S
        for pause_s in (0.0, *pauses_s):
            at += pause_s
            first = len(times)
            times += [at + i / LASER_HZ for i in range(LASERS)]
            (after if pause_s else before).update(range(first + LEARNED_WITHIN, first + LASERS))
            at = times[-1] + 1 / LASER_HZ
        laser = Flow("scan", SCAN, LASER_SIZE, times)
        image = Flow("image", IMAGE, PICTURE_SIZE, _times(1 / PICTURE_S, at - BEGIN_S, rng))
        found = drive([laser, image], at + 1.0, seed, HALF_DUPLEX)
        ages_s = found.ages_s["scan"]
        before_s, after_s = ([ages_s[i] for i in each if i in ages_s] for each in (before, after))
        note, n = f"{len(pauses_s)} pauses; {_told(found)}", len(after_s)
        ratio = _mean(after_s) / _mean(before_s)
        yield Row(f"laser_after_{name}_over_before", ratio, "", 1.1, "less", n, note=note)
        p99_ms = 1e3 * _quantile(after_s, 0.99)
        yield Row(f"laser_after_{name}_p99_ms", p99_ms, "ms", None, "less", n, note=note)


def _outage(seed: int) -> Iterator[Row]:
    """The radio is away for a minute while the robot goes on; what arrives then."""
    away = Outage(BEGIN_S + 2, BEGIN_S + 62)
    until_s = away.end_s + 3
    flows = [
        Flow(name, kind, size, _times(hz, until_s - BEGIN_S, Random(seed)), to=to)
        for name, kind, size, hz, to in (
            ("odom", ODOM, ODOM_SIZE, ODOM_HZ, None), ("scan", SCAN, 1500, 10.0, None),
            ("cmd_vel", TWIST, 52, 20.0, LISTENER),
        )
    ]  # fmt: skip
    found = drive(flows, until_s, seed, Air(silent=away))
    note, oldest_s = _told(found), 0.0
    for flow in flows:
        ages_s = found.ages_s[flow.name]
        later = {flow.times[i] + age_s: age_s for i, age_s in ages_s.items()}
        later = {at: age_s for at, age_s in later.items() if at > away.end_s}
        yield Row(f"outage_first_{flow.name}_s", later[min(later)], "s", 0.1, "less", 1, note=note)
        oldest_s = max(oldest_s, *later.values())
    yield Row("outage_oldest_s", oldest_s, "s", 0.3, "less", len(flows), note=note)


def _depths(seed: int) -> Iterator[Row]:
    """Histories as ROS 2 keeps them."""
    late = Outage(0.0, BEGIN_S + 4)
    latched = [BEGIN_S + i / 10 for i in range(5)]
    often = sorted(2 * [BEGIN_S + i / 20 for i in range(100)])
    for name, flow, air in (
        ("latched_depth_5", Flow("x", STRING, 200, latched, "reliable", "transient_local", 5),
         Air(unheard=late)),
        ("50_reliable_at_once", Flow("x", STRING, 200, [BEGIN_S] * 50), Air()),
        ("two_best_effort", Flow("x", STRING, 200, often, "best_effort"), Air()),
    ):  # fmt: skip
        found = drive([flow], flow.times[-1] + 20, seed, air)
        arrived, n = len(found.ages_s["x"]), len(flow.times)
        yield Row(name, arrived, f"of {n}", n, "more", n, note=_told(found))


def _nav2_flows(duration_s: float, seed: int) -> list[Flow]:
    """The topics of three robots that navigate, each with a phase of its own."""
    rng = Random(seed)
    return [
        Flow(f"{name}_{robot}", kind, size, _times(hz, duration_s, rng, SETTLED_S), sender=robot)
        for robot in range(1, NAV2_ROBOTS + 1)
        for name, kind, size, hz, _ in NAV2
    ]


def _nav2(
    row: str, flows: Sequence[Flow], ages_s: Ages, until_s: float, note: str
) -> Iterator[Row]:
    """How many messages of each topic arrive, of the robot with the fewest; and the latest."""
    p99_ms, states_p99_ms, n_robots = 0.0, 0.0, NAV2_ROBOTS
    for i, (name, *_, target) in enumerate(NAV2):
        arrived, n = list[float](), 0
        for flow in flows[i :: len(NAV2)]:
            found = ages_s[flow.name]
            due = [k for k, at in enumerate(flow.times) if at < until_s - LATE_S]
            arrived.append(100 * sum(k in found for k in due) / len(due))
            n += len(due)
            late_ms = 1e3 * _quantile(found.values(), 0.99)
            if target is not None:
                p99_ms = max(p99_ms, late_ms)
            if name in NAV2_STATES:
                states_p99_ms = max(states_p99_ms, late_ms)
        yield Row(f"{row}_{name}_pct", min(arrived), "%", target, "more", n, note=note)
    yield Row(f"{row}_p99_ms", p99_ms, "ms", NAV2_P99_MS, "less", n_robots, note=note)
    yield Row(f"{row}_states_p99_ms", states_p99_ms, "ms", NAV2_P99_MS, "less", n_robots, note=note)


def _times(hz: float, duration_s: float, rng: Random, begin_s: float = BEGIN_S) -> Sequence[float]:
    first = begin_s + rng.random() / hz
    return [first + i / hz for i in range(int(hz * duration_s))]


def _mean(values: Collection[float]) -> float:
    return sum(values) / len(values) if values else float("inf")


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
    mcs = "the MCS adapts" if found.config.rate.adapt else f"overridden: MCS {modem.mcs}, fixed"
    sealed = ", sealed" if found.config.security.mode != "off" else ""
    return f"{modem.rate_hz / 1e6:g} Msps as init writes it{sealed}; {mcs}"


def _options() -> argparse.ArgumentParser:
    own = argparse.ArgumentParser(add_help=False)
    own.add_argument("--before", type=Path, help="what --json printed before, to show beside")
    return own


if __name__ == "__main__":
    sys.exit(main("defaults", measure, _options()))
