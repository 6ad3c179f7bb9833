"""What the bridge does with bad input, faults, and changes while it runs."""

import json
import signal
import struct
import subprocess
import sys
import time
from contextlib import contextmanager

import pytest

from benchmarks.environments import BRIDGE
from sdrlinkd.adapters import empty, to_cdr
from sdrlinkd.calls import Kind, Packet, Status
from sdrlinkd.client import Publisher, Subscriber
from tests.ros.programs import Agent, Bridge, new_domain
from tests.ros.team import (
    CARRIER,
    GRID,
    ODOM,
    SCAN,
    TEXT,
    WAIT_S,
    Robot,
    ask,
    config,
    matched,
    transforms,
)
from tests.ros.wheels import environment, python
from tests.waiting import wait_for

pytestmark = [pytest.mark.realtime, pytest.mark.long]

OTHER_HASH = "RIHS01_" + "ab" * 32
IMAGE = "sensor_msgs/msg/Image"
DIAGNOSTICS = "diagnostic_msgs/msg/DiagnosticArray"


def test_what_comes_from_the_air_is_published_only_under_a_type_that_it_is(
    start_daemon, start, hub
):
    one = start_daemon(config(hub, 1, "[topic.odom]\ndepth = 0\n"))
    two = Robot(start, start_daemon(config(hub, 2)), "-p", 'restamp:=["odom"]').watched().bridged()
    topic, kind, _ = ODOM
    two.node.sub(topic="/robot_1/odom", type=kind)
    two.node.sub(topic="/robot_1/wrong", type=TEXT)
    ask(one, "declare", name="/custom", type="my_msgs/msg/Thing")
    ask(one, "declare", name="/wrong", type=TEXT, hash=OTHER_HASH)
    ask(one, "declare", name=topic, type=kind)
    two.bridge.says("my_msgs/msg/Thing: this type is not installed here; install its package, ros-")
    two.bridge.says(f"robot 1 sends {TEXT} with hash {'ab' * 8}, but here it has")
    wait_for(lambda: topic in ask(one, "demand")["wanted"], WAIT_S)
    with Publisher(one.directory) as out:
        out.send(topic, b"\0\1\0\0" + b"no odometry" * 6)
        out.send(topic, b"\7\7\0\0" + bytes(700))
        out.send("/wrong", b"\0\1\0\0\2\0\0\0a\0")
        message = empty(kind)
        message.header.frame_id = "base"
        # A length that is none, and a text that ends a node written in Python.
        at = to_cdr(message, kind).index(b"base")
        for where, what in ((at - 4, b"\xff\xff\xff\x7f"), (at, b"\xff\xfe")):
            hostile = bytearray(to_cdr(message, kind))
            hostile[where : where + len(what)] = what
            out.send(topic, bytes(hostile))
        sent_ns = time.time_ns()

        def is_restamped():
            # Once the source's clock is known, messages have the time of their publication.
            out.send(topic, to_cdr(message, kind))
            wait_for(lambda: two.node.count(topic="/robot_1/odom") > 0, WAIT_S)
            (seconds, ns), _ = two.node.last(topic="/robot_1/odom")[0]
            return abs(seconds * 10**9 + ns - sent_ns) < 60 * 10**9

        wait_for(is_restamped, WAIT_S)

    wait_for(lambda: two.node.count(topic="/link/topics") > 0, WAIT_S)

    def n_bad():
        told = json.loads(two.node.last(topic="/link/topics")[0])
        return [each["dropped"] for each in told if each["state"] == "rx_bad_cdr"]

    wait_for(lambda: n_bad() == [4], WAIT_S)

    def tells_that_nothing_is_sealed():
        # A topic that was declared anew has no message yet.
        out.send(topic, to_cdr(message, kind))
        told = json.loads(two.node.last(topic="/link/topics")[0])
        return [each["sealed"] for each in told if each["topic"] == "/robot_1/odom"] == [False]

    with Publisher(one.directory) as out:
        wait_for(tells_that_nothing_is_sealed, WAIT_S)
    assert two.node.count(topic="/robot_1/wrong") == 0


