"""Transforms are told apart by their child frames where their policy says so."""

import struct

from hypothesis import given
from hypothesis import strategies as st

from sdrlinkd.adapters import empty, to_cdr
from sdrlinkd.adapters.testing import ros2_types
from sdrlinkd.link import Overrides, Told, TopicPolicy
from sdrlinkd.link.queue.testing import child_frames, key_of
from tests.link.world import classes_queued, make_link, topic_of

TF = "tf2_msgs/msg/TFMessage"
BY_FRAME = TopicPolicy(key="child_frames", depth=1)


def tf_message(*children):
    types = ros2_types().types
    transforms = []
    for child in children:
        each = empty("geometry_msgs/msg/TransformStamped")
        each.child_frame_id, each.header.frame_id = child, "base" * (1 + len(child) % 3)
        transforms.append(each)
    return to_cdr(types[TF](transforms), TF)


@given(st.lists(st.text(st.characters(min_codepoint=1, max_codepoint=0x2FF), max_size=12)))
def test_child_frames_are_those_of_an_independent_reader(children):
    cdr = tf_message(*children)
    assert child_frames(cdr) == sorted(set(children))
    assert len(key_of(cdr, BY_FRAME).encode()) <= 32
    assert child_frames(cdr + b"\0\0\0") == child_frames(cdr)


@given(st.binary(max_size=200), st.integers(0, 400))
def test_any_octets_are_frames_or_none(octets, cut):
    for frame in child_frames(octets) or ():
        assert frame.encode() in octets
    cdr = tf_message("a", "lidar", "gps")
    assert child_frames(cdr[:cut]) is None or cut >= len(cdr)
    key_of(octets, BY_FRAME)


def test_the_same_frames_have_one_key():
    assert key_of(tf_message("b", "a"), BY_FRAME) == key_of(tf_message("a", "b"), BY_FRAME) == "a,b"
    long = [f"frame_{i}" for i in range(20)]
    assert key_of(tf_message(*long), BY_FRAME) == key_of(tf_message(*reversed(long)), BY_FRAME)
    assert key_of(b"\0\1\0\0" + struct.pack("<I", 1 << 31), BY_FRAME) == ""
    assert key_of(tf_message("a"), TopicPolicy()) == "", "its policy does not say so"


def test_the_newest_transform_of_each_frame_waits():
    link = make_link(1)
    link.set_policy(0, BY_FRAME)
    for child in ("base", "arm", "base", "arm", "base"):
        link.submit(0, tf_message(child), 0.0)
    topic = topic_of(link, 0)
    assert (topic.queued, topic.dropped) == (2, {"tx_superseded": 3})


def test_messages_to_one_robot_do_not_replace_those_to_another():
    link = make_link(1)
    link.set_policy(0, TopicPolicy(depth=1))
    for dst in (2, 3, 2, None):
        link.submit(0, bytes(40), 0.0, Overrides(dst=dst))
    topic = topic_of(link, 0)
    assert (topic.queued, topic.dropped) == (3, {"tx_superseded": 1})


def test_messages_to_one_robot_have_the_policy_of_commands():
    link = make_link(1)
    link.set_policy(0, TopicPolicy(), TopicPolicy(qos="urgent", lifespan_s=0.3, deadman_s=0.5))
    link.submit(0, bytes(40), 0.0)
    link.submit(0, bytes(40), 0.0, Overrides(dst=2))
    assert [q.label for q, n in classes_queued(link).items() if n] == ["urgent", "default"]
    treatment, of_commands, *_ = link.why(0, Told("robot.toml", ()), 0.0)
    assert "class default" in treatment
    assert of_commands == "sent to one robot: class urgent, lifespan 300 ms, dead-man after 500 ms"
    link.expire_queue(0.4)
    assert [q.label for q, n in classes_queued(link).items() if n] == ["default"]
