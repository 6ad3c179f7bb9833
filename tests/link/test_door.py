"""The door for PDUs: what is sealed waits for a proof, and what is refused has a name."""

from types import SimpleNamespace

import pytest

from sdrlinkd.errors import PduError
from sdrlinkd.link import LinkParams, TopicPolicy
from sdrlinkd.link.queue import Inflated
from sdrlinkd.link.receive import Neighbors, RecordHeard, Signal
from sdrlinkd.link.receive.testing import (
    Acceptance,
    Door,
    Held,
    PduReader,
    RepeatedPdus,
    RxLedger,
)
from sdrlinkd.link.topics import HeardTopics
from sdrlinkd.sealing import Opened
from sdrlinkd.wire import (
    Beacon,
    Clock,
    Entry,
    Frame,
    Pdu,
    Receipt,
    Repeat,
    Stamp,
    build,
    build_records,
    make_registry,
)

TOPICS = make_registry([("odom", "nav_msgs/Odometry")])
CLEAR, SEALED = bytes((0, 9, 255, 10)) + b"clear", bytes((1, 9, 255, 10)) + b"sealed"


class Opener:
    """Opens what it is told to open."""

    delivers_unproven = False

    def __init__(self):
        self.reason, self.is_proven, self.held_s, self.late = "", True, 0.0, set()
        self.refuses, self.later_s = False, None

    def refuses_clear(self, data, now):
        return self.refuses

    def open(self, data, at, later_s):
        self.later_s = later_s
        if self.reason:
            raise PduError(self.reason, "")
        return Opened(b"inner" + data[6:], 9, 77, 0.25, self.held_s, self.is_proven)

    def is_late(self, src, at, lead_s, held_s):
        assert (src, lead_s) == (9, 0.25)
        return at in self.late


class Entrance:
    """A door with all that it needs, and what it refused."""

    def __init__(self):
        self.opener = Opener()
        self.acceptance = Acceptance(TOPICS, Inflated({}), 1 << 20, False, True)
        topics = HeardTopics(TOPICS, True, lambda _: bytes(8))
        self.ledger, self.neighbors = RxLedger(topics), Neighbors(2)
        self.repeated, self.forwarded = RepeatedPdus(), []
        routes = SimpleNamespace(forwarded=lambda data, at: self.forwarded.append((data, at)))
        self.door = Door(
            SimpleNamespace(opener=self.opener), self.acceptance, self.ledger, self.neighbors,
            self.repeated, routes,
        )  # fmt: skip

    def admit(self, at=1.0, data=SEALED):
        return self.door.admit(data, at, Signal(12.0), at, at + 0.5)

    @property
    def refused(self):
        report = self.ledger.report(Held(0, 0, 0))
        assert report.pdus_heard == sum(report.pdus_dropped.values())
        return report.pdus_dropped


def test_what_comes_in_the_clear_is_admitted_or_refused():
    entrance = Entrance()
    (admitted,) = entrance.admit(data=CLEAR)
    assert admitted[:5] == (CLEAR, CLEAR, 1.0, Signal(12.0), 1.5)
    assert (admitted.is_proven, admitted.ticks, admitted.is_held) == (True, None, False)
    assert (admitted.number, admitted.first_at) == (None, 1.0)
    entrance.opener.refuses = True
    assert entrance.admit(data=CLEAR) == []
    assert entrance.refused == {"sec_cleartext": 1}


@pytest.mark.parametrize("reason", ["rx_dup", "rx_own", "sec_bad_tag"])
def test_what_does_not_open_is_counted_and_what_is_known_was_forwarded(reason):
    entrance = Entrance()
    entrance.opener.reason = reason
    assert entrance.admit() == []
    neighbor = entrance.neighbors.meet(9)
    assert entrance.admit() == []
    assert entrance.refused == {reason: 2}
    assert entrance.forwarded == [(SEALED, 1.0)] * 2 * (reason != "sec_bad_tag")
    assert neighbor.duplicates == (reason == "rx_dup")


