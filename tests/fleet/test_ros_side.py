"""A gateway in the ROS graph: what of a robot appears there, and what nodes send to it."""

import asyncio
import time
from contextlib import asynccontextmanager

import pytest

from sdrlinkd.adapters import type_hash
from sdrlinkd.calls import CALL_TYPE, Kind, Packet, Service, Status, told, with_action
from sdrlinkd.client import Message
from sdrlinkd.daemon_side import DaemonSide
from sdrlinkd.fleet import Claim, Command, Passed, TopicKey
from sdrlinkd.fleet.testing import (
    ENCODING,
    MOST_ASKED,
    MOST_HASHES,
    MOST_KNOWN,
    MOST_PROXIES,
    MOST_PUT,
    MOST_TAKEN,
    UNKNOWN_HASH,
    About,
    Attachment,
    Calls,
    FromRos,
    Graph,
    HeardRobots,
    Node,
    Qos,
    Question,
    Role,
    RosSide,
    Sample,
    Topics,
    Upward,
    dds_type,
    gid,
    is_name,
    read_data_key,
    read_endpoint,
    robot_in,
    ros_type,
)
from sdrlinkd.link import Overrides
from sdrlinkd.link import Qos as Class
from tests.fleet.beside import CDR, OWN, ROBOT, Daemon, Notes, until

DOMAIN = 42
ODOM, TEXT, OURS = "nav_msgs/msg/Odometry", "std_msgs/msg/String", "my_msgs/msg/Thing"
HASH, OTHER = f"RIHS01_{'ab' * 32}", f"RIHS01_{'cd' * 32}"
AT = f"@ros2_lv/{DOMAIN}/ab12/0"
GID = bytes(range(16))


@pytest.mark.parametrize(
    ("kind", "dds"),
    [
        (ODOM, "nav_msgs::msg::dds_::Odometry_"), ("a/srv/B", "a::srv::dds_::B_"),
        ("a/action/B_SendGoal", "a::action::dds_::B_SendGoal_"), ("a/b/C", ""), ("a/msg/C/d", ""),
        ("a/msg/", ""), ("", ""), ("ä/msg/C", ""),
    ],
)  # fmt: skip
def test_types_are_those_of_dds(kind, dds):
    assert dds_type(kind) == dds
    assert ros_type(dds) == (kind if dds else "")


def test_names_of_robots_topics_are_read_back():
    assert robot_in("/robot_2/camera/image") == (2, "camera/image")
    assert robot_in("/robot_254/a") == (254, "a")
    for other in ("/robot_02/a", "/robot_2", "/robot_2/", "/robot_1000/a", "robot_2/a", "/a/b"):
        assert robot_in(other) is None
    assert [is_name(each) for each in ("/a/b_1", "/_a", "a", "/", "/1a", "/a//b", "/a*", "")] == [
        True, True, False, False, False, False, False, False,
    ]  # fmt: skip
    kind = dds_type(ODOM)
    assert read_data_key(4, f"4/robot_2/odom/{kind}/{HASH}") == ("/robot_2/odom", kind)
    for key in ("4/K/H", "4//K/H", "4/odom/K/", "5/odom/K/H"):
        assert read_data_key(4, key) is None, key


@pytest.mark.parametrize("at", range(13))
def test_an_endpoint_with_one_part_wrong_or_missing_is_none(at):
    about = Role.SERVICE, "/set", "a::srv::dds_::B_", HASH
    token = Node(DOMAIN, "ab12", "desk").endpoint(1, *about, Qos())
    assert read_endpoint(token) == ("ab12", "desk", *about)
    chunks = token.split("/")
    assert read_endpoint("/".join(chunks[:at] + chunks[at + 1 :])) is None
    is_read = at in (5, 9, 10, 11)
    changed = read_endpoint("/".join([*chunks[:at], "?", *chunks[at + 1 :]]))
    assert (changed is None) == is_read
    assert read_endpoint("/".join([*chunks[:11], UNKNOWN_HASH, chunks[12]])) is not None


@pytest.fixture
def graph():
    """(graph of gateway 7, its session)."""
    notes = Notes()
    made = Graph(notes, DOMAIN, OWN)
    made.start()
    return made, notes


def note(notes, token, is_there=True):
    """A token comes or goes."""
    notes.takes[f"@ros2_lv/{DOMAIN}/**"](token, is_there)


