"""ROS 2 nodes on rmw_zenoh see the robots that a gateway hears, and command them.

The nodes are of zenoh-ros2-sdk, which has the keys, tokens and attachments from another author.
"""

import struct
import time

import pytest
import zenoh.ext
from zenoh_ros2_sdk import ROS2Publisher, ROS2Subscriber
from zenoh_ros2_sdk.qos import QosDurability, QosProfile, QosReliability
from zenoh_ros2_sdk.session import ZenohSession

from sdrlinkd.adapters import definition, empty, to_cdr, type_hash
from sdrlinkd.client import Publisher, Subscriber
from sdrlinkd.fleet.testing import Attachment, Node, Qos, Role, gid, read_data_key, read_endpoint
from tests.fleet.conftest import FIRST, ROBOT, SECOND
from tests.waiting import wait_for

ODOM, TWIST, GRID = "nav_msgs/msg/Odometry", "geometry_msgs/msg/Twist", "nav_msgs/msg/OccupancyGrid"
TEXT = "std_msgs/msg/String"
DOMAIN = 42
ALLOWED = f'ros_domain = {DOMAIN}\ndown = ["cmd_vel"]\n'


def odometry(x):
    message = empty(ODOM)
    message.pose.pose.position.x = x
    message.header.frame_id = "odom"
    return to_cdr(message, ODOM)


@pytest.fixture
def desk(start_fleet):
    """A fleet, and what a node needs to join its graph."""
    fleet = start_fleet(ALLOWED)
    wait_for(lambda: fleet.leader is not None)
    port = int(fleet.router.endpoint.rpartition(":")[2])
    there = {"router_ip": "127.0.0.1", "router_port": port, "domain_id": DOMAIN}

    def node(kind, topic, type_, *more, **options):
        known = {"msg_definition": definition(type_), "type_hash": type_hash(type_)}
        return kind(topic, type_, *more, **known, **there, **options)

    fleet.node = node
    yield fleet
    # The package keeps one session for the whole process, and tells of it nowhere.
    if (used := ZenohSession._instance) is not None:  # noqa: SLF001
        used.close()


def tokens(fleet, role=None):
    """The endpoints of gateways in the graph."""
    found = fleet.router.session.liveliness().get(f"@ros2_lv/{DOMAIN}/**")
    read = [read_endpoint(str(each.ok.key_expr)) for each in found if each.ok is not None]
    return [
        each
        for each in read
        if each and each.node.startswith("sdrlink_gateway_") and role in (None, each.role)
    ]


@pytest.mark.slow
def test_a_node_gets_each_message_once_and_typed(desk):
    got = []
    desk.node(ROS2Subscriber, f"/robot_{ROBOT}/odom", ODOM, got.append)
    with Publisher(runtime_dir=desk.daemons[ROBOT].directory) as out:
        for number in range(50):
            out.send(f"/robot_{ROBOT}/odom", odometry(float(number)))
            time.sleep(0.02)
    wait_for(lambda: len(got) >= 50)
    assert [each.pose.pose.position.x for each in got] == [float(n) for n in range(50)]
    published = tokens(desk, Role.PUBLISHER)
    assert {each.name for each in published} == {f"/robot_{ROBOT}/odom"}
    assert {each.hash for each in published} == {type_hash(ODOM)}


@pytest.mark.long
def test_a_node_commands_a_robot_once_through_one_gateway(desk):
    command = desk.node(ROS2Publisher, f"/robot_{ROBOT}/cmd_vel", TWIST)
    wait_for(lambda: [each.name for each in tokens(desk, Role.SUBSCRIPTION)])
    other = desk.node(ROS2Publisher, f"/robot_{ROBOT}/odom", ODOM)
    twist = empty(TWIST)
    with Subscriber("/*", runtime_dir=desk.daemons[ROBOT].directory) as heard:
        for number in range(20):
            twist.linear.x = float(number)
            command.publish(linear=twist.linear, angular=twist.angular)
            time.sleep(0.02)
        message = empty(ODOM)
        other.publish(**{name: getattr(message, name) for name in message.__dataclass_fields__
                         if name != "__msgtype__"})  # fmt: skip
        got = [heard.receive(10) for _ in range(20)]
        wait_for(lambda: desk.report(FIRST).down["down_not_allowed"] == 1)
    assert [struct.unpack_from("<d", each.payload, 4)[0] for each in got] == [*range(20)]
    assert {each.source for each in got} == {desk.leader}
    shown = tokens(desk, Role.SUBSCRIPTION)
    assert [(each.name, each.kind) for each in shown] == [
        (f"/robot_{ROBOT}/cmd_vel", "geometry_msgs::msg::dds_::Twist_")
    ]
    for gateway in (FIRST, SECOND):
        report = desk.report(gateway)
        assert report.down_taken == sum(report.down.values()) == 21


