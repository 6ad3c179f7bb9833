"""`pub` and `echo`: names, sizes, and messages that cannot be read."""

import contextlib

import pytest

from sdrlinkd.adapters import empty, to_cdr
from sdrlinkd.client import Publisher
from tests.programs import sdrlinkctl
from tests.waiting import again_and_again, wait_for

ODOM = "nav_msgs/msg/Odometry"


@pytest.fixture
def echo():
    """`sdrlinkctl echo` in a process of its own, once it has subscribed."""
    with contextlib.ExitStack() as stack:

        def start(daemon, *arguments):
            process = sdrlinkctl("echo", *arguments, "--runtime-dir", daemon.directory)
            return stack.enter_context(process)

        yield start


@pytest.mark.slow
def test_a_bad_message_is_shown_as_bad_and_the_next_one_as_it_is(daemon, echo):
    watch = echo(daemon, "/rx_robot_1/*", "-n", "4", "--timeout", "60")
    bad, good = bytes([0, 1, 0, 0]) + b"hello", to_cdr(empty(ODOM), ODOM)
    with Publisher(daemon.directory) as out:
        again_and_again(
            lambda: [out.send("/robot_1/odom", each) for each in (bad, good)],
            while_=lambda: watch.is_running,
        )
    shown = watch.out()
    assert (watch.code, watch.err()) == (0, "")
    assert shown.count("(bad message of 9 bytes, not valid CDR of nav_msgs/msg/Odometry: ") == 2
    assert shown.count("; --raw shows them)\n---") == 2
    assert shown.count("child_frame_id: ''") == 2


def test_a_topic_is_declared_and_sent(start_daemon, ctl):
    daemon = start_daemon('registry = ""\n')
    dir_ = ("--runtime-dir", daemon.directory)
    code, out, err = ctl("pub", "chatter", "{data: hi}", "--declare", "std_msgs/String", *dir_)
    assert (code, err) == (0, "")
    assert "on /robot_1/chatter (std_msgs/msg/String)" in out
    assert ctl("pub", "/robot_1/chatter", "{data: ho}", *dir_)[0] == 0
    code, _, err = ctl("pub", "chatter", "--declare", "std_msgs/Int8", *dir_)
    assert (code, "it is declared as std_msgs/msg/String" in err) == (2, True)


def test_ones_own_topic_is_not_what_one_hears(start_daemon, ctl):
    daemon = start_daemon("[link]\nbeacon_s = 0\n")
    nobody = "(none heard so far)"
    hear = "robot N's appears as /rx_robot_N/odom"
    dir_ = ("--runtime-dir", daemon.directory)
    for name in ("/robot_1/odom", "odom", "/odom"):
        assert ctl("echo", name, *dir_) == (
            2, "",
            f"sdrlinkctl: topic: got {name}, which this robot sends; {hear} {nobody}\n",
        )  # fmt: skip
    with Publisher(daemon.directory) as out:
        out.send("/robot_1/odom", bytes([0, 1, 0, 0]))
    wait_for(lambda: daemon.snapshot().link.neighbors)
    code, _, err = ctl("echo", "odom", *dir_)
    assert (code, "(heard so far: 1)" in err) == (2, True)


def test_a_name_that_others_have_too_may_be_heard(start_daemon, ctl):
    daemon = start_daemon('rx_format = "/robot_{src_id}"\n')
    code, _, err = ctl(
        "echo", "/robot_1/odom", "--timeout", "0.1", "--runtime-dir", daemon.directory
    )
    assert (code, "0 messages before --timeout" in err) == (2, True)


@pytest.mark.parametrize("lifespan", ["300ms", "0.3", "2s", "inf"])
def test_pub_takes_names_and_times_as_set_and_why_do(start_daemon, ctl, lifespan):
    daemon = start_daemon()
    dir_ = ("--runtime-dir", daemon.directory)
    for name in ("cmd_vel", "/cmd_vel", "/robot_1/cmd_vel"):
        code, out, err = ctl("pub", name, "{}", "--lifespan", lifespan, *dir_)
        assert (code, err) == (0, "")
        assert out == "published 1 × 52 B on /robot_1/cmd_vel (geometry_msgs/msg/Twist)\n"
    assert daemon.snapshot().link.tx.accepted == 3


def test_pub_refuses_in_the_clients_words(start_daemon, ctl, tmp_path):
    daemon = start_daemon("[topic.cmd_vel]\nmax_bytes = 20\n")
    pdu_size = "link.pdu_size = 1024 (with 2047: 518670 B)"
    large = tmp_path / "large"
    large.write_bytes(bytes(3_000_000))
    names = ", ".join(f"/robot_1/{n}" for n in ("scan", "odom", "imu", "cmd_vel", "map", "clock"))
    for arguments, says in (
        (("cmd_vl",), f'topic: got "cmd_vl"; did you mean /robot_1/cmd_vel? allowed: {names}'),
        (("cmd_vel",),
         "/robot_1/cmd_vel: too large: 52 B; at most 20 B with topic.cmd_vel.max_bytes = 20"),
        (("map", "--cdr", large),
         f"/robot_1/map: too large: 3000000 B; at most 257805 B with {pdu_size}"),
        (("odom", "--lifespan", "0"), "--lifespan: got 0; allowed: more than 0"),
        (("odom", "--lifespan", "soon"),
         "--lifespan: got soon; allowed: a time such as 0.1, 100ms, 2s or inf"),
        (("odom", "--qos", "fast"),
         '--qos: got "fast"; allowed: bulk, default, latency, urgent'),
    ):  # fmt: skip
        code, out, err = ctl("pub", *arguments, "--runtime-dir", daemon.directory)
        assert (code, out, err) == (2, "", f"sdrlinkctl: {says}\n")


def test_a_bag_with_messages_that_are_too_large_is_played_without_them(start_daemon, ctl, tmp_path):
    from rosbags.rosbag2 import Writer
    from rosbags.typesys import Stores, get_typestore

    daemon = start_daemon("[topic.odom]\nmax_bytes = 800\n")
    types = get_typestore(Stores.ROS2_HUMBLE)
    odom = empty(ODOM)
    with Writer(tmp_path / "bag", version=9) as writer:
        connection = writer.add_connection("/odom", ODOM, typestore=types)
        for i in range(6):
            odom.child_frame_id = "x" * (500 * (i % 2))
            writer.write(connection, i + 1, to_cdr(odom, ODOM))
    code, out, err = ctl("bag", "play", tmp_path / "bag", "--runtime-dir", daemon.directory)
    assert (code, "played 3 messages" in out) == (1, True)
    assert "not sent: 3 messages of /robot_1/odom (too large: " in " ".join(err.split())
