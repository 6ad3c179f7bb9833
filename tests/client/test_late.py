"""Subscribers that come late get what the daemon has kept, before anything newer, and once."""

import time

import pytest
import zmq
from hypothesis import given
from hypothesis import strategies as st

from sdrlinkd.client import (
    OUT_SOCKET,
    AsyncPublisher,
    AsyncSubscriber,
    NoDaemonError,
    Publisher,
    Subscriber,
    endpoint,
    pack_map,
)
from sdrlinkd.client.testing import Arrivals
from tests.waiting import wait_for

CDR = b"\0\1\0\0"
LATCHED = '[topic.map]\ndurability = "transient_local"\ndepth = 2\n'
MAP = "/robot_1/map"
HEARD = "/rx_robot_1/map"


def published(daemon, n):
    """Publish `n` maps one by one, each once the last one has come back through the air."""
    before = daemon.snapshot().bus.published
    with Publisher(daemon.directory) as out:
        for number in range(before + 1, before + n + 1):
            out.send(MAP, CDR + bytes([number]))
            wait_for(lambda number=number: daemon.snapshot().bus.published == number)


def received(subscriber, n):
    return [(each.payload[4], each.is_late) for each in (subscriber.receive(20) for _ in range(n))]


def test_a_late_subscriber_gets_the_kept_messages_and_then_the_new_ones(start_daemon):
    daemon = start_daemon(LATCHED)
    published(daemon, 20)
    with Subscriber(HEARD, runtime_dir=daemon.directory) as heard:
        published(daemon, 1)
        # With the registry, a topic's producers are not told apart: 8 times `depth` are kept.
        assert received(heard, 17) == [*((number, True) for number in range(5, 21)), (21, False)]
        with Subscriber("/rx_robot_1/*", runtime_dir=daemon.directory) as later:
            assert received(later, 16) == [(number, True) for number in range(6, 22)]
        published(daemon, 1)
        assert received(heard, 1) == [(22, False)], "what the later one was owed is no news here"


def test_a_kept_message_has_the_name_that_it_had_at_first(start_daemon):
    daemon = start_daemon(LATCHED)
    with Subscriber(HEARD, runtime_dir=daemon.directory) as early:
        published(daemon, 2)
        at_first = [early.receive(20).name for _ in range(2)]
    with Subscriber(HEARD, runtime_dir=daemon.directory) as late:
        kept = [late.receive(20).name for _ in range(2)]
    assert kept == at_first
    assert not kept[0].matches(kept[1])


def test_its_age_is_that_of_its_handover(start_daemon):
    daemon = start_daemon(LATCHED)
    with Subscriber(HEARD, runtime_dir=daemon.directory) as heard:
        published(daemon, 1)
        first = heard.receive(20)
    time.sleep(0.3)
    with Subscriber(HEARD, runtime_dir=daemon.directory) as heard:
        late = heard.receive(20)
    assert (late.number, late.received_ns) == (first.number, first.received_ns)
    assert late.age_us >= first.age_us + 300_000


async def test_so_it_is_in_asyncio(start_daemon):
    daemon = start_daemon(LATCHED)
    published(daemon, 1)
    async with AsyncSubscriber(HEARD, runtime_dir=daemon.directory) as heard:
        async with AsyncPublisher(daemon.directory) as out:
            await out.send(MAP, CDR + b"\2")
        both = [await heard.receive(), await heard.receive()]
        assert [(each.payload[4], each.is_late) for each in both] == [(1, True), (2, False)]


def test_a_plain_socket_gets_them_on_request(start_daemon):
    """Any language: the bus document, section 3.3."""
    daemon = start_daemon(LATCHED)
    published(daemon, 1)
    context = zmq.Context()
    with context.socket(zmq.SUB) as plain:
        request = b"\0late\0me\0" + HEARD.encode() + b"\0"
        plain.subscribe(request)
        plain.connect(endpoint(daemon.directory, OUT_SOCKET))
        assert plain.poll(20_000)
        asked, topic, header, payload = plain.recv_multipart()
        assert plain.poll(20_000)
        assert plain.recv_multipart() == [request]
    context.term()
    assert (asked, topic, payload) == (request, HEARD.encode() + b"\0", CDR + b"\1")
    assert b"late" in header


