"""Topics beyond the registry: declared by their source, and numbered."""

from random import Random

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sdrlinkd.errors import DeclarationError
from sdrlinkd.link import Offer, Outcome, Overrides, PolicyTable, RelayParams, TopicPolicy
from sdrlinkd.link.topics import (
    FREE,
    MOST_KEYS,
    MOST_OF_ALL,
    MOST_OF_ONE,
    MOST_TOLD,
    N_NUMBERS,
    TELLING_SHARE,
    HeardTopics,
    OwnTopics,
    TopicTeller,
)
from sdrlinkd.wire import (
    Description,
    Entry,
    Pdu,
    Registry,
    Topic,
    TopicPiece,
    build,
    build_records,
    make_registry,
    parse,
    pieces,
)
from tests.laws import law
from tests.link.declared import auto, run
from tests.link.world import compose, make_link, received, rx, topic_of, tx
from tests.wire.vectors import BY_NAME, HI, TOPIC

ODOM = Offer("odom", "nav_msgs/msg/Odometry")
CDR = b"\0\1\0\0"
HASH, OTHER_HASH = bytes(range(8)), bytes(range(1, 9))


def name_of(link, message):
    """The name under which a message has arrived at `link`."""
    return link.heard_topic(message.src, message.series).name


@pytest.mark.parametrize("pdu_size", [32, 64, 220, 1024])
def test_a_declared_topic_arrives_under_its_name(pdu_size):
    one, two = auto(1, pdu_size=pdu_size), auto(2, pdu_size=pdu_size)
    topic = one.declare(ODOM)
    one.submit(topic.id, CDR + bytes(700), 0.0)
    assert run([one, two], 0.0, 60) == [(2, 1, "odom", CDR + bytes(700))]
    assert two.heard_topic(1, topic.id).type == "nav_msgs/msg/Odometry"
    assert one.audit() == two.audit() == []
    assert [each.name for each in one.report(0.0).topics] == ["/odom"]
    assert [each.name for each in two.report(0.0).received] == ["/odom"]


def test_beside_a_registry_both_kinds_share_pdus():
    registry = [("scan", "sensor_msgs/LaserScan"), ("imu", "sensor_msgs/Imu")]
    one, two = auto(1, registry), auto(2, registry)
    topic = one.declare(ODOM)
    run([one, two], 0.0, 30)
    for topic_id in (0, 1, topic.id):
        one.submit(topic_id, CDR + bytes([topic_id]), 2.0)
    (burst,) = [compose(one, 2.0, 8)]
    (pdu,) = burst.pdus
    assert sorted(entry.topic_id for entry in parse(pdu, 1024).entries)[:3] == [0, 1, 14]
    assert [m.payload[4] for m in two.hear(pdu, 2.0)] == [0, 1, topic.id]
    assert one.declare(Offer("/scan", "sensor_msgs/LaserScan")).id == 0


@pytest.mark.slow
@law(30)
@given(
    names=st.lists(st.from_regex(r"[a-z]{1,6}(/[a-z]{1,6})?", fullmatch=True), min_size=1,
                   max_size=20, unique=True),
    pdu_size=st.sampled_from((64, 220, 1024)), seed=st.integers(0, 99),
)  # fmt: skip
def test_whatever_is_lost_each_message_has_its_own_name(names, pdu_size, seed):
    """Half of the PDUs are lost: no message ever comes under another's name or type."""
    rng = Random(seed)
    one, two = auto(1, pdu_size=pdu_size), auto(2, pdu_size=pdu_size)
    ids = {name: one.declare(Offer(name, f"p/msg/T{i}")).id for i, name in enumerate(names)}
    got = []
    for i in range(200):
        name = rng.choice(names)
        one.submit(ids[name], CDR + name.encode(), 0.1 * i)
        got += run([one, two], 0.1 * i, 2, lambda: rng.random() < 0.5)
    assert all(payload[4:].decode() == name for _, _, name, payload in got)
    assert len(got) > 20
    assert two.audit() == []


