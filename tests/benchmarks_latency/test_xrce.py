"""XRCE-DDS on a serial line: frames of any bytes, in any chunks, and their content."""

import itertools

import pytest
from hypothesis import given
from hypothesis import strategies as st

from benchmarks.peers.latency.job import ANSWERED, ASKED, FIRST_TOPIC, REPLY, REQUEST
from benchmarks.peers.latency.xrce import Xrce
from benchmarks.peers.latency.xrce_framing import (
    BEGIN,
    ESCAPE,
    MOST,
    Deframer,
    crc16,
    frame,
    stuff,
    unstuff,
)

CLIENT, AGENT = 1, 0
# Half of the bytes need stuffing, or look as if they were stuffed.
octets = st.lists(
    st.one_of(st.integers(0, 255), st.sampled_from([0x7E, 0x7D, 0x5E, 0x5D])), max_size=200
).map(bytes)
times_ns = st.integers(0, 2**31 * 10**9 - 1)


def chunks(stream, cuts):
    edges = [0, *sorted(cut % (len(stream) + 1) for cut in cuts), len(stream)]
    return [stream[a:b] for a, b in itertools.pairwise(edges)]


def heard(deframer, pieces):
    return [payload for piece in pieces for payload in deframer.feed(piece)]


def test_the_crc_is_the_one_of_the_catalogue():
    assert crc16(b"123456789") == 0xBB3D


def test_a_frame_octet_by_octet():
    octet_by_octet = bytes.fromhex("7e 01 00 03 00 7d5e 00 7d5d a0 39")
    assert frame(CLIENT, AGENT, b"\x7e\x00\x7d") == octet_by_octet


@given(octets)
def test_stuffing_hides_the_flag_and_can_be_undone(data):
    assert BEGIN not in stuff(data)
    assert unstuff(stuff(data)) == data


@given(st.lists(octets, max_size=5), st.lists(st.integers(0, 2000), max_size=20))
def test_frames_in_any_chunks(payloads, cuts):
    stream = b"".join(frame(CLIENT, AGENT, payload) for payload in payloads)
    assert heard(Deframer(AGENT), chunks(stream, cuts)) == payloads


@given(octets, octets, st.lists(st.integers(0, 2000), max_size=10))
def test_a_frame_after_anything_is_heard(noise, payload, cuts):
    stream = noise + frame(CLIENT, AGENT, payload)
    assert heard(Deframer(AGENT), chunks(stream, cuts))[-1:] == [payload]


@given(octets, st.integers(0, 7), st.data())
def test_a_damaged_payload_is_not_told(payload, bit, data):
    stuffed = frame(CLIENT, AGENT, payload)
    place = data.draw(st.integers(5, len(stuffed) - 1))
    damaged = bytearray(stuffed)
    damaged[place] ^= 1 << bit
    if not {BEGIN[0], ESCAPE[0]} & {damaged[place], stuffed[place], stuffed[place - 1]}:
        assert heard(Deframer(AGENT), [bytes(damaged)]) == []


def test_what_is_for_others_or_too_long_is_left_out():
    assert heard(Deframer(AGENT), [frame(AGENT, CLIENT, b"ours")]) == []
    assert heard(Deframer(AGENT), [frame(CLIENT, AGENT, bytes(MOST + 1))]) == []
    assert heard(Deframer(AGENT), [frame(CLIENT, AGENT, bytes(MOST))]) == [bytes(MOST)]


@pytest.mark.parametrize(("sender", "receiver"), [("fcu", "companion"), ("companion", "fcu")])
@given(octets, times_ns, times_ns, times_ns, st.integers(FIRST_TOPIC, 4095))
def test_messages_and_times_go_both_ways(sender, receiver, payload, t1, t2, t3, kind):
    told = [
        (kind, payload),
        (REQUEST, ASKED.pack(t1)),
        (REPLY, ANSWERED.pack(t1, t2, t3)),
    ]
    out, into = Xrce(sender), Xrce(receiver)
    assert list(into.decode(b"".join(out.encode(*one) for one in told))) == told


@given(octets)
def test_any_message_in_a_sound_frame_is_borne(message):
    for kind, _ in Xrce("companion").decode(frame(CLIENT, AGENT, message)):
        assert 0 <= kind < 4096


def test_what_goes_around_a_payload():
    """7 bytes of frame, 4 of message, 4 of submessage, 4 of request and object."""
    assert len(Xrce("fcu").encode(FIRST_TOPIC, bytes(115))) == 134
