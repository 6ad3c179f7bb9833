"""Rows with whole daemons: loads, other programs that fail, files, signals."""

import json
import signal
import struct
import subprocess
import sys
import threading
import time
from itertools import islice
from random import Random

import pytest
import zmq
from msgspec import to_builtins

from benchmarks.fleet.pdu_air import PduAir
from sdrlinkd.client import Publisher, Subscriber
from sdrlinkd.wire import Description, Entry, Pdu, build, build_records, pieces
from tests.scorecard.helpers import (
    CDR,
    Counting,
    cpu_s,
    descriptors,
    problems,
    rss_mib,
    spawn,
)
from tests.waiting import wait_for

pytestmark = pytest.mark.long
HEALTHY, HIT = 251, 252
ODOM = CDR + bytes(40)
NO_FIELDS = b"\x01\x80"
"""An envelope of version 1 that says nothing, not even a time."""

FLOOD = """
    from sdrlinkd.client import Publisher
    out = Publisher()
    payload = bytes([0, 1, 0, 0]) + b"k" * 9000
    print("ready", flush=True)
    while True:
        out.send("/robot_1/scan", payload, qos="bulk")
"""
FROZEN = """
    from sdrlinkd.client import Subscriber
    with Subscriber("/rx_robot_1/odom", depth=50) as heard:
        print("ready", flush=True)
        for message in heard:
            pass
"""


def topics(tmp_path, n):
    registry = tmp_path / "many.csv"
    registry.write_text("".join(f"t{i},std_msgs/msg/String\n" for i in range(n)))
    return f'registry = "{registry}"\n'


def test_row_1_load(start_daemon, tmp_path, lasting, figure):
    daemon = start_daemon(topics(tmp_path, 15))
    payload, n = CDR + bytes(696), 0
    with Counting(daemon.directory) as heard, Publisher(daemon.directory) as out:
        began, cpu = time.monotonic(), cpu_s(daemon)
        for _ in lasting():
            out.send(f"/robot_1/t{n % 15}", payload)
            n += 1
            time.sleep(max(0.0, began + n / 500 - time.monotonic()))
        wait_for(lambda: heard.count == n)
        share = (cpu_s(daemon) - cpu) / (time.monotonic() - began)
    assert daemon.snapshot().link.tx.dropped == {}
    figure(1, "500 messages/s of 700 B, 15 topics", f"{n} of {n}, CPU {100 * share:.0f} %")


def test_row_2_overload(start_daemon, tmp_path, lasting, figure):
    daemon = start_daemon("[direct]\nrate_bit_s = 2e6\n[queue]\nmax_messages = 1000\n")
    urgent, n = 0, 0
    with Publisher(daemon.directory) as out:
        for _ in range(2000):
            out.send("/robot_1/scan", CDR + bytes(696), qos="bulk")
        before = rss_mib(daemon)
        for _ in lasting():
            for _ in range(50):
                out.send("/robot_1/scan", CDR + bytes(696), qos="bulk")
            out.send("/robot_1/cmd_vel", CDR + bytes(48), qos="urgent")
            urgent, n = urgent + 1, n + 51
            time.sleep(0.01)
        wait_for(lambda: daemon.snapshot().link.tx.accepted >= n + 2000)
    snapshot, grown = daemon.snapshot(), rss_mib(daemon) / before - 1
    (commands,) = (each for each in snapshot.link.topics if each.name.endswith("cmd_vel"))
    assert commands.dropped == {}
    assert problems(daemon) == []
    assert grown < 0.25
    figure(
        2, "ten times the channel's capacity",
        f"urgent {urgent} of {urgent}, {sum(snapshot.link.tx.dropped.values())} bulk messages shed "
        f"by name, memory {100 * grown:+.0f} %",
    )  # fmt: skip


def test_row_3_producers_are_killed(start_daemon, lasting, figure):
    daemon = start_daemon("[link]\npdu_size = 64\n[direct]\nrate_bit_s = 2e6\n")
    whole, kills = CDR + b"k" * 9000, 0
    with Counting(daemon.directory, is_whole=whole.__eq__) as heard:
        for _ in lasting():
            with spawn(FLOOD, daemon.directory) as producer:
                producer.line()
                before = daemon.snapshot().link.tx.accepted
                wait_for(lambda before=before: daemon.snapshot().link.tx.accepted > before + 20)
                producer.kill()
            kills += 1
        assert problems(daemon) == []
        wait_for(lambda: heard.count > kills)
    assert heard.damaged == 0
    figure(3, "producers killed in mid-message", f"{kills} kills, 0 of {heard.count} messages torn")