def test_messages_wait_a_second_for_their_declaration():
    """The PDU with the first message and the declaration is lost."""
    one, two = auto(1), auto(2)
    topic = one.declare(ODOM)
    pdus = []
    for number in range(4):
        one.submit(topic.id, CDR + bytes([number]), 0.1 * number)
        burst = compose(one, 0.1 * number, 8)
        one.confirm(burst, Outcome.SENT, 0.1 * number)
        pdus += burst.pdus
    assert [m for number in (1, 2, 3) for m in two.hear(pdus[number], 0.1 * number)] == []
    assert (rx(two).started, rx(two).held) == (3, 3)
    assert rx(two).held_bytes > 0
    two.handle_timers(1.15)
    assert (rx(two).held, rx(two).dropped["rx_unknown_topic"]) == (2, 1)
    one.handle_timers(1.18)
    told = compose(one, 1.18, 8).pdus
    assert [m.payload[4] for pdu in told for m in two.hear(pdu, 1.18)] == [2, 3]
    assert (rx(two).held, rx(two).held_bytes, rx(two).delivered) == (0, 0, 2)
    assert two.audit() == []


def test_a_newcomer_is_told_all_at_once_and_within_its_share_of_the_air():
    one = auto(1)
    for i in range(60):
        one.declare(Offer(f"sensors/number_{i}", "sensor_msgs/msg/PointCloud2"))
    run([one], 0.0, 100)
    late = auto(2)
    late.declare(ODOM)
    run([one, late], 10.0, 60)
    assert len(late.heard_topics()[1]) == 60


@pytest.mark.slow
def test_declarations_take_two_per_cent_of_the_air_at_most():
    topics = OwnTopics(Registry(()), True, 250)
    for i in range(200):
        topics.declare(Offer(f"sensors/number_{i}", "sensor_msgs/msg/PointCloud2"))
    teller = TopicTeller(topics, 250)
    paid_s, pdu_s = 0.0, 0.01
    for tick in range(2000):
        now = 0.05 * tick
        if tick % 20 == 0:
            teller.newcomer(now)
        list(teller.due(now))
        if teller.may_pay(now, pdu_s):
            paid_s += pdu_s
    assert paid_s <= TELLING_SHARE * 100 + 0.1
    assert paid_s > 0.9 * TELLING_SHARE * 100


def test_each_producer_key_has_a_number_and_is_kept_apart():
    one, two, late = (auto(i, beacon_s=0.3) for i in (1, 2, 3))
    topic = one.declare(Offer("tf_static", "tf2_msgs/msg/TFMessage", depth=1))
    one.set_policy(topic.id, TopicPolicy(durability="transient_local", depth=1))
    for i, key in enumerate("abcab"):
        one.submit(topic.id, CDR + key.encode() + bytes([i]), 0.0, Overrides(key=key))
    got = run([one, two], 0.0, 40)
    assert {each[3][4:5] for each in got} == {b"a", b"b", b"c"}
    owed = [each for each in run([one, two, late], 3.0, 60) if each[0] == 3]
    assert [each[3][4:] for each in owed] == [b"c\2", b"a\3", b"b\4"]
    (heard,) = [each for each in late.report(0.0).received if each.src == 1]
    assert (heard.name, heard.delivered) == ("/tf_static", 3)


def test_receivers_keep_as_many_as_the_source_says():
    one, two = auto(1, beacon_s=0.3), auto(2)
    topic = one.declare(Offer("map", "nav_msgs/msg/OccupancyGrid", depth=3))
    one.submit(topic.id, CDR, 0.0)
    run([one, two], 0.0, 20)
    burst = None
    one.submit(topic.id, CDR, 2.0)
    burst = compose(one, 2.0, 8)
    (message,) = [m for pdu in burst.pdus for m in two.hear(pdu, 2.0)]
    assert two.retain(message).depth == 3