def test_what_the_robot_sends_follows_its_publishers_and_the_parameters(start_daemon, start, hub):
    one = Robot(start, start_daemon(config(hub, 1)), "-p", 'deny:=["/scna"]').bridged()
    two = start_daemon(config(hub, 2))
    one.node.pub(topic="/scan", type=SCAN[1], best_effort=True, depth=5)
    one.node.pub(topic="/camera", type=IMAGE)
    other = start(Agent, one.domain, "other")
    other.pub(topic="/mixed", type=TEXT)
    one.node.pub(topic="/mixed", type=CARRIER)
    one.bridge.says("deny: /scna matches no topic here so far; the nearest are /scan")
    one.bridge.says("/mixed: nodes here publish it as std_msgs/msg/ByteMultiArray and as std_msgs")
    with Subscriber("/rx_robot_1/*", directory=two.directory) as heard:
        matched(one, "/scan")
        one.node.send(topic="/scan", n=20, hz=10)
        got = [heard.receive(WAIT_S) for _ in range(20)]
        assert {each.topic for each in got if each} == {"/rx_robot_1/scan"}, "20 of 20"
        assert one.node.set(node="sdrlink_bridge", name="allow", value=["/*", "/camera"]) == [
            True, "",
        ]  # fmt: skip
        matched(one, "/camera")
        assert one.node.set(node="sdrlink_bridge", name="deny", value=["/scan"])[0]
        matched(one, "/scan", n=0)
        is_set, reason = one.node.set(node="sdrlink_bridge", name="allow", value=7)
        assert not is_set
        assert reason == "allow: got 7; allowed: a list of names or patterns"
        one.node.send(topic="/camera")
        assert heard.receive(WAIT_S).topic == "/rx_robot_1/camera"


def test_a_node_that_was_upgraded_is_followed_with_its_new_type(start_daemon, start, hub):
    """As is a map: a subscriber that has it does not get it again when the robots meet anew."""
    one = Robot(start, start_daemon(config(hub, 1))).bridged()
    two = Robot(start, start_daemon(config(hub, 2))).bridged()
    one.node.pub(topic="/state", type=TEXT)
    one.node.pub(topic="/map", type=GRID, latched=True, depth=1)
    one.node.send(topic="/map", first=5)
    one.node.pub(topic="/diagnostics", type=DIAGNOSTICS)
    two.node.sub(topic="/robot_1/map", type=GRID, latched=True, depth=1)
    two.node.sub(topic="/robot_1/diagnostics", type=DIAGNOSTICS)
    two.node.sub(topic="/robot_1/state", type=TEXT)
    matched(one, "/state", "/diagnostics")
    one.node.send(topic="/state", n=3, hz=5)
    wait_for(lambda: two.node.count(topic="/robot_1/state") == 3, WAIT_S)
    one.node.unpub(topic="/state")
    one.node.pub(topic="/state", type="std_msgs/msg/Int32")
    other = start(Agent, two.domain, "other")
    other.sub(topic="/robot_1/state", type="std_msgs/msg/Int32")
    matched(one, "/state")

    def is_followed():
        one.node.send(topic="/state")
        return other.count(topic="/robot_1/state") >= 3

    wait_for(is_followed, WAIT_S)
    wait_for(lambda: two.node.count(topic="/robot_1/map") == 1, WAIT_S)
    # The bridge tells its own diagnostics once a second to this computer alone.
    one.node.send(topic="/diagnostics", first=9)
    wait_for(lambda: two.node.count(topic="/robot_1/diagnostics") >= 1, WAIT_S)
    assert two.node.got(topic="/robot_1/diagnostics") == one.node.expect(
        type=DIAGNOSTICS, first=9, n=1
    )
    one.daemon.stop()
    one.daemon.at_work()
    wait_for(lambda: sent_of(one.daemon, "/map") >= 1, WAIT_S)
    other.sub(topic="/robot_1/map", type=GRID, latched=True, depth=1)
    wait_for(lambda: other.count(topic="/robot_1/map") == 1, WAIT_S)
    # It has come twice over the air.
    wait_for(lambda: heard_of(two.daemon, "/rx_robot_1/map") == 2, WAIT_S)
    assert two.node.count(topic="/robot_1/map") == 1


def sent_of(daemon, name):
    return sum(each.sent for each in daemon.snapshot().link.topics if each.name == name)