def endpoint(role, name, kind=ODOM, hash_=HASH, node="desk", session="cd", number=1):
    dds = dds_type(kind) or kind
    return Node(DOMAIN, session, node).endpoint(number, role, name, dds, hash_, Qos())


def test_a_gateway_is_a_node_with_endpoints_of_its_own(graph):
    made, notes = graph
    node = f"{AT}/0/NN/%/%/sdrlink_gateway_7"
    assert notes.tokens == [node]
    first = made.open(Role.PUBLISHER, "/a/b", dds_type(ODOM), HASH, Qos(depth=1))
    second = made.open(Role.SERVICE, "/set", "a::srv::dds_::B_", UNKNOWN_HASH, Qos())
    at = f"{AT}/1/MP/%/%/sdrlink_gateway_7/%a%b/nav_msgs::msg::dds_::Odometry_/{HASH}/::,1:,:,:,,"
    assert notes.tokens[1] == at
    assert notes.tokens[2].startswith(f"{AT}/2/SS/%/%/sdrlink_gateway_7/%set/")
    assert (first.gid, second.gid) == (gid(at), gid(notes.tokens[2]))
    first.close()
    assert [token.split("/")[4] for token in notes.tokens] == ["0", "2"]


def test_subscriptions_and_publishers_of_nodes_are_known_while_they_are_there(graph):
    made, notes = graph
    dds = dds_type(ODOM)
    for number, hash_ in ((1, HASH), (2, HASH), (3, OTHER)):
        note(notes, endpoint(Role.SUBSCRIPTION, "/odom", hash_=hash_, number=number))
    assert made.hashes("/odom", dds) == [HASH, OTHER]
    assert made.hashes("/odom", "other") == made.hashes("/o", dds) == []
    assert made.version == 3
    for number in (1, 3):
        hash_ = HASH if number == 1 else OTHER
        note(notes, endpoint(Role.SUBSCRIPTION, "/odom", hash_=hash_, number=number), False)
    assert made.hashes("/odom", dds) == [HASH]
    # One that is told twice counts once; the gateway's own, and what is none, do not count.
    again = endpoint(Role.SUBSCRIPTION, "/odom", number=2)
    note(notes, again)
    note(notes, endpoint(Role.SUBSCRIPTION, "/odom", hash_=OTHER, session="ab12"))
    note(notes, "junk")
    note(notes, "gone", False)
    assert made.version == 9
    assert made.hashes("/odom", dds) == [HASH]
    note(notes, again, False)
    assert made.hashes("/odom", dds) == []
    for each in (
        endpoint(Role.PUBLISHER, "/cmd_vel"), endpoint(Role.SUBSCRIPTION, "/map"),
        endpoint(Role.PUBLISHER, "/scan", node="sdrlink_gateway_8"),
    ):  # fmt: skip
        note(notes, each)
    assert made.published() == {("/cmd_vel", dds, HASH)}


def test_so_many_endpoints_are_known(graph):
    made, notes = graph
    tokens = [endpoint(Role.PUBLISHER, f"/t{n}", number=n) for n in range(MOST_KNOWN + 1)]
    for token in tokens:
        note(notes, token)
    assert len(made.published()) == MOST_KNOWN


class Putting:
    """The topics of robots that a gateway puts for nodes."""

    def __init__(self, graph):
        graph, self.notes = graph
        self.topics = Topics(graph, self.notes)

    def put(self, name="/odom", kind=ODOM, about=None, robot=ROBOT, qos="latency", sent_ns=5):
        self.topics.put(robot, name, kind, CDR, sent_ns, qos, about or About())

    @property
    def keys(self):
        return [key for key, *_ in self.notes.puts]

    @property
    def opened(self):
        """(name, hash, QoS) of the publishers in the graph."""
        chunks = [token.split("/") for token in self.notes.tokens[1:]]
        return [(each[9], each[11], each[12]) for each in chunks]


@pytest.fixture
def putting(graph):
    return Putting(graph)


def key_of(name, kind, hash_, robot=ROBOT):
    return f"{DOMAIN}/robot_{robot}{name}/{dds_type(kind)}/{hash_}"