def test_row_4_a_consumer_is_frozen(start_daemon, lasting, figure):
    daemon, n = start_daemon(), 0
    with spawn(FROZEN, daemon.directory) as frozen, Counting(daemon.directory) as heard:
        assert frozen.line() == "ready"
        frozen.send_signal(signal.SIGSTOP)
        before = rss_mib(daemon)
        with Publisher(daemon.directory) as out:
            for _ in lasting():
                out.send("/robot_1/odom", CDR + bytes(700))
                n += 1
                time.sleep(5e-4)
        wait_for(lambda: heard.count == n)
        grown = rss_mib(daemon) - before
        frozen.send_signal(signal.SIGCONT)
    assert grown < 10
    figure(4, "a frozen consumer beside a healthy one", f"{n} of {n}, memory {grown:+.1f} MiB")


def test_row_13_the_clock_steps(start_daemon, lasting, figure, tmp_path):
    """The daemon's clock alone steps, and the programs' do not."""
    begun = tmp_path / "begun"
    stepping = (
        f"import os, time; real = time.time; begun = {str(begun)!r}; "
        "since = lambda: real() - os.path.getmtime(begun) if os.path.exists(begun) else 0; "
        "time.time = lambda: real() + (0, 3600, -3600, 0.2, -0.2)[int(4 * since()) % 5]; "
        "time.time_ns = lambda: int(1e9 * time.time());"
    )
    daemon, n = start_daemon("", stepping), 1
    with Counting(daemon.directory) as heard, Publisher(daemon.directory) as out:
        # With a message, the daemon looks at the clock.
        out.send("/robot_1/odom", CDR + bytes(100))
        wait_for(lambda: heard.count == n)
        begun.touch()
        cpu, began = cpu_s(daemon), time.monotonic()
        for _ in lasting():
            out.send("/robot_1/odom", CDR + bytes(100))
            n += 1
            time.sleep(0.02)
        wait_for(lambda: heard.count == n)
        share = (cpu_s(daemon) - cpu) / (time.monotonic() - began)
    assert problems(daemon) == []
    assert share < 0.5, "no storm of timers"
    figure(13, "wall clock ±1 h and ±0.2 s, four times a second", f"{n} of {n} messages")


def test_row_16_a_second_instance(start_daemon, figure):
    daemon = start_daemon()
    done = subprocess.run(
        [sys.executable, "-m", "sdrlinkd", "--config", str(daemon.config)],
        capture_output=True, text=True, check=False, timeout=60,
    )  # fmt: skip
    assert done.returncode == 2
    (line,) = done.stderr.splitlines()
    assert f"(pid {daemon.pid}) already runs in" in line
    assert daemon.is_up()
    figure(16, "a second daemon in the same place", "exit code 2, in a line that names the first")


def test_row_18_soak(start_daemon, lasting, figure):
    """Messages, killed producers, frozen consumers and reloads, all at once."""
    daemon = start_daemon("[link]\npdu_size = 64\n[direct]\nrate_bit_s = 4e6\n")
    with (
        Counting(daemon.directory, "/rx_robot_1/odom") as heard,
        Publisher(daemon.directory) as out,
    ):
        n, rounds, first = 0, 0, None
        for left in lasting():
            with spawn(FLOOD, daemon.directory) as flood, spawn(FROZEN, daemon.directory) as frozen:
                flood.line()
                frozen.line()
                frozen.send_signal(signal.SIGSTOP)
                for _ in range(min(200, int(100 * left) + 20)):
                    # A machine may be busy for longer than the lifespan of the class.
                    out.send("/robot_1/odom", CDR + bytes(700), qos="urgent", lifespan_ms=60_000)
                    n += 1
                    time.sleep(0.005)
                flood.kill()
                frozen.kill()
            daemon.send_signal(signal.SIGHUP)
            rounds += 1
            wait_for(lambda n=n: heard.count == n)
            if first is None:
                first = rss_mib(daemon), descriptors(daemon)
        grown, more = rss_mib(daemon) - first[0], descriptors(daemon) - first[1]
    assert problems(daemon) == []
    assert (grown < 15, more <= 4) == (True, True), (grown, more)
    figure(
        18, "messages, kills, freezes and reloads",
        f"{rounds} rounds, {n} of {n}, memory {grown:+.1f} MiB, descriptors {more:+d}",
    )  # fmt: skip


def test_row_19_stopped_under_load(start_daemon, lasting, figure):
    worst_s, times = 0.0, 0
    for _ in lasting():
        daemon = start_daemon("drain_s = 0.3\n[direct]\nrate_bit_s = 2e6\n")
        with spawn(FLOOD, daemon.directory) as flood:
            flood.line()
            wait_for(lambda daemon=daemon: daemon.snapshot().link.tx.accepted > 50)
            began = time.monotonic()
            daemon.ends_well()
            worst_s = max(worst_s, time.monotonic() - began)
            flood.kill()
        assert "do not add up" not in daemon.log()
        assert not [each for each in daemon.directory.iterdir() if each.suffix == ".sock"]
        times += 1
    figure(19, "SIGTERM under load, drain_s = 0.3", f"{times} times, exit within {worst_s:.2f} s")


