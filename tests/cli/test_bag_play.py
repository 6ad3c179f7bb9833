"""`bag play`: recordings of others' programs, with their QoS, their pauses and their faults."""

import time

import pytest
from mcap.writer import Writer
from rosbags.interfaces import (
    Qos,
    QosDurability,
    QosHistory,
    QosLiveliness,
    QosReliability,
    QosTime,
)
from rosbags.rosbag2 import StoragePlugin
from rosbags.rosbag2 import Writer as Writer2
from rosbags.typesys import Stores, get_typestore

from sdrlinkd.adapters import empty, open_bag, to_cdr
from sdrlinkd.client import Subscriber
from sdrlinkd.errors import BagError
from tests.adapters.recordings import ros2_bag

TEXT = "std_msgs/msg/String"
T0 = 1_700_000_000_000_000_000
S = 1_000_000_000
FOREVER = QosTime(9223372036, 854775807)


def text(words):
    message = empty(TEXT)
    message.data = words
    return to_cdr(message, TEXT)


def offered(reliability, durability, depth):
    return Qos(
        QosHistory.KEEP_LAST, depth, reliability, durability, FOREVER, FOREVER,
        QosLiveliness.AUTOMATIC, FOREVER, avoid_ros_namespace_conventions=False,
    )  # fmt: skip


LATCHED = offered(QosReliability.RELIABLE, QosDurability.TRANSIENT_LOCAL, 1)
SENSOR = offered(QosReliability.BEST_EFFORT, QosDurability.VOLATILE, 5)