def test_the_documents_vectors_are_heard_as_it_says():
    two = auto(2)
    topic = Entry(15, 0, 0, 1, TOPIC.payload)
    two.hear(build(Pdu(0, False, 1, 255, 4, 1, [topic]), 1024), 0.0)
    assert two.heard_topic(1, 42).about == Description(
        "odom", "nav_msgs/msg/Odometry", bytes(range(8)), 5
    )
    small = auto(3, pdu_size=32)
    for piece in pieces(42, Description("odom", "nav_msgs/msg/Odometry"), 13):
        entry = Entry(15, 0, 0, 1, build_records([piece]))
        small.hear(build(Pdu(0, False, 1, 255, piece.piece, 1, [entry]), 32), 0.0)
    (message,) = small.hear(BY_NAME["numbered"].octets, 0.0)
    assert (message.topic.name, message.payload) == ("odom", HI)


def test_what_may_not_be_declared_is_refused_with_given_and_allowed():
    topics = OwnTopics(make_registry([("scan", "sensor_msgs/LaserScan")]), True, 250)
    topics.declare(Offer("odom", "nav_msgs/Odometry", HASH))
    for offer, says in (
        (Offer("9lives", "p/T"), "name: got '9lives'"),
        (Offer("a" * 200, "p/T"), "up to 128"),
        (Offer("odom", "p/T/X/Y"), "type: got"),
        (Offer("odom", "p/srv/T"), "type: got"),
        (Offer("odom", "p/T"), "declared as nav_msgs/msg/Odometry"),
        (Offer("scan", "p/T"), "declared as sensor_msgs/msg/LaserScan"),
        (Offer("Odom", "p/T"), "differs from odom by upper and lower case"),
        (Offer("odom2", "nav_msgs/Odometry", OTHER_HASH), "two versions"),
    ):
        with pytest.raises(DeclarationError, match=says):
            topics.declare(offer)
    for i in range(N_NUMBERS - 1):
        topics.declare(Offer(f"topic_{i}", "p/T"))
    with pytest.raises(DeclarationError, match="at most 240"):
        topics.declare(Offer("one_more", "p/T"))
    with pytest.raises(DeclarationError, match="auto"):
        OwnTopics(make_registry([("scan", "p/T")]), False, 250).declare(Offer("odom", "p/T"))
    with pytest.raises(DeclarationError, match=r"link\.pdu_size"):
        OwnTopics(Registry(()), True, 13).declare(Offer("a" * 120, f"p/{'T' * 100}"))


def test_numbers_are_the_same_after_a_restart_and_keys_share_when_they_run_out():
    first, again = (OwnTopics(Registry(()), True, 250) for _ in range(2))
    names = [f"topic_{i}" for i in range(20)]
    ids = {name: first.declare(Offer(name, "p/T")).id for name in names}
    same = sum(again.declare(Offer(name, "p/T")).id == ids[name] for name in reversed(names))
    assert same >= 15
    topic = first.declare(Offer("tf", "p/T"))
    numbers = [first.number(topic.id, f"key {i}") for i in range(MOST_KEYS + 5)]
    assert len(set(numbers)) == MOST_KEYS
    assert first.number(topic.id, "key 36") == numbers[-1]
    for i in range(N_NUMBERS - len(first.told)):
        first.declare(Offer(f"more_{i}", "p/T"))
    alone = first.declare(Offer("topic_0", "p/T")).id
    assert {first.number(alone, key) for key in "abc"} == {alone}


def test_another_version_of_a_type_is_refused_and_both_are_named():
    one, two = auto(1), auto(2)
    two.declare(Offer("/robot_9/odom", "nav_msgs/msg/Odometry", OTHER_HASH))
    topic, other = one.declare(ODOM._replace(hash_=HASH)), one.declare(Offer("imu", "p/msg/Imu"))
    for topic_id in (topic.id, other.id):
        one.submit(topic_id, CDR + bytes(40), 0.0)
    got = run([one, two], 0.0, 30)
    assert [each[2] for each in got] == ["imu"]
    assert received(two)[1, topic.id].dropped == {"rx_other_type": 1}
    (notice,) = two.notices(2.0)
    assert HASH.hex() in notice
    assert OTHER_HASH.hex() in notice