def test_messages_of_a_topic_are_numbered_from_one_publisher(putting):
    for sent_ns in (5, 9):
        putting.put(sent_ns=sent_ns)
    key = key_of("/odom", ODOM, type_hash(ODOM))
    assert putting.notes.publishers == [(key, "latency", ENCODING, 0)]
    assert putting.opened == [("%robot_2%odom", type_hash(ODOM), "::,10:,:,:,,")]
    its_gid = gid(putting.notes.tokens[1])
    assert putting.notes.puts == [
        (key, CDR, Attachment(number, sent_ns, its_gid).build(), "latency")
        for number, sent_ns in ((1, 5), (2, 9))
    ]
    putting.put("/map", about=About(latched=3))
    putting.put("/scan", about=About(is_best_effort=True))
    assert [(name, qos) for name, _, qos in putting.opened[1:]] == [
        ("%robot_2%map", ":1:,3:,:,:,,"), ("%robot_2%scan", "2::,10:,:,:,,"),
    ]  # fmt: skip
    assert [kept for *_, kept in putting.notes.publishers] == [0, 3, 0]


def test_what_a_robot_says_anew_of_a_topic_opens_it_anew(putting):
    putting.put()
    putting.put(about=About(latched=1))
    assert [qos for *_, qos in putting.opened] == [":1:,1:,:,:,,"]
    assert [kept for *_, kept in putting.notes.publishers] == [1]
    assert Attachment.parse(putting.notes.puts[-1][2]).number == 1
    putting.put(robot=3)
    putting.topics.close(ROBOT)
    assert [name for name, *_ in putting.opened] == ["%robot_3%odom"]
    assert len(putting.notes.publishers) == 1
    putting.topics.close(9)


@pytest.mark.parametrize(
    ("name", "kind"), [("/a*", ODOM), ("/a//b", ODOM), ("/a", "junk"), ("/a", "a/b/C")]
)
def test_what_has_no_name_or_type_of_ros_is_not_put(putting, name, kind):
    putting.put(name, kind)
    assert (putting.notes.puts, putting.opened) == ([], [])


def test_so_many_topics_are_put(putting):
    for number in range(MOST_PUT + 1):
        putting.put(f"/t{number}", OURS, robot=number % 2)
    putting.put("/t0", OURS, robot=0)
    assert len(putting.opened) == MOST_PUT


@pytest.mark.parametrize(
    ("kind", "says", "wanted", "put"),
    [
        (ODOM, "", [OTHER], [type_hash(ODOM)]),
        (ODOM, type_hash(ODOM)[7:15], [OTHER], [type_hash(ODOM)]),
        # Where ROS has no hashes yet, as in Humble.
        (ODOM, "", [UNKNOWN_HASH, OTHER], [type_hash(ODOM), UNKNOWN_HASH]),
        # The robot's type differs from the one known here, or none is known.
        (ODOM, "abab", [HASH, OTHER, type_hash(ODOM)], [HASH]),
        (OURS, "abab", [HASH, OTHER], [HASH]),
        (OURS, "", [HASH, OTHER, UNKNOWN_HASH], [HASH, OTHER, UNKNOWN_HASH]),
        (OURS, "", [], []),
    ],
)
def test_the_hash_is_that_of_the_type_or_of_subscriptions_that_agree(
    putting, kind, says, wanted, put
):
    for number, hash_ in enumerate(wanted):
        wanted_one = endpoint(Role.SUBSCRIPTION, "/robot_2/odom", kind, hash_, number=number)
        note(putting.notes, wanted_one)
    putting.put(kind=kind, about=About(hash=says))
    assert putting.keys == [key_of("/odom", kind, each) for each in put]
    is_known = put and put[0] == type_hash(ODOM)
    assert putting.opened[0][1] == (put[0] if is_known else UNKNOWN_HASH)


def test_so_many_hashes_of_a_type_are_learnt(putting):
    for number in range(MOST_HASHES + 2):
        hash_ = f"RIHS01_{number:064x}"
        note(putting.notes, endpoint(Role.SUBSCRIPTION, "/robot_2/a", OURS, hash_, number=number))
    putting.put("/a", OURS)
    assert len(putting.keys) == MOST_HASHES


SET = Service("/set", "a/srv/Set", "")
GO = [Service(f"/arm/go/_action/{end}", f"a/action/Go_{kind}", "") for end, kind in (
    ("send_goal", "SendGoal"), ("get_result", "GetResult"), ("cancel_goal", "CancelGoal"),
)]  # fmt: skip


