"""Recordings: verbatim, converted, and as far as they can be read."""

from contextlib import closing
from itertools import pairwise
from pathlib import Path
from random import Random

import pytest
from rosbags.rosbag1 import Writer as Writer1

from sdrlinkd.adapters import from_cdr, open_bag
from sdrlinkd.errors import BagError
from tests.adapters.recordings import CUSTOM, STORAGES, noisy_messages, ros1_bag, ros2_bag

SHARED = Path(__file__).parents[3] / "shared" / "data"


def read(path):
    bag = open_bag(path)
    messages = [tuple(message) for message in bag.messages()]
    bag.close()
    return messages, bag.damage


@pytest.mark.parametrize("storage", STORAGES)
def test_rosbag2_is_verbatim_garbage_and_all(tmp_path, storage):
    written = noisy_messages(seed=1, count=200)
    path = ros2_bag(tmp_path / "bag", STORAGES[storage], written)
    messages, damage = read(path)
    assert messages == written
    assert damage == ""
    with closing(open_bag(path)) as bag:
        assert {t.name: t.n_messages for t in bag.topics()} == {"/odom": 133, "/chat": 67}


@pytest.mark.parametrize("compression", [None, *Writer1.CompressionFormat])
def test_ros1_is_converted(tmp_path, compression):
    messages, damage = read(ros1_bag(tmp_path / "run.bag", compression, 20))
    assert damage == ""
    assert len(messages) == 40
    for i in range(20):
        (topic, kind, _, cdr), (topic2, kind2, _, cdr2) = messages[2 * i : 2 * i + 2]
        assert (topic, kind) == ("/cmd_vel", "geometry_msgs/msg/Twist")
        assert from_cdr(cdr, kind).linear.x == i
        assert (topic2, kind2) == ("/reading", CUSTOM)
        reading = from_cdr(cdr2, kind2)
        assert (reading.header.stamp.sec, reading.header.frame_id) == (i, "probe")
        assert (reading.value, reading.unit) == (i / 2, "K")
        assert not hasattr(reading.header, "seq")


def read_or_refusal(path):
    try:
        return *read(path), ""
    except BagError as error:
        return [], "", str(error)


def damaged_copies(data, seed):
    """Cut at many places, and with flipped octets."""
    rng = Random(seed)
    for _ in range(25):
        yield "cut", data[: rng.randrange(len(data))]
    for _ in range(15):
        flipped = bytearray(data)
        for _ in range(rng.randrange(1, 4)):
            flipped[rng.randrange(len(data))] ^= rng.randrange(1, 256)
        yield "flipped", bytes(flipped)


def check_damaged(path, file, whole, seed):
    """Cut files yield originals only; flipped ones may alter a payload, but never crash."""
    originals = set(whole)
    saved = 0
    data = file.read_bytes()
    for kind, damaged in damaged_copies(data, seed):
        file.write_bytes(damaged)
        messages, damage, refusal = read_or_refusal(path)
        if refusal:
            assert str(path) in refusal, f"seed {seed}"
            assert "\n" not in refusal, f"seed {seed}"
        elif kind == "cut":
            assert set(messages) <= originals, f"seed {seed}"
            assert damage or len(messages) == len(whole), f"seed {seed}"
            saved += len(messages)
    file.write_bytes(data)
    assert saved > len(whole), f"seed {seed}: positive control"


@pytest.mark.parametrize("storage", STORAGES)
@pytest.mark.parametrize("seed", [1, 2])
def test_a_damaged_rosbag2_gives_what_is_left_unaltered(tmp_path, storage, seed):
    written = noisy_messages(seed, count=300)
    path = ros2_bag(tmp_path / "bag", STORAGES[storage], written)
    (file,) = (f for f in path.iterdir() if f.suffix in (".db3", ".mcap"))
    check_damaged(path, file, written, seed)


@pytest.mark.parametrize("compression", [None, Writer1.CompressionFormat.BZ2])
def test_a_damaged_ros1_bag_gives_what_is_left_unaltered(tmp_path, compression):
    path = ros1_bag(tmp_path / "run.bag", compression, 4000)
    whole, _ = read(path)
    check_damaged(path, path, whole, seed=3)


@pytest.mark.parametrize("name", ["nothing.mcap", "empty", "junk.mcap", "junk.bag", "junk.db3"])
def test_what_is_no_bag_is_refused_in_words(tmp_path, name):
    path = tmp_path / name
    if name == "empty":
        path.mkdir()
    elif name.startswith("junk"):
        path.write_bytes(b"no recording at all" * 50)
    with pytest.raises(BagError, match=name):
        open_bag(path)


@pytest.mark.parametrize(
    ("name", "count"),
    [
        ("bags/sqlite3/husky_real_first100s", 4252),
        ("bags/sqlite3/mrclam7_robots123_30s", 5731),
        ("bags/mcap/nav2_turtlebot_sim.mcap", 8197),
        ("bags/ros1/turtlesim_teleop.bag", 8647),
        ("bags/ros1/lidar_stationary_2014.bag", 1265),
        ("cdr/talker.mcap", 20),
    ],
)
def test_real_recordings_are_read_whole(name, count):
    if not SHARED.exists():
        pytest.skip("the recordings are not part of the project; see ../shared/data")
    messages, damage = read(SHARED / name)
    assert len(messages) == count
    assert damage == ""
    assert all(a[2] <= b[2] for a, b in pairwise(messages))
