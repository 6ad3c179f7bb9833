"""The bridge for real: daemons with modems, a bridge, and a client of Foxglove's protocol."""

import json
import struct
import subprocess

import pytest
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from sdrlinkd.adapters import cdr_from_fields
from sdrlinkd.client import Publisher, Subscriber
from sdrlinkd.process import module
from tests.foxglove.conftest import bridge_to, url_of
from tests.foxglove.viewer import Viewer
from tests.waiting import wait_for

pytestmark = pytest.mark.slow
ODOMETRY, TWIST = "nav_msgs/msg/Odometry", "geometry_msgs/msg/Twist"
POSE, FIX = "geometry_msgs/msg/PoseWithCovarianceStamped", "sensor_msgs/msg/NavSatFix"
CDR = b"\0\1\0\0"


def odometry(x, frame="odom"):
    fields = {"header": {"frame_id": frame}, "pose": {"pose": {"position": {"x": x}}}}
    return cdr_from_fields(ODOMETRY, fields, "odom")


def test_topics_come_with_their_schemas_and_their_very_octets(team):
    team.declare("odom", ODOMETRY)
    team.declare("strange", "strange_msgs/msg/Unheard")
    sent = [odometry(number / 7) for number in range(3)]
    odd = CDR + bytes(range(256)) + b"\0\0\0"
    with (
        Viewer(team.url, "/rx_robot_1/*") as viewer,
        Publisher(runtime_dir=team.sender.directory) as out,
    ):
        # A client hears of a topic with its first message, and subscribes then.
        out.send("/robot_1/odom", odometry(0.0))
        out.send("/robot_1/strange", CDR)
        for name in ("odom", "strange"):
            viewer.until(lambda name=name: viewer.payloads(f"/rx_robot_1/{name}"))
        for each in sent:
            out.send("/robot_1/odom", each)
            viewer.until(lambda each=each: viewer.payloads("/rx_robot_1/odom")[-1:] == [each])
        out.send("/robot_1/strange", odd)
        viewer.until(lambda: viewer.payloads("/rx_robot_1/odom")[-3:] == sent)
        viewer.until(lambda: viewer.payloads("/rx_robot_1/strange")[-1:] == [odd])
        # Who comes later gets the last message, and nobody else gets it again.
        n = len(viewer.payloads("/rx_robot_1/strange"))
        with Viewer(team.url, "/rx_robot_1/*") as late:
            late.until(lambda: late.payloads("/rx_robot_1/odom"))
            late.until(lambda: late.payloads("/rx_robot_1/strange"))
        out.send("/robot_1/strange", CDR)
        viewer.until(lambda: viewer.payloads("/rx_robot_1/strange")[-1:] == [CDR])
        assert len(viewer.payloads("/rx_robot_1/strange")) == n + 1
    assert late.payloads("/rx_robot_1/odom") == [sent[-1]]
    assert late.payloads("/rx_robot_1/strange") == [odd]
    shown = viewer.channels["/rx_robot_1/odom"]
    assert (shown["encoding"], shown["schemaEncoding"]) == ("cdr", "ros2msg")
    assert shown["schemaName"] == ODOMETRY
    types = get_types_from_msg(shown["schema"], ODOMETRY)
    known = get_typestore(Stores.ROS2_HUMBLE).fielddefs
    assert types[ODOMETRY][1] == known[ODOMETRY][1]
    assert POSE.replace("Stamped", "") in types
    unheard = viewer.channels["/rx_robot_1/strange"]
    assert unheard["schemaName"] == "strange_msgs/msg/Unheard"
    assert (unheard["schemaEncoding"], unheard["schema"]) == ("", "")
    assert viewer.info["capabilities"] == ["clientPublish"]