class Calling:
    """The services of robots at gateway 7, which leads for `led`."""

    def __init__(self, graph, daemon=None, patterns=("set", "arm/*")):
        graph, self.notes = graph
        self.side = None if daemon is None else DaemonSide(str(daemon.folder))
        self.led, self.ended = {ROBOT}, []
        self.calls = Calls(graph, self.notes, list(patterns), self.side, lambda r: r in self.led)

    @property
    def served(self):
        """(name, type) of the services in the graph."""
        return [(each[9], each[10]) for each in (t.split("/") for t in self.notes.tokens[1:])]

    def ask(self, name="/set", n=1, kind="a/srv/Set", attachment=None, body=b"body"):
        """A node calls a service of robot 2."""
        told = Attachment(n, 5, GID).build() if attachment is None else attachment
        question = Question(
            body, told, lambda *answer: self.ended.append((n, *answer)),
            lambda: self.ended.append((n, "dropped")),
        )  # fmt: skip
        self.notes.takes[f"{DOMAIN}/robot_2{name}/{dds_type(kind)}/*"](question)

    @asynccontextmanager
    async def running(self):
        async with self.side.publisher() as out:
            task = asyncio.ensure_future(self.calls.run(out))
            yield out
            task.cancel()


def test_the_services_of_robots_that_are_served_are_those_that_may_be_called(graph):
    calling = Calling(graph)
    calls = calling.calls
    others = [Service(name, "a/srv/Set", "") for name in ("/get", "/se*")]
    calls.offer(ROBOT, told([SET, *GO, *others]))
    assert calling.served == []
    calls.serve([ROBOT, 3])
    keys = [f"%robot_2{name}" for name in ("%set", *(f"%arm%go%_action%{each}" for each in
            ("send_goal", "get_result", "cancel_goal")))]  # fmt: skip
    assert [name for name, _ in calling.served] == keys
    assert calling.served[0] == ("%robot_2%set", "a::srv::dds_::Set_")
    assert {"SS"} == {token.split("/")[5] for token in calling.notes.tokens[1:]}
    assert {UNKNOWN_HASH} == {token.split("/")[11] for token in calling.notes.tokens[1:]}
    assert len(calling.notes.takes) == 5
    calls.offer(3, told([SET, Service("/set", "junk", "")]))
    assert calling.served[4:] == [("%robot_3%set", "a::srv::dds_::Set_")]
    # What a robot says anew replaces what it said; what cannot be read changes nothing.
    calls.offer(3, b"junk")
    calls.offer(ROBOT, told([SET]))
    assert [name for name, _ in calling.served] == ["%robot_2%set", "%robot_3%set"]
    assert calls.offered(ROBOT, "/set") == SET
    assert calls.offered(ROBOT, "/get") is calls.offered(9, "/set") is None
    calls.serve([3])
    assert [name for name, _ in calling.served] == ["%robot_3%set"]
    assert len(calling.notes.takes) == 2
    calls.serve([3, ROBOT])
    assert len(calling.served) == 2


def test_so_many_services_are_served(graph):
    calling = Calling(graph, patterns=["*"])
    for robot in range(1, 5):
        services = [Service(f"/s{n}", "a/srv/Set", "") for n in range(150)]
        calling.calls.offer(robot, told(services))
    calling.calls.serve([1, 2, 3, 4])
    assert len(calling.served) == MOST_PROXIES


@pytest.fixture
async def daemon(tmp_path):
    daemon = Daemon(
        tmp_path,
        f'[fleet]\nname = "mine"\nzenoh = "zenoh.json5"\nros_domain = {DOMAIN}\n'
        'down = ["cmd_vel", "arm*", "set"]\n'
        '[topic.map]\ndurability = "transient_local"\ndepth = 3\n',
    )
    yield daemon
    daemon.stop()


@pytest.fixture
async def calling(graph, daemon):
    made = Calling(graph, daemon)
    made.calls.offer(ROBOT, told([SET, *GO]))
    made.calls.serve([ROBOT])
    yield made
    made.side.close()


async def requests(daemon, n):
    """The requests that the daemon has got, once there are `n` of them."""

    def found():
        packets = [(name, Packet.parse(cdr), wishes) for name, cdr, wishes, _ in daemon.taken]
        return [each for each in packets if each[1].kind == Kind.REQUEST]

    await until(lambda: len({each[1].number for each in found()}) >= n)
    first = {each[1].number: each for each in reversed(found())}
    return [first[number] for number in sorted(first)]


