"""The bus beside programs: what is taken, what is refused and why, and who hears what."""

import asyncio
import os
from math import inf

import msgspec
import pytest
import zmq

from sdrlinkd.bus import AIR_TAP, PDU_TAP, SENT_TAP
from sdrlinkd.client import LATE_PREFIX, RECEIPT_PREFIX
from sdrlinkd.link import (
    AS_CONFIGURED,
    Delivered,
    HeardTopic,
    MessageName,
    Overrides,
    Qos,
    Retain,
    TopicPolicy,
    Verdict,
)
from sdrlinkd.localtime import LocalTimes
from sdrlinkd.wire import Topic
from tests.bus.programs import EMPTY, Beside

CDR = b"\0\1\0\0data"
ODOM, IMU, MAP = 1, 2, 4
"""Topic ids of the registry."""
MOST = 1000
KEPT = Retain(8, inf)


@pytest.mark.parametrize(
    ("more", "key", "over"),
    [
        ("[bus]\nmax_message_bytes = 1000\n", "bus.max_message_bytes = 1000", "tx_too_big"),
        ("[topic.odom]\nmax_bytes = 99\n", "topic.odom.max_bytes = 99", "tx_size_cap"),
        ("[link]\npdu_size = 64\n", "link.pdu_size = 64", "tx_too_big"),
        ("[queue]\nmax_bytes = 5000\n", "queue.max_bytes = 5000", "tx_overflow_new"),
    ],
)
async def test_the_announcement_says_which_setting_limits_a_message(tmp_path, more, key, over):
    beside = Beside(tmp_path, more)
    try:
        takes = (await beside.program().subscribe())["takes"]["/robot_1/odom"]
        assert takes["key"].startswith(key)
        assert takes["over"] == over
        if "pdu_size" in more:
            assert takes["most"] == beside.setup.largest
        else:
            assert takes["most"] == int(key.split()[-1])
    finally:
        beside.close()


@pytest.fixture
async def beside(tmp_path):
    beside = Beside(tmp_path, f"rx_depth = 4\n[bus]\nmax_message_bytes = {MOST}\n")
    yield beside
    beside.close()


def from_air(number=1, topic=MAP, called="map", src=2, payload=CDR, **more):
    heard = HeardTopic(topic, called, "nav_msgs/msg/OccupancyGrid")
    fields = {"lost_pdus": 0, "origin_at": None, "heard_at": 0.0, "hops_left": 0, "snr_db": None}
    fields |= {"series": topic, "topic": heard}
    return Delivered(src, topic, payload, number, **{**fields, **more})


def receipts(frames):
    """The receipts among what a program heard."""
    return [
        msgspec.msgpack.decode(each[1][1:]) for each in frames if each[0].startswith(RECEIPT_PREFIX)
    ]


async def test_a_message_is_passed_on_as_its_producer_wishes(beside):
    program = beside.program()
    await program.send("/robot_1/odom", CDR)
    wishes = {"q": "urgent", "p": 7, "d": 2, "ls": 250.0, "t": 12, "id": "a.1", "k": "left"}
    await program.send("/robot_1/imu", CDR, wishes | {"ty": "sensor_msgs/msg/Imu"})
    await program.send("/robot_1/imu", CDR, {"p": 0})
    assert beside.ingress.taken == [
        (ODOM, CDR, AS_CONFIGURED, None),
        (IMU, CDR, Overrides(Qos.URGENT, 7, 2, 0.25, receipt="a.1", key="left"), 12),
        (IMU, CDR, Overrides(priority=0), None),
    ]
    assert beside.ingress.refused == []
    report = beside.bus.report(control_requests=5)
    assert (report.received, report.published, report.control_requests) == (3, 0, 5)
    assert (report.runtime_dir, report.bad_envelope_last) == (str(beside.folder), "")