def test_the_state_is_what_status_says(team):
    def asked():
        at = ("--json", "--runtime-dir", team.seen.directory)
        done = subprocess.run(module("sdrlinkd.cli", "status", *at), capture_output=True)
        return json.loads(done.stdout)

    with Viewer(team.url, "/sdrlink/status") as viewer:
        viewer.until(lambda: viewer.messages)
        before = asked()
        newer = viewer.until(
            lambda: [each for each in viewer.decoded("/sdrlink/status")
                     if each["taken_at_unix_ns"] > before["taken_at_unix_ns"]]
        )  # fmt: skip
        after = asked()
    shown = newer[0]
    times = [time_ns for time_ns, _ in viewer.messages["/sdrlink/status"]]
    assert shown["taken_at_unix_ns"] in times
    assert shown["taken_at_unix_ns"] < after["taken_at_unix_ns"]
    assert _shape(shown) == _shape(after)
    for name in ("version", "node", "namespace", "verdict", "state"):
        assert shown[name] == after[name]
    (neighbor,), (early,), (late,) = (each["link"]["neighbors"] for each in (shown, before, after))
    assert early["pdus_heard"] <= neighbor["pdus_heard"] <= late["pdus_heard"]
    assert neighbor["snr_db"] == pytest.approx(late["snr_db"], abs=3)
    assert shown["link"]["tx"]["queued_by_class"].keys() == {"urgent", "latency", "default", "bulk"}
    properties = json.loads(viewer.channels["/sdrlink/status"]["schema"])["properties"]
    assert properties.keys() == shown.keys()


def _shape(value):
    """The fields of a report, without its values and the names in its maps."""
    if isinstance(value, dict):
        return {key: _shape(each) for key, each in value.items() if not key.endswith("dropped")}
    return None


def test_a_robot_is_where_it_says_that_it_is(team):
    team.declare("odom", ODOMETRY)
    team.declare("amcl_pose", POSE)
    team.declare("gps", FIX)
    frames, robots = "/sdrlink/frames", "/sdrlink/robots"
    location = "/sdrlink/robot_1/location"

    def placed():
        return [(each.transforms[0].parent_frame_id, each.transforms[0].translation.x)
                for each in viewer.decoded(frames)]  # fmt: skip

    with (
        Viewer(team.url, "/sdrlink/*") as viewer,
        Publisher(runtime_dir=team.sender.directory) as out,
    ):
        viewer.until(lambda: {frames, robots} <= set(viewer.channels))
        for x in (1.5, 2.5, 3.5):
            out.send("/robot_1/odom", odometry(x))
            viewer.until(lambda x=x: placed()[-1:] == [("robot_1/odom", x)])
        (shown,) = viewer.until(lambda: viewer.decoded(robots)[2:])[0].entities
        assert (shown.id, shown.frame_id, shown.texts[0].text) == (
            "robot_1", "robot_1/odom", "robot 1",
        )  # fmt: skip
        assert shown.arrows[0].pose.position.x == 3.5
        (_, root) = viewer.decoded(frames)[-1].transforms
        assert (root.parent_frame_id, root.child_frame_id) == ("map", "robot_1/odom")
        at = {"pose": {"pose": {"position": {"y": -4.0}}}, "header": {"frame_id": "/map"}}
        out.send("/robot_1/amcl_pose", cdr_from_fields(POSE, at, "amcl_pose"))
        viewer.until(lambda: placed()[-1:] == [("map", 0.0)])
        assert viewer.decoded(frames)[-1].transforms[0].translation.y == -4.0
        # A place on the map is better than one by odometry.
        n = len(placed())
        out.send("/robot_1/odom", odometry(9.0))
        for latitude in (47.1, 47.2):
            fix = {"latitude": latitude, "longitude": 8.5, "altitude": 400.0}
            out.send("/robot_1/gps", cdr_from_fields(FIX, fix, "gps"))
            viewer.until(lambda: location in viewer.channels)
        viewer.until(lambda: [each.latitude for each in viewer.decoded(location)[-1:]] == [47.2])
        assert len(placed()) == n
        # Messages that are not of their type are counted, and nothing else happens.
        out.send("/robot_1/odom", CDR + b"\xff" * 30)
        viewer.until(lambda: any(each["unreadable"] == 1 for each in _reports(viewer)))