async def test_a_call_is_made_over_the_daemon_and_its_answer_comes_back(daemon, calling):
    calls = calling.calls
    async with calling.running():
        await until(lambda: bool(daemon.declared))
        assert daemon.declared == [("/robot_2/_sdrlink/calls", CALL_TYPE)]
        calling.ask()
        calling.ask("/arm/go/_action/cancel_goal", 2, "a/action/Go_CancelGoal")
        first, second = await requests(daemon, 2)
        assert first[0] == "/robot_2/_sdrlink/calls"
        assert (first[1].name, first[1].body, first[2]) == (
            "/set", b"body", Overrides(Class.LATENCY, dst=ROBOT),
        )  # fmt: skip
        assert second[2] == Overrides(Class.URGENT, dst=ROBOT)
        before_ns = time.time_ns()
        answer = first[1]._replace(kind=Kind.ANSWER, body=b"done", name="")
        # Neither a request, nor junk, nor a word that it runs, nor another robot's ends it.
        calls.hear(ROBOT, first[1].build())
        calls.hear(ROBOT, b"junk")
        calls.hear(ROBOT, answer._replace(kind=Kind.TAKEN).build())
        calls.hear(3, answer.build())
        assert calling.ended == []
        calls.hear(ROBOT, answer.build())
        ((n, body, attachment),) = calling.ended
        found = Attachment.parse(attachment)
        assert (n, body, found.number, found.gid) == (1, b"done", 1, GID)
        assert before_ns <= found.sent_ns <= time.time_ns()
        # Its end is acknowledged at once, though nothing else is due.
        await until(lambda: any(Packet.parse(each[1]).kind == Kind.ACK for each in daemon.taken))
        calls.hear(ROBOT, answer.build())
        failed = second[1]._replace(kind=Kind.ANSWER, status=Status.BUSY, name="")
        calls.hear(ROBOT, failed.build())
        assert calling.ended[1:] == [(2, "dropped")]
        assert calls.counts == {"calls_answered": 1, "calls_failed": 1}


async def test_a_call_without_an_answer_is_sent_again_and_ends_with_its_robot(daemon, calling):
    async with calling.running():
        calling.ask()
        await until(lambda: len(daemon.taken) >= 2)
        assert len({Packet.parse(each[1]).number for each in daemon.taken}) == 1
        calling.ask(n=2)
        calling.calls.forget(3)
        assert calling.ended == []
        calling.calls.forget(ROBOT)
        assert calling.ended == [(1, "dropped"), (2, "dropped")]
        assert calling.calls.counts == {"calls_failed": 2}
        number = len(daemon.taken)
        calling.ask(n=3)
        await requests(daemon, 3 if number > 2 else 2)


async def test_a_call_ends_when_its_time_is_over(daemon, calling, caplog):
    async with calling.running():
        calling.ask()
        await until(lambda: bool(calling.ended))
    assert calling.ended == [(1, "dropped")]
    assert "/robot_2/set: no answer came in time" in caplog.text


async def test_a_call_that_is_too_large_for_the_daemon_ends_at_once(daemon, calling, caplog):
    async with calling.running():
        await until(lambda: bool(daemon.declared))
        calling.ask(body=bytes(10_000_000))
        await until(lambda: bool(calling.ended))
        assert calling.ended == [(1, "dropped")]
        assert "too large" in caplog.text
        assert calling.calls.counts == {"calls_failed": 1}
        calling.ask(n=2)
        await requests(daemon, 1)


async def test_after_a_restart_the_daemon_is_told_the_topics_of_calls_again(daemon, calling):
    async with calling.running():
        await until(lambda: bool(daemon.declared))
        daemon.stop()
        daemon.start()
        calling.ask()
        await requests(daemon, 1)
    assert len(daemon.declared) == 2


async def test_a_robot_that_cannot_be_called_stops_nobody_and_a_daemon_away_is_asked_again(
    daemon, calling, caplog
):
    daemon.refused.add("/robot_2/_sdrlink/calls")
    daemon.stop()
    async with calling.running():
        await asyncio.sleep(0.1)
        daemon.start()
        await until(lambda: "robot 2 cannot be called: " in caplog.text)
        calling.calls.offer(3, told([SET]))
        calling.calls.serve([ROBOT, 3])
        await until(lambda: len(daemon.declared) > 1)
    assert [name for name, _ in daemon.declared] == [
        "/robot_2/_sdrlink/calls", "/robot_3/_sdrlink/calls",
    ]  # fmt: skip