async def test_programs_that_already_publish_are_heard_too(beside):
    program = beside.program(zmq.PUB)
    async with asyncio.timeout(30):
        while not beside.ingress.taken:
            # What is published before the connection is there is lost.
            await program.out.send_multipart([b"/robot_1/odom\0", EMPTY, CDR])
            await program.subscribe()
    assert beside.ingress.taken[0] == (ODOM, CDR, AS_CONFIGURED, None)


@pytest.mark.parametrize("size", [0, 3, 4, 5, MOST - 1, MOST, MOST + 1])
async def test_from_an_encapsulation_header_to_the_largest_is_taken(beside, size):
    program = beside.program()
    await program.subscribe(RECEIPT_PREFIX)
    payload = bytes(size)
    await program.send("/robot_1/odom", payload, {"id": "a.1", "d": 9})
    if 4 <= size <= MOST:
        assert [each[:2] for each in beside.ingress.taken] == [(ODOM, payload)]
        assert beside.ingress.refused == []
    else:
        reason = "tx_bad_envelope" if size < 4 else "tx_too_big"
        assert beside.ingress.taken == []
        assert beside.ingress.refused == [(reason, ODOM, "a.1", 9)]
        assert "/robot_1/odom" in beside.bus.report(0).bad_envelope_last
        assert f"{size} " in beside.bus.report(0).bad_envelope_last
    assert receipts(await program.all()) == [], "the link knows what became of it"


@pytest.mark.parametrize("empty", [True, False])
async def test_a_message_without_wishes_is_measured_like_any_other(beside, empty):
    program = beside.program()
    header = None if empty else {"p": 1}
    for size in (3, MOST + 1):
        await program.send("/robot_1/odom", bytes(size), header)
    assert [each[0] for each in beside.ingress.refused] == ["tx_bad_envelope", "tx_too_big"]
    assert {each[2:] for each in beside.ingress.refused} == {("", None)}


async def test_another_type_than_the_topics_is_refused(beside):
    program = beside.program()
    await program.send("/robot_1/odom", CDR, {"ty": "sensor_msgs/msg/Imu", "id": "a.1"})
    assert beside.ingress.refused == [("tx_bad_envelope", ODOM, "a.1", None)]
    assert "sensor_msgs/msg/Imu" in beside.bus.report(0).bad_envelope_last
    assert beside.ingress.taken == []


@pytest.mark.parametrize(
    ("topic", "header", "reason"),
    [
        (b"/robot_1/nothing\0", {}, "tx_unknown_topic"),
        (b"/robot_1/odom", {}, "tx_bad_envelope"),
        (b"/robot_1/odom\0", {"p": 128}, "tx_bad_envelope"),
        (b"/robot_1/odom\0", {"q": "fast"}, "tx_bad_envelope"),
        (b"/robot_1/odom\0", {"k": "x" * 33}, "tx_bad_envelope"),
    ],
)
@pytest.mark.parametrize("dst", [None, 0, 9])
async def test_what_no_topic_of_ours_owns_is_refused_with_a_receipt(
    beside, topic, header, reason, dst
):
    program = beside.program()
    await program.subscribe(RECEIPT_PREFIX)
    told = header | {"id": "a.1"} | ({} if dst is None else {"d": dst})
    await program.send_frames(topic, b"\x01" + msgspec.msgpack.encode(told), CDR)
    (receipt,) = receipts(await program.all())
    name = topic.removesuffix(b"\0").decode()
    at = 255 if dst is None else dst
    assert receipt == {"id": "a.1", "topic": name, "d": at, "fate": "dropped", "reason": reason}
    assert beside.ingress.refused == [(reason, None, "", None)]
    assert beside.ingress.taken == []
    assert beside.bus.report(0).bad_envelope_last != ""


async def test_without_an_id_there_is_no_receipt(beside):
    program = beside.program()
    await program.subscribe(RECEIPT_PREFIX)
    await program.send("/robot_1/nothing", CDR)
    await program.send_frames(b"junk")
    assert [each[0] for each in beside.ingress.refused] == ["tx_unknown_topic", "tx_bad_envelope"]
    assert receipts(await program.all()) == []