def heard_of(daemon, name):
    received = daemon.snapshot().link.received
    return sum(each.delivered for each in received if each.republished_as == name)


def test_types_of_every_shape_arrive_equal(start_daemon, start, hub):
    """Bounded, nested, constant, empty, defaults, arrays, wide strings."""
    one = Robot(start, start_daemon(config(hub, 1))).bridged()
    two = Robot(start, start_daemon(config(hub, 2))).bridged()
    kinds = one.node.types_of(package="test_msgs")
    assert {"test_msgs/msg/WStrings", "test_msgs/msg/BoundedSequences"} <= {*kinds}
    topics = {kind: "/" + kind.rsplit("/", 1)[-1].lower() for kind in kinds}
    for kind, topic in topics.items():
        one.node.pub(topic=topic, type=kind)
        two.node.sub(topic=f"/robot_1{topic}", type=kind)
    matched(one, *topics.values())
    for kind, topic in topics.items():
        one.node.send(topic=topic, first=len(kind))
    for kind, topic in topics.items():
        wait_for(lambda topic=topic: two.node.count(topic=f"/robot_1{topic}") == 1, WAIT_S)
        sent = one.node.expect(type=kind, first=len(kind), n=1)
        assert two.node.got(topic=f"/robot_1{topic}") == sent, kind


def test_a_subscriber_gets_no_more_than_it_asks_for(start_daemon, start, hub):
    one = Robot(start, start_daemon(config(hub, 1))).bridged()
    two = Robot(start, start_daemon(config(hub, 2)), "-p", 'rates:=["/robot_1/od*:=5"]').bridged()
    one.node.pub(topic="/odom", type=ODOM[1])
    two.node.sub(topic="/robot_1/odom", type=ODOM[1])
    matched(one, "/odom")

    def throttled():
        topics = one.daemon.snapshot().link.topics
        return sum(each.dropped.get("tx_throttled", 0) for each in topics)

    def is_slowed():
        one.node.send(topic="/odom", n=10)
        return throttled() >= 20

    wait_for(is_slowed, WAIT_S)
    before, heard = throttled(), two.node.count(topic="/robot_1/odom")
    one.node.send(topic="/odom", n=150, hz=50)
    one.node.sent()
    wait_for(lambda: two.node.count(topic="/robot_1/odom") >= heard + 10, WAIT_S)
    assert throttled() - before >= 100
    assert two.node.set(node="sdrlink_bridge", name="rates", value=["/robot_1/odom:=fast"]) == [
        False,
        "rates: got ['/robot_1/odom:=fast']; allowed: a list of NAME:=HZ, such as /robot_2/scan:=2",
    ]
    # The way back.
    assert two.node.set(node="sdrlink_bridge", name="rates", value=["/none:=5"])[0]

    def is_whole():
        before = throttled()
        one.node.send(topic="/odom", n=10)
        return throttled() == before

    wait_for(is_whole, WAIT_S)


@contextmanager
def odometry(start_daemon, start, hub):
    """A bridged robot that publishes /odom, and another one that has heard it."""
    one = Robot(start, start_daemon(config(hub, 1))).bridged()
    two = start_daemon(config(hub, 2))
    one.node.pub(topic="/odom", type=ODOM[1])
    with Subscriber("/rx_robot_1/odom", directory=two.directory) as heard:
        matched(one, "/odom")
        one.node.send(topic="/odom")
        assert heard.receive(WAIT_S) is not None
        yield one, heard


def test_a_busy_daemon_is_not_said_to_be_away(start_daemon, start, hub):
    """It is stopped for two seconds; what nodes publish meanwhile arrives."""
    with odometry(start_daemon, start, hub) as (one, heard):
        one.daemon.send_signal(signal.SIGSTOP)
        one.bridge.says("the daemon answers slowly (more than 1 s)")
        one.node.send(topic="/odom", first=1)
        one.daemon.send_signal(signal.SIGCONT)
        one.bridge.says("the daemon answers again, after ")
        assert heard.receive(WAIT_S) is not None
    assert "start one" not in one.bridge.log()
    assert one.node.matched(topic="/odom") == 1