def test_calls_that_cannot_be_made_are_not_taken(graph):
    calling = Calling(graph)
    calling.calls.offer(ROBOT, told([SET]))
    calling.calls.serve([ROBOT])
    calling.ask(attachment=b"junk")
    calling.led.clear()
    calling.ask(n=2)
    calling.led.add(ROBOT)
    for n in range(MOST_ASKED + 1):
        calling.ask(n=100 + n)
    assert calling.ended == [(n, "dropped") for n in (1, 2, 100 + MOST_ASKED)]
    assert calling.calls.counts == {"calls_not_taken": 3}


class Side:
    """Gateway 7 as a node, and what it takes from others."""

    def __init__(self, daemon):
        self.notes, self.daemon = Notes(), daemon
        self.side = DaemonSide(str(daemon.folder))
        self.led = {ROBOT}
        self.ros = RosSide(self.notes, daemon.setup, DOMAIN, self.side, lambda r: r in self.led)
        self.ros.start()
        self.robots = HeardRobots(OWN, 1.0, lambda _: [])

    def put(self, topic="odom", robot=ROBOT, ty=ODOM, qos="latency", **passed):
        item = Upward("", CDR, Passed(8, ty, **passed), qos, 0.0)
        self.ros.put(TopicKey(robot, topic), item)

    def leads(self, robot=ROBOT, since=1.0):
        known = self.robots.heard(robot, 0.0)
        known.election.hear(0.9, 0.0)
        known.election.poll(1.0)
        known.led_since = since
        return known

    def tokens(self, role):
        return [read_endpoint(each) for each in self.notes.tokens if f"/{role}/" in each]

    @property
    def keys(self):
        return [key for key, *_ in self.notes.puts]


@pytest.fixture
async def side(daemon):
    made = Side(daemon)
    yield made
    made.side.close()


async def test_a_message_of_a_topic_of_the_registry_is_put_at_once(side):
    before_ns = time.time_ns()
    side.put(tl=5, age=9)
    side.put(age=1_000_000)
    side.put()
    side.put("map", ty="nav_msgs/msg/OccupancyGrid", qos="bulk")
    side.put("odom", stop=True)
    side.put("_sdrlink/status")
    assert side.keys == [key_of("/odom", ODOM, type_hash(ODOM))] * 3 + [
        key_of("/map", "nav_msgs/msg/OccupancyGrid", type_hash("nav_msgs/msg/OccupancyGrid"))
    ]
    kept = [(qos, kept) for _, qos, _, kept in side.notes.publishers]
    assert kept == [("latency", 0), ("bulk", 3)]
    sent = [Attachment.parse(each[2]).sent_ns for each in side.notes.puts]
    assert sent[0] == 5
    assert before_ns <= sent[1] + 1_000_000_000 <= time.time_ns()
    assert before_ns <= sent[2] <= time.time_ns()


async def test_what_a_robot_says_of_its_own_topic_is_learnt_before_its_first_message(side, daemon):
    daemon.heard = [
        {"robot": ROBOT, "name": "thing", "latched": 2, "best_effort": True, "hash": "abab"},
    ]  # fmt: skip
    note(side.notes, endpoint(Role.SUBSCRIPTION, "/robot_2/thing", OURS))
    note(side.notes, endpoint(Role.SUBSCRIPTION, "/robot_2/thing", OURS, OTHER, number=2))
    note(side.notes, endpoint(Role.SUBSCRIPTION, "/robot_2/more", OURS, OTHER, number=3))
    side.put("thing", ty=OURS)
    side.put("more", ty=OURS)
    assert side.keys == []
    async with side.side.publisher() as out:
        task = asyncio.ensure_future(side.ros.run(out))
        await until(lambda: len(side.keys) == 2)
        assert side.keys == [key_of("/thing", OURS, HASH), key_of("/more", OURS, OTHER)]
        assert [kept for *_, kept in side.notes.publishers] == [2, 0]
        assert ":1:,2" in next(each for each in side.notes.tokens if "%thing" in each)
        side.put("thing", ty=OURS)
        side.put("more", ty=OURS)
        assert len(side.keys) == 4, "now it is known"
        daemon.stop()
        side.put("late", ty=ODOM)
        await until(lambda: len(side.keys) == 5)
        task.cancel()
    daemon.start()


