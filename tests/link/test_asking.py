"""What is missing of others: when it is asked for, how often, and when not at all."""

from math import inf

import pytest

from sdrlinkd.link import Qos
from sdrlinkd.link.receive import PduPlaced
from sdrlinkd.link.receive.testing import PduRead
from sdrlinkd.link.repeat import Asking
from sdrlinkd.link.repeat.testing import Missing, Source, inside, parts
from sdrlinkd.reports import RepeatReport
from sdrlinkd.wire import PARTS, Bare, ControlEntries, Entry, Need, Parity, Pdu, Stamp

NOTHING = RepeatReport(pdus=0, airtime_s=0.0, asked_of_us=0, unknown=0, expired=0, refused=0)
MESSAGE = Entry(0, 1, 0, 1, b"data")
Q_OF = {Qos.DEFAULT: 0, Qos.LATENCY: 1, Qos.BULK: 2, Qos.URGENT: 3}
CONTROL = Entry(15, 0, 0, 1, b"")


def placed(
    number, skipped=(), *records, at=0.0, src=9, entries=(MESSAGE,), is_wanted=True, is_ours=True,
    is_forwarded=False, qos=Qos.DEFAULT,
):  # fmt: skip
    pdu = Pdu(Q_OF[qos], False, src, 255, number & 0xFF, 1, list(entries))
    n_control = sum(each.topic_id == 15 for each in entries)
    control = ControlEntries(list(records), n_control, 0)
    read = PduRead(pdu, control, list(records), is_forwarded, is_forwarded)
    return PduPlaced(read, number, skipped, is_wanted, at, is_ours)


def fragment(index, total=9, entry_id=1, topic_id=0):
    return Entry(topic_id, entry_id, index, total, b"ab")


class Held(set):
    """The messages of which fragments are held: (source, topic id, entry id)."""

    def __call__(self, *key):
        return key in self


def make(share=0.05, held=(), room=40):
    return Asking(Held(held), share, room)


def lacking(*numbers, last=20, at=0.0, heard=5, asking=None, **more):
    """Asking, after PDUs before 10 came, and then `last`, which showed what is missing."""
    asking = asking or make()
    for number in range(10 - heard, 10):
        asking.placed(placed(number, at=at, **more))
    asking.placed(placed(last, numbers, at=at, **more))
    return asking


def asked(asking, at):
    return [number for need in asking.questions(at) for number in need.numbers()]


def told(asking):
    report = asking.report(NOTHING)
    return report.asked, report.given_up


def test_what_is_missing_is_asked_for_after_a_moment():
    asking = make()
    assert (asking.due_at, asking.alone_at, asking.offered_alone_at) == (inf, inf, inf)
    lacking(10, 12, asking=asking)
    assert asking.due_at == 0.005
    assert asking.alone_at == pytest.approx(0.005 + 0.05 / 2)
    assert asking.questions(0.0049) == []
    assert not asking.is_offered
    assert asking.questions(0.005) == [Need(9, 10, b"\xa0")]
    assert asking.is_offered
    assert asking.offered_alone_at == pytest.approx(0.005 + 0.05 / 2)
    asking.asked(0.01, (), 0.0)
    assert (told(asking), asking.is_offered) == ((2, 0), False)
    assert asking.due_at == pytest.approx(0.05)
    assert asking.offered_alone_at == inf


def test_a_source_that_brings_nothing_for_us_gets_no_pdu_of_its_own():
    asking = lacking(10, is_wanted=True, heard=1)
    assert (asking.due_at, asking.alone_at) == (0.005, inf), "two useful PDUs of late"
    assert lacking(10, heard=2).alone_at < inf
    assert lacking(10, is_wanted=False).due_at == inf
    assert lacking(10, entries=(CONTROL,)).alone_at == inf
    assert lacking(10, entries=(CONTROL, MESSAGE)).alone_at < inf


