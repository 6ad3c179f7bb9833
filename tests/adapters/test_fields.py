"""Converts fields in user notation into messages and back."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sdrlinkd.adapters import cdr_from_fields, empty, from_cdr, to_cdr
from sdrlinkd.errors import UserError
from tests.laws import law

KINDS = (
    "geometry_msgs/msg/Twist", "nav_msgs/msg/Odometry", "nav_msgs/msg/Path", "std_msgs/msg/Bool",
    "std_msgs/msg/Byte", "sensor_msgs/msg/JointState", "geometry_msgs/msg/PolygonStamped",
)  # fmt: skip


def made(kind, fields):
    return from_cdr(cdr_from_fields(kind, fields, "it"), kind)


@pytest.mark.parametrize("kind", KINDS)
def test_without_fields_a_message_is_the_default_one(kind):
    assert cdr_from_fields(kind, {}, "it") == to_cdr(empty(kind), kind)


def test_every_sort_of_field_arrives():
    odometry = made(
        "nav_msgs/msg/Odometry",
        {
            "header": {"stamp": {"sec": -5, "nanosec": 2**32 - 1}, "frame_id": "odom"},
            "pose": {"pose": {"position": {"x": 1, "y": 0.5}}, "covariance": list(range(36))},
        },
    )
    assert (odometry.header.stamp.sec, odometry.header.stamp.nanosec) == (-5, 2**32 - 1)
    assert odometry.header.frame_id == "odom"
    position = odometry.pose.pose.position
    assert [position.x, position.y, position.z] == [1.0, 0.5, 0.0]
    assert odometry.pose.covariance.tolist() == list(range(36))
    joints = made("sensor_msgs/msg/JointState", {"name": ["a", "ü"], "velocity": [1, 2.5]})
    assert (joints.name, joints.velocity.tolist()) == (["a", "ü"], [1.0, 2.5])
    path = made("nav_msgs/msg/Path", {"poses": [{"pose": {"position": {"z": 3}}}, {}]})
    assert [each.pose.position.z for each in path.poses] == [3.0, 0.0]
    assert made("std_msgs/msg/Bool", {"data": True}).data is True
    assert math.isnan(made("std_msgs/msg/Float32", {"data": math.nan}).data)


@pytest.mark.parametrize(
    ("kind", "fields", "says"),
    [
        ("geometry_msgs/msg/Twist", {"linaer": {}}, "linaer: no such field (did you mean linear?"),
        ("geometry_msgs/msg/Twist", {1: 2}, "it.1: no such field; allowed: linear, angular"),
        ("geometry_msgs/msg/Twist", {"linear": [1]}, "it.linear: got [1]; allowed: a table"),
        ("geometry_msgs/msg/Twist", {"linear": {"x": True}}, "x: got True; allowed: a float64"),
        ("std_msgs/msg/Float64", {"data": 10**400}, "allowed: a float64"),
        ("std_msgs/msg/Float32", {"data": 1e300}, "it.data: got 1e+300; allowed: a float32"),
        ("std_msgs/msg/UInt8", {"data": 300}, "it.data: got 300; allowed: a uint8"),
        ("std_msgs/msg/UInt8", {"data": True}, "it.data: got True; allowed: a uint8"),
        ("std_msgs/msg/Int64", {"data": 1.0}, "it.data: got 1.0; allowed: an int64"),
        ("std_msgs/msg/Bool", {"data": 1}, "it.data: got 1; allowed: a bool"),
        ("std_msgs/msg/String", {"data": None}, "it.data: got None; allowed: a string"),
        ("std_msgs/msg/String", {"data": "\ud800"}, "allowed: a string"),
        ("sensor_msgs/msg/JointState", {"name": "left"}, "it.name: got 'left'; allowed: a list"),
        ("sensor_msgs/msg/JointState", {"name": ["a", 2]}, "it.name[1]: got 2; allowed: a st"),
        ("std_msgs/msg/Int8MultiArray", {"data": [1, 200]}, "it.data[1]: got 200; allowed: an"),
        ("nav_msgs/msg/Path", {"poses": [{"pose": 1}]}, "it.poses[0].pose: got 1; allowed"),
        ("geometry_msgs/msg/PoseWithCovariance", {"covariance": [1, 2]}, "a list of 36 items"),
    ],
)  # fmt: skip
def test_what_does_not_fit_is_refused_by_name(kind, fields, says):
    with pytest.raises(UserError) as refused:
        cdr_from_fields(kind, fields, "it")
    assert says in str(refused.value)


names = st.sampled_from(["linear", "header", "stamp", "sec", "data", "poses", "pose", "name", "x"])
values = st.recursive(
    st.one_of(st.none(), st.booleans(), st.integers(), st.floats(), st.text(max_size=3)),
    lambda inner: st.one_of(st.lists(inner, max_size=3), st.dictionaries(names, inner, max_size=3)),
    max_leaves=8,
)


@pytest.mark.slow
@law(300)
@given(st.sampled_from(KINDS), st.dictionaries(names, values, max_size=3))
def test_whatever_people_write_it_is_a_message_or_refused_in_words(kind, fields):
    try:
        payload = cdr_from_fields(kind, fields, "it")
    except UserError:
        return
    assert to_cdr(from_cdr(payload, kind), kind) == payload