def mcap(path, encoding, schema, data, profile=""):
    """An MCAP file with three messages on /say, of an encoding."""
    with path.open("wb") as stream:
        writer = Writer(stream)
        writer.start(profile, "a test")
        number = writer.register_schema("std_msgs/String", schema, b"string data")
        channel = writer.register_channel("/say", encoding, number)
        for i in range(3):
            writer.add_message(channel, T0 + i * S // 10, data, T0)
        writer.finish()
    return path


def played(ctl, daemon, bag, *options):
    return ctl("bag", "play", bag, "--rate", "50", *options, "--runtime-dir", daemon.directory)


def test_topics_are_declared_with_the_qos_of_the_recording(start_daemon, ctl, tmp_path):
    types = get_typestore(Stores.ROS2_HUMBLE)
    with Writer2(tmp_path / "bag", version=9) as writer:
        for name, qos in (("/legend", [LATCHED, LATCHED]), ("/noise", [SENSOR]), ("/say", [])):
            connection = writer.add_connection(
                name, TEXT, typestore=types, offered_qos_profiles=qos
            )
            for i in range(3):
                writer.write(connection, T0 + i * S, text(f"{name} {i}"))
    daemon = start_daemon('registry = ""\n')
    # The map comes before the start that is given, and is played all the same.
    with Subscriber("/rx_robot_1/legend", directory=daemon.directory) as heard:
        code, out, err = played(ctl, daemon, tmp_path / "bag", "--start", "1.5", "--rate", "2")
        assert (code, out) == (0, f"played 5 messages of {tmp_path / 'bag'}\n"), err
        while (message := heard.receive(20)) is not None and message.payload != text("/legend 2"):
            pass
        assert message is not None
    accepted = {each.name: each.accepted for each in daemon.snapshot().link.topics}
    assert accepted == {"/robot_1/legend": 3, "/robot_1/noise": 1, "/robot_1/say": 1}
    with daemon.control() as control:
        policies = {
            name: control.ask("policy", {"topic": f"/robot_1/{name}"})
            for name in ("legend", "noise", "say")
        }
    assert [each["durability"] for each in policies.values()] == [
        "transient_local", "volatile", "volatile",
    ]  # fmt: skip
    assert [each["depth"] for each in policies.values()] == [2, 5, 100]


def test_a_pause_is_shortened_and_told(start_daemon, ctl, tmp_path):
    """A clock that began at 0, as with use_sim_time: the next message is 54 years later."""
    times = [0, T0, T0 + S, T0 + 1000 * S]
    bag = ros2_bag(
        tmp_path / "bag", StoragePlugin.MCAP, [("/say", TEXT, at, text(str(at))) for at in times]
    )
    daemon = start_daemon('registry = ""\n')
    began = time.monotonic()
    code, out, err = played(ctl, daemon, bag)
    assert (code, "played 4 messages" in out) == (0, True)
    assert time.monotonic() - began < 60
    assert "2 pauses of up to" in err
    assert "shortened: --max-gap" in err
    code, out, _ = ctl("bag", "info", bag)
    assert "longest pause" in out


def test_ros1_messages_in_mcap_are_converted(start_daemon, ctl, tmp_path):
    bag = mcap(tmp_path / "one.mcap", "ros1", "ros1msg", b"\x05\0\0\0hello", profile="ros1")
    daemon = start_daemon('registry = ""\n')
    with Subscriber("/rx_robot_1/say", directory=daemon.directory) as heard:
        code, out, err = played(ctl, daemon, bag)
        assert (code, "damaged" in err, "played 3 messages" in out) == (0, False, True), err
        assert heard.receive(10).payload == text("hello")
    opened = open_bag(bag)
    assert [(each.name, each.type) for each in opened.topics()] == [("/say", TEXT)]
    opened.close()


@pytest.mark.parametrize("encoding", ["protobuf", "json", "cbor"])
def test_other_encodings_are_refused_by_name(tmp_path, encoding):
    bag = mcap(tmp_path / "other.mcap", encoding, encoding, b"{}")
    with pytest.raises(BagError, match=rf"/say \({encoding}\); allowed: the message encodings"):
        open_bag(bag)
    # Neither are they taken for ROS messages where the file is cut.
    bag.write_bytes(bag.read_bytes()[:-40])
    with pytest.raises(BagError, match="nothing in it can be recovered"):
        open_bag(bag)


def test_what_was_heard_is_played_as_it_was_sent(start_daemon, ctl, tmp_path):
    messages = [
        (name, TEXT, T0 + i, text(str(i)))
        for i in range(3)
        for name in ("/rx_robot_2/say", "/rx_robot_2/tell", "/rx_robot_3/tell", "/link/receptions")
    ]
    bag = ros2_bag(tmp_path / "bag", StoragePlugin.MCAP, messages)
    daemon = start_daemon('registry = ""\n')
    code, out, err = played(ctl, daemon, bag)
    assert (code, "played 3 messages" in out) == (0, True)
    assert "/rx_robot_2/tell (heard from robots 2 and 3; choose one" in err
    assert {topic.name for topic in daemon.snapshot().link.topics} == {"/robot_1/say"}
    code, out, _ = played(ctl, daemon, bag, "--topics", "/rx_robot_3/*")
    assert (code, "played 3 messages" in out) == (0, True)
    assert "/robot_1/tell" in {topic.name for topic in daemon.snapshot().link.topics}


def test_what_is_refused_is_summed_and_makes_the_exit_code_1(start_daemon, ctl, tmp_path):
    size = 8 << 20
    large = b"\0\1\0\0" + size.to_bytes(4, "little") + bytes(size)
    messages = [
        ("/say", TEXT, T0, text("a")), ("/say", TEXT, T0 + 1, large),
        ("/say", TEXT, T0 + 2, large),
    ]  # fmt: skip
    bag = ros2_bag(tmp_path / "bag", StoragePlugin.MCAP, messages)
    daemon = start_daemon('registry = ""\n')
    code, out, err = played(ctl, daemon, bag)
    assert (code, out) == (1, f"played 1 messages of {bag}\n"), err
    assert "not sent: 2 messages of /robot_1/say (too large" in err


def test_of_two_types_on_one_topic_the_first_is_played(start_daemon, ctl, tmp_path):
    messages = [
        ("/say", kind, T0 + i, text("a")) for i in range(4) for kind in (TEXT, "std_msgs/msg/Int32")
    ]
    types = get_typestore(Stores.ROS2_HUMBLE)
    with Writer2(tmp_path / "bag", version=9) as writer:
        connections = {
            kind: writer.add_connection("/say", kind, typestore=types)
            for kind in (TEXT, "std_msgs/msg/Int32")
        }
        for _, kind, at, cdr in messages:
            writer.write(connections[kind], at, cdr)
    daemon = start_daemon('registry = ""\n')
    code, out, err = played(ctl, daemon, tmp_path / "bag")
    assert (code, "played 4 messages" in out) == (0, True), err
    assert err.count("left out: /say") == 1
