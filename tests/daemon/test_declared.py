"""Topics that producers declare at real daemons, and messages too large for 255 fragments."""

import struct
import time
from random import Random

import pytest

from sdrlinkd.adapters import empty, to_cdr
from sdrlinkd.adapters.testing import ros2_types
from sdrlinkd.client import MessageRefusedError, Publisher, RefusedError, Subscriber
from tests.backends.hubs import serving
from tests.daemon.ether import AIR
from tests.waiting import wait_for

CDR = b"\0\1\0\0"
NO_REGISTRY = 'registry = ""\n'
TRANSFORM = to_cdr(
    ros2_types().types["tf2_msgs/msg/TFMessage"]([empty("geometry_msgs/msg/TransformStamped")]),
    "tf2_msgs/msg/TFMessage",
)
HASH = "RIHS01_" + "ab" * 32


def on_ether(hub, robot):
    return (
        f'{NO_REGISTRY}namespace = "robot_{robot}"\nbackend = "ether"\n'
        f'[ether]\ndir = "{hub}"\n[modem]\nrate_hz = 1e6\n[access]\nnodes = [1, 2]\n'
    )


def declare(daemon, name, type_="std_msgs/msg/String", **more):
    with daemon.control() as control:
        return control.ask("declare", {"name": name, "type": type_, **more})


def ask(daemon, verb, **arguments):
    with daemon.control() as control:
        return control.ask(verb, arguments)


def test_a_topic_is_declared_and_used_without_a_registry(start_daemon):
    daemon = start_daemon(NO_REGISTRY)
    with Publisher(daemon.directory) as out:
        with pytest.raises(MessageRefusedError, match="allowed: none"):
            out.send("/robot_1/battery", CDR)
        told = declare(daemon, "/robot_1/battery", hash=HASH, reliability="best_effort")
        assert (told["name"], told["robot"], told["depth"]) == ("battery", 1, 5)
        assert told["lifespan_s"] == 0.5
        with Subscriber("/rx_robot_1/battery", directory=daemon.directory) as heard:
            out.send("/robot_1/battery", CDR + b"full", type="std_msgs/msg/String")
            message = heard.receive(20)
        assert (message.payload, message.type) == (CDR + b"full", "std_msgs/msg/String")
        with pytest.raises(MessageRefusedError, match="allowed: std_msgs/msg/String"):
            out.send("/robot_1/battery", CDR, type="std_msgs/msg/Int8")
    (sent,) = daemon.snapshot().link.topics
    assert (sent.name, sent.subscribed, sent.sent) == ("/robot_1/battery", True, 1)
    (heard,) = ask(daemon, "declared")
    assert (heard["robot"], heard["name"], heard["topic"]) == (1, "battery", "/rx_robot_1/battery")
    assert heard["hash"] == "ab" * 8
    assert ask(daemon, "check")["problems"] == []


@pytest.mark.parametrize(
    ("qos", "depth", "lifespan_s", "words"),
    [
        ({"reliability": "best_effort"}, 5, 0.5, "depth 5, lifespan 500 ms"),
        ({"reliability": "best_effort", "depth": 40}, 40, 0.5, "depth 40, lifespan 500 ms"),
        ({"reliability": "reliable"}, 100, 5.0, "depth 100, lifespan 5 s"),
        ({}, 100, 5.0, "the producer's offer: reliable"),
        ({"durability": "transient_local", "depth": 3}, 3, None, "last 3 messages kept"),
    ],
)
def test_the_policy_follows_the_offer(start_daemon, qos, depth, lifespan_s, words):
    daemon = start_daemon(NO_REGISTRY)
    told = declare(daemon, "/robot_1/a", **qos)
    assert (told["depth"], told["lifespan_s"]) == (depth, lifespan_s)
    assert words in ask(daemon, "why", topic="/robot_1/a")["why"][0]


