"""Daemons with GNU Radio between them: as the air, as an OFDM modem, as a GFSK modem."""

import contextlib
import socket
import struct

import pytest

from sdrlinkd.client import Publisher, Subscriber
from tests.laws import one_in
from tests.pdulink.gnu_radio import flowgraph, no_gnu_radio
from tests.waiting import wait_for

pytestmark = pytest.mark.skipif(bool(no_gnu_radio()), reason=no_gnu_radio())
N = 60
PDU = 220
SAMPLES = 200_000
RATES = {"ofdm_phy": 3e5, "gfsk_phy": 1e5}


@pytest.fixture
def endpoints(tmp_path_factory):
    """(send, receive) of two robots, from the view of each."""
    folder = tmp_path_factory.mktemp("air")
    return [
        (f"ipc://{folder}/{robot}-out", f"ipc://{folder}/{robot}-in") for robot in ("one", "two")
    ]


@pytest.fixture
def free_ports():
    """Some TCP and UDP ports that nobody uses."""

    def find(n):
        with contextlib.ExitStack() as stack:
            sockets = [stack.enter_context(socket.socket()) for _ in range(n)]
            for each in sockets:
                each.bind(("127.0.0.1", 0))
            return [each.getsockname()[1] for each in sockets]

    return find


def on_samples(robot, ends, pattern="push", form="cf32_le", paced=False):
    """Configuration with GNU Radio as the air; unpaced, a daemon waits for a stalled flowgraph."""
    return (
        f'namespace = "robot_{robot}"\nbackend = "zmq"\n[zmq]\nsend = "{ends[0]}"\n'
        f'receive = "{ends[1]}"\npattern = "{pattern}"\nformat = "{form}"\n'
        f"paced = {str(paced).lower()}\n"
        f"[modem]\nrate_hz = 1e6\n[link]\npdu_size = {PDU}\nbeacon_s = 0\n[clock]\nperiod_s = 0\n"
    )


def on_pdus(robot, send, receive="", transport="zmq-push", rate=3e5, size=PDU):
    """Configuration with GNU Radio as the modem."""
    return (
        f'namespace = "robot_{robot}"\nbackend = "gnuradio"\n[gnuradio]\nsend = "{send}"\n'
        f'receive = "{receive}"\ntransport = "{transport}"\nrate_bit_s = {rate}\n'
        f"[link]\npdu_size = {size}\nbeacon_s = 0\n[clock]\nperiod_s = 0\n"
    )


def is_ready(robot):
    """Whether PDUs are accepted and samples flow."""
    carrier = robot.snapshot().carrier
    return carrier.state == "up" and carrier.counters.get("samples", SAMPLES) >= SAMPLES


def greet(robot):
    """Send one PDU from the robot."""
    name = robot.snapshot().namespace
    with Publisher(robot.directory) as publisher:
        publisher.send(f"/{name}/imu", bytes(20))
        publisher.flush()
    wait_for(lambda: robot.snapshot().link.tx.sent)


def exchange(robots, n=N):
    """Send messages from each robot to the other; returns who heard which."""
    bodies = [struct.pack("<IQ", 0x100, i) + bytes(80) for i in range(n)]
    with (
        Subscriber("/rx_robot_2/odom", directory=robots[0].directory, depth=0) as first,
        Subscriber("/rx_robot_1/odom", directory=robots[1].directory, depth=0) as second,
        Publisher(robots[0].directory) as one,
        Publisher(robots[1].directory) as two,
    ):
        for robot in robots:
            wait_for(lambda robot=robot: is_ready(robot), 60)
        for body in bodies:
            one.send("/robot_1/odom", body)
            two.send("/robot_2/odom", body)
        wait_for(lambda: all(not robot.snapshot().link.tx.queued for robot in robots), 60)
        heard = []
        for listener in (first, second):
            got = []
            while len(got) < n and (message := listener.receive(3)) is not None:
                got.append(message.payload)
            heard.append(got)
    for robot in robots:
        with robot.control() as control:
            assert control.ask("check")["problems"] == []
    return bodies, heard


