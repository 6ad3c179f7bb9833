"""What others on the network put, say and declare ends no gateway, and makes it do nothing odd."""

import time
from io import BytesIO

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sdrlinkd.calls import Service, told
from sdrlinkd.fleet import Keys, Passed, encode, read_passed
from sdrlinkd.fleet.testing import (
    BRIDGE,
    MOST_ASKED,
    MOST_RESULTS,
    MOST_WAITING,
    Attachment,
    Bridge,
    Calls,
    Counts,
    Node,
    Qos,
    Question,
    Role,
    Sample,
    read_data_key,
    read_endpoint,
    robot_in,
)

KIND, HASH = "std_msgs::msg::dds_::String_", f"RIHS01_{'0a' * 32}"
KEYS = Keys("mine")
NEAR = 4


@pytest.mark.parametrize("at", [2**63, 2**64 - 1, -1])
def test_a_time_that_does_not_fit_makes_an_attachment_unreadable(at):
    assert read_passed(msgspec.msgpack.encode({"gw": 9, "tl": at})) is None


def test_the_latest_time_fits_an_attachment_of_ros():
    told = read_passed(encode(Passed(9, tl=2**63 - 1)))
    assert Attachment.parse(Attachment(1, told.tl, bytes(16)).build()).sent_ns == told.tl


@pytest.mark.parametrize(
    ("name", "kind", "hash_"),
    [
        ("/robot_2/odom", KIND, "**"),
        ("/robot_2/odom", KIND, "*"),
        ("/robot_2/odom", KIND, "RIHS01_0a$*"),
        ("/robot_2/odom", KIND, f"RIHS01_{'0A' * 32}"),
        ("/robot_2/odom", "*", HASH),
        ("/robot_2/**", KIND, HASH),
        ("/robot_2//odom", KIND, HASH),
    ],
)
def test_a_token_with_a_wildcard_says_nothing(name, kind, hash_):
    node = Node(0, "ab", "desk")
    assert read_endpoint(node.endpoint(1, Role.SUBSCRIPTION, name, kind, hash_, Qos())) is None
    assert read_endpoint(node.endpoint(1, Role.SUBSCRIPTION, "/robot_2/odom", KIND, HASH, Qos()))


@given(st.text())
def test_any_key_and_any_token_can_be_read(text):
    for read in (read_endpoint, robot_in):
        read(text)
    read_data_key(0, text)


@given(st.binary())
def test_any_attachment_can_be_read(octets):
    found = Attachment.parse(octets)
    assert found is None or found.build() == octets


def bridge(now=0.0, is_others=False):
    """A bridge of gateway 7 on the air of robot 4, whose daemon has answered since `now`."""
    counts = Counts()
    made = Bridge(
        7, KEYS, ["*"], None, counts, lambda: is_others, lambda robot: robot == NEAR,
        lambda robot, topic: f"/rx_robot_{robot}/{topic}", None,
    )  # fmt: skip
    made.see(True, now)
    return made, counts


def put(robot, topic="odom", **told):
    passed = Passed(**{"gw": 8, "ty": "a/msg/B", "b": 1, "e": 3, "pn": 5, "age": 10, **told})
    return Sample(f"sdrlink/mine/robot_{robot}/{topic}", b"\0\1\0\0", encode(passed))


@pytest.mark.parametrize(
    ("sample", "end"),
    [
        (put(2), "bridge_waiting"),
        (put(NEAR), "bridge_near"),
        (put(2, stop=True), "bridge_stop"),
        (put(2, "%405/cmd_vel"), "bridge_not_allowed"),
        (put(NEAR, "%405/cmd_vel"), "bridge_not_allowed"),
        (put(2, "a%2F%2Fb"), "bridge_not_allowed"),
        (put(2, again=True, age=None), "bridge_no_age"),
        (put(2, again=True), "bridge_waiting"),
    ],
)
def test_each_message_has_one_end(sample, end):
    made, counts = bridge()
    made.take(sample, 5.0)
    assert counts.of(BRIDGE) == {**dict.fromkeys(BRIDGE, 0), end: 1}
    assert counts["bridge_taken"] == 1