def test_a_daemon_that_ends_and_starts_again_is_waited_for(start_daemon, start, hub):
    with odometry(start_daemon, start, hub) as (one, heard):
        one.daemon.stop()
        one.bridge.says("waiting for the daemon; messages are lost meanwhile")
        one.node.send(topic="/odom", first=1)
        one.daemon.at_work()
        one.bridge.says("the daemon of robot 1 answers")
        matched(one, "/odom")
        deadline = time.monotonic() + WAIT_S
        while heard.receive(0.5) is None:
            assert time.monotonic() < deadline
            one.node.send(topic="/odom", first=2)
    assert one.bridge.log().count("waiting for the daemon") == 1
    # `sdrlinkctl status` shows it.

    def is_told(words):
        notices = ask(one.daemon, "status")["notices"]
        return any("ROS bridge: topics out 1 " in each and words in each for each in notices)

    wait_for(lambda: is_told("(wanted 1), in 0 (wanted 0)"), WAIT_S)
    assert is_told("messages lost while the daemon was away")


def test_transforms_of_others_are_merged_and_never_go_back(start_daemon, start, hub):
    one = Robot(start, start_daemon(config(hub, 1)), "-p", "tf.merge:=true").bridged()
    two = Robot(start, start_daemon(config(hub, 2)), "-p", "tf.merge:=true").bridged()
    for robot in (one, two):
        robot.node.pub(topic="/tf", type=CARRIER)
        robot.node.sub(topic="/tf", type=CARRIER)
        robot.node.sub(topic="/diagnostics", type=DIAGNOSTICS)
    # The node and the bridge, which takes it for the other robot.
    matched(one, "/tf", n=2)
    matched(two, "/tf", n=2)
    sent = {one: transforms("r1/scan"), two: transforms("r2/scan")}
    for robot in (one, two):
        robot.node.raw(topic="/tf", octets=sent[robot])
    for robot in (one, two):
        wait_for(lambda robot=robot: robot.node.count(topic="/tf") >= 2, WAIT_S)
    # Had one gone back, it would go round for ever.
    sent_by = [ask(robot.daemon, "status")["link"]["tx"]["accepted"] for robot in (one, two)]
    assert sent_by == [1, 1]
    for robot in (one, two):
        assert sorted(robot.node.got_raw(topic="/tf")) == sorted(sent.values())
        wait_for(lambda robot=robot: robot.node.count(topic="/diagnostics") > 0, WAIT_S)
    _, ((level, name, words, robot_name, values),) = one.node.last(topic="/diagnostics")
    assert (name, robot_name) == ("sdrlinkd: link of robot 1", "robot_1")
    assert (level, words) == ([0], "OK, in the clear")
    assert "robot 2 SNR (dB)" in [key for key, _ in values]


def test_merging_at_run_time_brings_what_was_latched_before(start_daemon, start, hub):
    one = Robot(start, start_daemon(config(hub, 1))).bridged()
    two = Robot(start, start_daemon(config(hub, 2))).bridged()
    one.node.pub(topic="/tf_static", type=CARRIER, latched=True)
    one.node.raw(topic="/tf_static", octets=transforms("r1/scan"))
    two.node.sub(topic="/robot_1/tf_static", type=CARRIER, latched=True)
    wait_for(lambda: two.node.count(topic="/robot_1/tf_static") == 1, WAIT_S)
    two.node.sub(topic="/tf_static", type=CARRIER, latched=True)
    # The robot has static transforms of its own.
    two.node.pub(topic="/tf_static", type=CARRIER, latched=True)
    two.node.raw(topic="/tf_static", octets=transforms("r2/scan"))
    assert two.node.set(node="sdrlink_bridge", name="tf.merge", value=True)[0]
    wait_for(lambda: two.node.count(topic="/tf_static") == 2, WAIT_S)
    # A demand that comes later finds the robot's own transforms only.
    with Subscriber("/rx_robot_2/tf_static", directory=one.daemon.directory) as heard:
        assert heard.receive(WAIT_S).payload.startswith(bytes.fromhex(transforms("r2/scan")))
        assert heard.receive(2.0) is None