def test_the_last_useful_pdu_or_the_one_before_is_reason_to_ask():
    for before, after, due_at in ((True, False, 0.005), (False, True, 0.005), (False, False, inf)):
        asking = make()
        asking.placed(placed(9, is_wanted=before))
        asking.placed(placed(11, (10,), is_wanted=after))
        assert asking.due_at == due_at, (before, after)
    asking = make()
    asking.placed(placed(11, (10,)))
    assert asking.due_at == 0.005
    assert make(share=0.0).placed(placed(11, (10,))) is None
    off = lacking(10, asking=make(share=0.0))
    assert (off.due_at, asked(off, 1.0)) == (inf, [])


def test_what_comes_is_not_asked_for_and_a_late_one_shows_nothing_new():
    asking = lacking(10, 11, 300)
    asking.placed(placed(10, (7, 8), at=0.002))
    assert asked(asking, 0.01) == [11, 300]
    asking.placed(placed(300, at=0.011))
    asking.placed(placed((1 << 32) + 11, at=0.011))
    assert (asked(asking, 0.02), asking.due_at) == ([], inf), "numbers wrap around"


def test_a_question_is_asked_three_times_the_last_one_only_if_the_source_is_heard():
    asking = lacking(10)
    times = []
    for at in range(1, 500):
        if asking.questions(at / 1000):
            times.append(at)
            asking.asked(at / 1000, (), 0.0)
    assert times == [5, 45]
    asking.placed(placed(21, at=0.5))
    assert asked(asking, 0.50) == []
    assert asked(asking, 0.54) == [10], "it was put off"
    asking.asked(0.54, (), 0.0)
    assert told(asking) == (3, 0)
    assert asking.due_at == inf
    assert asked(asking, 0.9) == []
    assert told(asking) == (3, 0)
    asked(asking, 1.0)
    assert told(asking) == (3, 0)
    asked(asking, 1.001)
    assert told(asking) == (3, 1)


def test_the_time_of_answers_sets_when_to_ask_again():
    source = Source()
    assert source.again_s == 0.04
    for asks, took_s, again_s in (
        (1, 0.02, 0.04), (1, 0.1, 0.08), (2, 0.2, 0.1), (1, 0.0, 0.075), (1, 9.0, 0.3),
    ):  # fmt: skip
        missing = Missing(1, 0.0, 0.0, frozenset(), asks=asks, first_asked_at=1.0)
        source.filled(missing, 1.0 + took_s)
        assert source.again_s == pytest.approx(again_s)
    for _ in range(30):
        source.filled(missing, 1.0)
    assert source.again_s == 0.02
    source.filled(Missing(1, 0.0, 0.0, frozenset()), 2.0)
    assert source.again_s == 0.02, "nobody asked for it"
    asking = lacking(10)
    asked(asking, 0.005)
    asking.asked(0.005, (), 0.0)
    asking.placed(placed(10, at=0.105))
    asking.placed(placed(30, (29,), at=0.2))
    asked(asking, 0.21)
    asking.asked(0.21, (), 0.0)
    assert asking.due_at == pytest.approx(0.21 + 2 * (0.02 + 0.25 * 0.08))


@pytest.mark.parametrize("answer_s", [0.005, 0.03, 0.08, 0.14])
def test_answers_become_slower_and_faster_and_are_asked_for_once_again(answer_s):
    """Where an answer takes longer than before, a second question is soon in vain no more."""

    def n_asks(source):
        missing = Missing(1, 0.0, 0.0, frozenset())
        at = 0.0
        while at < answer_s and missing.asks_left:
            source.asked(missing, at)
            at = missing.next_at
        source.filled(missing, answer_s)
        return missing.asks

    for before_s in (0.0, 0.02, 0.15, 1.0):
        source = Source(answer_s=before_s)
        asks = [n_asks(source) for _ in range(40)]
        assert set(asks[20:]) == {1}
        assert source.again_s < 4 * max(answer_s, 0.01)


def test_where_there_was_no_room_nothing_counts_as_asked():
    asking = lacking(10)
    lacking(10, asking=asking, src=8)
    assert asked(asking, 0.005) == [10, 10]
    asking.asked(0.005, {9}, 0.0)
    assert told(asking) == (1, 0)
    assert asking.due_at == 0.005
    assert asking.questions(0.006) == [Need(9, 10, b"\x80")]
    asking.placed(placed(10, at=0.006))
    asking.asked(0.006, (), 0.0)
    assert told(asking) == (1, 0), "it has come in the meantime"