def test_what_is_configured_or_set_wins(start_daemon):
    daemon = start_daemon(f"{NO_REGISTRY}[topic.a]\nlifespan_s = 2.0\npriority = 9\n")
    told = declare(daemon, "/robot_1/a")
    assert (told["depth"], told["lifespan_s"]) == (100, 2.0)
    ask(daemon, "set", topic="/robot_1/a", depth=4)
    assert declare(daemon, "/robot_1/a")["depth"] == 4
    why = ask(daemon, "why", topic="/robot_1/a")["why"][0]
    assert "priority 9" in why
    assert "set while running: depth" in why
    ask(daemon, "reload")
    assert declare(daemon, "/robot_1/a")["depth"] == 100


def test_a_file_can_ignore_the_offer(start_daemon):
    daemon = start_daemon(f"{NO_REGISTRY}[topic.a]\noffer = false\n")
    told = declare(daemon, "/robot_1/a", durability="transient_local")
    assert (told["durability"], told["depth"], told["lifespan_s"]) == ("volatile", 0, None)


def test_a_registrys_topic_can_be_offered_and_a_new_one_cannot(start_daemon):
    daemon = start_daemon("[topic]\n")
    told = declare(daemon, "/robot_1/odom", "nav_msgs/msg/Odometry", reliability="best_effort")
    assert (told["number"], told["depth"]) == (1, 1)
    with pytest.raises(RefusedError, match="auto = true"):
        declare(daemon, "/robot_1/battery")
    with pytest.raises(RefusedError, match="it is declared as nav_msgs/msg/Odometry"):
        declare(daemon, "/robot_1/odom")


def test_a_name_on_the_air_belongs_to_one_bus_topic(start_daemon):
    daemon = start_daemon(NO_REGISTRY)
    declare(daemon, "/robot_1/odom")
    with pytest.raises(RefusedError, match="on the air it has the name of /robot_1/odom"):
        declare(daemon, "/odom")
    assert len(daemon.snapshot().link.topics) == 1


def test_several_producers_of_a_topic(start_daemon):
    """The stronger offer of each holds: a volatile one does not end what another latches."""
    daemon = start_daemon(NO_REGISTRY)
    declare(daemon, "/tf_static", durability="transient_local", depth=2)
    told = declare(daemon, "/tf_static", reliability="best_effort")
    assert (told["durability"], told["depth"]) == ("transient_local", 2)


def test_once_its_producers_have_ended_another_type_may_have_the_name(start_daemon):
    daemon = start_daemon(NO_REGISTRY)
    first = declare(daemon, "/robot_1/chg")
    with pytest.raises(RefusedError, match="in use; end that"):
        ask(daemon, "declare", name="/robot_1/chg", type="std_msgs/msg/Int32")
    with pytest.raises(RefusedError, match="got type std_msgs/msg/Int8; it is std_msgs"):
        ask(daemon, "undeclare", name="/robot_1/chg", type="std_msgs/msg/Int8")
    ask(daemon, "undeclare", name="/robot_1/chg")
    with Subscriber("/rx_robot_1/chg", directory=daemon.directory) as heard:
        told = ask(daemon, "declare", name="/robot_1/chg", type="std_msgs/msg/Int32")
        assert (told["type"], told["number"] != first["number"]) == ("std_msgs/msg/Int32", True)
        with Publisher(daemon.directory) as out:
            out.send("/robot_1/chg", b"\0\1\0\0\7\0\0\0")
        assert heard.receive(20).type == "std_msgs/msg/Int32"
    # A program that goes on to use a name keeps it.
    ask(daemon, "undeclare", name="/robot_1/chg")
    with Publisher(daemon.directory) as out:
        out.send("/robot_1/chg", b"\0\1\0\0\7\0\0\0")
        out.flush(10)
    with pytest.raises(RefusedError, match="in use; end that"):
        declare(daemon, "/robot_1/chg")
    with pytest.raises(RefusedError, match="allowed: a declared topic"):
        ask(daemon, "undeclare", name="/robot_1/none")


