"""A robot's whole recording: every topic, every message, in order, with the stated type."""

from contextlib import closing
from itertools import pairwise

import pytest
from rosbags.rosbag1 import Writer as Writer1

from sdrlinkd.adapters import from_cdr, open_bag
from tests.adapters.drives import TOPICS, ros1_drive, ros2_drive
from tests.adapters.recordings import STORAGES
from tests.laws import one_in

DURATION_S = 20.0
COUNTS = {topic: int(DURATION_S * rate_hz) for topic, (_, rate_hz) in TOPICS.items()}


def read(path):
    """(messages, topics) of an undamaged bag with messages in order of time."""
    with closing(open_bag(path)) as bag:
        messages = [tuple(each) for each in bag.messages()]
        assert bag.damage == ""
        topics = {each.name: (each.type, each.n_messages) for each in bag.topics()}
    assert all(a[2] <= b[2] for a, b in pairwise(messages))
    assert topics == {name: (kind, COUNTS[name]) for name, (kind, _) in TOPICS.items()}
    return messages


@pytest.mark.slow
@pytest.mark.parametrize("storage", STORAGES)
def test_a_drive_of_ros2_is_read_whole(tmp_path, storage):
    written = ros2_drive(tmp_path / "drive", STORAGES[storage], DURATION_S)
    assert read(tmp_path / "drive") == written
    assert len(written) == sum(COUNTS.values()) > 2000


@pytest.mark.slow
@pytest.mark.parametrize("compression", one_in(3, [None, *Writer1.CompressionFormat]))
def test_a_drive_of_ros1_is_read_whole(tmp_path, compression):
    written = ros1_drive(tmp_path / "drive.bag", compression, DURATION_S)
    messages = read(tmp_path / "drive.bag")
    assert [each[:3] for each in messages] == written
    for _, kind, _, cdr in messages[::10]:
        assert from_cdr(cdr, kind).__msgtype__ == kind