def test_names_that_clash_and_bad_directories_end_nothing_else(start_daemon, start, hub):
    one = start_daemon(config(hub, 1))
    allow = ("-p", 'services.allow:=["/set"]')
    two = Robot(start, start_daemon(config(hub, 2)), *allow).bridged().watched()
    two.node.serve(name="/set")
    two.node.pub(topic="/odom", type=ODOM[1])
    latched = {"durability": "transient_local", "depth": 1}
    # The bridge publishes this name itself, as another type.
    ask(one, "declare", name="/robot_2/diagnostics", type=TEXT)
    ask(one, "declare", name="/_sdrlink/services", type=TEXT, **latched)
    ask(one, "declare", name="/robot_2/_sdrlink/calls", type="sdrlink_ros/msg/Call")
    offered = [
        ["/x", TEXT, ""], ["/a b", "std_srvs/srv/SetBool", ""], ["/y", "this/srv/Set", ""],
        ["/set", "std_srvs/srv/SetBool", ""], ["/z", "no_such_msgs/srv/Set", ""],
    ]  # fmt: skip
    with (
        Publisher(one.directory) as out,
        Subscriber("/rx_robot_2/robot_1/_sdrlink/calls", directory=one.directory) as heard,
    ):
        text = json.dumps(offered).encode() + b"\0"
        out.send("/_sdrlink/services", b"\0\1\0\0" + struct.pack("<I", len(text)) + text)
        wait_for(lambda: two.node.is_served(name="/robot_1/set"), WAIT_S)
        two.bridge.says("robot 1, std_msgs/msg/String: ")
        two.bridge.says("no_such_msgs/srv/Set: this type is not installed here")
        with Subscriber("/rx_robot_2/_sdrlink/services", directory=one.directory) as offers:
            while b"/set" not in offers.receive(WAIT_S).payload:
                pass
        for octets in (b"\0\1\0\0", b"\0\1\0\0" + bytes(60), b"\0\1\0\0\1"):
            out.send("/robot_2/_sdrlink/calls", octets)
        answers = {}
        requests = {1: ("/set", b""), 2: ("/none", b"x"), 3: ("/set", b"\0\1\0\0\1")}
        deadline = time.monotonic() + WAIT_S
        while len(answers) < 3 and time.monotonic() < deadline:
            for number, (name, body) in requests.items():
                packet = Packet(Kind.REQUEST, 9, number, name, body=body)
                out.send("/robot_2/_sdrlink/calls", packet.build())
            while (message := heard.receive(1.0)) is not None:
                packet = Packet.parse(message.payload)
                answers[packet.number] = packet.status
        assert answers == {1: Status.OTHER_TYPE, 2: Status.NO_SERVER, 3: Status.OK}
        assert two.node.n_served() == 1
    with Subscriber("/rx_robot_2/odom", directory=one.directory):
        matched(two, "/odom")


def test_bridges_that_see_each_other_refuse_and_name_both(start_daemon, start, hub):
    one, two = (start_daemon(config(hub, robot)) for robot in (1, 2))
    domain = new_domain()
    first = start(Bridge, domain, one.directory)
    first.says("bridge of robot 1")
    again = start(Bridge, new_domain(), one.directory)
    again.says("another bridge already serves the daemon in")
    assert again.wait(20) == 2
    second = start(Bridge, domain, two.directory)
    for bridge, robots in ((first, "1 and 2"), (second, "2 and 1")):
        bridge.says(f"refused: the bridges of robots {robots} see each other over DDS")
        bridge.says("ROS_AUTOMATIC_DISCOVERY_RANGE=LOCALHOST")
    node = start(Agent, domain, "node")
    node.pub(topic="/odom", type=ODOM[1])
    second.end()
    first.says("topics are sent again")
    with Subscriber("/rx_robot_1/*", directory=two.directory):
        wait_for(lambda: node.matched(topic="/odom") == 1, WAIT_S)


def test_without_rclpy_or_client_it_says_what_to_run(ros):
    for path, says in ((python(), "pip install ./etc/client"), (sys.executable, "setup.bash")):
        variables = environment(1, PYTHONPATH=BRIDGE)
        done = subprocess.run(
            [path, "-m", "sdrlink_ros"],
            capture_output=True, text=True, check=False, env=variables, cwd="/",
        )  # fmt: skip
        if "sdrlinkd.client" not in done.stderr and path == sys.executable:
            assert "no rclpy" in done.stderr
        assert done.returncode == 2
        assert says in done.stderr
        assert "Traceback" not in done.stderr
