"""Messages of a robot at one gateway: which it puts on Zenoh, with what attachment, and when."""

import msgspec
import pytest

from sdrlinkd.client import Message, MessageName
from sdrlinkd.fleet import Claim, Keys, Passed, TopicKey, encode, read_passed
from sdrlinkd.fleet.testing import UP, Counts, HeardRobots, Sample, UpwardMessages
from tests.fleet.beside import OWN, ROBOT, Notes

CDR = b"\0\1\0\0"
KEYS = Keys("mine")
ODOM = "sdrlink/mine/robot_2/odom"
KIND = "nav_msgs/msg/Odometry"
CLASSES = {"odom": "latency", "scan": "urgent"}


def message(number=1, **more):
    told = {
        "topic": "/rx_robot_2/odom", "payload": CDR + bytes((number,)), "type": KIND,
        "source": ROBOT, "number": number, "lost_pdus": 0, "age_us": 400, "received_ns": 1,
        "hops_left": 0, "snr_db": None, "name": MessageName(9, number, 5),
    }  # fmt: skip
    return Message(**{**told, **more})


class Upwards:
    """What a gateway puts of robot 2, which leads for it from 1 s on, or waits for gateway 3."""

    def __init__(self, patterns=(), leads=True):
        self.session, self.counts, self.on_put = Notes(), Counts(), []
        self.up = UpwardMessages(
            OWN, KEYS, list(patterns), self.session, self.counts,
            lambda topic: CLASSES.get(topic, "default"),
        )  # fmt: skip
        self.robot = HeardRobots(OWN, 100.0, lambda _: []).heard(ROBOT, 0.0)
        if leads:
            self.lead()
        else:
            self.follow()

    def lead(self):
        self.robot.election.hear(0.9, 0.0)
        assert self.robot.election.poll(1.0) is not None

    def follow(self, leader=3):
        self.robot.election.claimed(Claim(leader, 5, 1.0), 0.0)

    def tell_ros(self):
        self.up.on_put = lambda told, item: self.on_put.append((told, item))
        return self

    def take(self, now, number=1, topic="odom", **more):
        self.up.take(self.robot, topic, message(number, **more), now)

    def passed(self, now, number=1, gw=3, key=ODOM, **more):
        told = Passed(gw, KIND, 9, number, 5, **more)
        self.up.passed(self.robot, Sample(key, CDR + bytes((number,)), encode(told)), now)

    @property
    def ends(self):
        """The counters that are not zero."""
        assert sum(self.counts.of(UP).values()) == self.counts["up_taken"]
        return {name: n for name, n in self.counts.of(UP).items() if n}

    @property
    def put(self):
        """(topic, number, age, whether again, class) of what was put."""
        found = []
        for key, payload, attachment, qos in self.session.puts:
            told = read_passed(attachment)
            found.append((KEYS.read_message(key).topic, payload[4], told.age, told.again, qos))
        return found


@pytest.mark.parametrize(
    ("given", "told"),
    [
        ({}, {"b": 9, "e": 1, "pn": 5}),
        ({"name": MessageName(None, 3, 4, 2, is_numbered=False)}, {"e": 3, "sq": 4, "ps": 2}),
        ({"name": None, "is_stop": True}, {"stop": True}),
        ({"is_late": True, "age_us": None}, {"b": 9, "e": 1, "pn": 5, "again": True, "age": None}),
        (
            {
                "series": 3, "snr_db": 2.5, "published_ns": 6, "published_error_us": 7,
                "hops_left": 1,
            },
            {"b": 9, "e": 1, "pn": 5, "sr": 3, "sn": 2.5, "tl": 6, "eb": 7, "h": 1},
        ),
    ],
)  # fmt: skip
def test_the_attachment_says_what_is_known_of_a_message(given, told):
    ups = Upwards()
    ups.take(2.0, **given)
    ((key, payload, attachment, qos),) = ups.session.puts
    expected = {"gw": OWN, "ty": KIND, "age": 400, **told}
    assert msgspec.msgpack.decode(attachment) == {
        name: value for name, value in expected.items() if value is not None
    }
    assert (key, payload, qos) == (ODOM, CDR + b"\1", "latency")