async def test_a_declared_topic_is_accepted_from_then_on(beside):
    program = beside.program()
    topic = Topic(200, "arm", "std_msgs/msg/String")
    assert beside.bus.accept("/robot_1/arm", topic)
    assert not beside.bus.accept("/robot_1/arm", topic)
    await program.send("/robot_1/arm", CDR, {"ty": "std_msgs/msg/String"})
    assert beside.ingress.taken[0][0] == 200
    assert beside.bus.names_in()[200] == "/robot_1/arm"
    assert beside.bus.names_in()[ODOM] == "/robot_1/odom"


async def test_who_subscribes_is_told_what_is_accepted_and_again_when_that_changes(beside):
    program = beside.program()
    welcome = await program.subscribe(b"\0\1")
    assert welcome["boot"] == beside.bus.boot
    assert welcome["topics"] == list(beside.setup.topics_in)
    assert welcome["takes"]["/robot_1/odom"]["most"] == MOST
    await program.all()
    beside.bus.accept("/robot_1/arm", Topic(200, "arm", "std_msgs/msg/String"))
    beside.bus.announce({ODOM: TopicPolicy(max_bytes=100)})
    (frame,) = (frames[0] for frames in await program.all())
    again = msgspec.msgpack.decode(frame[2:])
    assert frame[:2] == b"\0\1"
    assert again["takes"]["/robot_1/arm"]["ty"] == "std_msgs/msg/String"
    odom = again["takes"]["/robot_1/odom"]
    assert (odom["most"], odom["over"]) == (100, "tx_size_cap")
    assert (await program.subscribe()) == again, "an acknowledgement tells the same"
    later = beside.program()
    later.heard.subscribe(b"\0\1")
    assert (await later.take())[0] == frame, "and so does the welcome of a new program"


async def test_a_verdict_is_told_to_its_producer_in_order(beside):
    program, other = beside.program(), beside.program()
    await program.subscribe(RECEIPT_PREFIX + b"a.")
    await other.subscribe(RECEIPT_PREFIX + b"b.")
    for number in range(3):
        beside.bus.tell(Verdict(f"a.{number}", ODOM, 2, "delivered", took_s=0.5, left=2 - number))
    beside.bus.tell(Verdict("b.0", IMU, 3, "dropped", "rx_expired", None, 0, 4))
    told = receipts(await program.all())
    assert [each["id"] for each in told] == ["a.0", "a.1", "a.2"]
    common = {"topic": "/robot_1/odom", "d": 2, "fate": "delivered", "took": 0.5}
    assert told[0] == common | {"id": "a.0", "left": 2}
    assert told[2] == common | {"id": "a.2"}
    assert receipts(await other.all()) == [
        {"id": "b.0", "topic": "/robot_1/imu", "d": 3, "fate": "dropped",
         "reason": "rx_expired", "repeats": 4}
    ]  # fmt: skip


async def test_a_message_from_the_air_reaches_those_who_want_it(beside):
    program, other = beside.program(), beside.program()
    assert not beside.bus.has_consumer.is_set()
    await program.subscribe(b"/rx_robot_2/map\0")
    assert beside.bus.filters == {b"/rx_robot_2/map\0"}
    assert beside.bus.has_consumer.is_set()
    await other.subscribe(b"/rx_robot_3/")
    beside.bus.publish(from_air(5), 0.25, 77)
    beside.bus.publish(from_air(6, src=3), None, 78)
    ((topic, header, payload),) = await program.all()
    assert (topic, payload) == (b"/rx_robot_2/map\0", CDR)
    told = program.read([topic, header])
    assert (told["s"], told["n"], told["age"], told["tr"]) == (2, 5, 250_000, 77)
    assert len(await other.all()) == 1
    assert beside.bus.report(0).published == 2
    assert beside.bus.names_out() == {(2, MAP): "/rx_robot_2/map", (3, MAP): "/rx_robot_3/map"}
    await program.unsubscribe(b"/rx_robot_2/map\0")
    assert beside.bus.filters == {b"/rx_robot_3/"}