def test_more_than_a_consumers_queue_holds_all_come(start_daemon):
    daemon = start_daemon(LATCHED.replace("depth = 2", "depth = 60"))
    published(daemon, 240)
    with Subscriber(HEARD, runtime_dir=daemon.directory, depth=10) as slow:
        time.sleep(0.2)
        with Subscriber(HEARD, runtime_dir=daemon.directory) as heard:
            assert received(heard, 240) == [(number, True) for number in range(1, 241)]
        assert received(slow, 240) == [(number, True) for number in range(1, 241)]


def test_what_is_volatile_is_not_kept(start_daemon):
    daemon = start_daemon(LATCHED)
    published(daemon, 3)
    with daemon.control() as control:
        control.ask("set", {"topic": "map", "durability": "volatile"})
    with Subscriber(HEARD, runtime_dir=daemon.directory) as heard:
        published(daemon, 1)
        assert received(heard, 1) == [(4, False)]


def test_keys_of_producers_are_checked(start_daemon):
    daemon = start_daemon(LATCHED)
    with Publisher(daemon.directory, checked=False) as out:
        out.send(MAP, CDR, key="é" * 16)
    with Publisher(daemon.directory) as out, pytest.raises(Exception, match="up to 32 bytes"):
        out.send(MAP, CDR, key="é" * 17)
    assert daemon.snapshot().link.tx.dropped == {}


def test_without_waiting_the_answer_is_false_and_the_publisher_comes_back(
    start_daemon, stop, spawn_again, tmp_path
):
    with Publisher(tmp_path) as nobody:
        assert nobody.send(MAP, CDR, wait=False) is False
    daemon = start_daemon()
    with Publisher(daemon.directory) as out:
        out.wait_for_daemon(20)
        assert out.send(MAP, CDR, wait=False) is True
        assert isinstance(out.send(MAP, CDR, wait=False, receipt=True), str)
        stop(daemon)
        begun = time.monotonic()
        assert out.send(MAP, CDR, wait=False) is False
        assert time.monotonic() - begun < 4, "and not the publisher's 5 s"
        wait_for(spawn_again(daemon).is_up)
        wait_for(lambda: out.send(MAP, CDR, wait=False))


async def test_so_it_does_in_asyncio(start_daemon, tmp_path):
    async with AsyncPublisher(tmp_path) as nobody:
        assert await nobody.send(MAP, CDR, wait=False) is False
        with pytest.raises(NoDaemonError):
            await nobody.send(MAP, CDR, timeout_s=0)
    daemon = start_daemon()
    async with AsyncPublisher(daemon.directory) as out:
        await out.wait_for_daemon(20)
        assert await out.send(MAP, CDR, wait=False) is True


def frames(number, late, arrivals):
    fields = {"s": 1, "n": number, "tr": 1000 + number // 2, "ty": "t", "late": late}
    message = [b"/rx\0", b"\x01" + pack_map(fields), CDR]
    return [arrivals.requests[0], *message] if late else message


@given(
    st.lists(st.integers(1, 8), max_size=12),
    st.lists(st.integers(1, 8), max_size=12),
)
def test_any_order_of_the_first_messages_and_repeats_after_them(before, after):
    """Kept and new messages may come in any order until the answer; kept ones again after it."""
    arrivals = Arrivals([b"/rx\0"])
    for number in before:
        arrivals.hold(frames(number, number < 5, arrivals))
    assert not arrivals.has_kept
    arrivals.hold(arrivals.requests)
    assert arrivals.has_kept
    arrivals.begin()
    got = []
    while (message := arrivals.next()) is not None:
        got.append(message.number)
    assert got == sorted(set(before))
    newest = max(got, default=0)
    for number in after:
        message = arrivals.admit(frames(number, True, arrivals))
        # Messages with the numbers 2 and 3 came in one burst, as did 4 and 5 and so on.
        is_new = number > newest or number // 2 > newest // 2
        assert (message is not None) == is_new
        newest = number if is_new else newest


def test_a_topic_is_subscribed_to_later_and_its_kept_messages_come_first(start_daemon):
    daemon = start_daemon(LATCHED)
    published(daemon, 3)
    with Subscriber("/rx_robot_1/odom", runtime_dir=daemon.directory) as heard:
        heard.subscribe(HEARD)
        assert received(heard, 3) == [(1, True), (2, True), (3, True)]
        published(daemon, 1)
        assert received(heard, 1) == [(4, False)]
        heard.subscribe("/rx_robot_1/*")
        published(daemon, 1)
        assert received(heard, 1) == [(5, False)], "the others came before"
        heard.unsubscribe("/rx_robot_1/*")
        heard.subscribe("/rx_robot_1/*")
        assert received(heard, 5) == [(number, True) for number in range(1, 6)], "asked for again"