def test_commands_go_where_the_pattern_allows_and_nowhere_else(team):
    topic, twist = "/rx_robot_2/robot_1/cmd_vel", CDR + struct.pack("<6d", 0.5, 0, 0, 0, 0, -1)
    with (
        Subscriber(topic, runtime_dir=team.sender.directory) as heard,
        Viewer(team.url, "/sdrlink/bridge") as viewer,
    ):
        viewer.until(lambda: viewer.info)
        viewer.advertise(1, "/robot_1/cmd_vel")
        viewer.publish(1, twist)
        message = heard.receive(20)
        assert (message.payload, message.type, message.source) == (twist, TWIST, 2)
        viewer.advertise(2, "/robot_1/cmd_vel", "geometry_msgs/Twist", "json")
        viewer.publish(2, b'{"linear": {"x": 0.5}, "angular": {"z": -1}}')
        assert heard.receive(20).payload == twist
        assert team.seen.snapshot().link.airtime_by_class_s["urgent"] > 0
        assert viewer.statuses == []
        refused = {
            (3, "/robot_1/odom", ODOMETRY, "cdr"):
                'publish: got "/robot_1/odom"; allowed: /robot_1/cmd_*; --publish',
            (4, "/robot_1/cmd_x", "Twist", "cdr"): 'type: got "Twist"; allowed: pkg/msg/Name',
            (5, "/robot_1/cmd_y", TWIST, "flat"): 'encoding: got "flat"; allowed: cdr, json',
        }  # fmt: skip
        for (number, *channel), sentence in refused.items():
            viewer.advertise(number, *channel)
            viewer.until(lambda told=sentence: told in "".join(_sentences(viewer)))
            viewer.publish(number, twist)
        viewer.publish(2, b'{"linear": {"q": 1}}')
        viewer.until(lambda: "cmd_vel.linear.q: no such field" in "".join(_sentences(viewer)))
        viewer.publish(2, b"\xff")
        viewer.until(lambda: "no JSON" in "".join(_sentences(viewer)))
        counts = viewer.until(
            lambda: [each for each in _reports(viewer) if each["commands_refused"] == 5]
        )
        assert counts[0]["commands_sent"] == 2
        assert heard.receive(20).is_stop, "as no more commands come"
        assert heard.receive(0.2) is None
    assert team.seen.snapshot().link.tx.accepted == 2


def _reports(viewer):
    return viewer.decoded("/sdrlink/bridge")


def _sentences(viewer):
    return [each["message"] for each in viewer.statuses]


@pytest.mark.long
def test_a_topic_of_the_registry_is_sent_as_this_robots_own(start_daemon):
    daemon = start_daemon('namespace = "robot_2"\n')
    with (
        bridge_to(daemon, "--publish", "/*") as bridge,
        Viewer(url_of(bridge), "/sdrlink/bridge") as viewer,
    ):
        viewer.until(lambda: any(each["has_daemon"] for each in _reports(viewer)))
        viewer.advertise(1, "/robot_9/cmd_vel")
        viewer.publish(1, CDR + bytes(48))
        wait_for(lambda: daemon.snapshot().link.tx.sent == 1)
        (sent,) = [each for each in daemon.snapshot().link.topics if each.sent]
        assert sent.name == "/robot_2/cmd_vel"
        viewer.advertise(2, "/robot_2/cmd_vel")
        viewer.publish(2, CDR + bytes(48))
        viewer.until(lambda: "this is the bridge's own robot" in "".join(_sentences(viewer)))
        viewer.advertise(3, "/robot_9/nothing")
        viewer.publish(3, CDR)
        viewer.until(lambda: "/robot_9/nothing: not sent: " in "".join(_sentences(viewer)))
        viewer.advertise(4, "/robot_300/cmd_vel")
        viewer.until(lambda: "allowed: topics of a robot" in "".join(_sentences(viewer)))


@pytest.mark.long
def test_the_bridge_waits_for_the_daemon_and_goes_on(start_daemon):
    daemon = start_daemon()
    topic = "/rx_robot_1/odom"

    def comes(message):
        """Whether a message has come; it is sent anew, as ZeroMQ may still be connecting."""
        out.send("/robot_1/imu", message)
        out.send("/robot_1/odom", message)
        return topic in viewer.channels and message in viewer.payloads(topic)

    def has_daemon():
        return [each["has_daemon"] for each in _reports(viewer)][-1:]

    daemon.stop()
    with bridge_to(daemon, topic) as bridge, Viewer(url_of(bridge), "*") as viewer:
        viewer.until(lambda: has_daemon() == [False])
        wait_for(lambda: "waiting for it" in bridge.log())
        for number in (1.0, 2.0):
            daemon.at_work()
            viewer.until(lambda: has_daemon() == [True])
            with Publisher(runtime_dir=daemon.directory) as out:
                viewer.until(lambda n=number: comes(odometry(n)))
            daemon.stop()
        viewer.until(lambda: has_daemon() == [False])
        # What was not named is not shown, and was not subscribed to.
        assert [each for each in viewer.channels if each.startswith("/rx_")] == [topic]
        assert bridge.is_running
        assert "Traceback" not in bridge.log()