def test_a_proven_source_is_admitted_at_once():
    entrance = Entrance()
    for held_s in (0.0, 0.125):
        entrance.opener.held_s = held_s
        (admitted,) = entrance.admit()
        assert (admitted.data, admitted.raw, admitted.ticks) == (b"inneraled", SEALED, 77)
        assert (admitted.is_proven, admitted.is_glance, admitted.was_seen) == (True, False, False)
        assert (admitted.may_schedule, admitted.is_held) == (True, held_s > 0)


def waiting(*times):
    """An entrance where PDUs came at these times from a source that is not proven."""
    entrance = Entrance()
    entrance.opener.is_proven = False
    for at in times:
        (glance,) = entrance.admit(at)
        assert (glance.is_glance, glance.is_proven) == (True, False)
        assert glance.may_schedule == (at < times[0] + 2.0)
    entrance.opener.is_proven = True
    return entrance


def test_what_waited_is_admitted_in_order_once_its_source_is_proven():
    entrance = waiting(1.0, 2.0, 2.5, 3.0)
    entrance.opener.late = {2.5}
    admitted = entrance.admit(3.5)
    assert [(each.at, each.was_seen, each.is_proven) for each in admitted] == [
        (2.0, True, True), (3.0, True, True), (3.5, False, True),
    ]  # fmt: skip
    assert entrance.refused == {"sec_unproven": 1, "sec_late": 1}
    assert len(entrance.admit(3.6)) == 1
    entrance.opener.is_proven = False
    (glance,) = entrance.admit(5.0)
    assert glance.may_schedule, "the time in which its schedule is followed begins anew"


def test_what_waits_too_long_is_dropped():
    entrance = waiting(1.0, 1.5, 2.0)
    entrance.door.expire(3.0)
    assert entrance.refused == {}
    entrance.door.expire(3.75)
    assert entrance.refused == {"sec_unproven": 2}
    entrance.door.expire(9.0)
    entrance.door.expire(10.0)
    assert entrance.refused == {"sec_unproven": 3}
    assert len(entrance.admit(10.0)) == 1


def test_no_more_than_512_wait():
    entrance = waiting(*(1.0 + i / 1024 for i in range(513)))
    assert entrance.refused == {"sec_unproven": 1}
    admitted = entrance.admit(2.0)
    assert (len(admitted), admitted[0].at) == (513, 1.0 + 1 / 1024)


@pytest.mark.parametrize("of_all", [True, False])
def test_where_unproven_messages_are_delivered_nothing_waits(of_all):
    entrance = Entrance()
    entrance.opener.is_proven = False
    if of_all:
        entrance.opener.delivers_unproven = True
    else:
        entrance.acceptance.set_policy(0, TopicPolicy(unproven="deliver"))
    (admitted,) = entrance.admit()
    assert (admitted.is_glance, admitted.is_proven, admitted.may_schedule) == (False, False, True)
    entrance.opener.is_proven = True
    assert len(entrance.admit(1.5)) == 1


def test_what_a_source_repeats_was_sent_before():
    entrance = Entrance()
    entrance.neighbors.meet(9)
    entrance.repeated.take(Repeat(9, 10, 2500, 1), 9, entrance.neighbors.get(9).track, 1.0)
    (admitted,) = entrance.admit(1.0, CLEAR)
    assert (admitted.number, admitted.first_at, admitted.is_held) == (10, 0.75, True)
    entrance.admit(1.0)
    assert entrance.opener.later_s == 0.25
    entrance.repeated.take(Repeat(8, 10, 2500, 1), 8, entrance.neighbors.get(9).track, 1.0)
    other = bytes((0, 8, 255, 10))
    assert entrance.admit(1.0, other)[0].number is None, "it was never heard"
    for size in range(4):
        assert entrance.admit(1.0, CLEAR[:size])[0].number is None
    assert entrance.admit(1.0, CLEAR[:4])[0].number == 10


