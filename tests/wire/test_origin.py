"""Names of topics that a gateway sends for robots elsewhere."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sdrlinkd.errors import PduError
from sdrlinkd.wire import (
    Description,
    is_topic_name,
    name_for,
    parse_description,
    pieces,
    read_origin,
)

TYPE = "nav_msgs/msg/Odometry"


@given(robot=st.integers(0, 254), name=st.text(min_size=1))
def test_a_name_says_whose_topic_it_is(robot, name):
    if "\n" not in name and not name.startswith("/"):
        assert read_origin(name_for(robot, name)) == (robot, name)


@given(name=st.text())
def test_any_text_has_an_origin_and_a_ros_name_has_none(name):
    robot, rest = read_origin(name)
    assert rest == name or name_for(robot, rest) == name
    if is_topic_name(name):
        assert robot is None


@pytest.mark.parametrize("name", ["@255/odom", "@01/odom", "@/odom", "@1", "@1/", "@-1/odom"])
def test_what_does_not_have_the_form_has_no_origin(name):
    assert read_origin(name) == (None, name)


def told(name):
    (piece,) = pieces(16, Description(name, TYPE), 200)
    return parse_description(piece.data, piece.check)


@pytest.mark.parametrize("name", ["@1/odom", "@254/robot_2/cmd_vel"])
def test_such_a_topic_can_be_declared(name):
    assert told(name).name == name


@pytest.mark.parametrize("name", ["@1/@2/odom", "@1//odom", "@255/odom", "@1/o dom", "odom@1"])
def test_others_are_refused(name):
    with pytest.raises(PduError, match="is no topic name"):
        told(name)