def test_consumers_get_no_more_than_they_ask_for(start_daemon, tmp_path_factory):
    """And every message again, once nobody asks any more, or somebody wants them all."""
    hub = tmp_path_factory.mktemp("hub")
    with serving(hub, **AIR):
        one, two = (start_daemon(on_ether(hub, robot)) for robot in (1, 2))
        declare(one, "/robot_1/a")
        with (
            Subscriber("/rx_robot_1/a", directory=two.directory, depth=0) as heard,
            Publisher(one.directory) as out,
        ):
            wait_for(lambda: ask(one, "demand")["wanted"] == {"/robot_1/a": [2]}, 60)

            def throttled():
                (topic,) = one.snapshot().link.topics
                return topic.dropped.get("tx_throttled", 0)

            def send(n):
                before = throttled()
                for _ in range(n):
                    out.send("/robot_1/a", b"\0\1\0\0\1\0\0\0\0")
                    time.sleep(0.01)
                out.flush(20)
                return throttled() - before

            assert send(20) == 0
            told = ask(two, "rate", topic="/rx_robot_1/a", hz=2)
            assert told == {"topic": "/rx_robot_1/a", "hz": 2, "lease_s": 5.0}
            wait_for(lambda: send(10) >= 9, 60)
            words = " ".join(ask(one, "why", topic="a")["why"])
            assert "throttled to 2 Hz, which the robots that want it ask for" in words
            # The way back: the lease ends.
            wait_for(lambda: send(10) == 0, 60)
            assert heard.receive(20) is not None
        assert ask(two, "rate", topic="/rx_robot_1/a", hz=0)["hz"] == 0, "all"
        for wrong in (-1, 1e-320, 0.01, 1e9, "two", None):
            with pytest.raises(RefusedError, match="hz: got"):
                ask(two, "rate", topic="/rx_robot_1/a", hz=wrong)


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        ({"name": "/robot_1/a"}, "missing required field `type`"),
        ({"name": "/no name", "type": "p/T"}, "name: got 'no name'"),
        ({"name": "a", "type": "p/T"}, "allowed: a name with leading slash"),
        ({"name": "/a", "type": "p/srv/T"}, "type: got 'p/srv/T'"),
        ({"name": "/a", "type": "p/T", "hash": "md5"}, "hash: got 'md5'"),
        ({"name": "/a", "type": "p/T", "reliability": "maybe"}, "reliability"),
        ({"name": "/a", "type": "p/T", "depth": 10_001}, "depth"),
    ],
)
def test_bad_declarations_are_refused_in_words(start_daemon, arguments, says):
    daemon = start_daemon(NO_REGISTRY)
    with pytest.raises(RefusedError, match=says):
        ask(daemon, "declare", **arguments)
    assert daemon.snapshot().link.topics == []


def test_a_large_message_arrives_equal(start_daemon):
    """Two megabytes, in PDUs of the default size."""
    daemon = start_daemon(NO_REGISTRY)
    declare(daemon, "/robot_1/points", "sensor_msgs/msg/PointCloud2")
    cloud = CDR + Random(2).randbytes(2_000_000)
    with (
        Subscriber("/rx_robot_1/points", directory=daemon.directory) as heard,
        Publisher(daemon.directory) as out,
    ):
        out.send("/robot_1/points", cloud, receipt=True, dst=1)
        assert heard.receive(60).payload == cloud
        assert out.receipt(20).fate == "delivered"
        with pytest.raises(MessageRefusedError, match=r"at most 8388608 B with bus\.max"):
            out.send("/robot_1/points", bytes((8 << 20) + 1))
    assert ask(daemon, "check")["problems"] == []