def test_a_bitmap_is_no_longer_than_the_room_for_it():
    numbers = (10, 20, 40)
    for room, n in ((7, 3), (8, 3), (9, 2), (11, 1)):
        assert len(lacking(*numbers, last=50, asking=make(room=room)).questions(0.01)) == n
    assert len(lacking(*numbers, last=50, asking=make(room=1)).questions(0.01)) == 3


def test_what_others_ask_for_is_asked_later():
    asking = lacking(10, 11, 12)
    asking.others_need(Need(8, 10, b"\xff"), 0.001)
    assert asking.due_at == 0.005
    asking.others_need(Need(9, 9, b"\x60"), 0.001)
    assert asked(asking, 0.005) == [12]
    asking.others_need(Need(9, 9, b"\x60"), 0.03)
    assert asked(asking, 0.041) == [10, 11, 12], "only once"
    asking.asked(0.041, (), 0.0)
    asking.others_need(Need(9, 12, b"\x80"), 0.042)
    assert asking.due_at == pytest.approx(0.041 + 0.04)


def test_a_pdu_of_its_own_takes_air():
    asking = lacking(10)
    asked(asking, 0.005)
    asking.asked(0.005, (), 0.105)
    free_at = 0.005 + 0.005 / 0.05
    assert asking.alone_at == pytest.approx(free_at)
    asked(asking, 0.05)
    assert asking.offered_alone_at == pytest.approx(free_at)
    assert lacking(10, asking=asking, src=8).alone_at == pytest.approx(free_at)


def test_only_those_due_at_nearly_the_same_time_share_a_pdu():
    asking = lacking(10)
    asking.placed(placed(30, (28, 29), at=0.004))
    assert asking.alone_at == pytest.approx(0.005 + 0.05 / 3)
    later = lacking(10)
    later.placed(placed(30, (28, 29), at=0.0051))
    assert later.alone_at == pytest.approx(0.005 + 0.05)


def test_of_too_many_the_oldest_are_given_up():
    asking = lacking(*range(10, 1000), last=1000)
    assert told(asking) == (0, 0), "they were never taken up"
    assert asked(asking, 0.01)[0] == 1000 - 512
    asking.placed(placed(1011, range(1001, 1011), at=0.01))
    assert told(asking) == (0, 10)
    assert asked(asking, 0.02)[0] == 1000 - 502


def test_what_holds_nothing_is_not_asked_for():
    asking = lacking(10, 11, 12)
    asking.placed(placed(21, (), Bare(10, b"\xa0")))
    assert asked(asking, 0.01) == [11]
    assert told(asking) == (0, 0)
    only = lacking(10)
    only.placed(placed(21, (), Bare(10, b"\x80")))
    assert only.due_at == inf


def test_a_robot_that_restarts_and_a_clock_that_does_are_begun_anew():
    asking = lacking(10)
    lacking(10, asking=asking, src=8)
    asked(asking, 0.01)
    asking.forget(9)
    assert asking.is_offered
    asking.asked(0.01, (), 0.0)
    assert told(asking) == (1, 0)
    assert asked(asking, 0.06) == [10]
    asking.forget(8)
    assert (asking.is_offered, asking.due_at) == (False, inf)
    lacking(10, asking=asking)
    asked(asking, 0.01)
    asking.asked(5.0, (), 0.2)
    asking.restart()
    assert (asking.is_offered, asking.due_at, asking.alone_at) == (False, inf, inf)
    assert asked(asking, 9.0) == []
    assert lacking(10, asking=asking).alone_at == pytest.approx(2.0), "as the new clock has it"


def test_parts_of_a_message_that_is_complete_or_given_up_are_not_asked_for():
    held = Held({(9, 0, 1)})
    asking = Asking(held, 0.05, 40)
    asking.placed(placed(9, entries=(fragment(0),)))
    asking.placed(placed(11, (10,), entries=(fragment(2),)))
    asking.placed(placed(12, entries=(MESSAGE,)))
    assert asked(asking, 0.005) == [10]
    held.clear()
    assert asked(asking, 0.006) == []
    assert told(asking) == (0, 0), "nothing was given up"