def test_the_leader_puts_each_message_at_once_and_once():
    ups = Upwards().tell_ros()
    ups.take(2.0)
    ups.take(2.1)
    ups.take(2.2, 2, "scan")
    ups.take(2.2, 2, "map", age_us=None)
    ups.take(2.2, 2, "map", series=1, name=MessageName(9, 2, 5))
    assert ups.put == [
        ("odom", 1, 400, False, "latency"), ("scan", 2, 400, False, "urgent"),
        ("map", 2, None, False, "default"), ("map", 2, 400, False, "default"),
    ]  # fmt: skip
    assert ups.ends == {"up_put": 4, "up_repeated": 1}
    assert [told for told, _ in ups.on_put] == [
        TopicKey(ROBOT, each) for each in ("odom", "scan", "map", "map")
    ]


def test_only_topics_that_are_named_are_put():
    ups = Upwards(["sc*", "map"])
    for topic in ("odom", "scan", "map"):
        ups.take(2.0, topic=topic)
    ups.up.leave_bridged()
    assert ups.ends == {"up_put": 2, "up_not_selected": 1, "up_bridged": 1}
    assert [told.topic for told, _ in ups.up.last_items(ROBOT, 2.0)] == ["scan", "map"]


def test_another_gateway_puts_what_the_leader_does_not():
    ups = Upwards(leads=False).tell_ros()
    for number in (1, 2):
        ups.take(2.0, number)
    assert ups.ends == {"up_held": 2}
    ups.passed(2.005, 1)
    assert ups.ends == {"up_held": 1, "up_left": 1}
    ups.up.put_due(ups.robot, 2.019)
    assert ups.put == []
    ups.up.put_due(ups.robot, 2.021)
    assert ups.put == [("odom", 2, 400 + 21_000, False, "latency")]
    assert ups.ends == {"up_put": 1, "up_left": 1}
    assert ups.on_put == [], "the leader tells the nodes"
    ups.passed(2.03, 3)
    ups.take(2.04, 3)
    assert ups.ends == {"up_put": 1, "up_left": 2}


def test_only_the_leaders_puts_say_how_long_to_wait():
    ups = Upwards(leads=False)
    ups.take(2.0)
    ups.passed(2.3, gw=4)
    assert ups.robot.forwarding.hold_s == 0.02
    ups.take(2.0, 2)
    ups.passed(2.3, 2, gw=3)
    assert ups.robot.forwarding.hold_s == pytest.approx(0.301)


def test_who_leads_from_now_on_puts_all_that_it_held():
    ups = Upwards(leads=False).tell_ros()
    ups.take(2.0)
    ups.robot.election.gone(3, 2.0)
    ups.up.put_due(ups.robot, 2.001, all_held=True)
    assert [number for _, number, *_ in ups.put] == [1]
    assert len(ups.on_put) == 1, "where nobody leads, each gateway tells the nodes"
    assert ups.ends == {"up_put": 1}


def test_a_put_without_room_is_counted():
    ups = Upwards()
    ups.session.has_room = False
    ups.take(2.0)
    assert ups.ends == {"up_overflow": 1}


def test_what_the_gateway_itself_or_a_stranger_says_it_has_put_is_no_news():
    ups = Upwards(leads=False).tell_ros()
    ups.take(2.0)
    ups.passed(2.001, gw=OWN)
    ups.up.passed(ups.robot, Sample(ODOM, CDR, b"junk"), 2.001)
    ups.up.passed(ups.robot, Sample(ODOM, CDR, None), 2.001)
    assert ups.ends == {"up_held": 1}


def test_the_leader_tells_nodes_what_another_gateway_puts_first():
    ups = Upwards().tell_ros()
    ups.take(2.0)
    ups.passed(2.1, 1)
    assert len(ups.on_put) == 1
    ups.passed(2.1, 2, age=70)
    ups.passed(2.1, 3, again=True)
    ups.up.passed(ups.robot, Sample(ODOM, CDR, encode(Passed(3, KIND, stop=True))), 2.1)
    ups.passed(2.1, 4, key="sdrlink/mine/robot_2")
    (told, item) = ups.on_put[-1]
    assert len(ups.on_put) == 2
    assert told == TopicKey(ROBOT, "odom")
    assert item == (ODOM, CDR + b"\2", Passed(3, KIND, 9, 2, 5, age=70), "latency", 2.1)
    ups.take(2.2, 2)
    assert ups.ends == {"up_put": 1, "up_left": 1}
    assert len(ups.on_put) == 2
    ups.follow()
    ups.passed(2.3, 5)
    assert len(ups.on_put) == 2