def test_late_robots_and_late_consumers_get_what_each_producer_sent_last(
    start_daemon, tmp_path_factory
):
    hub = tmp_path_factory.mktemp("hub")
    with serving(hub, **AIR):
        one = start_daemon(on_ether(hub, 1))
        qos = {"durability": "transient_local", "depth": 1}
        declare(one, "/tf_static", "tf2_msgs/msg/TFMessage", **qos)
        with Publisher(one.directory) as out:
            for number, key in enumerate(("lidar", "camera", "gps", "lidar")):
                out.send("/tf_static", CDR + bytes([number]) + key.encode(), key=key)
        two = start_daemon(on_ether(hub, 2))
        # Once it has heard the other, the first robot sends the three again.
        wait_for(lambda: one.snapshot().link.topics[0].reoffered == 3, 60)
        wait_for(lambda: one.snapshot().link.tx.queued == one.snapshot().link.tx.in_flight == 0, 60)
        wait_for(lambda: [each.delivered >= 3 for each in two.snapshot().link.received] == [True])
        with Subscriber("/rx_robot_1/tf_static", directory=two.directory) as heard:
            got = [heard.receive(20) for _ in range(3)]
        assert [each.payload[5:] for each in got] == [b"camera", b"gps", b"lidar"]
        assert all(each.is_late for each in got)
        (why,) = ask(two, "why", topic="/rx_robot_1/tf_static")["why"]
        assert "received from robot 1" in why
        for daemon in (one, two):
            assert ask(daemon, "check")["problems"] == []


def test_a_robot_knows_which_of_its_topics_somebody_subscribes_to(start_daemon, tmp_path_factory):
    hub = tmp_path_factory.mktemp("hub")
    with serving(hub, **AIR):
        one, two = (start_daemon(on_ether(hub, robot)) for robot in (1, 2))
        for name in ("/odom", "/scan", "/imu"):
            declare(one, name)
        with Subscriber("/rx_robot_1/scan", directory=two.directory) as heard:
            wait_for(lambda: ask(one, "demand")["wanted"] == {"/scan": [2]}, 60)
            heard.subscribe("/rx_robot_1/i*")
            wait_for(lambda: ask(one, "demand")["wanted"] == {"/imu": [2], "/scan": [2]}, 60)
            version = ask(two, "demand")["version"]
            assert version >= 3
            declare(one, "/battery")
            wait_for(lambda: ask(two, "demand")["version"] > version, 60)
        wait_for(lambda: not ask(one, "demand")["wanted"], 60)


def test_the_dead_man_of_a_command_stops_the_robot_in_the_commands_type(
    start_daemon, tmp_path_factory
):
    hub = tmp_path_factory.mktemp("hub")
    with serving(hub, **AIR):
        # A busy machine takes longer than the 0.3 s after which a command is too old.
        policy = "[topic.cmd_vel]\nlifespan_s = inf\n"
        one = start_daemon(on_ether(hub, 1) + policy)
        stop = "deadman_s = 0.5\nstop = { linear = { x = -0.5 } }\n"
        two = start_daemon(on_ether(hub, 2) + policy + stop)
        declare(one, "/robot_2/cmd_vel", "geometry_msgs/msg/Twist")
        with (
            Subscriber("/rx_robot_1/robot_2/cmd_vel", directory=two.directory) as heard,
            Publisher(one.directory) as out,
        ):
            # What is sent before the other robot listens, it does not hear.
            wait_for(lambda: ask(one, "demand")["wanted"] == {"/robot_2/cmd_vel": [2]}, 60)
            out.send("/robot_2/cmd_vel", CDR + bytes(48), dst=2)
            first, stop = heard.receive(60), heard.receive(60)
        assert (first.payload, first.is_stop) == (CDR + bytes(48), False)
        assert (stop.payload[:12], stop.is_stop) == (CDR + struct.pack("<d", -0.5), True)
        assert "no stop message" not in two.log()


def test_transforms_are_filtered_on_topics_that_are_declared(start_daemon):
    daemon = start_daemon(f'{NO_REGISTRY}[tf]\ntopics = ["tf"]\ndrop = ["*"]\n')
    with pytest.raises(RefusedError, match=r"tf: got type std_msgs/msg/String; .*TFMessage"):
        declare(daemon, "/tf")
    declare(daemon, "/tf", "tf2_msgs/msg/TFMessage")
    with Publisher(daemon.directory) as out:
        out.send("/tf", TRANSFORM)
    wait_for(lambda: daemon.snapshot().link.tx.dropped == {"tx_filtered": 1})
