"""Samples over ZeroMQ: what other programs may send, and peers that come and go."""

import itertools
import struct

import numpy as np
import pytest
import zmq

from backends import BackendError, TxBurst, TxOutcome, ZmqParams, ZmqRadio
from tests.backends.echo import Echo
from tests.backends.radios import BLOCK_S, RATE, TUNING, N, hand_over, heard, noise, opened, take

QUIET = 0.25


def zmq_radio(send, receive, **more):
    """A radio at these endpoints."""
    return ZmqRadio(ZmqParams(send=send, receive=receive, **more), BLOCK_S)


class Peer:
    """A program that pushes given data, and reads nothing."""

    def __init__(self, folder):
        self._context = zmq.Context()
        self._out = self._context.socket(zmq.PUSH)
        self._out.setsockopt(zmq.LINGER, 0)
        self.send, self.receive = f"ipc://{folder}/to", f"ipc://{folder}/from"
        self._out.bind(self.receive)

    def push(self, *parts):
        """Push a message."""
        self._out.send_multipart(parts)

    def radio(self, form="cf32_le", paced=False):
        """A radio connected to this peer."""
        return zmq_radio(self.send, self.receive, format=form, paced=paced)

    def close(self):
        """Close the peer."""
        self._context.destroy(linger=0)


@pytest.fixture
def peer(tmp_path):
    made = Peer(tmp_path)
    yield made
    made.close()


async def test_messages_of_any_size_are_one_stream(peer):
    played = noise(10 * N)
    async with opened(peer.radio()) as radio:
        cuts = [0, 1, 5, 700, 701, 1500, 10 * N]
        for begin, end in itertools.pairwise(cuts):
            # gr-zeromq's key, if there is one, precedes the samples.
            peer.push(*([b"key"] * (begin % 2)), played[begin:end].tobytes())
        taken = await take(radio.blocks(), 10 * N)
    assert np.array_equal(heard(taken), played)


async def test_sixteen_bits_are_scaled(peer):
    sent = np.array([[16384, -32768]] * N, np.int16)
    async with opened(peer.radio("ci16_le")) as radio:
        peer.push(sent.tobytes())
        (block,) = await take(radio.blocks(), N)
    assert np.allclose(block.samples, 0.5 - 1j)


@pytest.mark.parametrize(
    ("message", "told"),
    [
        (bytes(12), "not whole cf32_le samples"),
        (np.full(2 * N, 30000, np.int16).tobytes() + struct.pack("<f", 1e9) * 2, "beyond"),
        (np.full(N, np.nan, np.complex64).tobytes(), "not numbers"),
    ],
)
async def test_another_item_type_is_a_gap_that_is_told(peer, message, told):
    async with opened(peer.radio()) as radio:
        peer.push(message)
        peer.push(noise(N).tobytes())
        blocks = radio.blocks()
        gap, *_ = await take(blocks, 1)
        assert gap.samples is None
        assert told in gap.gap_reason
        assert told in radio.detail
        assert radio.counters["bad_messages"] == 1
        after = await take(blocks, gap.n + N)
    assert np.array_equal(heard(after), noise(N))


async def test_without_a_peer_time_goes_on_and_bursts_do_not_leave_twice(peer, tmp_path):
    async with opened(peer.radio(paced=True)) as radio:
        blocks = radio.blocks()
        sends = await hand_over(radio, [TxBurst(round(0.1 * RATE), noise(N))])
        taken = await take(blocks, round(2 * QUIET * RATE))
        assert all(block.samples is None for block in taken)
        assert "no samples from the peer" in radio.detail
        assert radio.counters["outages"] == 1
        assert sends[0].done()
        peer.push(noise(3 * N).tobytes())
        await take(blocks, taken[-1].index + taken[-1].n + 3 * N)
        assert "no samples" not in radio.detail


async def test_srsrans_requests_are_answered_too(tmp_path):
    """A request is one byte instead of a count."""
    echo = Echo(tmp_path, "req", word=b"\xff")
    radio = zmq_radio(echo.send, echo.receive, pattern="req", paced=False)
    try:
        async with opened(radio):
            burst = TxBurst(5000, noise(300))
            sends = await hand_over(radio, [burst])
            taken = await take(radio.blocks(), 6000)
            assert (await sends[0]).outcome is TxOutcome.SENT
    finally:
        echo.end()
    assert np.array_equal(heard(taken)[5000:5300], burst.samples)


async def test_an_endpoint_that_cannot_be_had_names_its_key(tmp_path):
    for send, receive, key in (
        ("tcp://nowhere:x", "tcp://127.0.0.1:9", "zmq.send"),
        (f"ipc://{tmp_path}/a", "nonsense", "zmq.receive"),
    ):
        radio = zmq_radio(send, receive)
        with pytest.raises(BackendError, match=key):
            await radio.open(TUNING)
        await radio.close()


async def test_what_came_before_a_gap_is_told_before_it(peer):
    async with opened(peer.radio()) as radio:
        peer.push(noise(N // 2).tobytes())
        peer.push(bytes(12))
        before, gap = await take(radio.blocks(), N // 2 + 1)
    assert np.array_equal(before.samples, noise(N // 2))
    assert (gap.index, gap.samples) == (N // 2, None)
