"""Two daemons on one air: clocks, ages, receipts, and command topics that fall silent."""

import socket
import struct
import time

import pytest

from backends import RadioParams
from sdrlinkd.__main__ import main
from sdrlinkd.adapters import empty, from_cdr, to_cdr
from sdrlinkd.cli.app import run
from sdrlinkd.client import Publisher, Subscriber
from tests.backends.hubs import serving
from tests.waiting import wait_for

AIR = {"rate_hz": 1e6, "frequency_hz": 2.45e9, "block_s": 0.001, "snr_db": 25.0}
PPM = {1: 20.0, 2: -15.0}
TWIST, ODOMETRY = "geometry_msgs/msg/Twist", "nav_msgs/msg/Odometry"
CONFIG = """namespace = "robot_{robot}"
backend = "ether"
[ether]
dir = "{hub}"
[modem]
rate_hz = 1e6
mcs = 3
[clock]
share = 0.5
[topic.cmd_vel]
deadman_s = 0.3
stop = {{ linear = {{ z = -0.5 }} }}
[topic.odom]
lifespan_s = 5.0
[chrony]
socket = "{chrony}"
robot = {source}
"""


@pytest.fixture
def pair(start_daemon, tmp_path_factory):
    """Two daemons that hear each other, and the socket of the second one's chronyd."""
    hub = tmp_path_factory.mktemp("hub")
    radios = {robot: RadioParams(full_duplex=True, clock_ppm=ppm) for robot, ppm in PPM.items()}
    with serving(hub, radios, **AIR):
        chrony = str(hub / "chrony.sock")
        daemons = [
            start_daemon(
                CONFIG.format(robot=robot, hub=hub, chrony=chrony * (robot == 2), source=3 - robot)
            )
            for robot in PPM
        ]
        wait_for(lambda: all(daemon.snapshot().link.neighbors for daemon in daemons))
        yield [*daemons, chrony]


def know_each_other(*daemons):
    """Whether both are in step with the other's clock."""
    clocks = [each.clock for daemon in daemons for each in daemon.snapshot().link.neighbors]
    return len(clocks) == 2 and all(
        each and each.state == "synced" and each.samples > 10 for each in clocks
    )


def odometry(stamp_ns):
    """An odometry message with that stamp in its header."""
    message = empty(ODOMETRY)
    message.header.stamp.sec, message.header.stamp.nanosec = divmod(stamp_ns, 10**9)
    return to_cdr(message, ODOMETRY)


@pytest.mark.realtime
def test_two_daemons_know_how_late_everything_is(pair, capsys, monkeypatch):
    one, two, chrony = pair
    wait_for(lambda: know_each_other(one, two), 30)
    n = 10
    with (
        Publisher(one.directory) as out,
        Subscriber("/rx_robot_1/odom", directory=two.directory) as heard,
    ):
        for _ in range(n):
            sent_ns = time.time_ns()
            name = out.send("/robot_1/odom", odometry(sent_ns - 7_000_000), receipt=True,
                            published_ns=sent_ns)  # fmt: skip
            message = heard.receive(20)
            arrived_ns = time.time_ns()
            receipt = out.receipt(20)
            assert (receipt.id, receipt.topic, receipt.dst) == (name, "/robot_1/odom", 2)
            assert receipt.fate == "delivered"
            assert receipt.took_s == pytest.approx(1e-6 * message.age_us, abs=2e-4)
            # Wide limits, because machines are not real-time systems. Benchmarks measure the
            # accuracy.
            assert 1e3 * message.age_us <= arrived_ns - sent_ns + 20_000_000
            assert abs(message.published_ns - sent_ns) < 50_000_000
            assert message.sampled_ns == pytest.approx(sent_ns - 7_000_000, abs=5_000_000)
            assert 0 < message.sampled_error_us < 50_000
            parts_us = message.waited_us + message.reassembly_us + message.on_air_us
            assert 7_000 < parts_us <= message.age_us + 10
        # Its lifespan is 5 s.
        out.send("/robot_1/odom", odometry(sent_ns), receipt=True,
                 published_ns=time.time_ns() - 12 * 10**9)  # fmt: skip
        receipt = out.receipt(20)
        assert (receipt.fate, receipt.reason) == ("expired", "tx_expired")
    for daemon, src, sign in ((one, 2, 1), (two, 1, -1)):
        (neighbor,) = daemon.snapshot().link.neighbors
        clock = neighbor.clock
        assert neighbor.src == src
        assert clock.skew_ppm == pytest.approx(sign * (PPM[1] - PPM[2]), abs=1.0)
        assert abs(clock.wall_offset_ms) < 5.0, "the same host"
        assert (clock.steps, clock.resets, clock.refused) == (0, 0, 0)
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as chronyd:
        chronyd.bind(chrony)
        chronyd.settimeout(10)
        offset_s = struct.unpack_from("@d", chronyd.recv(40), 16)[0]
        assert abs(offset_s) < 0.005, "robot 1 is on the same host"
    (topic,) = two.snapshot().link.received
    latency = topic.latency
    assert latency.air_ms == pytest.approx(7.4, abs=0.5)
    assert sum(latency.percentiles_ms.values()) > 0
    # Names still have room next to the figures of a slow machine.
    monkeypatch.setenv("COLUMNS", "140")
    assert run(["latency", "--runtime-dir", str(two.directory)]) == 0
    screen = capsys.readouterr().out
    assert "/rx_robot_1/odom" in screen
    assert "synced" in screen
    assert run(["latency", "/rx_robot_1/odom", "--runtime-dir", str(two.directory)]) == 0
    assert "all ages in ms: p50" in capsys.readouterr().out
    assert run(["latency", "nonsense", "--runtime-dir", str(two.directory)]) == 2
    assert "not heard; allowed: /rx_robot_1/odom" in capsys.readouterr().err


@pytest.mark.realtime
def test_a_command_topic_that_falls_silent_is_stopped_once(pair):
    one, two, _ = pair
    moves = to_cdr(empty(TWIST), TWIST)
    with (
        Publisher(one.directory) as out,
        Subscriber("/rx_robot_1/cmd_vel", directory=two.directory) as heard,
    ):
        for _ in range(2):
            out.send("/robot_1/cmd_vel", moves)
            assert not heard.receive(20).is_stop
            began = time.monotonic()
            stop = heard.receive(20)
            assert stop.is_stop
            assert time.monotonic() - began > 0.2
            assert from_cdr(stop.payload, TWIST).linear.z == -0.5
        assert heard.receive(1.0) is None
    assert two.log().count("published the stop message") == 2
    assert two.snapshot().link.received[0].stops == 2


@pytest.mark.parametrize(
    ("stop", "told"),
    [
        ("{ linaer = {} }", "stop.linaer: no such field (did you mean linear?); allowed: linear"),
        ("{ linear = 3 }", "stop.linear: got 3; allowed: a table of its fields"),
        ('{ linear = { x = "fast" } }', "stop.linear.x: got 'fast'; allowed: a float64"),
        ("{ linear = { x = true } }", "stop.linear.x: got True; allowed: a float64"),
    ],
)
def test_a_stop_message_that_cannot_be_made(write_config, tmp_path, capsys, stop, told):

    config = write_config(tmp_path, f"[topic.cmd_vel]\ndeadman_s = 0.3\nstop = {stop}\n")
    assert main(["--config", str(config), "--check"]) == 2
    assert told in capsys.readouterr().err
