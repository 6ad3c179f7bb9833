"""Two daemons with radios like a USRP: 30 Hz odometry and an image of 64 KB a second, both ways.

    python -m benchmarks.radio.team [--rate 5] [--mcs 1] [--policy auto] [--seconds 20]

Prints what came of both, how late, and what `why` says of each topic; 1 where not all came. With
--rate 2 (Msps) it takes --mcs 3: QPSK 1/2 has no room for it at 2 Msps.
"""

import argparse
import sys
import time
from collections import defaultdict
from concurrent.futures import ThreadPoolExecutor
from functools import partial

import numpy as np

from benchmarks.loopback_radio import NoDriverError, use_driver
from benchmarks.radio_pair import ROBOTS, Pair, pair
from sdrlinkd.client import ControlClient, Publisher, Subscriber

CONFIG = """[modem]
rate_hz = {rate}
mcs = {mcs}
frequency_hz = 915e6
[access]
policy = "{policy}"
nodes = [1, 2]
force = {force}
[topic.odom]
qos = "latency"
[topic.image]
qos = "bulk"
"""
TOPICS = {"odom": (30, 720), "image": (1, 65_536)}
"""Messages per second, and their size in bytes."""
CDR = b"\0\1\0\0"
NUMBER = slice(4, 12)
SETTLE_S, DRAIN_S, LOOK_S = 5.0, 5.0, 0.2
Heard = dict[str, dict[int, float]]
"""Arrival time of each message in s, by topic and number."""


def main() -> int:
    """Run; returns 0 if everything arrived, 1 if not, 2 without a test radio."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n", maxsplit=1)[0])
    parser.add_argument("--rate", type=float, default=5.0, help="Msps")
    parser.add_argument("--mcs", type=int, default=1)
    parser.add_argument("--policy", default="auto")
    parser.add_argument("--seconds", type=float, default=20.0)
    options = parser.parse_args()
    try:
        use_driver()
    except NoDriverError as error:
        sys.stderr.write(f"not measured: the test radio: {error}\n")
        return 2
    force = str(options.policy not in ("auto", "tdma")).lower()
    config = CONFIG.format(
        rate=1e6 * options.rate, mcs=options.mcs, policy=options.policy, force=force
    )
    with pair("usrp", list(TOPICS), config) as robots, ThreadPoolExecutor(8) as pool:
        time.sleep(SETTLE_S)
        until = time.monotonic() + options.seconds + DRAIN_S
        ears = {robot: pool.submit(_listen, robots, robot, until) for robot in ROBOTS}
        sent = dict(zip(ROBOTS, pool.map(partial(_send, robots, options.seconds), ROBOTS),
                        strict=True))  # fmt: skip
        heard = {robot: ear.result() for robot, ear in ears.items()}
        words = {robot: _words(robots, robot) for robot in ROBOTS}
    is_whole = True
    for robot, other in ((1, 2), (2, 1)):
        for topic, times in sent[robot].items():
            came = heard[other][topic]
            ages_ms = [1e3 * (came[number] - at) for number, at in times.items() if number in came]
            is_whole &= len(ages_ms) == len(times)
            quantiles = np.quantile(ages_ms, (0.5, 0.99)) if ages_ms else (np.nan, np.nan)
            print(
                f"robot {robot} {topic:5}: {len(ages_ms)} of {len(times)} arrived, PDR "
                f"{len(ages_ms) / len(times):.3f}, p50 {quantiles[0]:.0f} ms, p99 "
                f"{quantiles[1]:.0f} ms"
            )
    print(*words[1], sep="\n")
    return int(not is_whole)


def _send(robots: Pair, seconds: float, robot: int) -> Heard:
    """Send each topic at its rate; returns the send times."""
    begin, sent = time.monotonic(), defaultdict[str, dict[int, float]](dict)
    due = sorted(
        (i / per_s, topic, i) for topic, (per_s, _) in TOPICS.items()
        for i in range(int(per_s * seconds))
    )  # fmt: skip
    rng = np.random.default_rng(robot)
    with Publisher(robots.folders[robot]) as out:
        for at, topic, number in due:
            time.sleep(max(0.0, begin + at - time.monotonic()))
            rest = rng.bytes(TOPICS[topic][1] - NUMBER.stop)
            sent[topic][number] = time.monotonic()
            out.send(f"/robot_{robot}/{topic}", CDR + number.to_bytes(8, "little") + rest)
    return sent


def _listen(robots: Pair, robot: int, until: float) -> Heard:
    """Record what arrives from the other robot."""
    heard = defaultdict[str, dict[int, float]](dict)
    with Subscriber("*", directory=robots.folders[robot]) as ear:
        while time.monotonic() < until:
            message = ear.receive(LOOK_S)
            if message is not None:
                number = int.from_bytes(message.payload[NUMBER], "little")
                heard[message.topic.rsplit("/", 1)[-1]][number] = time.monotonic()
    return heard


def _words(robots: Pair, robot: int) -> list[str]:
    """Access policy in force, and `why` of each topic."""
    with ControlClient(robots.folders[robot]) as control:
        link = control.ask("status")["link"]
        policy, share = link["access_policy"], link["access_share_pct"]
        told = [f"access {policy}, {link['access_reason']}; capacity {share:.0f} % of the air"]
        for topic in TOPICS:
            told += control.ask("why", {"topic": topic})["why"]
    return told


if __name__ == "__main__":
    sys.exit(main())
