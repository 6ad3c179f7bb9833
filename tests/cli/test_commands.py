"""sdrlinkctl with real daemons, and its response to bad input."""

import contextlib
import json
import re
import signal
import threading
from functools import partial

import msgspec
import pytest
from rosbags.rosbag2 import StoragePlugin

from sdrlinkd.adapters import empty, to_cdr
from sdrlinkd.client import Publisher, Subscriber
from sdrlinkd.reports import Snapshot
from tests.adapters.recordings import robot_bag, ros2_bag
from tests.programs import sdrlinkctl
from tests.sealing.vectors import VECTORS
from tests.waiting import again_and_again, wait_for
from tests.wire.vectors import BY_NAME, DOCUMENTED

ODOM = "/robot_1/odom"


def publish(daemon, count=3):
    """Publish odometry."""
    with Publisher(daemon.directory) as out:
        for _ in range(count):
            out.send(ODOM, to_cdr(empty("nav_msgs/msg/Odometry"), "nav_msgs/msg/Odometry"))


@pytest.mark.slow
@pytest.mark.quick
def test_status_for_people_and_programs(start_daemon, ctl):
    daemon = start_daemon()
    publish(daemon)
    wait_for(lambda: daemon.snapshot().link.rx.delivered == 3)
    code, out, _ = ctl("status", "--runtime-dir", daemon.directory)
    assert code == 0
    assert "3 in = 3 sent + 0 queued" in out
    assert "/rx_robot_1/odom" in out
    code, out, _ = ctl("status", "--json", "--runtime-dir", daemon.directory)
    snapshot = msgspec.json.decode(out, type=Snapshot)
    assert snapshot.link.tx.sent == 3


def test_topics_check_reload(start_daemon, ctl):
    daemon = start_daemon()
    publish(daemon)
    wait_for(lambda: daemon.snapshot().link.rx.delivered == 3)
    code, out, _ = ctl("topics", "--runtime-dir", daemon.directory)
    assert code == 0
    assert "/robot_1/odom" in out
    assert "/rx_robot_1/odom" in out
    for name in ("odom", "/robot_1/odom", "/rx_robot_1/odom"):
        code, out, _ = ctl("why", name, "--runtime-dir", daemon.directory)
        assert code == 0
        assert "received from robot 1: 3 messages as /rx_robot_1/odom, " in out
    code, out, _ = ctl("check", "--runtime-dir", daemon.directory)
    assert code == 0
    assert "the ledger adds up" in out
    code, out, _ = ctl("check", "--json", "--runtime-dir", daemon.directory)
    assert json.loads(out)["problems"] == []
    code, out, _ = ctl("reload", "--runtime-dir", daemon.directory)
    assert (code, "reloaded" in out) == (0, True)


@pytest.mark.slow
def test_pub_and_echo(daemon, ctl):
    dir_ = ("--runtime-dir", daemon.directory)
    done = threading.Event()

    def repeat():
        while not done.wait(0.05):
            ctl("pub", "/robot_1/cmd_vel", "{linear: {x: 0.5}}", "--qos", "urgent", *dir_)

    thread = threading.Thread(target=repeat)
    with sdrlinkctl("echo", "/rx_robot_1/*", "-n", "1", "--timeout", "20", *dir_) as echo:
        thread.start()
        try:
            assert echo.wait(30) == 0
        finally:
            done.set()
            thread.join()
    assert "/rx_robot_1/cmd_vel from robot 1" in echo.out()
    assert "linear: {x: 0.5, y: 0.0, z: 0.0}" in echo.out()


