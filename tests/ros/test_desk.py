"""A node on rmw_zenoh at a desk calls services and actions of a real ROS 2 node, over a gateway.

The service's client is of zenoh-ros2-sdk. It has no actions: their calls are made by hand here.
"""

import time
import uuid

import pytest
import zenoh
from zenoh_ros2_sdk import ROS2ServiceClient

from sdrlinkd.fleet.testing import Attachment, Node, Qos, Role
from sdrlinkd.process import Process, module
from tests.fleet.conftest import Router
from tests.ros.rough_air import air, hub, world
from tests.ros.team import WAIT_S, Robot, config
from tests.waiting import wait_for

__all__ = ["air", "hub", "world"]

pytestmark = [pytest.mark.realtime, pytest.mark.long]

DOMAIN, HASH = 42, f"RIHS01_{'ab' * 32}"
ALLOW = ("-p", 'services.allow:=["/set", "/fibonacci", "/secret"]')
FIBONACCI = "test_msgs::action::dds_::Fibonacci"
SUCCEEDED = 4
HEAD = b"\0\1\0\0"


class Desk:
    """A Zenoh router, and what a node needs to call over it."""

    def __init__(self, folder):
        self.router = Router(folder)
        self.router.start()
        self.port = int(self.router.endpoint.rpartition(":")[2])
        self.numbers = 0

    def services(self):
        """The names of the services in the graph."""
        found = self.router.session.liveliness().get(f"@ros2_lv/{DOMAIN}/*/*/*/SS/**")
        keys = [str(each.ok.key_expr) for each in found if each.ok is not None]
        return {key.split("/")[9].replace("%", "/") for key in keys}

    def call(self, name, kind, body, within_s=60.0):
        """The answer to a call without its encapsulation; None if none comes."""
        self.numbers += 1
        asked = Attachment(self.numbers, time.time_ns(), bytes(range(16)))
        replies = self.router.session.get(
            f"{DOMAIN}{name}/{FIBONACCI}{kind}_/{HASH}", payload=HEAD + body,
            attachment=asked.build(), target=zenoh.QueryTarget.ALL_COMPLETE, timeout=within_s,
        )  # fmt: skip
        for reply in replies:
            told = Attachment.parse(reply.ok.attachment.to_bytes())
            assert told[::2] == asked[::2]
            return reply.ok.payload.to_bytes()[len(HEAD) :]
        return None


@pytest.fixture
def desk(start_daemon, start, hub, tmp_path):
    found = Desk(tmp_path)
    fleet = (
        f'[fleet]\nconnect = ["{found.router.door}"]\nros_domain = {DOMAIN}\n'
        f'zenoh = "{found.router.file}"\ndown = ["set", "fibonacci"]\n'
    )
    found.robot = Robot(start, start_daemon(config(hub, 1)), *ALLOW).bridged()
    base = start_daemon(config(hub, 2, fleet))
    with Process(module("sdrlinkd.cli.gateway", "--config", base.config), name="gateway") as runs:
        yield found
        assert "Traceback" not in runs.err()
    found.router.stop()


def test_calls_from_a_desk_are_each_executed_once(desk, air):
    desk.robot.node.serve(name="/set")
    desk.robot.node.serve(name="/secret")
    wait_for(lambda: desk.services() == {"/robot_1/set"}, WAIT_S)
    client = ROS2ServiceClient(
        "/robot_1/set", "std_srvs/srv/SetBool", request_definition="bool data", timeout=60.0,
        response_definition="bool success\nstring message", domain_id=DOMAIN, router_port=desk.port,
    )  # fmt: skip
    try:
        air.loss = 0.2
        answers = [client.call(data=i % 2 == 0) for i in range(20)]
    finally:
        client.session_mgr.close()
    assert [each.success for each in answers] == [i % 2 == 0 for i in range(20)]
    assert [each.message for each in answers] == [f"call {i + 1}" for i in range(20)]
    assert desk.robot.node.n_served() == 20


def test_an_action_is_led_from_a_desk(desk):
    desk.robot.node.act(name="/fibonacci", step_s=0.5)
    action = "/robot_1/fibonacci/_action"
    wait_for(lambda: f"{action}/get_result" in desk.services(), WAIT_S)
    session, feedback = desk.router.session, []
    kind = f"{FIBONACCI}_FeedbackMessage_"
    token = Node(DOMAIN, "0123456789abcdef", "desk").endpoint(
        1, Role.SUBSCRIPTION, f"{action}/feedback", kind, HASH, Qos()
    )
    there = [
        session.liveliness().declare_token(token),
        session.declare_subscriber(
            f"{DOMAIN}{action}/feedback/{kind}/{HASH}",
            lambda sample: feedback.append(sample.payload.to_bytes()),
        ),
    ]
    goal, order = uuid.uuid4().bytes, 8
    answer = desk.call(f"{action}/send_goal", "_SendGoal", goal + order.to_bytes(4, "little"))
    assert answer[0] == 1, "the goal is accepted"
    result = desk.call(f"{action}/get_result", "_GetResult", goal)
    assert result[0] == SUCCEEDED
    n = int.from_bytes(result[4:8], "little")
    numbers = [int.from_bytes(result[8 + 4 * i : 12 + 4 * i], "little") for i in range(n)]
    assert numbers == [0, 1, 1, 2, 3, 5, 8, 13]
    assert feedback
    assert all(each[4:20] == goal for each in feedback)
    assert len(there) == 2
