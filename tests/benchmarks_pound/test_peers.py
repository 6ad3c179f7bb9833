"""The peers of the Pound benchmark: their framing, the control loop, and short runs."""

import contextlib
import os
import re
import subprocess
import sys
import time
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.signal import cont2discrete

from benchmarks.environments import ROOT
from benchmarks.flows import Flow, Trace, figures
from benchmarks.peers.pound import PEERS, namespaces, unavailable
from benchmarks.peers.pound.control import local_loop, plant
from benchmarks.peers.pound.job import Job, Loop, Topic
from benchmarks.peers.pound.runs import recovery, run_peer
from benchmarks.peers.pound.sockets import Sockets
from benchmarks.peers.pound.wire import (
    HEAD,
    NIMBRO_DATAGRAM,
    UDPROS_DATAGRAM,
    NimbroJoin,
    NimbroTcpJoin,
    PoundJoin,
    TcpRosJoin,
    UdpRosJoin,
    cut_nimbro,
    cut_nimbro_tcp,
    cut_pound,
    cut_tcpros,
    cut_udpros,
)
from tests.benchmarks_pound.machine import in_namespaces

messages = st.integers(8, 20_000).map(lambda size: bytes(i % 251 for i in range(size)))


def joined(join, pieces):
    return [message for piece in pieces for message in join.feed(piece)]


@given(st.lists(messages, max_size=3), st.integers(1, 3000))
def test_tcp_streams_come_back_in_any_pieces(sent, size):
    for cut, join in (
        (cut_tcpros, TcpRosJoin()),
        (lambda message: cut_nimbro_tcp(message, b"image"), NimbroTcpJoin()),
    ):
        stream = b"".join(map(cut, sent))
        pieces = [stream[at : at + size] for at in range(0, len(stream), size)]
        assert joined(join, pieces) == sent


@given(messages)
def test_datagrams_come_back_and_keep_to_their_size(message):
    for datagrams, join, largest in (
        (cut_udpros(message, 3, 9), UdpRosJoin(), UDPROS_DATAGRAM),
        (cut_nimbro(message, 9, b"image"), NimbroJoin(), NIMBRO_DATAGRAM),
        (cut_pound(message, 9, 1, 2), PoundJoin(), 1436),
    ):
        assert max(map(len, datagrams)) <= largest
        assert joined(join, datagrams) == [message]


def test_udpros_loses_a_message_with_a_block_and_takes_the_next():
    first, second = (cut_udpros(bytes([n]) * 9000, 1, n) for n in (1, 2))
    assert joined(UdpRosJoin(), [*first[:2], *first[3:], *second]) == [bytes([2]) * 9000]


def test_pound_and_nimbro_do_not_mind_the_order():
    message = bytes(range(250)) * 40
    for datagrams, join in (
        (cut_pound(message, 1, 1, 2), PoundJoin()),
        (cut_nimbro(message, 1, b"image"), NimbroJoin()),
    ):
        assert joined(join, reversed(datagrams)) == [message]


def test_joins_forget_what_never_becomes_whole():
    join = PoundJoin()
    for number in range(100):
        assert not joined(join, cut_pound(bytes(3000), number, 1, 2)[:2])
    assert len(join.under_way) <= 32


def test_a_job_comes_back_from_its_line():
    loop = Loop(0.001, 5, 20, [[1.0, 0.0], [0.0, 1.0]], [0.0, 1.0], 1.0, 1.0)
    topics = [Topic(0, "y", 60, "latency", "a"), Topic(1, "u", 60, "latency", "b")]
    job = Job("udp", "a", "10.0.0.1", "10.0.0.2", 6e6, topics, [(0.5, 0, 1)], 2.0, loop)
    for one in (job, replace(job, loop=None)):
        assert Job.from_json(one.to_json()) == one
        assert "\n" not in one.to_json()
    assert (job.out, job.into) == (topics[:1], topics[1:])


def test_an_endpoint_needs_the_standard_library_only():
    """Endpoints run with interpreters that have none of our packages."""
    code = "import benchmarks.peers.pound.endpoint"
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    subprocess.run([sys.executable, "-S", "-c", code], check=True, env=environment)


def test_pound_sends_what_is_urgent_between_the_parts_of_what_is_not():
    topics = [Topic(0, "image", 65536, "bulk", "a"), Topic(1, "laser", 1024, "latency", "a")]
    heard = []
    a = Sockets(
        Job("pound_like", "a", "127.0.0.1", "127.0.0.2", 60e6, topics, [], 1.0),
        PEERS["pound_like"].transports,
        lambda message, at: None,
    )
    b = Sockets(
        Job("pound_like", "b", "127.0.0.2", "127.0.0.1", 60e6, topics, [], 1.0),
        PEERS["pound_like"].transports,
        lambda message, at: heard.append(HEAD.unpack_from(message)[0]),
    )
    for topic in topics:
        a.send(topic.number, HEAD.pack(topic.number, 0) + bytes(topic.size - HEAD.size))
    deadline = time.monotonic() + 5
    while len(heard) < 2 and time.monotonic() < deadline:
        a.run(time.monotonic() + 0.002)
        b.run(time.monotonic())
    a.close()
    b.close()
    assert heard == [1, 0]


