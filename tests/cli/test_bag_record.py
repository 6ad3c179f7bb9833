"""`bag record` and `bag play`: what came over the air, on disk, even after a crash."""

import contextlib
import itertools
import os
import time
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from mcap.exceptions import McapError
from mcap.reader import make_reader
from rosbags.highlevel import AnyReader
from rosbags.typesys import Stores, get_typestore

from sdrlinkd.adapters import BagWriter, Recorded, empty, open_bag, to_cdr
from sdrlinkd.client import Publisher, Subscriber
from sdrlinkd.errors import BagError
from tests.programs import sdrlinkctl
from tests.waiting import wait_for

ODOM, KIND = "/rx_robot_1/odom", "nav_msgs/msg/Odometry"
TEXT = "std_msgs/msg/String"
T0 = 1_700_000_000_000_000_000


def odometry(i):
    message = empty(KIND)
    message.pose.pose.position.x = float(i)
    return to_cdr(message, KIND)


def by_mcap(folder):
    """The bag's messages, by the reader of the format's authors."""
    found = []
    for path in sorted(folder.glob("*.mcap")):
        with path.open("rb") as file:
            reader = make_reader(file)
            found += [
                (channel.topic, schema.name, message.data, message.log_time, message.publish_time)
                for schema, channel, message in reader.iter_messages(log_time_order=False)
            ]
    return found


def by_rosbags(folder):
    # A bag without messages has no types of its own.
    with AnyReader([folder], default_typestore=get_typestore(Stores.ROS2_JAZZY)) as reader:
        return [
            (connection.topic, connection.msgtype, bytes(data), time_ns)
            for connection, time_ns, data in reader.messages()
        ]


@pytest.mark.slow
def test_a_bag_is_whole_between_any_two_writes(tmp_path, monkeypatch):
    """Whenever the recorder is killed, both readers read the same."""
    bag, looks = tmp_path / "bag", []

    def looking(write):
        def call(*arguments):
            done = write(*arguments)
            if (bag / "metadata.yaml").exists():
                looks.append(len(by_mcap(bag)))
                assert len(by_rosbags(bag)) == looks[-1]
            return done

        return call

    monkeypatch.setattr(os, "pwrite", looking(os.pwrite))
    monkeypatch.setattr(Path, "replace", looking(Path.replace))
    writer = BagWriter(bag, split_s=0.025)
    for i in range(12):
        at = T0 + i * 10_000_000
        writer.add(Recorded(ODOM if i % 2 else f"/t{i}", KIND, odometry(i), at, at))
        if i % 2:
            writer.sync()
    writer.close()
    assert looks[-1] == 12
    assert len(set(looks)) > 5


def test_what_is_recorded_outlives_the_recorder(start_daemon, tmp_path):
    daemon = start_daemon('[topic]\nodom.depth = 0\nmap.durability = "transient_local"\n')
    bag = tmp_path / "bag"
    arguments = ("bag", "record", bag, "--sent", "--runtime-dir", daemon.directory)
    sent = [odometry(i) for i in range(20)]

    def n_written():
        # While the recorder writes, the end of the file may be half the old one.
        with contextlib.suppress(McapError):
            return len(by_mcap(bag)) if (bag / "metadata.yaml").exists() else 0
        return 0

    with (
        sdrlinkctl(*arguments, log=tmp_path / "log") as recorder,
        Publisher(daemon.directory) as out,
        Subscriber(ODOM, directory=daemon.directory) as heard,
    ):
        wait_for(lambda: "recording in" in recorder.log(), 30)
        for cdr in sent:
            out.send("/robot_1/odom", cdr)
            assert heard.receive(20) is not None
        # What a crash leaves is what was written last.
        wait_for(lambda: n_written() >= 60, 30)
        recorder.kill()
    found = by_mcap(bag)
    assert [each[2] for each in found if each[0] == ODOM] == sent
    assert [each[2] for each in found if each[0] == "/robot_1/odom"] == sent
    assert {each[1] for each in found if each[0] in (ODOM, "/robot_1/odom")} == {KIND}
    now = time.time_ns()
    for _, _, _, log_ns, publish_ns in found:
        assert now - 100e9 < publish_ns <= log_ns < now
    receptions = [each for each in found if each[0] == "/link/receptions"]
    assert len(receptions) == 20
    assert b'"robot": 1' in receptions[0][2]
    same = [(topic, kind, data, log) for topic, kind, data, log, _ in found]
    assert sorted(by_rosbags(bag)) == sorted(same)
    # It plays back into a daemon, the same octets.
    with (
        Subscriber(ODOM, directory=daemon.directory) as heard,
        sdrlinkctl(
            "bag", "play", bag, "--topics", "/robot_*", "--rate", "100", "--runtime-dir",
            daemon.directory, log=tmp_path / "play",
        ) as played,
    ):  # fmt: skip
        assert [heard.receive(30).payload for _ in sent] == sent
        assert played.wait(30) == 0