@pytest.mark.parametrize(
    "after", [Offer("odom", "p/msg/Pose"), ODOM._replace(hash_=OTHER_HASH)], ids=["type", "hash"]
)
def test_a_producer_that_begins_anew_may_have_another_type(after):
    """Nobody takes octets of one type for those of the other, whatever is lost."""
    one, two = auto(1), auto(2)
    before = one.declare(ODOM._replace(hash_=HASH), 0.0)
    for number in range(3):
        one.submit(before.id, CDR + bytes([number]), 0.0)
    got = run([one, two], 0.0, 30)
    assert [each[2] for each in got] == ["odom"] * 3
    with pytest.raises(DeclarationError, match=r"two versions|in use; end that, and try again"):
        one.declare(after, 4.9)
    topic = one.declare(after, 5.0)
    assert topic.id != before.id
    assert one.topic_named("odom") == topic
    one.submit(topic.id, CDR + bytes([3]), 5.0)
    got = run([one, two], 5.0, 30)
    assert [each[3][4:] for each in got] == [bytes([3])]
    (heard,) = two.heard_topics()[1]
    assert (heard.type, heard.about.hash_) == (topic.type, after.hash_)
    assert two.heard_topic(1, before.id) is None
    assert one.audit() == two.audit() == []
    # And back, as often as that happens; each time the type before has ended.
    assert {one.declare(each, 10.0 * i).type for i, each in enumerate([ODOM, after] * 3, 2)} == {
        before.type, topic.type,
    }  # fmt: skip


def test_a_robot_without_numbers_says_what_it_misses():
    one, plain = auto(1, beacon_s=0.2), make_link(2)
    topic = one.declare(ODOM)
    one.submit(topic.id, CDR, 0.0)
    assert run([one, plain], 0.0, 20) == []
    assert any("auto = true" in notice for notice in plain.notices(1.0))
    assert plain.audit() == []
    run([make_link(1, beacon_s=0.2, seed=77), plain], 2.0, 10)
    assert plain.notices(3.0) == [], "it has restarted, and declares nothing"


def test_after_its_restart_a_robots_numbers_are_learned_anew():
    one, two = auto(1, beacon_s=0.2), auto(2)
    topic = one.declare(ODOM)
    run([one, two], 0.0, 20)
    assert two.heard_topic(1, topic.id).name == "odom"
    again = make_link(1, topics=(), has_numbers=True, seed=77, beacon_s=0.2)
    run([again, two], 2.0, 10)
    assert two.heard_topic(1, topic.id) is None
    assert two.take_changed_topics() == [(1, topic.id)]


def heard():
    return HeardTopics(Registry(()), True, lambda _: bytes(8))


def test_names_from_the_air_that_cannot_be_used_are_refused_and_named():
    topics = heard()
    for number, about, says in (
        (16, Description("odom", "p/msg/T"), ""),
        (17, Description("Odom", "p/msg/T"), "upper and lower case"),
        (19, Description("no name", "p/msg/T"), "no topic name"),
        (20, Description("x", "no type"), "no message type"),
        (21, Description("odom", "p/msg/T"), ""),
    ):
        (piece,) = pieces(number, about, 250)
        assert topics.take(5, piece) == (not says)
        if says:
            assert says in topics.refused[5][number]
    assert len(topics.refused[5]) == 3
    assert "robot 5 declares topics that cannot be used (3)" in topics.notices()[0]
    assert [topics.topic(5, n).base for n in (16, 21)] == [16, 16]


@law(200)
@given(
    st.lists(
        st.builds(
            TopicPiece, st.integers(0, 255), st.integers(0, 3), st.integers(0, 15),
            st.integers(0, 15), st.binary(max_size=40),
        ),
        max_size=60,
    )
)  # fmt: skip
def test_any_pieces_are_learned_or_refused_within_bounds(found):
    topics = heard()
    for piece in found:
        topics.take(1, piece)
    for piece in found:
        known = topics.topic(1, piece.number)
        assert known is None or known.about is not None
    topics.notices()