async def test_a_new_leader_puts_what_is_latched(side):
    items = [
        (TopicKey(ROBOT, topic), Upward("", CDR, Passed(8, ty), "bulk", 0.0))
        for topic, ty in (("odom", ODOM), ("map", "nav_msgs/msg/OccupancyGrid"), ("thing", OURS))
    ]
    side.ros.take_over(items)
    assert [key.split("/")[2] for key in side.keys] == ["map"]


async def test_a_node_sends_commands_to_a_robot(side):
    took = []
    end = side.ros.follow(ROBOT, lambda given, cdr: took.append((given, cdr)))
    take = side.notes.takes[f"{DOMAIN}/robot_2/**"]
    right = Attachment(3, 5, GID).build()
    key = key_of("/cmd_vel", TEXT, HASH)
    take(Sample(key, CDR, right, "application/cdr"))
    assert took == [(FromRos(TopicKey(ROBOT, "cmd_vel"), Command(GID.hex(), 3, TEXT)), CDR)]
    for other, attachment, encoding in (
        (key, right, ENCODING), (key, b"junk", ""), (key, None, ""),
        (key.replace("robot_2", "robot_3"), right, ""), (key.replace("robot_2", "robo"), right, ""),
        (key.replace("::dds_", ""), right, ""), ("junk", right, ""),
        (key, Attachment(-1, 5, GID).build(), ""),
    ):  # fmt: skip
        take(Sample(other, CDR, attachment, encoding))
    assert len(took) == 1
    take(Sample(key, CDR, Attachment(0, 5, GID).build(), ""))
    assert len(took) == 2
    side.put()
    end()
    assert f"{DOMAIN}/robot_2/**" not in side.notes.takes
    assert side.notes.publishers == []


async def test_without_topics_that_go_down_nothing_is_taken_from_nodes(daemon, tmp_path):
    folder = tmp_path / "up"
    folder.mkdir()
    other = Daemon(folder, f'[fleet]\nname = "mine"\nros_domain = {DOMAIN}\n')
    side = Side(other)
    end = side.ros.follow(ROBOT, lambda *_: None)
    assert list(side.notes.takes) == [f"@ros2_lv/{DOMAIN}/**"]
    end()
    side.side.close()
    other.stop()


async def test_services_and_subscriptions_appear_once_every_gateway_knows_who_leads(side):
    side.ros.hear(ROBOT, "_sdrlink/services", message(told([SET])), leads=True)
    for number, name in enumerate(("/robot_2/cmd_vel", "/robot_2/odom", "/robot_3/cmd_vel", "/x")):
        note(side.notes, endpoint(Role.PUBLISHER, name, number=number))
    known = side.leads()
    side.ros.look(side.robots, 2.19)
    assert side.tokens("SS") == side.tokens("MS") == []
    side.ros.look(side.robots, 2.2)
    assert [each.name for each in side.tokens("SS")] == ["/robot_2/set"]
    shown = [(each.name, each.kind, each.hash) for each in side.tokens("MS")]
    assert shown == [("/robot_2/cmd_vel", dds_type(ODOM), HASH)]
    opened = list(side.notes.tokens)
    side.ros.look(side.robots, 2.3)
    note(side.notes, endpoint(Role.PUBLISHER, "/y", number=9))
    side.ros.look(side.robots, 2.4)
    assert side.notes.tokens == opened
    note(side.notes, endpoint(Role.PUBLISHER, "/robot_2/arm", number=10))
    side.ros.look(side.robots, 2.5)
    assert [each.name for each in side.tokens("MS")] == ["/robot_2/cmd_vel", "/robot_2/arm"]
    note(side.notes, endpoint(Role.PUBLISHER, "/robot_2/cmd_vel", number=0), False)
    side.ros.look(side.robots, 2.6)
    assert [each.name for each in side.tokens("MS")] == ["/robot_2/arm"]
    # Another one leads: its leader has all of that.
    side.put()
    side.put(robot=3)
    known.election.claimed(Claim(8, 9, 1.0), 3.0)
    known.led_since = float("inf")
    side.ros.look(side.robots, 3.1)
    assert side.tokens("SS") == side.tokens("MS") == []
    assert [key for key, *_ in side.notes.publishers] == [key_of("/odom", ODOM, type_hash(ODOM), 3)]