@pytest.mark.long
def test_a_late_node_gets_what_is_latched(start_fleet):
    fleet = start_fleet(
        f'ros_domain = {DOMAIN}\n[topic.map]\ndurability = "transient_local"\ndepth = 1\n'
    )
    grid, got = to_cdr(empty(GRID), GRID), []
    with Publisher(runtime_dir=fleet.daemons[ROBOT].directory) as out:
        out.send(f"/robot_{ROBOT}/map", grid)
        wait_for(lambda: any(each.name.endswith("map") for each in tokens(fleet)))
        # This is what rmw_zenoh does for a subscription that is transient local.
        key = f"{DOMAIN}/robot_{ROBOT}/map/nav_msgs::msg::dds_::OccupancyGrid_/{type_hash(GRID)}"
        late = zenoh.ext.declare_advanced_subscriber(
            fleet.router.session, key, lambda sample: got.append(sample.payload.to_bytes()),
            history=zenoh.ext.HistoryConfig(detect_late_publishers=True),
        )  # fmt: skip
        wait_for(lambda: got == [grid])
        late.undeclare()


@pytest.mark.long
def test_the_hash_of_a_type_that_is_unknown_here_is_learnt_from_subscriptions(start_fleet):
    fleet = start_fleet(f"ros_domain = {DOMAIN}\n", top="auto = true\n")
    thing, right, wrong = "my_msgs/msg/Thing", f"RIHS01_{'ab' * 32}", f"RIHS01_{'cd' * 32}"
    got, session, name = [], fleet.router.session, f"/robot_{ROBOT}/thing"
    there = []  # What nobody refers to, Zenoh takes down.
    with fleet.daemons[ROBOT].control() as control:
        control.ask("declare", {"name": name, "type": thing, "hash": right})
    kind = "my_msgs::msg::dds_::Thing_"
    for number, hash_ in enumerate((right, wrong)):
        node = Node(DOMAIN, "0123456789abcdef", "desk")
        token = node.endpoint(number, Role.SUBSCRIPTION, name, kind, hash_, Qos())
        key = f"{DOMAIN}{name}/{kind}/{hash_}"
        there.append(session.liveliness().declare_token(token))
        there.append(session.declare_subscriber(key, lambda each: got.append(str(each.key_expr))))
    with Publisher(runtime_dir=fleet.daemons[ROBOT].directory) as out:
        # The hash that the robot tells comes to the gateways a moment after the topic.
        wait_for(lambda: out.send(name, b"\0\1\0\0thing") is None and bool(got))
    assert set(got) == {f"{DOMAIN}{name}/{kind}/{right}"}


# Vectors from the design document of rmw_zenoh, and from a node of zenoh-ros2-sdk on a router.
NODE = "@ros2_lv/2/aac3178e146ba6f1fc6e6a4085e77f21/0/0/NN/%/%/listener"
SUBSCRIPTION = (
    "@ros2_lv/2/8b20917502ee955ac4476e0266340d5c/0/10/MS/%/%/listener/%chatter/"
    "std_msgs::msg::dds_::String_/"
    "RIHS01_df668c740482bbd48fb39d76a70dfd4bd59db1288021743503259e948f6b1a18/::,10:,:,:,,"
)


def test_tokens_are_those_of_rmw_zenoh():
    assert Node(2, "aac3178e146ba6f1fc6e6a4085e77f21", "listener").token == NODE
    found = read_endpoint(SUBSCRIPTION)
    assert (found.role, found.name, found.node) == (Role.SUBSCRIPTION, "/chatter", "listener")
    node = Node(2, "8b20917502ee955ac4476e0266340d5c", "listener")
    again = node.endpoint(10, Role.SUBSCRIPTION, found.name, found.kind, found.hash, Qos())
    assert again == SUBSCRIPTION
    assert found.hash == type_hash(TEXT)
    assert read_endpoint(NODE) is None


@pytest.mark.parametrize(
    ("qos", "reliability", "durability"),
    [
        (Qos(), "RELIABLE", "VOLATILE"),
        (Qos(is_best_effort=True, depth=5), "BEST_EFFORT", "VOLATILE"),
        (Qos(is_latched=True, depth=1), "RELIABLE", "TRANSIENT_LOCAL"),
    ],
)
def test_qos_is_told_as_others_tell_it(qos, reliability, durability):
    profile = QosProfile(
        reliability=QosReliability[reliability], durability=QosDurability[durability],
        history_depth=qos.depth,
    )  # fmt: skip
    assert qos.text() == profile.encode()
    assert QosProfile.decode(qos.text()) == profile


def test_a_gid_is_the_hash_of_the_token():
    # The specification of XXH3_128 gives 99aa06d3014798d8 6001c324468d497f for no octets.
    assert gid("").hex() == "7f498d4624c30160d8984701d306aa99"


def test_attachments_are_read_back_and_others_are_refused():
    given = Attachment(3, 1_700_000_000_000_000_000, bytes(range(16)))
    assert Attachment.parse(given.build()) == given
    assert len(given.build()) == 33
    for octets in (None, b"", given.build()[:-1], given.build() + b"\0", bytes(33)):
        assert Attachment.parse(octets) is None


def test_keys_of_messages_are_read_back():
    key = f"{DOMAIN}/robot_2/camera/image/sensor_msgs::msg::dds_::Image_/RIHS01_00"
    assert read_data_key(DOMAIN, key) == ("/robot_2/camera/image", "sensor_msgs::msg::dds_::Image_")
    assert read_data_key(7, key) is None
    assert read_data_key(DOMAIN, f"{DOMAIN}/a") is None
