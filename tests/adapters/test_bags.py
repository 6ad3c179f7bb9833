"""Recordings: verbatim, converted, and as far as they can be read."""

import sqlite3
from contextlib import closing
from itertools import pairwise
from random import Random

import pytest
from rosbags.rosbag1 import Writer as Writer1
from rosbags.rosbag2 import CompressionFormat, CompressionMode
from rosbags.rosbag2 import Writer as Writer2
from rosbags.typesys import Stores, get_typestore

from sdrlinkd.adapters import due_messages, from_cdr, open_bag, summarise
from sdrlinkd.errors import BagError
from tests.adapters.recordings import CUSTOM, STORAGES, noisy_messages, ros1_bag, ros2_bag
from tests.laws import often, one_in, trials


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


def packed_bag(path, storage, mode, messages):
    types = get_typestore(Stores.ROS2_HUMBLE)
    writer = Writer2(path, version=9, storage_plugin=STORAGES[storage])
    writer.set_compression(mode, CompressionFormat.ZSTD)
    with writer:
        connections = {}
        for topic, kind, time_ns, cdr in messages:
            if topic not in connections:
                connections[topic] = writer.add_connection(topic, kind, typestore=types)
            writer.write(connections[topic], time_ns, cdr)
    return path


def data_file(path):
    (file,) = (f for f in path.iterdir() if f.name != "metadata.yaml")
    return file


def chunks_of(mcap):
    """Number of chunk records after the magic, up to the end of the data section."""
    data, at, count = mcap.read_bytes(), 8, 0
    while data[at] != 0x0F:
        count += data[at] == 6
        at += 9 + int.from_bytes(data[at + 1 : at + 9], "little")
    return count


PACKED = [
    ("sqlite3", CompressionMode.FILE),
    ("sqlite3", CompressionMode.MESSAGE),
    ("mcap", CompressionMode.FILE),
    ("mcap", CompressionMode.MESSAGE),
    ("mcap", CompressionMode.STORAGE),
]


@pytest.mark.parametrize(("storage", "mode"), PACKED, ids=lambda v: getattr(v, "name", v))
def test_compressed_rosbag2_is_verbatim(tmp_path, storage, mode):
    written = noisy_messages(seed=4, count=200)
    assert read(packed_bag(tmp_path / "bag", storage, mode, written)) == (written, "")


