"""/tf on a slow link: which frames are sent, with which names, and how often."""

import numpy as np
import pytest
from rosbags.typesys import Stores, get_typestore

from sdrlinkd.adapters import Transforms, from_cdr, to_cdr
from sdrlinkd.config import TransformParams

TYPES = get_typestore(Stores.ROS2_HUMBLE).types
TF = "tf2_msgs/msg/TFMessage"


def tf(*pairs, x=1.0):
    """CDR of transforms (parent, child), `x` m apart."""
    stamped, header = TYPES["geometry_msgs/msg/TransformStamped"], TYPES["std_msgs/msg/Header"]
    time, vector = TYPES["builtin_interfaces/msg/Time"], TYPES["geometry_msgs/msg/Vector3"]
    turn, moved = TYPES["geometry_msgs/msg/Quaternion"], TYPES["geometry_msgs/msg/Transform"]
    return to_cdr(
        TYPES[TF](
            [
                stamped(
                    header(time(3, 4), parent), child, moved(vector(x, 2.0, 3.0), turn(0, 0, 0, 1))
                )
                for parent, child in pairs
            ]
        ),
        TF,
    )


def told(payload):
    return [
        (each.header.frame_id, each.child_frame_id, each.transform.translation.x)
        for each in from_cdr(payload, TF).transforms
    ]


def test_only_the_frames_that_are_wanted_go_and_under_their_robots_name():
    transforms = Transforms(
        TransformParams(frames=["base_*", "odom"], drop=["base_cam"], prefix="robot_1/")
    )
    pairs = [("map", "odom"), ("odom", "base_link"), ("base_link", "base_cam"), ("a", "wheel")]
    payload, reason = transforms.take(tf(*pairs), 0.0)
    assert reason == ""
    assert told(payload) == [
        ("map", "robot_1/odom", 1.0), ("robot_1/odom", "robot_1/base_link", 1.0),
    ]  # fmt: skip


def test_without_wishes_everything_goes_as_it_is():
    given = tf(("/odom", "/base_link"))
    payload, _ = Transforms(TransformParams()).take(given, 0.0)
    assert told(payload) == told(given)
    assert from_cdr(payload, TF).transforms[0].header.stamp.sec == 3


def test_what_has_no_wanted_frame_or_is_no_transform_is_named():
    transforms = Transforms(TransformParams(frames=["odom"]))
    assert transforms.take(tf(("a", "b")), 0.0) == (None, "tx_filtered")
    for bad in (b"", b"\0\1\0\0", b"\0\1\0\0\xff\xff\xff\xff", np.random.default_rng(1).bytes(90)):
        assert transforms.take(bad, 0.0) == (None, "tx_bad_transform")


def test_transforms_are_combined_and_the_last_of_each_frame_counts():
    transforms = Transforms(TransformParams(combine_s=0.1))
    first, _ = transforms.take(tf(("odom", "base")), 0.0)
    assert told(first) == [("odom", "base", 1.0)]
    for i in range(4):
        assert transforms.take(tf(("odom", "base"), x=float(i)), 0.02 * i) == (None, "tx_combined")
    assert transforms.take(tf(("base", "arm")), 0.09) == (None, "tx_combined")
    assert transforms.flush(0.099) is None
    assert told(transforms.flush(0.1)) == [("odom", "base", 3.0), ("base", "arm", 1.0)]
    assert transforms.flush(0.5) is None


@pytest.mark.parametrize("n", [1, 30])
def test_many_frames_survive_the_way(n):
    pairs = [(f"a{i}", f"b{i}") for i in range(n)]
    payload, _ = Transforms(TransformParams(prefix="r/")).take(tf(*pairs), 0.0)
    assert len(told(payload)) == n