def test_what_this_gateway_has_put_is_not_taken():
    made, counts = bridge()
    made.take(put(2, gw=7), 5.0)
    assert counts["bridge_taken"] == 0


def test_nothing_is_sent_before_it_is_known_who_is_on_this_air():
    made, counts = bridge(now=time.monotonic())
    made.take(put(2), time.monotonic())
    assert counts["bridge_no_daemon"] == 1
    assert not made.sends
    made.see(False, 5.0)
    made.take(put(2), 1e9)
    assert counts["bridge_no_daemon"] == 2


def test_a_copy_and_a_last_message_that_has_come_before_are_not_sent_again():
    made, counts = bridge()
    for at, sample in ((5.0, put(2)), (5.1, put(2)), (9.0, put(2, again=True)), (9.1, put(2, e=4))):
        made.take(sample, at)
    assert (counts["bridge_waiting"], counts["bridge_repeated"]) == (2, 2)


def test_a_flood_pushes_out_the_oldest_and_adds_up():
    made, counts = bridge()
    for number in range(3 * MOST_WAITING):
        made.take(put(2, f"t{number}"), 5.0)
    ends = counts.of(BRIDGE)
    assert (ends["bridge_waiting"], ends["bridge_overflow"]) == (MOST_WAITING, 2 * MOST_WAITING)
    assert sum(ends.values()) == counts["bridge_taken"]


SERVICES = [
    Service("/set", "a/srv/Set", ""),
    Service("/go/_action/get_result", "a/action/Go_GetResult", ""),
    Service("/go/_action/cancel_goal", "a/action/Go_CancelGoal", ""),
]


class Served:
    """A graph and a session that hand over to `ask` what is asked of robot 2's services."""

    domain = 0

    def __init__(self):
        self._served = {}

    def open(self, *_):
        return BytesIO()  # something to close

    def serve(self, key, take):
        self._served[key] = take
        return lambda: None

    def ask(self, name, question):
        (take,) = [each for key, each in self._served.items() if f"/robot_2{name}/" in key]
        take(question)


def calls(leads=True):
    """(calls, what is served of robot 2)."""
    served = Served()
    made = Calls(served, served, ["*"], None, lambda _: leads)
    made.offer(2, told(SERVICES))
    made.serve([2])
    return made, served


def question(ended):
    asked = Attachment(1, 2, bytes(16)).build()
    reply, drop = (lambda *_: ended.append("reply")), (lambda: ended.append("drop"))
    return Question(b"\0\1\0\0", asked, reply, drop)


@pytest.mark.slow
def test_results_that_take_long_leave_room_for_calls_and_for_cancelling():
    (made, served), ended = calls(), []
    for kind, most in (("get_result", MOST_RESULTS), ("cancel_goal", MOST_ASKED)):
        for _ in range(most + 10):
            served.ask(f"/go/_action/{kind}", question(ended))
    assert ended == ["drop"] * 20
    served.ask("/set", question(ended))
    assert made.counts["calls_not_taken"] == 20
    made.forget(2)
    assert ended == ["drop"] * (20 + MOST_RESULTS + MOST_ASKED + 1)
    # Now there is room again.
    for _ in range(MOST_RESULTS):
        served.ask("/go/_action/get_result", question(ended))
    assert made.counts["calls_not_taken"] == 20


def test_a_gateway_that_does_not_lead_any_more_makes_no_call():
    (made, served), ended = calls(leads=False), []
    served.ask("/set", question(ended))
    assert ended == ["drop"]
    assert made.counts["calls_not_taken"] == 1


@given(st.binary())
def test_any_packet_and_any_offer_can_be_heard(octets):
    made, _ = calls()
    made.hear(2, octets)
    made.offer(2, octets)