@law(50)
@given(
    st.text(alphabet="abc_", min_size=1, max_size=60).map(lambda text: "a" + text),
    st.integers(14, 250), st.integers(0, 255), st.randoms(),
)  # fmt: skip
def test_a_description_in_pieces_of_any_size_and_order(name, room, depth, rng):
    about = Description(name, "pkg/msg/Name", HASH, depth, depth % 2 == 0)
    found = pieces(77, about, room)
    rng.shuffle(found)
    topics = heard()
    assert [topics.take(1, piece) for piece in found] == [False] * (len(found) - 1) + [True]
    assert topics.topic(1, 77).about == about


@law(100)
@given(st.lists(st.binary(max_size=50), min_size=1, max_size=9), st.booleans())
def test_any_octets_under_topic_id_14(payloads, known):
    """No entry under topic id 0xE can harm the entries beside it."""
    two = auto(2, [("scan", "sensor_msgs/LaserScan")])
    one = auto(1, [("scan", "sensor_msgs/LaserScan")])
    if known:
        for number in range(16, 256, 40):
            record = build_records(pieces(number, Description(f"t{number}", "p/msg/T"), 250))
            entry = Entry(15, 0, 0, 1, record)
            two.hear(build(Pdu(0, False, 1, 255, number, 1, [entry]), 1024), 0.0)
    entries = [Entry(14, i, 0, 1, payload) for i, payload in enumerate(payloads)]
    entries.append(Entry(0, 99, 0, 1, CDR + b"scan"))
    pdu = build(Pdu(0, False, 1, 255, 3, 1, entries), 1024)
    assert CDR + b"scan" in [m.payload for m in two.hear(pdu, 0.0)]
    two.handle_timers(2.0)
    two.handle_timers(4.0)
    assert rx(two).held == 0
    assert two.audit() == one.audit() == []


def test_its_receipt_and_why():
    one, two = auto(1), auto(2)
    topic = one.declare(ODOM)
    run([one, two], 0.0, 20)
    one.submit(topic.id, CDR + bytes(3000), 2.0, Overrides(dst=2, receipt="a.1"))
    run([one, two], 2.0, 20)
    (verdict,) = one.take_verdicts()
    assert verdict[:4] == ("a.1", topic.id, 2, "delivered")
    assert tx(one).sent == 1
    assert topic_of_name(one, "/odom").sent == 1
    assert two.topic_named("odom") is None
    assert one.topic_named("/odom") == Topic(topic.id, "odom", "nav_msgs/msg/Odometry")


def topic_of_name(link, name):
    return next(each for each in link.report(0.0).topics if each.name == name)


def test_a_relay_forwards_them_unread():
    one = auto(1, hop_limit=2)
    relay = make_link(2, hop_limit=2, relay=RelayParams(policy="flood"), seed=2)
    three = auto(3, hop_limit=2)
    topic = one.declare(ODOM)
    one.submit(topic.id, CDR + b"far", 0.0)
    got = []
    for i in range(40):
        now = 0.05 * i
        for link in (one, relay):
            link.handle_timers(now)
            while burst := compose(link, now, 8):
                link.confirm(burst, Outcome.SENT, now)
                for pdu in burst.pdus:
                    other = relay if link is one else three
                    got += [m.payload for m in other.hear(pdu, now)]
    assert got == [CDR + b"far"]
    assert relay.audit() == three.audit() == []
    assert topic_of(relay, 0).accepted == 0


def declared_as(topics, *numbers):
    """Let robot 5 declare (number, name); returns the bases of these numbers."""
    for number, name in numbers:
        (piece,) = pieces(number, Description(name, f"p/msg/{name.capitalize()}"), 250)
        topics.take(5, piece)
    return [topics.topic(5, number).base for number, _ in numbers]


def test_topics_never_share_what_they_are_counted_under():
    """A number gets another meaning, and its old name another number."""
    topics = heard()
    assert declared_as(topics, (20, "odom"), (21, "odom"), (22, "odom")) == [20, 20, 20]
    assert declared_as(topics, (20, "scan")) == [20]
    assert [topics.topic(5, n).base for n in (21, 22)] == [21, 21]
    assert declared_as(topics, (23, "odom")) == [21]
    assert sorted(topics.take_changed()) == [(5, 20), (5, 21), (5, 22)]
    for number in range(1000):
        declared_as(topics, (30, f"name_{number}"))
    assert topics.topic(5, 30).base == 30


