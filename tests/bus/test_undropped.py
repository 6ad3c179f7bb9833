"""Answers wait for a subscriber with a full queue, and for no other subscriber."""

import asyncio
import time
from types import SimpleNamespace

import pytest
import zmq

from sdrlinkd.bus.testing import CONSTANTS, Undropped

ROOM = 4
"""Number of messages that fit for a subscriber here, in both ends of the pipe together."""


@pytest.fixture
def sockets():
    """(XPUB, a SUB for `slow`, a SUB for `quick`)."""
    context = zmq.Context()
    out = context.socket(zmq.XPUB)
    out.sndhwm = ROOM // 2
    out.bind("inproc://out")
    subs = []
    for topic in (b"slow", b"quick"):
        sub = context.socket(zmq.SUB)
        sub.rcvhwm = ROOM // 2
        sub.subscribe(topic)
        sub.connect("inproc://out")
        assert out.recv() == b"\x01" + topic
        subs.append(sub)
    yield out, *subs
    context.destroy(linger=0)


def heard(sub):
    got = []
    while sub.poll(0):
        got.append(int(sub.recv_multipart()[1]))
    return got


def numbered(topic, numbers):
    return [[topic, b"%d" % number] for number in numbers]


async def until(condition):
    async with asyncio.timeout(30):
        while not condition():  # noqa: ASYNC110 (a timer of the loop is what is tested)
            await asyncio.sleep(0.001)


async def test_who_has_no_room_waits_and_nobody_else(sockets, monkeypatch):
    monkeypatch.setattr(*CONSTANTS["stuck_s"], 1000.0)
    out, slow, quick = sockets
    certain = Undropped(asyncio.get_running_loop(), out, lambda: None)
    for frames in numbered(b"slow", range(20)):
        certain.send(b"slow", frames)
    for frames in numbered(b"quick", range(ROOM)):
        certain.send(b"quick", frames)
    assert heard(quick) == list(range(ROOM))
    got = []

    def read():
        got.extend(heard(slow))
        return len(got) == 20

    await until(read)
    assert got == list(range(20))
    out.get(zmq.EVENTS)  # takes note of the room there is again
    certain.send(b"slow", [b"slow", b"20"])
    assert heard(slow) == [20]
    certain.close(1.0)


async def test_who_does_not_read_at_all_is_given_up_until_it_does(sockets, monkeypatch):
    monkeypatch.setattr(*CONSTANTS["stuck_s"], 0.0)
    out, slow, _ = sockets
    used = []
    certain = Undropped(asyncio.get_running_loop(), out, lambda: used.append(True))
    for frames in numbered(b"slow", range(20)):
        certain.send(b"slow", frames)
    await until(lambda: len(used) > 20)  # it has tried again
    certain.send(b"slow", [b"slow", b"20"])
    assert heard(slow) == list(range(ROOM))
    out.get(zmq.EVENTS)
    certain.send(b"slow", [b"slow", b"21"])
    assert heard(slow) == [21]
    # It is waited for again.
    monkeypatch.setattr(*CONSTANTS["stuck_s"], 1000.0)
    out.get(zmq.EVENTS)
    for frames in numbered(b"slow", range(20)):
        certain.send(b"slow", frames)
    got = []

    def read():
        got.extend(heard(slow))
        return len(got) == 20

    await until(read)
    assert got == list(range(20))
    certain.close(1.0)


def test_who_reads_slowly_is_not_given_up(sockets, monkeypatch):
    """Only one who reads nothing at all for that long is."""
    out, slow, _ = sockets
    now, calls, used = [100.0], [], []
    stuck_s = getattr(*CONSTANTS["stuck_s"])
    monkeypatch.setattr(time, "monotonic", lambda: now[0])

    def call_later(_delay_s, call):
        calls.append(call)
        return SimpleNamespace(cancel=lambda: None)

    loop = SimpleNamespace(call_later=call_later)
    certain = Undropped(loop, out, lambda: used.append(now[0]))
    for frames in numbered(b"slow", range(40)):
        certain.send(b"slow", frames)
    got = heard(slow)
    while len(got) < 40 and calls:
        now[0] += stuck_s
        out.get(zmq.EVENTS)  # takes note of the room there is again
        calls.pop()()
        got += heard(slow)
        assert used[-1] == now[0], "who reads the socket is told of each use"
    assert got == list(range(40))


async def test_at_the_end_there_is_a_little_time(sockets, monkeypatch):
    out, slow, _ = sockets
    certain = Undropped(asyncio.get_running_loop(), out, lambda: None)
    for frames in numbered(b"slow", range(20)):
        certain.send(b"slow", frames)
    got = []
    monkeypatch.setattr(time, "sleep", lambda _: got.extend(heard(slow)))
    certain.close(30.0)
    got += heard(slow)
    assert got == list(range(20))
