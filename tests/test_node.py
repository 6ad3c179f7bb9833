"""A node between link and bus: what a PDU brings reaches the bus in order."""

import asyncio
from functools import partial
from random import Random
from types import SimpleNamespace

import pytest
import zmq

from sdrlinkd.adapters import MessageTypes
from sdrlinkd.bus import Bus, RuntimeDirectory
from sdrlinkd.client import OUT_SOCKET, endpoint
from sdrlinkd.client.testing import decode_in, new_late_topic
from sdrlinkd.config import Config, make_setup
from sdrlinkd.link import AccessParams, Link, PduLinkTraits, RateParams
from sdrlinkd.node import Node
from sdrlinkd.pdulink import Heard
from sdrlinkd.wire import Beacon, Description, Entry, Pdu, build, build_records, pieces

CDR = b"\0\1\0\0"


@pytest.fixture
async def node(tmp_path):
    """A node of robot 2 without a registry, with a real bus and no PDU link of its own."""
    setup = make_setup(Config(namespace="robot_2"), tmp_path)
    config = setup.config
    link = Link(
        config.link, config.queue, config.reassembly, setup.registry, 2, Random(1), has_numbers=True
    )
    link.attach(PduLinkTraits(), AccessParams(), RateParams())
    context, directory = zmq.Context(), RuntimeDirectory(tmp_path)
    opening = SimpleNamespace(pdu_link=SimpleNamespace(now=lambda: 0.0))
    open_bus = partial(Bus, context, directory, setup)
    node = Node(setup, link, opening, open_bus, {}, MessageTypes(setup))
    node.directory = directory.path
    yield node
    node.bus.close()
    directory.close()
    context.destroy(linger=0)


def pdu(seq, boot, *declared, messages):
    """A PDU of robot 1 with a beacon, with what it declares, and with one message of a number."""
    told = [
        piece
        for number, name in declared
        for piece in pieces(number, Description(name, f"p/msg/{name.title()}", depth=1), 250)
    ]
    entries = [Entry(15, 0, 0, 1, build_records([Beacon(boot, seq), *told]))]
    entries += [Entry(14, 7, 0, 1, bytes([number]) + CDR + text) for number, text in messages]
    return build(Pdu(0, False, 1, 255, seq, 1, entries), 1024)


async def test_a_number_with_another_meaning_in_the_same_pdu_as_its_message(node):
    """The message has its new name at once, and later consumers get it and nothing older."""
    loop = asyncio.get_running_loop()
    context = zmq.Context()
    with context.socket(zmq.SUB) as heard, context.socket(zmq.SUB) as late:
        heard.subscribe(b"/rx_robot_1/")
        heard.connect(endpoint(node.directory, OUT_SOCKET))
        async with asyncio.timeout(20):
            await node.bus.has_consumer.wait()
        node.heard([Heard(pdu(1, 1, (20, "map"), messages=[(20, b"old")]), 0.0, None, 0.0)])
        for seq, boot, name in ((2, 1, "scan"), (3, 2, "plan")):
            data = pdu(seq, boot, (20, name), messages=[(20, name.encode())])
            node.heard([Heard(data, 0.0, None, 0.0)])
        got = [decode_in(await loop.run_in_executor(None, heard.recv_multipart)) for _ in range(3)]
        assert [(m.topic, m.type, m.payload[4:]) for m in got] == [
            ("/rx_robot_1/map", "p/msg/Map", b"old"),
            ("/rx_robot_1/scan", "p/msg/Scan", b"scan"),
            ("/rx_robot_1/plan", "p/msg/Plan", b"plan"),
        ]
        request = new_late_topic(b"/")
        late.subscribe(request)
        late.connect(endpoint(node.directory, OUT_SOCKET))
        answer = await loop.run_in_executor(None, late.recv_multipart)
        assert decode_in(answer[1:]).payload == CDR + b"plan"
        assert await loop.run_in_executor(None, late.recv_multipart) == [request]
    context.term()
    assert node.audit() == []