def test_pub_says_what_became_of_each_message(start_daemon, ctl):
    daemon = start_daemon("[link]\nreceipt_s = 0.2\n[topic.cmd_vel]\nperiod_s = 1000\n")
    dir_ = ("--receipt", "--runtime-dir", daemon.directory)
    code, out, _ = ctl("pub", "/robot_1/odom", "{}", "--dst", "1", "-t", "3", "-r", "20", *dir_)
    assert code == 0
    assert re.findall(r"message (\d), robot 1: delivered, \d+\.\d\d ms old", out) == list("123")
    # A lone robot knows of nobody who could answer.
    code, out, err = ctl("pub", "/robot_1/odom", "{}", *dir_)
    assert "message 1, everyone: unknown\n" in out
    assert "lists the robots that are heard" in err
    assert code == 1
    code, out, _ = ctl("pub", "cmd_vel", "{}", "--dst", "7", "-t", "2", "-r", "1000", *dir_)
    assert "message 2, robot 7: dropped (tx_throttled)\n" in out
    assert code == 1


@pytest.mark.slow
def test_pub_refuses_in_words(daemon, ctl):
    dir_ = ("--runtime-dir", daemon.directory)
    for arguments, says in (
        (("/robot_1/nothing",), "allowed: /robot_1/scan"),
        (("/robot_1/cmd_vel", "{linear: {q: 1}}"), "linear.q: no such field; allowed: x, y, z"),
        (("/robot_1/cmd_vel", "{linear: 3}"), "linear: got 3; allowed: a table"),
        (("/robot_1/cmd_vel", "{linear: {x: fast}}"), "linear.x: got 'fast'; allowed: a float64"),
        (("/robot_1/cmd_vel", "[1]"), "allowed: a map"),
        (("/robot_1/cmd_vel", "{"), "not YAML"),
        (("/robot_1/cmd_vel", "{}", "--qos", "fast"), "allowed: bulk, default, latency, urgent"),
        (("/robot_1/cmd_vel", "{}", "--cdr", "/nothing"), "cannot be read"),
    ):
        code, _, err = ctl("pub", *arguments, *dir_)
        assert code == 2, arguments
        assert says in err, arguments
    code, _, _ = ctl("pub", "/robot_1/cmd_vel", "{}", "--priority", "200", *dir_)
    assert code == 2


@pytest.mark.parametrize(
    ("kind", "fields"),
    [
        ("std_msgs/String", "{data: 5}"),
        ("std_msgs/String", "{data: null}"),
        ("std_msgs/UInt8", "{data: 300}"),
        ("std_msgs/UInt8", "{data: 1.5}"),
        ("nav_msgs/Odometry", "{pose: {covariance: [1, 2]}}"),
        ("nav_msgs/Odometry", "{header: {stamp: {sec: 1.5}}}"),
        ("nav_msgs/Path", "{poses: [{pose: 1}]}"),
        ("sensor_msgs/JointState", "{name: left}"),
        ("sensor_msgs/JointState", "{name: [1, 2]}"),
    ],
)
def test_values_that_do_not_fit_are_refused_in_words(start_daemon, ctl, tmp_path, kind, fields):
    registry = tmp_path / "own.csv"
    registry.write_text(f"topic,{kind}\n")
    daemon = start_daemon(f'registry = "{registry}"\n')
    code, _, err = ctl("pub", "/robot_1/topic", fields, "--runtime-dir", daemon.directory)
    assert code == 2, err
    assert err.count("\n") == 1


def test_what_others_send_is_shown_as_it_is(start_daemon, tmp_path):
    registry = tmp_path / "own.csv"
    registry.write_text("say,std_msgs/String\n")
    daemon = start_daemon(f'registry = "{registry}"\n')
    message = empty("std_msgs/msg/String")
    message.data = "[bold]not[/odom] markup"
    with (
        sdrlinkctl("echo", "-n", "1", "--runtime-dir", daemon.directory) as echo,
        Publisher(daemon.directory) as out,
    ):
        say = partial(out.send, "/robot_1/say", to_cdr(message, "std_msgs/msg/String"))
        again_and_again(say, while_=lambda: echo.is_running)
    assert "[bold]not[/odom] markup" in echo.out()