def test_the_plant_is_what_scipy_makes_of_it():
    continuous = ([[0.0, 1], [-100, -10]], [[0.0], [100]], [[1.0, 0]], [[0.0]])
    a, b, *_ = cont2discrete([np.array(matrix) for matrix in continuous], 0.02)
    ours_a, ours_b = plant()
    np.testing.assert_allclose(ours_a, a, atol=1e-12)
    np.testing.assert_allclose(ours_b, b[:, 0], atol=1e-12)


def test_the_local_loop_settles_at_half_a_volt_and_overshoots():
    over, under, _ = cont2discrete(([1.0], [0.01, 0.1, 1.0]), 0.02)
    over = np.ravel(over)
    vc = local_loop(300)
    y, u = np.zeros(300), np.zeros(300)
    for k in range(300):
        y[k] = sum(over[i] * u[k - i] - under[i] * y[k - i] for i in (1, 2) if k >= i)
        u[k] = 1 - y[k - 1] if k else 0.0
    np.testing.assert_allclose(vc, y, atol=1e-9)
    assert vc[-1] == pytest.approx(0.5, abs=1e-6)
    assert vc.max() / 0.5 - 1 == pytest.approx(0.45, abs=0.01)


def test_recovery_is_when_messages_begin_to_stay_fresh():
    flow = Flow("x", 1024, 0.02, 500)
    sent = np.arange(500) * 0.02
    heard = sent + 0.002
    heard[(sent > 2) & (sent < 7)] = np.nan
    backlog = (sent >= 7) & (sent < 8)
    heard[backlog] = 8.0
    heard[420] += 0.05
    found = recovery(Trace(flow, sent, heard), 7.0)
    assert found == (pytest.approx(1.0), pytest.approx(1.002), pytest.approx(1.0))
    old = np.where(backlog, np.nan, heard)
    old[120] = 7.5  # What was sent before the outage says nothing of the link after it.
    found = recovery(Trace(flow, sent, old), 7.0)
    assert found == (pytest.approx(0.5), pytest.approx(1.002), pytest.approx(1.002))
    never = Trace(flow, sent, np.full(500, np.nan))
    assert np.all(np.isnan(recovery(never, 7.0)))


def test_a_peer_that_is_not_there_has_a_reason():
    assert "no peer is called 'telepathy'" in unavailable("telepathy")


@pytest.mark.slow
@in_namespaces
@pytest.mark.parametrize("peer", ["tcp_nodelay", "pound_like"])
def test_a_second_of_laser_and_image(peer):
    flows = [Flow("laser", 1024, 0.02, 50, "latency"), Flow("image", 65536, 0.15, 6, "bulk")]
    with namespaces.network() as network:
        laser, image = run_peer(peer, flows, network, 1, drain_s=0.5)
        rooms = [network.a.namespace, network.b.namespace]
    assert figures(laser).mdr_pct == 100
    assert np.all(laser.heard_at > laser.sent_at)
    # The channel's own times for 64 KB and for 1 KB; no machine can be faster.
    assert np.nanmin(image.heard_at - image.sent_at) > 0.08
    assert np.nanmin(laser.heard_at - laser.sent_at) > 8 * 1024 / 6e6
    listed = subprocess.run(["ip", "netns", "list"], capture_output=True, text=True).stdout
    assert not [room for room in rooms if room in listed]


@pytest.mark.slow
@in_namespaces
@pytest.mark.parametrize("peer", ["tcp_nodelay", "udp_nod"])
def test_the_lasers_port_has_a_queue_of_its_own(peer):
    """Counted by the queues themselves: 50 lasers go first, and the image waits behind them."""
    flows = [Flow("laser", 1024, 0.02, 50, "latency"), Flow("image", 65536, 0.15, 6, "bulk")]
    with namespaces.network(discipline="laser_first") as network:
        laser, _ = run_peer(peer, flows, network, 1, drain_s=0.5)
        room = network.a.namespace.removesuffix("a") + "air"
        command = ["tc", "-n", room, "-s", "class", "show", "dev", "sky"]
        told = subprocess.run(command, capture_output=True, text=True, check=True).stdout
    carried = {
        found[1]: int(found[2])
        for found in re.finditer(r"class htb (\S+) .*?\n Sent (\d+) bytes", told, re.DOTALL)
    }
    assert np.nanmin(laser.heard_at - laser.sent_at) > 8 * 1024 / 6e6
    assert 50 * 1024 < carried["1:30"] < 80 * 1024
    assert carried["1:10"] > 6 * 65536


@in_namespaces
def test_a_network_goes_away_with_an_exception():
    with contextlib.suppress(KeyboardInterrupt), namespaces.network(relay=True) as network:
        raise KeyboardInterrupt
    listed = subprocess.run(["ip", "netns", "list"], capture_output=True, text=True).stdout
    assert network.hops == 2
    assert network.relay.namespace not in listed