@pytest.mark.parametrize("mode", [CompressionMode.NONE, CompressionMode.STORAGE])
def test_mcap_of_several_chunks_whole_and_cut(tmp_path, mode):
    written = noisy_messages(seed=6, count=4500)
    path = packed_bag(tmp_path / "bag", "mcap", mode, written)
    file = data_file(path)
    assert chunks_of(file) >= 2
    assert read(path) == (written, "")
    data = file.read_bytes()
    file.write_bytes(data[: len(data) // 2])
    messages, damage = read(path)
    assert 1000 < len(messages) < 3500
    assert messages == written[: len(messages)]
    assert str(path) in damage


def test_a_single_file_needs_no_metadata(tmp_path):
    written = noisy_messages(seed=8, count=50)
    for storage in STORAGES:
        path = ros2_bag(tmp_path / storage, STORAGES[storage], written)
        assert read(data_file(path)) == (written, ""), storage


def read_or_refusal(path):
    try:
        return *read(path), ""
    except BagError as error:
        return [], "", str(error)


def damaged_copies(data, seed):
    """Copies of `data` cut at many places, and copies with flipped octets."""
    rng = Random(seed)
    for _ in range(often(25)):
        yield "cut", data[: rng.randrange(len(data))]
    for _ in range(often(15)):
        flipped = bytearray(data)
        for _ in range(rng.randrange(1, 4)):
            flipped[rng.randrange(len(data))] ^= rng.randrange(1, 256)
        yield "flipped", bytes(flipped)


def check_damaged(path, file, whole, seed, has_many_chunks=True):
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
            continue
        assert "Traceback" not in damage, f"seed {seed}"
        if kind == "cut":
            assert set(messages) <= originals, f"seed {seed}"
            assert len(set(messages)) == len(messages), f"seed {seed}"
            assert all(a[2] <= b[2] for a, b in pairwise(messages)), f"seed {seed}"
            assert damage or len(messages) == len(whole), f"seed {seed}"
            saved += len(messages)
    file.write_bytes(data)
    assert saved or not has_many_chunks, f"seed {seed}: positive control"


@pytest.mark.parametrize("storage", STORAGES)
@pytest.mark.parametrize("seed", [1, 2])
def test_a_damaged_rosbag2_gives_what_is_left_unaltered(tmp_path, storage, seed):
    written = noisy_messages(seed, count=300)
    path = ros2_bag(tmp_path / "bag", STORAGES[storage], written)
    (file,) = (f for f in path.iterdir() if f.suffix in (".db3", ".mcap"))
    check_damaged(path, file, written, seed)


@pytest.mark.slow
@pytest.mark.parametrize("compression", one_in(3, [None, *Writer1.CompressionFormat]))
def test_a_damaged_ros1_bag_gives_what_is_left_unaltered(tmp_path, compression):
    path = ros1_bag(tmp_path / "run.bag", compression, 4000)
    whole, _ = read(path)
    check_damaged(path, path, whole, seed=3)


@pytest.mark.parametrize("seed", [1, 2])
def test_a_damaged_compressed_mcap_gives_what_is_left_unaltered(tmp_path, seed):
    written = noisy_messages(seed, count=300)
    path = packed_bag(tmp_path / "bag", "mcap", CompressionMode.STORAGE, written)
    check_damaged(path, data_file(path), written, seed, has_many_chunks=False)


def test_a_database_cut_within_its_last_page_is_damaged(tmp_path):
    written = noisy_messages(seed=1, count=600)
    path = ros2_bag(tmp_path / "bag", STORAGES["sqlite3"], written)
    file = data_file(path)
    file.write_bytes(file.read_bytes()[:-85])
    messages, damage = read(path)
    assert set(messages) <= set(written)
    assert damage


def test_a_row_that_holds_no_bytes_costs_only_itself(tmp_path):
    written = noisy_messages(seed=1, count=100)
    path = ros2_bag(tmp_path / "bag", STORAGES["sqlite3"], written)
    file = data_file(path)
    with closing(sqlite3.connect(file)) as database, database:
        database.execute("UPDATE messages SET data = 5 WHERE id = 50")
    (path / "metadata.yaml").write_text("junk")
    messages, damage = read(path)
    assert messages == written[:49] + written[50:]
    assert damage


def test_an_mcap_with_a_name_that_is_no_text_gives_the_rest(tmp_path):
    path = ros2_bag(tmp_path / "bag", STORAGES["mcap"], noisy_messages(seed=1, count=50))
    file = data_file(path)
    file.write_bytes(file.read_bytes().replace(b"std_msgs/msg/String", b"std_msgs/\x97sg/String"))
    _, damage, refusal = read_or_refusal(path)
    assert damage or refusal


@pytest.mark.parametrize("storage", STORAGES)
def test_damage_leaves_no_message_compressed(tmp_path, storage):
    written = noisy_messages(seed=2, count=300)
    path = packed_bag(tmp_path / "bag", storage, CompressionMode.MESSAGE, written)
    file = data_file(path)
    data = file.read_bytes()
    file.write_bytes(data[: len(data) // 2])
    messages, _, refusal = read_or_refusal(path)
    assert set(messages) <= set(written)
    assert messages or refusal


@pytest.mark.parametrize("storage", STORAGES)
def test_a_cut_compressed_file_is_refused_in_words(tmp_path, storage):
    path = packed_bag(
        tmp_path / "bag", storage, CompressionMode.FILE, noisy_messages(seed=2, count=100)
    )
    file = data_file(path)
    file.write_bytes(file.read_bytes()[:-1000])
    with pytest.raises(BagError, match="bag"):
        open_bag(path)


def flip_until(path, file, seed, change):
    """Damage `file` in up to 400 seeded ways; any exception but BagError fails the test."""
    data, rng = file.read_bytes(), Random(seed)
    for _ in range(trials(400)):
        damaged = bytearray(data)
        change(damaged, rng)
        file.write_bytes(damaged)
        _, damage, refusal = read_or_refusal(path)
        assert "\n" not in damage + refusal


def zero_a_stretch(damaged, rng):
    at, size = rng.randrange(len(damaged)), rng.choice([1, 8, 64, 512, 4096])
    damaged[at : at + size] = bytes(len(damaged[at : at + size]))


def flip_some(damaged, rng):
    for _ in range(rng.randrange(1, 6)):
        damaged[rng.randrange(len(damaged))] ^= rng.randrange(1, 256)


@pytest.mark.slow
@pytest.mark.parametrize("change", [zero_a_stretch, flip_some])
def test_a_ros1_bag_damaged_anywhere_gives_words(tmp_path, change):
    path = ros1_bag(tmp_path / "run.bag", Writer1.CompressionFormat.LZ4, 300)
    flip_until(path, path, 5, change)


@pytest.mark.parametrize("storage", STORAGES)
def test_damage_is_told_in_one_line(tmp_path, storage):
    path = ros2_bag(tmp_path / "bag", STORAGES[storage], noisy_messages(seed=1, count=50))
    file = data_file(path)
    file.write_bytes(file.read_bytes().replace(b"Time stamp", b"Ti!e stamp"))
    _, damage, refusal = read_or_refusal(path)
    assert damage or refusal
    assert "\n" not in damage + refusal


@pytest.mark.parametrize("name", ["nothing.mcap", "empty", "junk.mcap", "junk.bag", "junk.db3"])
def test_what_is_no_bag_is_refused_in_words(tmp_path, name):
    path = tmp_path / name
    if name == "empty":
        path.mkdir()
    elif name.startswith("junk"):
        path.write_bytes(b"no recording at all" * 50)
    with pytest.raises(BagError, match=name) as refused:
        open_bag(path)
    assert "\n" not in str(refused.value)


@pytest.mark.parametrize("storage", STORAGES)
def test_names_are_absolute_whatever_the_recording_says(tmp_path, storage):
    """ROS 1 records names as the publisher wrote them, and its bags are converted unchanged."""
    messages = [(t.removeprefix("/"), *rest) for t, *rest in noisy_messages(3, 30)]
    bag = open_bag(ros2_bag(tmp_path / "bag", STORAGES[storage], messages))
    assert [topic.name for topic in bag.topics()] == ["/chat", "/odom"]
    assert {message.topic for message in bag.messages()} == {"/chat", "/odom"}
    due = due_messages(bag, 10.0, 0.0, {"/odom": 3})
    assert [each.topic_id for each in due] == [3] * 20
    bag.close()


def test_a_summary_tells_length_rates_and_sizes(tmp_path):
    ms = 1_000_000
    messages = [("/chat", "std_msgs/msg/String", 100 * ms * i, bytes(10 + i)) for i in range(11)]
    messages += [("/once", "std_msgs/msg/String", 1500 * ms, bytes(40))]
    bag = open_bag(ros2_bag(tmp_path / "bag", STORAGES["mcap"], messages))
    read = []
    found = summarise(bag, read.append)
    assert read == list(range(1, 13))
    assert (found.duration_s, found.n_messages, found.n_bytes) == (1.5, 12, 205)
    chat, once = found.topics
    assert chat == ("/chat", "std_msgs/msg/String", 11, 10.0, 15.0, 20)
    assert once == ("/once", "std_msgs/msg/String", 1, None, 40.0, 40)
    bag.close()