def test_a_bag_with_another_type_is_left_out_by_name(start_daemon, ctl, recorded, tmp_path):
    registry = tmp_path / "own.csv"
    registry.write_text("odom,std_msgs/String\nimu,sensor_msgs/Imu\n")
    daemon = start_daemon(f'registry = "{registry}"\n[topic.imu]\ndepth = 0\n')
    code, out, err = ctl("bag", "play", recorded, "--rate", "50", "--runtime-dir", daemon.directory)
    assert code == 0
    assert "played 100 messages" in out
    assert (
        "/odom (its type is nav_msgs/msg/Odometry; the daemon carries std_msgs/msg/String there)"
        in " ".join(err.split())
    )
    assert daemon.snapshot().link.tx.dropped == {}


def test_a_bag_declares_its_topics_where_the_daemon_has_no_registry(start_daemon, ctl, recorded):
    daemon = start_daemon('registry = ""\n[topic.imu]\ndepth = 0\n')
    code, out, err = ctl("bag", "play", recorded, "--rate", "5", "--runtime-dir", daemon.directory)
    assert (code, err.count("left out")) == (0, 0)
    assert "played 200 messages" in out
    topics = {topic.name: topic for topic in daemon.snapshot().link.topics}
    assert {name: topic.qos for name, topic in topics.items()} == {
        "/robot_1/scan": "latency", "/robot_1/odom": "latency", "/robot_1/imu": "latency",
        "/robot_1/cmd_vel": "latency",
    }  # fmt: skip
    assert (topics["/robot_1/odom"].policy_from, topics["/robot_1/imu"].policy_from) == (
        "type", "file",
    )  # fmt: skip


def test_pdu_watch_ends_with_the_daemon(start_daemon):
    daemon = start_daemon("[link]\nbeacon_s = 0\n")
    with sdrlinkctl("pdu", "watch", "--runtime-dir", daemon.directory) as watch:
        wait_for(lambda: daemon.snapshot().bus.control_requests > 2)
        daemon.stop()
        assert watch.wait(15) == 2
    assert "no sdrlinkd answers" in watch.err()


def test_echo_says_when_nothing_comes(daemon, ctl):
    code, _, err = ctl(
        "echo", "/rx_robot_9/odom", "--timeout", "0.1", "--runtime-dir", daemon.directory
    )
    assert code == 2
    assert "0 messages before --timeout" in err


@pytest.mark.parametrize(
    "arguments",
    [("status",), ("topics",), ("check",), ("reload",), ("echo",), ("pdu", "watch"),
     ("pub", "/robot_1/odom"), ("bag", "play", "BAG")],
)  # fmt: skip
def test_without_a_daemon(ctl, tmp_path, arguments, recorded):
    arguments = [recorded if a == "BAG" else a for a in arguments]
    code, _, err = ctl(*arguments, "--runtime-dir", tmp_path)
    # The exit code of status is its verdict; 2 means wrong usage.
    assert code == (4 if arguments[0] == "status" else 2)
    assert f"no sdrlinkd answers in {tmp_path}" in err


@pytest.fixture
def recorded(tmp_path_factory):
    """A rosbag2 folder with two seconds of the built-in robot."""
    return robot_bag(tmp_path_factory.mktemp("bag") / "robot")


def test_bag_play_and_info(start_daemon, ctl, recorded):
    daemon = start_daemon()
    dir_ = ("--runtime-dir", daemon.directory)
    code, out, _ = ctl("bag", "info", recorded)
    assert code == 0
    (length, _, *lines) = out.splitlines()
    assert length.startswith("2.0 s, 200 messages, ")
    rows = {words[4]: words for words in map(str.split, lines) if len(words) == 6}
    assert rows["/odom"] == ["60", "30.00", "724", "724", "/odom", "nav_msgs/msg/Odometry"]
    with Subscriber(
        ODOM.replace("robot_1", "rx_robot_1"), directory=daemon.directory, depth=0
    ) as heard:
        code, out, _ = ctl("bag", "play", recorded, "--rate", "20", *dir_)
        assert code == 0
        assert "played 200 messages" in out
        assert [heard.receive(5).number for _ in range(60)] == list(range(1, 61))
    code, out, _ = ctl(
        "bag", "play", recorded, "--rate", "20", "--topics", "/imu", "--duration", "1", *dir_
    )
    assert "played 50 messages" in out
    code, out, _ = ctl(
        "bag",
        "play",
        recorded,
        "--rate",
        "20",
        "--topics",
        "/imu",
        "--remap",
        "/imu:=/robot_1/imu",
        *dir_,
    )
    assert "played 100 messages" in out
    for arguments, says in (
        (("--topics", "/none"), "allowed: the bag's topics"),
        (("--remap", "/imu=/x"), "allowed: /from:=/to"),
        (("--topics", "/imu", "--remap", "/imu:=/x"), "carries none of its topics"),
    ):
        code, _, err = ctl("bag", "play", recorded, *arguments, *dir_)
        assert (code, says in err) == (2, True), err