@pytest.mark.parametrize(("topic_id", "with_parity"), [(0, True), (0, False), (PARTS, False)])
def test_while_parity_may_still_come_nothing_is_asked(topic_id, with_parity):
    message = (9, topic_id, 1)
    asking = make(held=[message])
    records = [Parity(topic_id, 7, 9, 1, 0, 0, 2, 18, b"x")] if with_parity else []
    asking.placed(placed(8, (), *records))
    asking.placed(placed(9, entries=(fragment(0, topic_id=topic_id),)))
    asking.placed(placed(11, (10,), entries=(fragment(2, topic_id=topic_id),)))
    waits = with_parity or topic_id == PARTS
    assert asked(asking, 0.005) == ([] if waits else [10])
    assert asking.due_at == (0.010 if waits else 0.005)
    assert asked(asking, 0.0501) == ([10])
    asking.placed(placed(12, at=0.051, entries=(MESSAGE,)))
    assert asked(asking, 0.055) == [10], "the message is over"


def test_a_topic_that_has_no_parity_any_more_is_asked_for_at_once():
    asking = make(held=[(9, 0, 1)])
    asking.placed(placed(8, (), Parity(0, 7, 9, 1, 0, 0, 2, 18, b"x")))
    for at, waits in ((9.9, True), (10.2, False)):
        asking.placed(placed(9, entries=(fragment(0),), at=at))
        asking.placed(placed(11, (10,), entries=(fragment(2),), at=at))
        assert asked(asking, at + 0.006) == ([] if waits else [10])
        asking.placed(placed(10, entries=(fragment(1),), at=at + 0.01))


def test_where_relays_send_less_urgent_ones_later_one_waits_longer():
    def forwarded(number, skipped=(), at=0.0, qos=Qos.DEFAULT, **more):
        return placed(number, skipped, at=at, qos=qos, is_forwarded=True, **more)

    asking = make()
    asking.placed(forwarded(9))
    asking.placed(forwarded(12, (10, 11)))
    assert asking.due_at == 0.2
    asking.placed(forwarded(13, at=0.01))
    assert asking.due_at == pytest.approx(0.015), "no less urgent one was heard lately"
    assert asked(asking, 0.02) == [10, 11]
    asking.asked(0.02, (), 0.0)
    assert asking.due_at == pytest.approx(0.06)
    asking.placed(forwarded(14, at=0.06))
    assert asked(asking, 0.06) == [10, 11]
    asking.asked(0.06, (), 0.0)
    assert asking.due_at == pytest.approx(0.06 + 2 * 0.04), "ever later"
    for _ in range(4):
        asking.placed(forwarded(14, at=asking.due_at))
        at = asking.due_at
        assert asked(asking, at) == [10, 11]
        asking.asked(at, (), 0.0)
    assert (told(asking), asking.due_at) == ((12, 0), inf)


def test_what_is_older_than_the_least_urgent_class_does_not_wait_at_a_relay():
    source = Source()

    def came(number, qos, at=0.0, entries=(MESSAGE,)):
        event = placed(number, at=at, qos=qos, entries=entries, is_forwarded=True)
        return source.came(event, is_useful=True)

    came(20, Qos.BULK)
    source.missing = {
        n: Missing(n, 0.0, 0.2, frozenset(), is_relayed=True, may_wait=n != 17)
        for n in (17, 18, 19, 25)
    }
    assert not came(30, Qos.URGENT, 0.01, entries=(CONTROL,)), "control records have no class"
    assert source.heard_at == 0.01
    assert came(30, Qos.URGENT, 0.02)
    assert [source.missing[n].next_at for n in (17, 18, 19, 25)] == [0.2, 0.025, 0.025, 0.2]
    assert not came(31, Qos.URGENT, 0.03)
    assert not came(12, Qos.BULK, 0.05), "the highest number counts"
    assert not came(32, Qos.URGENT, 0.54)
    assert came(33, Qos.URGENT, 0.55), "the other class is not used any more"
    assert source.missing[25].next_at == 0.2, "no later than it was"
    assert not source.missing[25].may_wait