def test_a_restart_ends_what_was_begun():
    """Parts of a large message from before and after it are not joined."""
    old, two = auto(1, pdu_size=64), auto(2, pdu_size=64)
    new = make_link(1, topics=(), has_numbers=True, seed=77, pdu_size=64, beacon_s=0.2)
    for link in (old, new):
        topic = link.declare(ODOM)
        link.submit(topic.id, CDR + bytes([link is old]) * 30_000, 0.0)
    run([old, two], 0.0, 1)
    old.handle_timers(0.0)
    begun = rx(two).held
    got = run([new, two], 0.1, 60)
    assert [each[3] for each in got] == [CDR + bytes(30_000)]
    assert begun == 0 or rx(two).dropped["rx_partial_superseded"]
    assert two.audit() == []


def test_a_name_of_the_registry_keeps_its_type():
    one, two = auto(1), auto(2, [("odom", "nav_msgs/msg/Odometry")])
    topic = one.declare(Offer("odom", "std_msgs/msg/String"))
    one.submit(topic.id, CDR, 0.0)
    assert run([one, two], 0.0, 30) == []
    assert received(two)[1, topic.id].dropped == {"rx_other_type": 1}
    assert "here it is nav_msgs/msg/Odometry" in two.notices(2.0)[0]


def test_one_robot_cannot_displace_what_another_waits_for():
    two = auto(2)
    for src, n in ((1, 1), (66, 300)):
        for seq in range(n):
            entry = Entry(14, seq % 256, 0, 1, bytes([77]) + CDR)
            two.hear(build(Pdu(0, False, src, 255, seq % 256, 1, [entry]), 1024), 0.0)
    (piece,) = pieces(77, Description("odom", "p/msg/T"), 250)
    entry = Entry(15, 0, 0, 1, build_records([piece]))
    told = build(Pdu(0, False, 1, 255, 1, 1, [entry]), 1024)
    assert [m.src for m in two.hear(told, 0.02)] == [1]
    assert two.audit() == []


def test_what_is_short_of_entry_ids_is_named_by_its_topic():
    one = auto(1)
    topic = one.declare(ODOM)
    for number in range(600):
        one.submit(topic.id, CDR + bytes(1500), 0.0, Overrides(key=f"k{number % 2}"))
    while (burst := compose(one, 0.0, 63)) is not None:
        one.confirm(burst, Outcome.SENT, 0.0)
    assert any("odom had to wait for a free entry id" in each for each in one.notices(0.0))


def test_the_policy_in_force_is_told():
    one, two = auto(1), auto(2)
    topic = one.declare(ODOM)
    one.set_policy(topic.id, TopicPolicy(durability="transient_local", depth=4))
    run([one, two], 0.0, 30)
    assert two.heard_topic(1, topic.id).about.depth == 4


TWIST = "geometry_msgs/msg/Twist"


@pytest.mark.parametrize("first", ["gateway", "robot"])
def test_commands_over_a_gateway_and_from_their_robot_are_one_stream(first):
    robot, gateway, receiver = auto(1), auto(8), auto(4)
    receiver.set_table(PolicyTable({"cmd_vel": TopicPolicy(deadman_s=0.3)}))
    own, via = (
        link.declare(Offer(name, TWIST)).id
        for link, name in ((robot, "cmd_vel"), (gateway, "@1/cmd_vel"))
    )
    senders = [(gateway, via), (robot, own)]
    silent, heard = [], []
    for i in range(80):
        now = 0.05 * i
        if i < 60:
            link, topic_id = senders[(i >= 30) == (first == "gateway")]
            link.submit(topic_id, CDR + bytes((i,)) * 48, now)
        for link in (robot, gateway):
            link.handle_timers(now)
            while burst := compose(link, now, 8):
                link.confirm(burst, Outcome.SENT, now)
                for pdu in burst.pdus:
                    for message in receiver.hear(pdu, now):
                        receiver.delivered(message, now)
                        heard.append(message)
        silent += [(i, *each) for each in receiver.take_silent(now)]
    assert [each.payload[4] for each in heard] == [*range(60)]
    assert {each.topic.origin(each.src) for each in heard} == {1}
    assert {each.topic.at_origin for each in heard} == {"cmd_vel"}
    # Only the end of all commands is silence.
    assert [i for i, *_ in silent] == [65]
    assert receiver.heard_topic(*silent[0][1:]).at_origin == "cmd_vel"