async def test_the_header_tells_what_is_known_of_a_message(beside):
    program = beside.program()
    await program.subscribe(b"/rx_robot_")
    name = MessageName(9, 5, 70_000, 3, is_numbered=True)
    heard = from_air(
        4, series=201, lost_pdus=7, hops_left=2, snr_db=12.5, origin_at=10.0, began_at=10.25,
        heard_at=10.75, ended_at=11.5, name=name,
    )  # fmt: skip
    beside.bus.publish(heard, 2.0, 77, LocalTimes(1, 2, 3, 4))
    beside.bus.publish(heard._replace(name=name._replace(is_numbered=False)), None, 78)
    beside.bus.publish(from_air(1), None, 79)
    full, unaged, plain = [program.read(each) for each in await program.all()]
    assert full == {
        "s": 2, "n": 4, "tr": 77, "ty": "nav_msgs/msg/OccupancyGrid", "g": 7, "h": 2,
        "age": 2_000_000, "sn": 12.5, "tl": 1, "eb": 2, "ts": 3, "es": 4, "dw": 250_000,
        "dr": 500_000, "da": 750_000, "b": 9, "e": 5, "pn": 70_000, "ps": 3, "sr": 201,
    }  # fmt: skip
    unknown = {"age", "tl", "eb", "ts", "es", "dw", "dr", "da", "pn"}
    assert unaged.keys() == full.keys() - unknown | {"sq"}
    assert unaged["sq"] == 70_000
    assert "sr" not in plain


async def test_who_wants_everything_is_no_consumer_of_its_own(beside):
    program = beside.program()
    await program.subscribe(b"")
    assert beside.bus.filters == {b""}
    assert not beside.bus.has_consumer.is_set(), (
        "a program that watches wants nothing in particular"
    )


async def late(program, filter_=b""):
    """The numbers of the messages that are kept, as (number, age, late)."""
    topic = LATE_PREFIX + b"token\0" + filter_
    program.heard.subscribe(topic)
    found = []
    while len(frames := await program.take()) > 1:
        if frames[0] == topic:
            told = program.read(frames[1:3])
            found.append((told["n"], told.get("age"), told["late"]))
    assert frames == [topic]
    program.heard.unsubscribe(topic)
    return found


async def test_what_is_kept_comes_to_those_who_ask_later(beside):
    program = beside.program()
    for number in range(1, 5):
        beside.bus.publish(from_air(number), None, 77, retain=Retain(3, inf))
    beside.bus.publish(from_air(5, topic=ODOM, called="odom"), None, 77)
    beside.bus.publish(from_air(6, src=3), None, 77, retain=KEPT)
    beside.bus.publish(from_air(7, src=4), 5.0, 77, retain=Retain(8, 4.0))
    assert await late(program) == [(n, None, True) for n in (2, 3, 4, 6)], "one is too old"
    assert [n for n, *_ in await late(program, b"/rx_robot_3/map\0")] == [6]
    beside.bus.forget_topics([(2, MAP)])
    assert [n for n, *_ in await late(program)] == [6]
    beside.bus.publish_stop(3, from_air().topic, CDR)
    assert await late(program) == []


async def test_a_topic_that_is_no_longer_latched_keeps_nothing(beside):
    program = beside.program()
    beside.bus.publish(from_air(1), None, 77, retain=KEPT)
    beside.bus.publish(from_air(2, topic=ODOM, called="odom"), None, 77, retain=KEPT)
    beside.bus.announce({MAP: TopicPolicy(durability="transient_local")})
    assert [n for n, *_ in await late(program)] == [1]