@pytest.mark.slow
def test_a_bag_whose_names_have_no_slash_is_played(daemon, ctl, tmp_path):
    messages = [("odom", "nav_msgs/msg/Odometry", 1_000_000 * i, bytes(724)) for i in range(20)]
    bag = ros2_bag(tmp_path / "bag", StoragePlugin.MCAP, messages)
    for topics in ((), ("--topics", "odom"), ("--remap", "odom:=/robot_1/odom")):
        code, out, _ = ctl("bag", "play", bag, *topics, "--runtime-dir", daemon.directory)
        assert (code, "played 20 messages" in out) == (0, True)


def test_a_truncated_bag_is_played_as_far_as_it_goes(start_daemon, ctl, recorded):
    daemon = start_daemon()
    file = next(recorded.glob("*.db3"))
    file.write_bytes(file.read_bytes()[: file.stat().st_size * 2 // 3])
    code, out, err = ctl("bag", "play", recorded, "--rate", "50", "--runtime-dir", daemon.directory)
    assert code == 2
    assert "played" in out
    assert "damaged" in err
    wait_for(lambda: 0 < daemon.snapshot().link.tx.sent < 200)


def test_pdu_decode_shows_numbers(ctl):
    for name, shown in (("numbered", "number 42"), ("part", "part of a large message, control")):
        code, out, _ = ctl("pdu", "decode", BY_NAME[name].octets.hex())
        assert code == 0
        assert shown in out


def test_pdu_decode_shows_what_all_can_read_of_a_sealed_pdu(ctl):
    octets = VECTORS["v3_limits"]
    code, out, _ = ctl("pdu", "decode", octets.hex())
    assert code == 0
    assert "inside  sealed with key 3, T 33554431.97 s, held 6553.5 ms; not readable here" in out
    code, _, err = ctl("pdu", "decode", octets[:-1].hex() + "00")
    assert (code, "refused as rx_crc" in err) == (2, True)


def test_pdu_decode_shows_the_layout(ctl, tmp_path):
    octets = bytes.fromhex(DOCUMENTED["message_and_stamp"])
    registry = tmp_path / "r.csv"
    registry.write_text("scan,sensor_msgs/LaserScan\nodom,nav_msgs/Odometry\n")
    code, out, _ = ctl("pdu", "decode", octets.hex(" "), "--registry", registry)
    assert code == 0
    for part in (
        "src 1",
        "dst 255",
        "latency",
        "entries 2",
        "odom, control",
        "age_us=1234567",
        "pad     0 B",
        "good",
    ):
        assert part in out
    code, out, err = ctl("pdu", "decode", octets[:-1].hex() + "00")
    assert code == 2
    assert "rx_crc" in err
    assert "src 1" in out
    code, _, err = ctl("pdu", "decode", "00")
    assert (code, "got 1 octets; allowed: a whole PDU" in err) == (2, True)
    code, _, err = ctl("pdu", "decode", "zz")
    assert code == 2
    assert "allowed: octets" in err


@pytest.mark.slow
def test_pdu_watch_shows_both_directions(daemon):
    with sdrlinkctl("pdu", "watch", "-n", "4", "--runtime-dir", daemon.directory) as watch:
        again_and_again(lambda: publish(daemon, 1), while_=lambda: watch.is_running)
    assert "→ src 1 dst all" in watch.out()
    assert "← src 1 dst all" in watch.out()


def test_a_bug_of_ours_is_one_line_too(ctl, monkeypatch):
    def broken(*_):
        raise ZeroDivisionError("oh")

    monkeypatch.setattr("sdrlinkd.cli.status.ask_status", broken)
    monkeypatch.setattr("sdrlinkd.cli.status.connect", lambda _: contextlib.nullcontext())
    code, _, err = ctl("status")
    assert code == 1
    assert err.count("\n") == 1
    assert "SDRLINKD_DEBUG=1" in err
    monkeypatch.setenv("SDRLINKD_DEBUG", "1")
    with pytest.raises(ZeroDivisionError):
        ctl("status")


def test_completion_and_help(ctl, monkeypatch):
    # Independent of the shell that runs the tests, if any.
    monkeypatch.setattr("shellingham.detect_shell", lambda *_: ("bash", "/bin/bash"))
    code, out, _ = ctl("--help")
    assert code == 0
    for command in ("status", "topics", "pub", "echo", "pdu", "bag", "demo", "check", "phy"):
        assert command in out
    code, out, _ = ctl("--show-completion")
    assert code == 0
    assert "completion" in out
    code, out, _ = ctl("--version")
    assert out.startswith("sdrlinkctl 0.")
    code, _, _ = ctl("explode")
    assert code == 2


def test_a_policy_is_set_while_the_daemon_runs_and_explained(start_daemon, ctl):
    daemon = start_daemon("[topic]\n")
    there = ("--runtime-dir", daemon.directory)
    code, out, _ = ctl(
        "set", "/robot_1/odom", "--qos", "bulk", "--priority", "90", "--period", "10s",
        "--lifespan", "300ms", "--depth", "2", "--compress", "zstd", *there,
    )  # fmt: skip
    assert code == 0
    assert out.splitlines() == [
        "odom:", "  qos: latency -> bulk", "  priority: 64 -> 90", "  period_s: 0 s -> 10 s",
        "  lifespan_s: that of its class -> 0.3 s", "  depth: 1 -> 2", "  compress: none -> zstd",
    ]  # fmt: skip
    publish(daemon, 10)
    wait_for(lambda: daemon.snapshot().link.tx.accepted == 10)
    assert daemon.snapshot().link.topics[1].priority == 90
    code, out, _ = ctl("why", "odom", *there)
    assert code == 0
    assert "class bulk, priority 90" in out
    assert "90 % throttled to 0.1 Hz by sdrlinkctl set (tx_throttled, 9)" in out
    code, out, _ = ctl("why", "odom", "--json", *there)
    assert len(json.loads(out)) >= 3
    assert ctl("reload", *there)[0] == 0
    assert daemon.snapshot().link.topics[1].priority == 64


@pytest.mark.parametrize(
    ("arguments", "parts"),
    [
        (["/nothing", "--qos", "bulk"], ["topic /nothing: unknown", "the registry has"]),
        (["odom", "--qos", "fast"], ['qos: got "fast"', 'one of "bulk", "default"']),
        (["odom", "--priority", "128"], ["priority: got 128", "from 0 to 127"]),
        (["odom", "--period", "1parsec"], ["--period: got 1parsec", "100ms"]),
        (["odom", "--max-bytes", "many"], ["--max-bytes: got many", "64k"]),
        (["odom", "--lifespan", "0"], ["lifespan_s: got 0", "allowed"]),
        (["odom"], ["nothing to change"]),
    ],
)
def test_a_policy_that_is_not_allowed_is_refused_and_changes_nothing(daemon, ctl, arguments, parts):
    # Not even what is right next to it is accepted.
    more = ["--depth", "3"] if len(arguments) > 1 else []
    code, _, err = ctl("set", *arguments, *more, "--runtime-dir", daemon.directory)
    assert code == 2
    for part in parts:
        assert part in err
    with daemon.control() as control:
        told = control.ask("set", {"topic": "odom", "depth": 0})
    assert told["old"] == {"depth": 0}


def test_a_dictionary_is_trained_from_a_recording(ctl, tmp_path, monkeypatch):
    words = b"\0\1\0\0the same words over and over, but for number %d"
    messages = [("/odom", "std_msgs/msg/String", i, words % (i % 97)) for i in range(2000)]
    bag = ros2_bag(tmp_path / "bag", StoragePlugin.SQLITE3, messages)
    code, out, _ = ctl(
        "topics", "train-dict", bag, "/odom", "--out", tmp_path / "d", "--size", "2k"
    )
    assert code == 0
    assert "others shrink to" in out
    monkeypatch.chdir(tmp_path)
    code, out, _ = ctl("topics", "train-dict", bag, "/odom", "--size", "2k")
    assert code == 0
    assert (tmp_path / "odom.zdict").read_bytes() == (tmp_path / "d").read_bytes()
    assert '[topic.odom] compress = "zstd", dictionary = "odom.zdict"' in out
    code, _, err = ctl("topics", "train-dict", bag, "/odom", "--out", "none/d", "--size", "2k")
    assert (code, err) == (2, "sdrlinkctl: none/d: cannot be written (No such file or directory)\n")
    code, _, err = ctl("topics", "train-dict", bag, "/none", "--out", tmp_path / "d")
    assert code == 2
    assert "/none: not in" in err


@pytest.mark.slow
def test_publishing_at_a_rate_tells_how_many_also_at_ctrl_c(daemon):
    dir_ = ("--runtime-dir", daemon.directory)
    with sdrlinkctl("pub", "odom", "--rate", "20", *dir_) as publishing:
        before = daemon.snapshot().link.tx.accepted
        wait_for(lambda: daemon.snapshot().link.tx.accepted >= before + 3)
        publishing.send_signal(signal.SIGINT)
        code = publishing.wait(20)
    assert code == 130
    assert "publishing 708 B on /robot_1/odom at 20 Hz, until Ctrl-C" in publishing.err()
    assert re.search(r"published \d+ × 708 B on /robot_1/odom", publishing.out())


@pytest.mark.slow
def test_a_name_that_nobody_sends_is_answered_with_the_nearest(daemon, ctl):
    dir_ = ("--runtime-dir", daemon.directory)
    with Publisher(daemon.directory) as out, Subscriber(directory=daemon.directory) as heard:
        out.send("/robot_1/odom", bytes(724))
        assert heard.receive(20) is not None
    code, _, err = ctl("topic", "hz", "/rx_robot_1/odmo", "--duration", "0.1", *dir_)
    assert code == 2
    assert "nothing of this name was heard so far; did you mean /rx_robot_1/odom?" in err
    code, _, err = ctl("topic", "hz", "/rx_robot_1/odom", "--duration", "0.1", *dir_)
    assert "did you mean" not in err


@pytest.mark.slow
def test_what_is_set_is_shown_with_its_unit(daemon, ctl):
    dir_ = ("--runtime-dir", daemon.directory)
    code, out, err = ctl("set", "odom", "--qos", "urgent", "--lifespan", "300", *dir_)
    assert (code, "-> 300 s" in out) == (0, True)
    assert "for milliseconds, give 300ms" in err
    code, out, err = ctl("set", "odom", "--lifespan", "300ms", "--queue-bytes", "4k", *dir_)
    assert ("300 s -> 0.3 s" in out, "-> 4000 B" in out, err) == (True, True, "")


@pytest.mark.parametrize(
    ("word", "says"),
    [("tdma", "turns"), ("MCS", "Modulation and coding"), ("PDR", "Share of messages"),
     ("rssi", "received level")],
)  # fmt: skip
def test_help_knows_the_words_of_the_glossary(ctl, word, says):
    code, out, _ = ctl("help", word)
    assert (code, says in out) == (0, True), out


def test_a_part_of_a_scenarios_name_is_enough_to_be_told_it(ctl):
    code, _, err = ctl("lab", "three")
    assert (code, "did you mean three-robots?" in err) == (2, True)