@pytest.mark.realtime
@pytest.mark.parametrize(
    ("pattern", "form", "sample"),
    one_in(
        3, [("push", "cf32_le", "cf32"), ("req", "cf32_le", "cf32"), ("push", "ci16_le", "sc16")]
    ),
)
def test_gnu_radio_as_the_air(start_daemon, endpoints, pattern, form, sample):
    one, two = endpoints
    with flowgraph(
        "channel", "--node", *one, "--node", *two, "--rate", 1e6, "--snr-db", 25, "--pattern",
        pattern, "--format", sample,
    ):  # fmt: skip
        robots = [
            start_daemon(on_samples(1, one, pattern, form)),
            start_daemon(on_samples(2, two, pattern, form)),
        ]
        bodies, heard = exchange(robots)
    assert heard == [bodies, bodies]
    for robot in robots:
        assert robot.snapshot().carrier.counters["bad_messages"] == 0


@pytest.mark.realtime
@pytest.mark.long
def test_what_gnu_radio_loses_in_real_time_has_a_name(start_daemon, endpoints):
    one, two = endpoints
    with flowgraph("channel", "--node", *one, "--node", *two, "--rate", 1e6, "--snr-db", 25):
        robots = [
            start_daemon(on_samples(1, one, paced=True)),
            start_daemon(on_samples(2, two, paced=True)),
        ]
        bodies, heard = exchange(robots)
        counters = [robot.snapshot().carrier.counters for robot in robots]
    for got in heard:
        assert got == [body for body in bodies if body in set(got)]
    # A stall of the machine is an outage of the flowgraph's, or samples that came too fast.
    stalled = any(
        each[name] for each in counters for name in ("outages", "skips", "late", "samples_lost")
    )
    assert stalled or heard == [bodies, bodies], counters


@pytest.mark.realtime
@pytest.mark.parametrize("phy", one_in(2, ["ofdm_phy", "gfsk_phy"]))
@pytest.mark.parametrize("pattern", one_in(2, ["push", "pub"]))
def test_gnu_radio_as_the_modem(start_daemon, endpoints, phy, pattern):
    one, two = endpoints
    with flowgraph(
        phy, "--link", *one, *two, "--pdu-size", PDU, "--snr-db", 25, "--pattern", pattern
    ):
        robots = [
            start_daemon(on_pdus(1, *one, f"zmq-{pattern}", RATES[phy])),
            start_daemon(on_pdus(2, *two, f"zmq-{pattern}", RATES[phy])),
        ]
        bodies, heard = exchange(robots)
    assert heard == [bodies, bodies]


@pytest.mark.realtime
@pytest.mark.long
@pytest.mark.parametrize("transport", ["udp", "tcp"])
def test_gnu_radio_as_the_modem_by_socket_pdu(start_daemon, free_ports, transport):
    one, two = (f"127.0.0.1:{port}" for port in free_ports(2))
    with flowgraph(
        "ofdm_phy", "--link", one, two, "--pdu-size", PDU, "--snr-db", 25, "--transport", transport
    ):
        robots = [
            start_daemon(on_pdus(1, one, "", transport)),
            start_daemon(on_pdus(2, two, "", transport)),
        ]
        if transport == "udp":
            # Its answers are sent to the peer that it has heard.
            for robot in robots:
                greet(robot)
        bodies, heard = exchange(robots)
    assert heard == [bodies, bodies]


def test_a_flowgraph_that_is_not_there_is_told_and_waited_for(start_daemon, endpoints):
    one, two = endpoints
    robots = [start_daemon(on_pdus(1, *one)), start_daemon(on_pdus(2, *two))]
    wait_for(lambda: robots[0].snapshot().carrier.notices)
    snapshot = robots[0].snapshot()
    assert snapshot.carrier.state == "down"
    assert f"no flowgraph: nothing accepts PDUs at {one[0]}" in snapshot.carrier.notices[0]
    with Publisher(robots[0].directory) as publisher:
        publisher.send("/robot_1/odom", bytes(100))
        publisher.flush()
    assert robots[0].snapshot().link.tx.queued == 1
    with flowgraph("ofdm_phy", "--link", *one, *two, "--pdu-size", PDU, "--snr-db", 25):
        wait_for(lambda: robots[1].snapshot().link.rx.delivered == 1, 60)
