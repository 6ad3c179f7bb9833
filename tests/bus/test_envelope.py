"""Bus frames: what is accepted; nothing else crashes."""

import json

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sdrlinkd.bus import shown
from sdrlinkd.bus.testing import OutHeader, decode, encode
from sdrlinkd.client import pack_map
from sdrlinkd.errors import EnvelopeError
from tests.laws import law

TOPIC = b"/robot_1/odom\0"
CDR = b"\0\1\0\0data"


@pytest.mark.parametrize(
    "pack", [lambda m: b"\x01" + pack_map(m), lambda m: json.dumps(m).encode()]
)
def test_header_in_messagepack_or_json(pack):
    fields = {"q": "latency", "p": 90, "d": 2, "ls": 250.0, "ty": "nav_msgs/msg/Odometry", "new": 1}
    topic, header, payload = decode([TOPIC, pack(fields), CDR])
    assert (topic, payload) == (TOPIC, CDR)
    assert (header.q, header.p, header.d, header.ls) == ("latency", 90, 2, 250.0)


@pytest.mark.parametrize("empty", [b"\x01\x80", b"{}"])
def test_a_header_may_say_nothing(empty):
    assert decode([TOPIC, empty, CDR]) == (TOPIC, None, CDR)


@pytest.mark.parametrize(
    ("frames", "says"),
    [
        ([], "0 frames"),
        ([TOPIC], "1 frames"),
        ([TOPIC, b"{}", CDR, b""], "4 frames"),
        ([b"/robot_1/odom", b"{}", CDR], "NUL"),
        ([TOPIC, b"", CDR], "header begins"),
        ([TOPIC, b"\x02\x80", CDR], "header begins"),
        ([TOPIC, b"\x01", CDR], "header"),
        ([TOPIC, b"\x01\x80\x80", CDR], "header"),
        ([TOPIC, b"{]", CDR], "header"),
        ([TOPIC, b'{"p": 128}', CDR], "p"),
        ([TOPIC, b'{"p": "high"}', CDR], "p"),
        ([TOPIC, b'{"q": "fast"}', CDR], "fast"),
        ([TOPIC, b'{"d": 256}', CDR], "d"),
        ([TOPIC, b'{"ls": 0}', CDR], "ls"),
        ([TOPIC, b'{"x": "' + b"x" * 300 + b'"}', CDR], "at most 256"),
    ],
)
def test_refused_with_a_reason(frames, says):
    with pytest.raises(EnvelopeError, match=says):
        decode(frames)


@law(500)
@given(st.lists(st.binary(max_size=40), max_size=5), st.booleans())
def test_any_frames_decode_or_are_refused(frames, plausible):
    if plausible and len(frames) >= 2:
        frames[0] += b"\0"
        frames[1] = b"\x01" + frames[1]
    try:
        decode(frames)
    except EnvelopeError:
        return
    assert len(frames) == 3


def test_out_header_leaves_out_what_is_unknown():
    header = OutHeader(s=1, n=2, tr=3, ty="a/msg/B")
    frames = encode(TOPIC, header, CDR)
    assert frames[0] == TOPIC
    assert msgspec.msgpack.decode(frames[1][1:]) == {"s": 1, "n": 2, "tr": 3, "ty": "a/msg/B"}


@pytest.mark.parametrize("size", [0, 1, 239, 240, 241, 1000])
def test_words_of_others_are_cut_to_what_can_be_shown(size):
    words = "x\n" * (size // 2) + "x" * (size % 2)
    plain = words.replace("\n", "?")
    assert shown(words) == (plain if size <= 240 else plain[:239] + "…")