@pytest.mark.slow
@given(st.lists(st.sampled_from("ab+"), max_size=30), st.integers(0, 3000))
def test_a_bag_is_whole_after_each_sync(tmp_path_factory, steps, max_bytes):
    folder = tmp_path_factory.mktemp("bags") / "bag"
    writer = BagWriter(folder, max_bytes=max_bytes)
    added, written = [], []
    for i, step in enumerate(steps):
        if step == "+":
            writer.sync()
            written = list(added)
        else:
            cdr = to_cdr(empty(TEXT), TEXT) + bytes(i)
            added.append((f"/{step}", TEXT, cdr, T0 + i, T0 - i))
            writer.add(Recorded(f"/{step}", TEXT, cdr, T0 + i, T0 - i, step == "b"))
        # A file that is full is written before the next one begins.
        found = by_mcap(folder)
        assert found[: len(written)] == written
        assert found == added[: len(found)]
    writer.close()
    assert by_mcap(folder) == added
    assert by_rosbags(folder) == [each[:4] for each in added]
    bag = open_bag(folder)
    assert [message.cdr for message in bag.messages()] == [each[2] for each in added]
    assert not bag.damage
    bag.close()


def test_files_are_split_by_time_and_size(tmp_path):
    writer = BagWriter(tmp_path / "bag", split_s=1.0, max_bytes=0)
    for i in range(50):
        writer.add(Recorded("/odom", KIND, odometry(i), T0 + i * 100_000_000, T0))
    writer.close()
    assert len(list((tmp_path / "bag").glob("*.mcap"))) == 5
    assert len(by_rosbags(tmp_path / "bag")) == 50
    with pytest.raises(BagError, match="give a folder that does not exist"):
        BagWriter(tmp_path / "bag")


def test_a_part_is_played_again_and_again_with_its_clock(start_daemon, ctl, tmp_path):
    daemon = start_daemon('registry = ""\n')
    writer = BagWriter(tmp_path / "bag")
    for i in range(30):
        writer.add(Recorded("/robot_1/a", TEXT, b"\0\1\0\0" + bytes([i]) * 8, T0 + i * 10**8, T0))
    writer.close()
    with daemon.control() as control:
        control.ask("declare", {"name": "/robot_1/a", "type": TEXT})
    dir_ = ("--runtime-dir", daemon.directory)
    with (
        Subscriber("/rx_robot_1/*", directory=daemon.directory) as heard,
        sdrlinkctl(
            "bag", "play", tmp_path / "bag", "--start", "1", "--duration", "0.5", "--loop",
            "--clock", "10", "--rate", "5", *dir_, log=tmp_path / "log",
        ) as player,
    ):  # fmt: skip
        numbers, clocks = [], []
        while sum(later < one for one, later in itertools.pairwise(numbers)) < 2:
            message = heard.receive(30)
            if message.topic.endswith("/clock"):
                clocks.append(message.payload)
            else:
                numbers.append(message.payload[4])
        player.kill()
    # Twice from the start again; on a busy machine, the newest replaces what still waits.
    assert set(numbers) <= {*range(10, 15)}
    assert len(numbers) > 4
    assert {int.from_bytes(each[4:8], "little") for each in clocks} == {T0 // 10**9 + 1}
    code, _, err = ctl("bag", "play", tmp_path / "bag", "--start", "9", "--loop", *dir_)
    assert code
    assert "no messages to play again" in err
    code, _, err = ctl("bag", "record", tmp_path / "bag", "--max-size", "huge", *dir_)
    assert code
    assert "--max-size: got huge; allowed: a size such as" in err