async def test_a_changed_name_is_used_from_the_next_message_on(beside):
    program = beside.program()
    await program.subscribe(b"/rx_robot_2/")
    beside.bus.publish(from_air(1, topic=200, called="arm"), None, 77)
    beside.bus.forget_topics([(2, 200)])
    beside.bus.publish(from_air(1, topic=200, called="leg"), None, 77)
    assert [each[0] for each in await program.all()] == [b"/rx_robot_2/arm\0", b"/rx_robot_2/leg\0"]


async def test_a_silent_topics_stop_message_is_told_apart(beside):
    program = beside.program()
    await program.subscribe(b"/rx_robot_2/")
    beside.bus.publish_stop(2, from_air().topic, b"\0\1\0\0stop")
    ((_, header, payload),) = await program.all()
    told = program.read([b"", header])
    assert (told["s"], told["n"], told["stop"], payload) == (2, 0, True, b"\0\1\0\0stop")
    assert "v" not in told


async def test_taps_are_on_for_as_long_as_somebody_watches(beside):
    program = beside.program()
    assert not beside.bus.is_tapped
    assert not beside.bus.is_air_watched
    await program.subscribe(PDU_TAP, AIR_TAP)
    assert beside.bus.is_tapped
    assert beside.bus.is_air_watched
    assert not beside.bus.filters
    beside.bus.tap("rx", b"pdu")
    beside.bus.tell_air({"bad": 1})
    pdu, air = await program.all()
    assert (pdu[0], program.read(pdu)["dir"], pdu[2]) == (PDU_TAP, "rx", b"pdu")
    assert (air[0], program.read(air)) == (AIR_TAP, {"bad": 1})
    await program.unsubscribe(PDU_TAP)
    assert (beside.bus.is_tapped, beside.bus.is_air_watched) == (False, True)
    await program.unsubscribe(AIR_TAP)
    assert not beside.bus.is_air_watched


async def test_copies_of_what_producers_send_come_whatever_becomes_of_it(beside):
    program, watcher, odom = (beside.program() for _ in range(3))
    await program.send("/robot_1/odom", CDR)
    await watcher.subscribe(SENT_TAP)
    await odom.subscribe(SENT_TAP + b"/robot_1/odom\0")
    await program.send("/robot_1/nothing", CDR)
    await program.send("/robot_1/odom", CDR)
    await program.send_frames(b"/robot_1/odom\0", EMPTY)
    copies = [[SENT_TAP + name, EMPTY, CDR] for name in (b"/robot_1/nothing\0", b"/robot_1/odom\0")]
    assert await watcher.all() == copies
    assert await odom.all() == copies[1:]
    await watcher.unsubscribe(SENT_TAP)
    await program.send("/robot_1/nothing", CDR)
    await program.send("/robot_1/odom", CDR)
    assert await watcher.all() == []
    assert await odom.all() == copies[1:]


async def test_what_has_arrived_is_taken_before_producers_are_closed(beside):
    program = beside.program()
    await program.subscribe()
    for _ in range(300):
        await program.out.send_multipart([b"/robot_1/odom\0", EMPTY, CDR])
    await beside.bus.stop_ingress()
    assert len(beside.ingress.taken) == 300


async def test_after_its_end_its_descriptors_are_free_for_others(tmp_path):
    loop = asyncio.get_running_loop()
    Beside(tmp_path).close()
    pipes = [os.pipe() for _ in range(20)]
    for read, write in pipes:
        loop.add_reader(read, lambda: None)
        loop.remove_reader(read)
        os.close(read)
        os.close(write)


async def test_nobody_comes_while_it_does_not_listen(beside):
    beside.bus.listen(is_on=False)
    stranger = beside.program()
    await stranger.out.send_multipart([b"/robot_1/imu\0", EMPTY, CDR])
    await asyncio.sleep(0.05)
    assert beside.ingress.taken == []
    beside.bus.listen(is_on=True)
    await stranger.until_taken()
    assert [each[0] for each in beside.ingress.taken] == [IMU]
