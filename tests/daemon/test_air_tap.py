"""What the daemon tells those who watch the air."""

import time

import msgspec
import pytest
import zmq

from sdrlinkd.airwatch import AirWatch
from sdrlinkd.bus import AIR_TAP
from sdrlinkd.client import OUT_SOCKET, Publisher, endpoint
from sdrlinkd.pdulink import AirSeen, BurstSeen, Heard
from sdrlinkd.wire import Entry, Pdu, build, source_and_class

LOOPBACK = 'namespace = "robot_1"\nbackend = "loopback"\n[modem]\nrate_hz = 1e6\nmcs = 3\n'
CDR = b"\0\1\0\0" + bytes(300)


@pytest.mark.slow
def test_own_bursts_and_those_heard_are_told_while_somebody_watches(start_daemon):
    daemon = start_daemon(LOOPBACK)
    own, heard, bands = [], [], []
    with zmq.Context() as context, context.socket(zmq.SUB) as watching:
        watching.linger = 0
        watching.connect(endpoint(daemon.directory, OUT_SOCKET))
        watching.subscribe(AIR_TAP)
        with Publisher(runtime_dir=daemon.directory) as out:
            deadline = time.monotonic() + 30
            while len(bands) < 5 or not any("s" in each for each in heard):
                assert time.monotonic() < deadline
                out.send("/robot_1/odom", CDR)
                while watching.poll(50):
                    _, packed = watching.recv_multipart()
                    told = msgspec.msgpack.decode(packed[1:])
                    own += told.get("own", [])
                    heard += told.get("heard", [])
                    bands += [told] if "peak" in told else []
    assert {each["end"] for each in own} == {"sent"}
    assert {each["mcs"] for each in own} <= {0, 1, 2, 3}
    known = [each for each in heard if "s" in each]
    assert {(each["s"], each["end"]) for each in known} == {(1, "whole")}
    assert all(each["ok"] == each["n"] for each in known)
    # It hears itself: a burst is heard when it was sent, and is as long.
    for each in known:
        same = min(own, key=lambda sent, each=each: abs(sent["at"] - each["at"]))
        assert abs(same["at"] - each["at"]) < 1e6
        assert (same["us"], same["n"]) == (pytest.approx(each["us"], abs=2), each["n"])
    for band in bands:
        assert band["rate"] == 1e6
        assert len(band["mean"]) == len(band["peak"]) == 128
        peaks, means = (memoryview(band[key]).cast("b") for key in ("peak", "mean"))
        assert all(peak >= mean for peak, mean in zip(peaks, means, strict=True))
    assert any(band["mod"] == "QAM16" and band["pts"] for band in bands)


class FakeBus:
    is_tapped = False
    is_air_watched = False

    def __init__(self):
        self.told = []

    def tell_air(self, told):
        self.told.append(told)


class FakeLink:
    tell = None

    def observe(self, tell):
        self.tell = tell

    def now(self):
        return 5.0


def seen(*bursts):
    return AirSeen(5.0, 2e6, list(bursts), b"", b"", b"", "", 0, [])


def burst(at, n_good=1):
    return BurstSeen(at, 0.001, 3, 1, n_good, 20.0, -30.0, "whole")


def test_the_modem_looks_only_while_somebody_does():
    bus, link = FakeBus(), FakeLink()
    watch = AirWatch(bus, lambda: link)
    pdu = build(Pdu(3, False, 7, 255, 0, 0, [Entry(1, 0, 0, 1, b"x")]), 64)
    watch.look()
    assert link.tell is None
    bus.is_air_watched = True
    watch.look()
    watch.heard([Heard(pdu, 4.5)])
    link.tell(seen(burst(4.5), burst(4.6)))
    first, second = bus.told[0]["heard"]
    assert (first["s"], first["q"]) == (7, "urgent")
    assert "s" not in second
    assert second["at"] - first["at"] == pytest.approx(0.1e9, abs=2)
    bus.is_air_watched = False
    watch.look()
    assert link.tell is None


def test_a_link_that_is_opened_anew_is_watched_too():
    bus, links = FakeBus(), [FakeLink(), FakeLink()]
    watch = AirWatch(bus, lambda: links[-1])
    bus.is_air_watched = True
    watch.look()
    assert links[1].tell is not None
    links.append(FakeLink())
    watch.look()
    assert links[2].tell is not None
    assert links[1].tell is None


@pytest.mark.parametrize("qos", range(4))
def test_source_and_class_are_in_the_header(qos):
    data = build(Pdu(qos, True, 9, 255, 1, 2, [Entry(1, 0, 0, 1, b"x")]), 64)
    assert source_and_class(data) == (9, qos)