def test_a_source_that_relays_bring_is_asked_if_it_is_useful():
    source = Source()
    assert source.is_asked
    assert source.patience_s == 0.005
    source.came(placed(1, is_forwarded=True), is_useful=False)
    assert (source.is_asked, source.patience_s) == (False, 0.2)
    source.came(placed(2), is_useful=True)
    assert (source.is_asked, source.useful, source.hears_relays) == (True, 0.02, True)
    source.came(placed(3, at=1.99), is_useful=False)
    assert source.useful == pytest.approx(0.02 * 0.98)
    assert source.patience_s == 0.2
    source.came(placed(4, at=2.0), is_useful=False)
    assert (source.hears_relays, source.patience_s) == (False, 0.005), "it has come near"
    source.came(placed(5, at=2.1, is_forwarded=True), is_useful=False)
    assert source.hears_relays
    relayed, own = (Missing(1, 0.0, 0.0, frozenset(), is_relayed=each) for each in (True, False))
    assert (relayed.asks_left, own.asks_left) == (6, 3)
    asking = make()
    asking.placed(placed(9, is_forwarded=True, is_wanted=False))
    asking.placed(placed(11, (10,), is_forwarded=True, is_wanted=False))
    assert asking.due_at == inf


def parity(number, at=0, n_parity=3, entry_id=1, data=b"xy", topic_id=0):
    return Parity(topic_id, entry_id, 9, n_parity, number, at, 4, 30, data)


def test_the_parts_of_longer_messages_in_a_pdu():
    event = placed(
        5, (), parity(0), Stamp(0, 1, 2), parity(1), parity(0, entry_id=3),
        entries=(fragment(7), MESSAGE, fragment(8), fragment(1, entry_id=2), fragment(0, 2, 9, 15)),
    )  # fmt: skip
    assert parts(event) == {
        (0, 1): [fragment(7), fragment(8), parity(0), parity(1)],
        (0, 2): [fragment(1, entry_id=2)],
        (0, 3): [parity(0, entry_id=3)],
    }


def between(n_lost, before, after):
    """The messages of which `n_lost` PDUs held parts, between others with such parts."""

    def event(number, pieces):
        entries = [each for each in pieces if isinstance(each, Entry)] or [MESSAGE]
        return placed(number, (), *(each for each in pieces if isinstance(each, Parity)),
                      entries=entries)  # fmt: skip

    return inside(event(10, before), event(11 + n_lost, after))


ONE = frozenset({(0, 1)})


@pytest.mark.parametrize(
    ("before", "after", "most"),
    [
        ([fragment(2)], [fragment(5)], 2),
        ([fragment(2)], [fragment(3)], 0),
        ([fragment(1), fragment(2)], [fragment(4), fragment(5)], 1),
        ([fragment(2)], [parity(0)], 6),
        ([fragment(2)], [parity(2)], 8),
        ([fragment(8)], [parity(1)], 1),
        ([fragment(8)], [parity(1), parity(2)], 1),
        ([fragment(8)], [parity(0), parity(1)], 0),
        ([fragment(8)], [parity(1, at=2)], 4),
        ([parity(0)], [parity(2)], 1),
        ([parity(2)], [parity(0, at=2)], 0),
        ([parity(0)], [parity(0, at=2)], 2),
        ([parity(0)], [parity(1, at=4)], 6),
        ([parity(0)], [parity(1, at=4), parity(2, at=4)], 3),
        ([parity(0, data=b"")], [parity(1, at=1)], 3),
        ([parity(0)], [fragment(3)], 0),
        ([fragment(2), parity(1)], [parity(2)], 0),
    ],
)
def test_whether_all_lost_pdus_held_parts_of_a_message(before, after, most):
    for n_lost in range(most + 3):
        assert between(n_lost, before, after) == (ONE if n_lost <= most else frozenset()), n_lost


def test_a_message_must_have_parts_before_and_after():
    other = fragment(5, entry_id=2)
    assert between(1, [fragment(2)], [other]) == frozenset()
    assert between(1, [fragment(2), fragment(3, entry_id=2)], [fragment(4), other]) == {
        (0, 1), (0, 2),
    }  # fmt: skip
