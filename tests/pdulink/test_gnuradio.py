"""PDUs to and from flowgraphs: what peers may send, and endpoints that are not available."""

import asyncio
import binascii
import struct

import pytest
import zmq
from hypothesis import given
from hypothesis import strategies as st

from sdrlinkd.errors import UserError
from sdrlinkd.pdulink import from_gnu_radio, to_gnu_radio
from sdrlinkd.pdulink.testing import TcpTransport, UdpTransport, ZmqTransport, pmt

SIZE = 64


def whole(number):
    """A PDU with a valid CRC."""
    body = struct.pack(">I", number) + bytes(SIZE - 6)
    return body + binascii.crc_hqx(body, 0).to_bytes(2, "big")


def test_metadata_are_the_papers():
    pdu = bytes([0x40, 7, 255, 9, 0x11]) + bytes(SIZE - 5)
    sent = pmt.loads(to_gnu_radio(pdu))
    assert sent.cdr == pdu
    assert list(sent.car) == ["src_id", "dst_id", "seq", "t_src_wall"]
    assert (sent.car["src_id"], sent.car["dst_id"], sent.car["seq"]) == (7, 255, 9)
    assert sent.car["t_src_wall"] > 1.7e9
    assert from_gnu_radio(to_gnu_radio(pdu)) == pdu
    assert from_gnu_radio(pmt.dumps(pdu)) == pdu, "without metadata, too"


@given(st.binary(max_size=100))
def test_what_is_no_pdu_is_refused(data):
    for message in (data, pmt.dumps(pmt.Pair(None, "text")), pmt.dumps(b"abc")):
        try:
            assert isinstance(from_gnu_radio(message), bytes)
        except ValueError:
            continue


async def test_bad_messages_are_counted_and_the_next_one_works(tmp_path):
    got = asyncio.Queue()
    transport = ZmqTransport(f"ipc://{tmp_path}/out", f"ipc://{tmp_path}/in", publishes=False)
    context = zmq.Context()
    peer = context.socket(zmq.PUSH)
    peer.bind(f"ipc://{tmp_path}/in")
    await transport.open(got.put_nowait)
    assert not transport.is_ready()
    for message in (b"", b"\xff", pmt.dumps(5), to_gnu_radio(whole(1))):
        peer.send(message)
    async with asyncio.timeout(20):
        assert await got.get() == whole(1)
    assert transport.counters["bad_messages"] == 3
    transport.close()
    transport.close()
    context.destroy(linger=0)


async def test_nothing_is_published_before_anybody_has_subscribed(tmp_path):
    transport = ZmqTransport(f"ipc://{tmp_path}/out", f"ipc://{tmp_path}/in", publishes=True)
    await transport.open(print)
    context = zmq.Context()
    assert not transport.is_ready()
    for _ in range(2):
        flowgraph = context.socket(zmq.SUB)
        flowgraph.setsockopt(zmq.SUBSCRIBE, b"")
        flowgraph.connect(f"ipc://{tmp_path}/out")
        await until(transport.is_ready)
        assert transport.send(whole(1))
        assert flowgraph.poll(20_000)
        assert from_gnu_radio(flowgraph.recv()) == whole(1)
        flowgraph.close()
        await until(lambda: not transport.is_ready())
    transport.close()
    context.destroy(linger=0)


async def until(condition):
    """Poll until the condition holds: ZeroMQ reports peers only on request."""
    async with asyncio.timeout(20):
        while not condition():  # noqa: ASYNC110
            await asyncio.sleep(0.005)


@pytest.mark.parametrize("cut", [1, 7, 63, 64, 65, 1000])
async def test_a_stream_of_octets_is_cut_where_pdus_are_whole(cut):
    """From any start, in any pieces."""
    got = asyncio.Queue()
    sent = [whole(number) for number in range(5)]
    stream = sent[0][9:] + b"".join(sent[1:])

    async def serve(_, writer):
        for at in range(0, len(stream), cut):
            writer.write(stream[at : at + cut])
            await writer.drain()
        writer.close()

    server = await asyncio.start_server(serve, "127.0.0.1", 0)
    port = server.sockets[0].getsockname()[1]
    transport = TcpTransport(f"127.0.0.1:{port}", SIZE)
    await transport.open(got.put_nowait)
    async with asyncio.timeout(20):
        assert [await got.get() for _ in sent[1:]] == sent[1:]
    assert transport.counters["bad_octets"] == SIZE - 9
    transport.close()
    server.close()
    await server.wait_closed()


async def test_datagrams_are_pdus_and_answers_come_back():
    got = asyncio.Queue()

    class Mirror(asyncio.DatagramProtocol):
        def connection_made(self, transport):
            self.transport = transport

        def datagram_received(self, data, addr):
            self.transport.sendto(data, addr)

    loop = asyncio.get_running_loop()
    mirror, _ = await loop.create_datagram_endpoint(Mirror, local_addr=("127.0.0.1", 0))
    port = mirror.get_extra_info("sockname")[1]
    transport = UdpTransport(f"127.0.0.1:{port}", "")
    await transport.open(got.put_nowait)
    assert transport.is_ready()
    assert transport.send(whole(3))
    async with asyncio.timeout(20):
        assert await got.get() == whole(3)
    transport.close()
    mirror.close()


async def test_endpoints_that_cannot_be_had_name_their_key(tmp_path):
    for address in ("nohost", "host:", "host:99999", ":5"):
        with pytest.raises(UserError, match=r"gnuradio\.send"):
            UdpTransport(address, "")
    for send, receive, key in (
        ("tcp://nowhere:x", f"ipc://{tmp_path}/in", "gnuradio.send"),
        (f"ipc://{tmp_path}/out", "nonsense", "gnuradio.receive"),
    ):
        with pytest.raises(UserError, match=key):
            await ZmqTransport(send, receive, publishes=True).open(print)
