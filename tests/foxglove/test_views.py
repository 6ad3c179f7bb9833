"""Places, schemas, layout and the command's own words; without daemons and servers."""

import math
import re
import sys

import pytest

from docs.site import foxglove_layout
from sdrlinkd.adapters import Fix, Place, cdr_from_fields, read_place
from sdrlinkd.cli import run
from sdrlinkd.cli.bridge import meanings
from sdrlinkd.extras import hint
from sdrlinkd.foxglove import BridgeReport, json_schema, judge
from sdrlinkd.reports import Snapshot

ODOMETRY, STAMPED = "nav_msgs/msg/Odometry", "geometry_msgs/msg/PoseStamped"
FIX = "sensor_msgs/msg/NavSatFix"


def fix(**fields):
    return read_place(2, FIX, cdr_from_fields(FIX, fields, "fix"))


def stamped(frame="odom", **pose):
    fields = {"header": {"frame_id": frame}, "pose": pose}
    return read_place(2, STAMPED, cdr_from_fields(STAMPED, fields, "pose"))


def test_places_are_read_in_frames_of_their_own():
    position = {"x": 1.0, "y": 2.0, "z": 3.0}
    found = stamped(position=position, orientation={"z": 1.0, "w": 0.0})
    assert found == Place("robot_2/odom", (1.0, 2.0, 3.0), (0.0, 0.0, 1.0, 0.0))
    assert not found.is_shared
    assert stamped("/map").is_shared
    assert stamped("robot_2/odom").frame == "robot_2/odom"
    assert stamped("robot_3/odom").frame == "robot_2/robot_3/odom"
    assert len(stamped("x" * 1000).frame) < 100
    # Zeros are no quaternion; a robot that sends them is drawn without a turn.
    assert stamped(orientation={"w": 0.0}).turn == (0.0, 0.0, 0.0, 1.0)
    assert stamped(position={"x": math.nan}) is None
    assert stamped(orientation={"x": math.inf}) is None
    assert read_place(2, "sensor_msgs/msg/Imu", b"") is None


def test_fixes_are_read_if_they_are_any():
    found = fix(latitude=47.0, longitude=8.0, altitude=math.nan, position_covariance_type=2)
    assert found == Fix("robot_2/", 47.0, 8.0, 0.0, [0.0] * 9, 2)
    assert fix(latitude=47.0, longitude=8.0, status={"status": -1}) is None
    assert fix(latitude=91.0, longitude=8.0) is None
    assert fix(latitude=math.nan, longitude=8.0) is None


def test_commands_are_judged_in_a_sentence():
    allowed = ["/robot_*/cmd_vel", "/robot_3/*"]
    assert judge("/robot_2/cmd_vel", "a/msg/B", "cdr", allowed)[:3] == (2, "/cmd_vel", "a/msg/B")
    assert judge("/robot_3/arm/goal", "a/B", "json", allowed).type == "a/msg/B"
    refused = {
        ("/robot_2/led", "a/B", "cdr"): 'got "/robot_2/led"; allowed: /robot_*/cmd_vel, /robot_3/*',
        ("/robot_3/a b", "a/B", "cdr"): "allowed: topics of a robot, such as /robot_2/cmd_vel",
        ("/robot_999/cmd_vel", "a/B", "cdr"): "allowed: topics of a robot",
        ("/robot_2/x/cmd_vel", "", "cdr"): 'type: got ""; allowed: pkg/msg/Name',
        ("/robot_2/cmd_vel", "a/B", "ros1"): 'encoding: got "ros1"; allowed: cdr, json',
    }
    for given, words in refused.items():
        assert words in judge(*given, allowed), given
    assert "allowed: none; --publish" in judge("/robot_2/cmd_vel", "a/B", "cdr", [])
    assert 'got "/a?b?"' in judge("/a\nb\x1b", "a/B", "cdr", [])
    assert len(judge("x" * 5000, "a/B", "cdr", [])) < 250


@pytest.mark.parametrize("report", [Snapshot, BridgeReport])
def test_schemas_have_only_what_foxglove_reads(report):
    def check(schema, path):
        assert schema["type"] in ("object", "array", "string", "number", "integer", "boolean"), path
        assert set(schema) <= {"title", "type", "properties", "items"}, path
        if schema["type"] == "object":
            for name, each in schema["properties"].items():
                check(each, f"{path}.{name}")
        if schema["type"] == "array":
            assert schema["items"]["type"] != "array", path
            check(schema["items"], path)

    made = json_schema(report)
    check(made, report.__name__)
    assert list(made["properties"]) == list(report.__struct_fields__)


def test_the_layout_is_that_of_its_description_and_shows_what_there_is():
    text = foxglove_layout.FILE.read_text()
    assert text == foxglove_layout.text(), "`make reference` writes it anew"
    paths = re.findall(r'"(?:value|path|topicPath)": "(/sdrlink/[^"]+)"', text)
    assert len(paths) > 15
    schemas = {
        "/sdrlink/status": json_schema(Snapshot),
        "/sdrlink/bridge": json_schema(BridgeReport),
    }
    for path in paths:
        topic, *steps = path.replace("[:]", ".[:]").split(".")
        schema = schemas[topic]
        for step in steps:
            is_map = schema["type"] == "object" and not schema["properties"]
            schema = (
                {"type": "number"} if is_map else schema["items"] if step == "[:]"
                else schema["properties"][step]
            )  # fmt: skip
    panels = set(re.findall(r'"panelType": "([^"]+)"', text))
    assert {"ThreeDee", "Map", "Plot", "Table", "Indicator", "StateTransitions"} <= panels
    assert "/sdrlink/robots" in text


def test_a_missing_sdk_and_a_bad_address_are_one_sentence(monkeypatch, capsys):
    assert run(["bridge", "foxglove", "--listen", "8765"]) == 2
    assert 'got "8765"; allowed: HOST:PORT, such as 127.0.0.1:8765' in capsys.readouterr().err
    for name in [each for each in sys.modules if each.startswith("sdrlinkd.foxglove")]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, "foxglove", None)
    assert run(["bridge", "foxglove"]) == 2
    assert hint("foxglove") in capsys.readouterr().err


def test_the_command_says_who_may_see_and_send():
    for host in ("127.0.0.1", "::1", "localhost"):
        assert meanings(host, [], has_token=False) == meanings(host, [], has_token=True) == []
    (command,) = meanings("127.0.0.1", ["/robot_2/*"], has_token=True)
    assert command == "who has this address may command /robot_2/*: keep it to yourself"
    (open_,) = meanings("0.0.0.0", [], has_token=False)
    assert open_.startswith("anybody who reaches it (see --token) sees all that robots send")
    both = meanings("192.0.2.1", ["/robot_2/*"], has_token=True)
    assert both[0] == command
    assert both[1].startswith("who has this address sees all that robots send at 192.0.2.1: there")