@pytest.mark.parametrize(
    ("allowed", "n"), [([], 5), ([1], 0), ([8], 0), ([1, 8], 5), ([8, 9, 1], 5)]
)
def test_a_topic_of_a_robot_elsewhere_is_taken_only_from_both(allowed, n):
    gateway, receiver = auto(8), auto(4)
    receiver.set_table(PolicyTable({"cmd_vel": TopicPolicy(from_=allowed)}))
    topic = gateway.declare(Offer("@1/cmd_vel", TWIST))
    for i in range(5):
        gateway.submit(topic.id, CDR + bytes(48), 0.05 * i)
    assert len(run([gateway, receiver], 0.0, 20)) == n
    assert receiver.audit() == []


def declares(topics, src, number, name, kind="a/msg/B"):
    """A robot declares a topic under a number, in as many pieces as it takes."""
    for piece in pieces(number, Description(name, kind), 60):
        known = topics.take(src, piece)
    return known


def test_declared_topics_are_bounded_by_robot_and_in_all_and_each_robot_has_some():
    topics = HeardTopics(Registry(()), True, lambda _: bytes(8))
    for src in range(1, 254):
        for number in range(16, 256):
            declares(topics, src, number, f"topic_{number}")
    sizes = {src: len(known) for src, known in topics.declared().items()}
    assert sizes[1] == MOST_OF_ONE
    assert min(sizes.values()) == FREE
    assert sum(sizes.values()) <= MOST_OF_ALL + 253 * FREE
    refused = topics.refused[253][200]
    assert refused == f"topic_200: got one more; allowed: {MOST_OF_ALL} of all robots together"
    assert topics.refused[1][255].endswith(f"allowed: {MOST_OF_ONE} of a robot")
    assert len(topics.notices()) == MOST_TOLD + 1
    assert topics.notices()[-1] == f"and {253 - MOST_TOLD} more like the last"
    # Who restarts makes room, also for those that were refused.
    topics.forget(1)
    assert declares(topics, 253, 200, "topic_200")
    assert len(topics.refused[253]) == 240 - FREE - 1


@law(300)
@given(
    st.lists(
        st.tuples(
            st.integers(1, 2), st.integers(16, 20), st.sampled_from(["a", "b", "B", "c"]),
            st.sampled_from(["x/msg/X", "y/msg/Y"]),
        )
        | st.integers(1, 2)
    )
)  # fmt: skip
def test_whatever_is_declared_each_name_has_one_number_and_one_type(steps):
    topics, heard = HeardTopics(Registry(()), True, lambda _: bytes(8)), {}
    for step in steps:
        if isinstance(step, int):
            topics.forget(step)
            continue
        before = topics.versions()
        src, number, name, kind = step
        if declares(topics, src, number, name, kind):
            assert topics.topic(src, number)[1:3] == (name, kind)
            assert topics.versions()[src] > before.get(src, 0)
        for each, known in topics.declared().items():
            names = [topic.name for topic in known]
            assert len({name.lower() for name in names}) == len(names)
            for topic in known:
                assert topics.topic(each, topic.base) == topic
            numbers = [topics.topic(each, number) for number in range(16, 21)]
            assert {topic for topic in numbers if topic is not None} >= set(known)
            assert {topic.name for topic in numbers if topic is not None} == set(names)
            # What did not change has the version it had.
            if heard.get(each, (0, None))[0] == topics.versions()[each]:
                assert heard[each][1] == known
            heard[each] = topics.versions()[each], known