@pytest.mark.parametrize("leader", [None, OWN, 3])
def test_while_the_network_is_away_nothing_is_put_but_nodes_are_told(leader):
    ups = Upwards(leads=leader == OWN).tell_ros()
    if leader is None:
        ups.robot.election.gone(3, 1.0)
    ups.session.is_reached = False
    ups.take(2.0)
    assert ups.ends == {"up_away": 1}
    assert (ups.put, len(ups.on_put)) == ([], leader != 3)
    ups.session.is_reached = True
    ups.up.put_again({ROBOT}, 3.0)
    assert ups.put == [("odom", 1, 1_000_400, True, "bulk")]


def test_what_was_held_when_the_network_went_is_put_again_later():
    ups = Upwards(leads=False)
    ups.take(2.0)
    ups.session.is_reached = False
    ups.up.put_due(ups.robot, 2.5)
    assert ups.ends == {"up_away": 1}
    ups.session.is_reached = True
    ups.up.put_again({ROBOT}, 3.0)
    assert ups.put == [("odom", 1, 1_000_400, True, "bulk")]


def test_once_the_network_is_back_the_last_message_of_each_topic_is_put_again():
    ups = Upwards()
    ups.session.is_reached = False
    ups.take(2.0)
    ups.take(2.5, 2)
    ups.take(2.5, 3, "stopped", is_stop=True, name=None)
    ups.session.is_reached = True
    # Until others have found their way in the network, too, what is put may not come to them.
    ups.take(2.6, 4, "scan")
    ups.up.reach(3.0)
    ups.take(3.69, 5, "map")
    ups.take(3.7, 6, "imu")
    assert [number for _, number, *_ in ups.put] == [4, 5, 6]
    ups.up.put_again({ROBOT + 1}, 4.0)
    assert len(ups.put) == 3
    ups.session.has_room = False
    ups.up.put_again(set(), 4.0)
    ups.session.has_room = True
    ups.up.put_again({1, ROBOT}, 4.5)
    assert ups.put[3:] == [
        ("map", 5, 400 + 810_000, True, "bulk"),
        ("odom", 2, 400 + 2_000_000, True, "bulk"),
        ("scan", 4, 400 + 1_900_000, True, "bulk"),
    ]
    assert ups.counts["up_again"] == 3
    ups.up.put_again({ROBOT}, 5.0)
    assert len(ups.put) == 6
    assert ups.ends == {"up_away": 3, "up_put": 3}


def test_what_another_gateway_has_put_meanwhile_is_not_put_again():
    ups = Upwards()
    ups.session.is_reached = False
    for number, topic in ((1, "odom"), (2, "scan")):
        ups.take(2.0, number, topic)
    ups.session.is_reached = True
    ups.up.reach(2.1)
    scan = ODOM.replace("odom", "scan")
    ups.passed(2.2, 1)
    ups.passed(2.2, 1, key=scan)
    ups.passed(2.2, 9, key=ODOM)
    ups.up.passed(ups.robot, Sample(scan, CDR, encode(Passed(3, KIND))), 2.2)
    ups.up.put_again({ROBOT}, 3.0)
    assert [topic for topic, *_ in ups.put] == ["scan"]


def test_the_last_messages_are_there_for_queries_and_for_a_new_leader():
    ups = Upwards()
    ups.take(2.0)
    ups.take(3.0, 2)
    ups.take(3.0, 3, "scan", is_late=True)
    ups.take(3.0, 4, "map", age_us=None)
    ups.take(3.5, 5, is_stop=True, name=None)
    other = HeardRobots(OWN, 1.0, lambda _: []).heard(20, 0.0)
    ups.up.take(other, "odom", message(6), 3.0)
    answers = [(each.key, each.payload, read_passed(each.attachment)) for each in
               ups.up.answers(ROBOT, 5.0)]  # fmt: skip
    assert [(key, payload[4], told.age, told.again) for key, payload, told in answers] == [
        (ODOM, 2, 2_000_400, True),
        (ODOM.replace("odom", "scan"), 3, 2_000_400, True),
        (ODOM.replace("odom", "map"), 4, None, True),
    ]
    items = list(ups.up.last_items(ROBOT, 5.0))
    assert [(told, item.payload[4], item.passed.age, item.passed.again, item.qos, item.at)
            for told, item in items] == [
        (TopicKey(ROBOT, "odom"), 2, 2_000_400, False, "latency", 5.0),
        (TopicKey(ROBOT, "scan"), 3, 2_000_400, True, "urgent", 5.0),
        (TopicKey(ROBOT, "map"), 4, None, False, "default", 5.0),
    ]  # fmt: skip
    assert [item.key for _, item in ups.up.last_items(20, 5.0)] == [
        "sdrlink/mine/robot_20/odom"
    ]  # fmt: skip
