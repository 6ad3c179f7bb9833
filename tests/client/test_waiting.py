"""How long a program waits, and what it learns when its daemon has been replaced meanwhile."""

import asyncio
import threading
import time

import pytest
import zmq

from sdrlinkd.client import (
    AsyncPublisher,
    AsyncSubscriber,
    NoDaemonError,
    Publisher,
    Subscriber,
    pack_map,
)
from sdrlinkd.client.testing import Deadline, milliseconds

CDR = b"\0\1\0\0abcd"
HEADER = b"\x01" + pack_map({"s": 1, "n": 1})


@pytest.mark.parametrize(
    ("seconds", "ms"), [(None, None), (float("inf"), None), (-1.0, 0), (0.0, 0), (0.0001, 1)]
)
def test_seconds_for_zeromq(seconds, ms):
    assert milliseconds(seconds) == ms


def test_a_deadline_passes_once():
    assert Deadline(None).left_ms is None
    assert Deadline(float("inf")).left_or_none is None
    assert Deadline(-5.0).left_s == 0.0
    assert 0 < Deadline(5.0).left_s <= 5.0


def test_send_waits_no_longer_than_it_is_told(tmp_path):
    """The limit holds for all waits together."""
    context = zmq.Context()
    with context.socket(zmq.XPUB) as out_socket, context.socket(zmq.PULL) as in_socket:
        out_socket.bind(f"ipc://{tmp_path}/out.sock")
        in_socket.bind(f"ipc://{tmp_path}/in.sock")
        # A listener that never answers.
        with Publisher(tmp_path, timeout_s=0.5) as out:
            began = time.monotonic()
            with pytest.raises(NoDaemonError):
                out.send("/robot_1/odom", CDR, receipt=True)
            assert time.monotonic() - began < 5.0
    context.term()


async def test_who_has_the_answer_goes_on_whoever_listens(start_daemon):
    """Several tasks wait for receipts that never come, one for an answer that does."""
    daemon = start_daemon('backend = "ether"\n[ether]\ndir = "nobody"\n')
    async with AsyncPublisher(daemon.directory) as out:
        await out.send("/robot_1/odom", CDR, receipt=True)
        waiting = [asyncio.ensure_future(out.receipt(30)) for _ in range(3)]
        await asyncio.sleep(0)
        async with asyncio.timeout(20):
            for _ in range(20):
                await out.wait_for_daemon()
        for each in waiting:
            each.cancel()
        await asyncio.gather(*waiting, return_exceptions=True)


@pytest.fixture
def full_stream(tmp_path):
    """A daemon whose first answer is lost among messages; yields the topics it was queried for."""
    asked, is_over = [], threading.Event()

    def serve(out):
        while not is_over.is_set():
            if not out.poll(20):
                continue
            said = out.recv()
            if said[:1] == b"\1" and said[1:].startswith(b"\0ack\0"):
                asked.append(said[1:])
                if len(asked) > 1:
                    out.send_multipart([b"/rx_robot_1/odom\0", HEADER, CDR])
                    out.send_multipart([said[1:], b""])

    with zmq.Context() as context, context.socket(zmq.XPUB) as out:
        out.bind(f"ipc://{tmp_path}/out.sock")
        thread = threading.Thread(target=serve, args=(out,))
        thread.start()
        yield asked
        is_over.set()
        thread.join()


def test_a_subscriber_asks_again_where_its_answer_was_dropped(full_stream, tmp_path):
    with Subscriber("/rx_robot_1/*", runtime_dir=tmp_path, timeout_s=20):
        assert len(set(full_stream)) == len(full_stream) >= 2


async def test_so_it_does_in_asyncio(full_stream, tmp_path):
    async with AsyncSubscriber("/rx_robot_1/*", runtime_dir=tmp_path, timeout_s=20):
        assert len(set(full_stream)) == len(full_stream) >= 2


@pytest.mark.parametrize(
    "header",
    [
        b"\x01\x81\xa1a" + b"\x91" * 100_000,
        b'{"a":' + b"[" * 100_000,
        b"\x01\x81\xa1q\xdb\x00\x10\x00\x00" + b"\x1b" * (1 << 20),
        b"\x01\x81\xa1q\xd9\xe0" + b"\x1b[2J" * 56,
    ],
    ids=["nested", "nested JSON", "long", "escapes"],
)
def test_a_hostile_header_is_counted_and_shown_as_a_screen_can_bear_it(start_daemon, header):
    daemon = start_daemon()
    with zmq.Context() as context, context.socket(zmq.PUSH) as push:
        push.connect(f"ipc://{daemon.directory}/in.sock")
        push.send_multipart([b"/robot_1/odom\0", header, CDR])
        with Subscriber("/rx_robot_1/*", runtime_dir=daemon.directory) as heard:
            push.send_multipart([b"/robot_1/odom\0", b"{}", CDR])
            assert heard.receive(20).payload == CDR
    snapshot = daemon.snapshot()
    assert snapshot.link.tx.dropped == {"tx_bad_envelope": 1}
    said = snapshot.bus.bad_envelope_last
    assert 0 < len(said) <= 240
    assert said.isprintable()
    with daemon.control() as control:
        assert control.ask("check")["problems"] == []