def test_row_20_a_flood_of_declared_topics(start_daemon, lasting, figure):
    """From 250 ids that nobody has: a healthy robot is heard, and the daemon answers."""
    ages, waits, n_forged = [], [], 0
    with PduAir((HEALTHY, HIT)) as air:
        healthy, hit = (
            start_daemon(
                f'auto = true\nnamespace = "robot_{robot}"\nbackend = "gnuradio"\n'
                f"{air.settings(robot)}pdu_size = 64\n"
            )
            for robot in (HEALTHY, HIT)
        )
        forged = (
            build(Pdu(0, False, src, 255, number, 1, [Entry(15, 0, 0, 1, each)]), 64)
            for number in range(16, 256)
            for src in range(1, 251)
            for each in map(build_records, ([p] for p in pieces(number, about(number), 40)))
        )
        rng = Random(1)
        with (
            Subscriber(f"/rx_robot_{HEALTHY}/odom", runtime_dir=hit.directory) as heard,
            Publisher(healthy.directory) as out,
        ):
            with healthy.control() as control:
                declared = {"name": f"/robot_{HEALTHY}/odom", "type": "nav_msgs/msg/Odometry"}
                control.ask("declare", declared)

            def comes():
                out.send(f"/robot_{HEALTHY}/odom", ODOM)
                return heard.receive(0.3)

            wait_for(comes)
            for _ in lasting():
                for pdu in islice(forged, 13):
                    air.forge(HIT, pdu)
                    n_forged += 1
                if rng.random() < 0.2:
                    out.send(f"/robot_{HEALTHY}/odom", ODOM)
                message = heard.receive(0.01)
                if message is not None and message.age_us is not None:
                    ages.append(message.age_us / 1e3)
                if rng.random() < 0.02:
                    began = time.monotonic()
                    snapshot = hit.snapshot()
                    waits.append(time.monotonic() - began)
        p99 = sorted(ages)[int(0.99 * len(ages))]
        figure(
            20, "PDUs that declare 240 topics of each of 250 robots",
            f"{n_forged} PDUs; status in {1e3 * max(waits):.0f} ms at most; healthy odometry "
            f"p99 {p99:.0f} ms old; loop lag {snapshot.loop_lag_ms:.0f} ms; "
            f"{len(json.dumps(to_builtins(snapshot))) >> 10} KiB of snapshot",
        )  # fmt: skip
        assert problems(hit) == []
        assert max(waits) < 5
        assert len(ages) > 10


def test_row_24_stops_that_stutter(start_daemon, lasting, figure):
    """The daemon is stopped again as soon as it has awoken: what waited meanwhile is old.

    Its producer tells no times. A message that the daemon has handed over just before a stop may
    still wait for its consumer in ZeroMQ, but says when that was.
    """
    daemon = start_daemon("[topic.odom]\nlifespan_s = 1.0\ndepth = 0\n")
    rng, sent, late, stops, is_over = Random(24), 0, 0, 0, threading.Event()
    context = zmq.Context()

    def produce():
        nonlocal sent
        out = context.socket(zmq.PUSH)
        out.connect(f"ipc://{daemon.directory / 'in.sock'}")
        while not is_over.wait(0.003):
            stamp = struct.pack("<d", time.monotonic())
            out.send_multipart([b"/robot_1/odom\0", NO_FIELDS, CDR + stamp])
            sent += 1
        out.close(linger=0)

    ages = []

    def listen():
        with Subscriber("/rx_robot_1/odom", directory=daemon.directory, depth=0) as heard:
            while not is_over.is_set():
                message = heard.receive(0.1)
                if message is not None:
                    stamp = struct.unpack_from("<d", message.payload, 4)[0]
                    told = message.age_us / 1e6 + (time.time_ns() - message.received_ns) / 1e9
                    ages.append((message.age_us / 1e6, time.monotonic() - stamp - told))

    threads = [threading.Thread(target=each) for each in (produce, listen)]
    for each in threads:
        each.start()
    wait_for(lambda: len(ages) > 10)
    for _ in lasting():
        for stopped_s, awake_s in ((3.0, rng.uniform(0.002, 0.012)), (0.6, 1.5)):
            daemon.send_signal(signal.SIGSTOP)
            time.sleep(stopped_s)
            daemon.send_signal(signal.SIGCONT)
            time.sleep(awake_s)
            stops += 1
    is_over.set()
    for each in threads:
        each.join()
    context.term()
    late = sum(age > 1.0 or more > 1.0 for age, more in ages)
    assert problems(daemon) == []
    assert late == 0
    figure(
        24, "stops that stutter, a producer without times",
        f"{stops} stops; {len(ages)} of {sent} messages heard, the oldest {max(ages)[0]:.1f} s old",
    )  # fmt: skip


def about(number):
    return Description(f"flood/topic_{number}", "std_msgs/msg/String")
