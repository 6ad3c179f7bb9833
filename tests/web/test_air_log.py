"""What a station told of the air."""

import msgspec
from hypothesis import given
from hypothesis import strategies as st

from sdrlinkd.web.testing import MOST_BURSTS, AirLog
from tests.laws import law

OWN = {"at": 5_000_000, "us": 250, "mcs": 3, "n": 2, "q": "urgent", "end": "sent"}
HEARD = {"at": 9_000_000, "us": 500, "mcs": 1, "n": 4, "ok": 3, "end": "whole", "s": 7}


def told(**what):
    return msgspec.msgpack.encode(what)


def test_bursts_and_band_are_kept():
    log = AirLog()
    log.take(told(own=[OWN, {**OWN, "end": "late"}]), 1)
    log.take(
        told(
            heard=[HEARD],
            rate=2e6,
            mean=b"\x9c\x9c",
            peak=b"\xa6\xb0",
            pts=b"\x20\xe0",
            mod="QPSK",
            bad=2,
        ),
        1,
    )
    sent, late, heard = log.since(0)
    assert (sent.robot, sent.at_ms, sent.length_ms, sent.n_good, sent.is_own) == (
        1,
        5,
        0.25,
        2,
        True,
    )
    assert late.n_good == 0
    assert (heard.robot, heard.n_pdus, heard.n_good, heard.is_own) == (7, 4, 3, False)
    assert log.band["mean"] == [-100, -100]
    assert log.band["points"] == [32, -32]
    assert log.band["unreadable"] == 2
    assert list(log.since(sent.number)) == [late, heard]
    log.forget_before(6.0)
    assert list(log.since(0)) == [heard]


def test_it_is_bounded():
    log = AirLog()
    for _ in range(3):
        log.take(told(own=[OWN] * MOST_BURSTS), 1)
    assert len(list(log.since(0))) == MOST_BURSTS


@law(200)
@given(st.binary(max_size=200))
def test_what_another_version_tells_is_ignored(octets):
    log = AirLog()
    log.take(octets, 1)
    assert list(log.since(0)) == []
