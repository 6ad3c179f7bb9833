"""Names, types and routes of the bridge, which need no ROS."""

import sys

import pytest
from hypothesis import given
from hypothesis import strategies as st
from sdrlink_ros.echoes import Echoes
from sdrlink_ros.kinds import UnknownTypeError, kind
from sdrlink_ros.names import Names, command_for, is_command, left_out, matches, unused
from sdrlink_ros.offer import Offer
from sdrlink_ros.routes import decide
from sdrlink_ros.settings import Settings

ODOM, IMAGE = "nav_msgs/msg/Odometry", "sensor_msgs/msg/Image"
TF = "tf2_msgs/msg/TFMessage"


def offer(name, kind_=ODOM, nodes=("/driver",), n=1, latched=False, reliable=True, depth=0):
    kinds = (kind_,) if isinstance(kind_, str) else kind_
    return Offer(name, kinds, "", reliable, latched, n, depth, nodes)


def routes(*offers, own=1, heard=(), **settings):
    names = Names(own, "/robot_{src}")
    return decide({each.name: each for each in offers}, Settings(**settings), names, heard)


@pytest.mark.parametrize(
    ("name", "kind_", "settings", "is_sent"),
    [
        ("/odom", ODOM, {}, True),
        ("/rosout", ODOM, {}, False),
        ("/clock", ODOM, {}, False),
        ("/diagnostics", ODOM, {}, True),
        ("/diagnostics_agg", ODOM, {}, False),
        ("/a/_hidden", ODOM, {}, False),
        ("/camera", IMAGE, {}, False),
        ("/camera", IMAGE, {"allow": ("/*", "/camera")}, True),
        ("/camera", IMAGE, {"allow": ("camera*",)}, True),
        ("/odom", ODOM, {"allow": ("camera*",)}, False),
        ("/odom", ODOM, {"deny": ("/o*",)}, False),
        ("/odom", ODOM, {"allow": ("/odom",), "deny": ("/odom",)}, False),
        ("/clock", ODOM, {"allow": ("/*", "/clock")}, True),
        ("/cmd_vel", ODOM, {}, False),
        ("/cmd_vel", ODOM, {"commands": ()}, True),
    ],
)
def test_what_goes_over_the_radio(name, kind_, settings, is_sent):
    found = routes(offer(name, kind_), **settings)
    assert (name in found.taken) == is_sent
    assert (name in found.left_out) != is_sent, "the reason is told"


def test_a_name_with_a_robots_prefix_is_a_command_or_its_own():
    found = routes(offer("/robot_2/cmd_vel"), offer("/robot_1/odom"), offer("/robot_3/a/b"))
    assert [(each.bus, each.robot) for each in found.taken.values()] == [
        ("/odom", None), ("/robot_2/cmd_vel", 2), ("/robot_3/a/b", 3),
    ]  # fmt: skip
    found = routes(offer("/robot_2/led"), heard={(2, "led")})
    assert "robot 2 sends it, and /driver here commands it" in found.refused["/robot_2/led"]
    assert routes(offer("/robot_2/cmd_vel"), heard={(2, "cmd_vel")}).taken, "always a command"
    assert "no robot's id" in routes(offer("/robot_255/x")).refused["/robot_255/x"]
    both = routes(offer("/odom"), offer("/robot_1/odom"))
    assert list(both.taken) == ["/odom"]
    assert "has the name of /odom" in both.refused["/robot_1/odom"]
    two_types = routes(offer("/x", (IMAGE, ODOM)))
    assert "use one type" in two_types.refused["/x"]


@pytest.mark.parametrize(
    ("offered", "depth"),
    [
        (offer("/x"), 0),
        (offer("/x", n=2, depth=7), 14),
        (offer("/x", n=2, reliable=False), 10),
        (offer("/x", n=2, reliable=False, depth=1), 2),
        (offer("/x", n=2, depth=9000), 10_000),
        (offer("/x", latched=True, depth=5), 5),
        (offer("/x", n=3, latched=True, depth=1), 3),
        (offer("/x", latched=True), 5),
        (offer("/x", n=2, latched=True, depth=200), 255),
        (offer("/tf_static", TF, n=3, latched=True, depth=100), 1),
        (offer("/tf_static", TF, n=2, depth=3), 6),
    ],
)
def test_there_is_room_for_the_messages_of_each_publisher(offered, depth):
    """Where ROS does not tell the depth it is generous, and /tf_static has one for each frame."""
    (route,) = routes(offered).taken.values()
    assert route.depth == depth


def test_names_of_other_robots_and_commands():
    names = Names(2, "/robots/r{src}")
    assert names.here(1, "a/odom") == "/robots/r1/a/odom"
    assert names.address("/robots/r7/a/odom") == (7, "/a/odom")
    assert names.address("/robots/r7") is None
    assert (names.local("/robots/r2/odom"), names.local("/robots/r1/odom")) == (
        "/odom", "/robots/r1/odom",
    )  # fmt: skip
    for bad in ("robot_{src}", "/robot", "/{src}{src}", "/a b{src}", "/{src}/"):
        with pytest.raises(ValueError, match="rx_format: got"):
            Names(1, bad)
    assert command_for(2, "robot_2/cmd_vel") == "/cmd_vel"
    assert command_for(1, "robot_2/cmd_vel") is None
    assert [is_command(each) for each in ("robot_2/x", "robot_x/x", "odom")] == [True, False, False]


def test_patterns_that_match_nothing_name_the_nearest():
    assert unused(["/odmo", "/o*"], ["/odom", "/imu"]) == {"/odmo": ["/odom"]}
    assert matches("/odom", ["odom"])
    assert left_out("/odom", ODOM, [], []) == "not named by the parameter allow"


@pytest.mark.parametrize("name", ["no_such_msgs/msg/Thing", "this/msg/Thing", "", "a", "../b/c"])
def test_a_type_that_is_not_installed_names_its_package(name):
    with pytest.raises(UnknownTypeError, match="this type is not installed here; install"):
        kind(name)
    assert "this" not in sys.modules, "a name from the air imports nothing"


@given(st.binary(min_size=4, max_size=40), st.binary(max_size=3))
def test_own_messages_are_known_once_each_whatever_dds_appends(cdr, more):
    echoes = Echoes()
    echoes.sent("/tf", cdr)
    assert not echoes.is_own("/tf", cdr), "it does not subscribe to that"
    echoes.watched = frozenset({"/tf"})
    received = cdr + more[: -len(cdr) % 4] + bytes(max(0, -len(cdr) % 4 - len(more)))
    echoes.sent("/tf", cdr)
    echoes.sent("/tf", cdr)
    assert not echoes.is_own("/other", received)
    assert [echoes.is_own("/tf", received) for _ in range(3)] == [True, True, False]
    # What was latched comes again to each new subscription, also to a later one.
    echoes.watched = frozenset()
    echoes.sent("/tf", cdr, is_latched=True)
    assert [echoes.is_own("/tf", received) for _ in range(3)] == [True] * 3