async def test_topics_stay_while_it_leads_or_nobody_does(side):
    side.put()
    known = side.leads(since=2.0)
    side.ros.look(side.robots, 2.1)
    known.led_since = float("inf")
    side.ros.look(side.robots, 2.1)
    known.election.hear(None, 2.0)
    known.election.poll(2.1)
    side.ros.look(side.robots, 2.2)
    assert len(side.notes.publishers) == 1


async def test_so_many_subscriptions_are_shown(side):
    for number in range(MOST_TAKEN + 1):
        note(side.notes, endpoint(Role.PUBLISHER, f"/robot_2/arm{number}", number=number))
    side.leads()
    side.ros.look(side.robots, 9.0)
    assert len(side.tokens("MS")) == MOST_TAKEN


def message(payload, age_us=None):
    return Message("", payload, "", ROBOT, 1, 0, age_us, 1, 0, None)


async def test_topics_of_actions_appear_as_the_robots_action_has_them(side):
    side.ros.hear(ROBOT, "_sdrlink/services", message(told(GO)), leads=True)
    of_go, of_other = (with_action(name) + b"inner" for name in ("/arm/go", "/other"))
    side.ros.hear(ROBOT, "_sdrlink/feedback", message(of_go), leads=False)
    side.ros.hear(ROBOT, "_sdrlink/feedback", message(of_other), leads=True)
    side.ros.hear(ROBOT, "_sdrlink/status", message(b"junk"), leads=True)
    side.ros.hear(ROBOT, "odom", message(of_go), leads=True)
    assert side.keys == []
    name, kind = "/robot_2/arm/go/_action/feedback", "a/action/Go_FeedbackMessage"
    note(side.notes, endpoint(Role.SUBSCRIPTION, name, kind))
    before_ns = time.time_ns()
    side.ros.hear(ROBOT, "_sdrlink/feedback", message(of_go, 3_000_000), leads=True)
    side.ros.hear(ROBOT, "_sdrlink/status", message(of_go), leads=True)
    status = "action_msgs/msg/GoalStatusArray"
    assert side.keys == [
        key_of("/arm/go/_action/feedback", "a/action/Go_FeedbackMessage", HASH),
        key_of("/arm/go/_action/status", status, type_hash(status)),
    ]
    assert [(payload, qos) for _, payload, _, qos in side.notes.puts] == [(b"inner", "latency")] * 2
    first, second = (Attachment.parse(each[2]).sent_ns for each in side.notes.puts)
    assert before_ns <= first + 3_000_000_000 <= second <= time.time_ns()
    assert [kept for *_, kept in side.notes.publishers] == [0, 1]
    qos = [each.rpartition("/")[2] for each in side.notes.tokens if "/MP/" in each]
    assert qos == ["2::,10:,:,:,,", ":1:,1:,:,:,,"]


async def test_answers_to_calls_come_on_the_gateways_own_topic(side, daemon):
    side.ros.hear(ROBOT, "_sdrlink/services", message(told([SET])), leads=True)
    side.leads()
    side.ros.look(side.robots, 9.0)
    ended = []
    question = Question(b"", Attachment(1, 2, GID).build(), lambda *_: ended.append(1), lambda: 0)
    async with side.side.publisher() as out:
        task = asyncio.ensure_future(side.ros.run(out))
        side.notes.takes[f"{DOMAIN}/robot_2/set/a::srv::dds_::Set_/*"](question)
        ((_, packet, _),) = await requests(daemon, 1)
        answer = message(packet._replace(kind=Kind.ANSWER).build())
        side.ros.hear(ROBOT, "robot_8/_sdrlink/calls", answer, leads=True)
        assert side.ros.counts == {}
        side.ros.hear(ROBOT, "robot_7/_sdrlink/calls", answer, leads=False)
        assert side.ros.counts == {"calls_answered": 1}
        end = side.ros.follow(ROBOT, lambda *_: None)
        side.notes.takes[f"{DOMAIN}/robot_2/set/a::srv::dds_::Set_/*"](question)
        end()
        assert side.ros.counts == {"calls_answered": 1, "calls_failed": 1}, "the robot has gone"
        task.cancel()
    assert ended == [1]