def admitted_pdu(*records, at=5.0, first_at=5.0, ticks=None, hop=2, **more):
    entrance = Entrance()
    (admitted,) = entrance.admit(at, CLEAR)
    entries = [Entry(15, 0, 0, 1, build_records(records)), Entry(0, 3, 0, 1, b"data")]
    octets = build(Pdu(0, False, 9, 255, 77, hop, entries), 96)
    return admitted._replace(data=octets, first_at=first_at, ticks=ticks, **more)


def reader(has_control=True):
    params = LinkParams(pdu_size=96, hop_limit=2)
    return PduReader(params, 96, has_control=has_control, has_numbers=True)


RECEIPT = Receipt(0, 1, 2, 3, 4, 5)


@pytest.mark.parametrize(
    ("how", "later_s", "grown"),
    [
        ({}, None, (0, 0)),
        ({"first_at": 4.5}, None, (500_000, 5000)),
        ({"first_at": 4.5, "ticks": 7}, None, (0, 0)),
        ({}, 0.25, (250_000, 0)),
        ({"ticks": 7}, 0.25, (250_000, 0)),
    ],
)
def test_the_times_in_a_repeated_pdu_grow(how, later_s, grown):
    """Inside sealed ones they have grown already; what nobody tells is added to ages alone."""
    read = reader().read(admitted_pdu(Stamp(0, 3, 100), RECEIPT, **how), later_s)
    told = RECEIPT._replace(since_100us=5 + grown[1])
    assert read.records == [Stamp(0, 3, 100 + grown[0]), told]
    assert read.stamps == [Stamp(0, 3, 100 + grown[0])]
    without = reader(has_control=False).read(admitted_pdu(Stamp(0, 3, 100), **how), later_s)
    assert (without.records, without.stamps, without.has_messages) == ([], [], True)


def test_who_vouches_for_a_pdu_and_whether_others_need_it():
    for hop, is_held, is_relayed, is_forwarded in (
        (2, False, False, False), (2, True, True, False), (1, False, True, True),
    ):  # fmt: skip
        read = reader().read(admitted_pdu(RECEIPT, hop=hop, is_held=is_held))
        assert (read.is_relayed, read.is_forwarded) == (is_relayed, is_forwarded)
        assert read.has_messages
        assert read.is_far
    read = reader().read(admitted_pdu(Beacon(1, 2)))
    bare = read._replace(pdu=read.pdu._replace(entries=read.pdu.entries[:1]))
    assert (bare.has_messages, bare.is_far, read.is_far) == (False, False, True)
    far = bare._replace(records=[Beacon(1, 2), RECEIPT])
    assert far.is_far


@pytest.mark.parametrize(
    ("records", "told"),
    [
        ([RECEIPT], None),
        ([Beacon(1, 2)], None),
        ([Beacon(1, 2), Clock(1, 2, 3, 4, pdu_number=0x1234)], 0x124D),
        ([Beacon(1, 2, 0x124D), Clock(1, 2, 3, 4, pdu_number=9)], 0x124D),
    ],
)
def test_a_pdu_tells_its_number_by_its_sequence_number(records, told):
    assert reader().read(admitted_pdu(*records)).told == told


def test_what_waits_for_a_proof_shows_that_its_source_is_there():
    frame, beacon = Frame(1, 0, 2, 3), Beacon(1, 2)
    for how, used in (
        ({}, [beacon, frame]), ({"may_schedule": False}, [beacon]), ({"is_held": True}, []),
        ({"hop": 1}, []),
    ):  # fmt: skip
        first, *rest = reader().glance(admitted_pdu(RECEIPT, beacon, frame, **how))
        assert (first.stamps, first.at, first.signal.snr_db) == ([], 5.0, 12.0)
        assert first.is_relayed == (not used)
        assert rest == [RecordHeard(9, each, 5.0) for each in used]
    assert reader().glance(admitted_pdu()._replace(data=b"short")) == []
