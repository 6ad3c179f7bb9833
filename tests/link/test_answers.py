"""What is sent again: kept for a second, asked for or not, within a share of the air."""

from math import inf
from random import Random

import pytest

from sdrlinkd.link import Qos
from sdrlinkd.link.packing import TopicEntryIds
from sdrlinkd.link.queue import Outgoing, TxTally
from sdrlinkd.link.repeat import Answers, RepeatGroup, RepeatParams
from sdrlinkd.link.repeat.testing import KeptPdus
from sdrlinkd.wire import (
    PARTS,
    Entry,
    Frame,
    Parity,
    Pdu,
    PduBuilder,
    Repeat,
    Stamp,
    build,
    build_records,
    needs,
)

FREE = 0.5
"""A share of the air that the few PDUs here do not use up."""


def outgoing(topic_id=0, expires_at=inf, *, payload=b"data", **more):
    return Outgoing(
        topic_id, payload, Qos.DEFAULT, 64, 255, 0.0, expires_at, False, TxTally(), **more
    )


def pdu(number, *records, src=1, dst=255, hop=1, entries=()):
    builder = PduBuilder(140)
    for entry in entries or [Entry(0, 1, 0, 1, b"abcd")]:
        builder.add(*entry)
    for record in records:
        assert builder.add_record(build_records([record]))
    return builder.build(0, src, dst, number & 0xFF, hop)


def relayed(number, src=9, *, at=0.0, told=True, **more):
    """The message for another robot's PDU."""
    return Outgoing(
        512 + src, pdu(number, src=src), Qos.DEFAULT, 64, 255, at, inf, False, TxTally(),
        is_whole=True, pdu_number=number if told else None, **more,
    )  # fmt: skip


def make(share=FREE, **more):
    params = {"has_control": True, "has_numbers": True, "is_sealed": False, **more}
    return Answers(RepeatParams(share=share), 1, TopicEntryIds(Random(1), 0.6), **params)


def send(
    answers, *numbers, at=0.0, qos=Qos.DEFAULT, mcs=3, message=None, dst=255, hop=1, octets=None,
    **more,
):  # fmt: skip
    message = message or outgoing()
    pdus = [octets or pdu(number, dst=dst, hop=hop) for number in numbers]
    n = len(numbers)
    answers.sent(numbers, pdus, (), [[message]] * n, [qos] * n, mcs, at, **more)
    return message


def ask(answers, *numbers, asker=2, at=0.01, n_others=1, src=1, is_asked=True):
    for need in needs(src, sorted(numbers)):
        answers.needed(asker, need, at, n_others, is_asked=is_asked)


def due(answers, at=0.02, next_number=100):
    return [each.kept.number for each in answers.due(at, next_number)]


def counts(answers):
    report = answers.report()
    return report.asked_of_us, report.unknown, report.expired, report.refused


def repeat(answers, at=0.02, airtime_s=0.001, most=9, next_number=100):
    group = answers.group(answers.due(at, next_number), at, most)
    answers.took(group, at, airtime_s)
    return group


def test_what_is_asked_for_is_sent_again_once_and_counted():
    answers = make()
    message = send(answers, 10, 11, 12)
    assert (answers.due_at(0.0), due(answers)) == (inf, [])
    ask(answers, 12, 10, asker=2)
    ask(answers, 10, asker=3)
    assert (answers.due_at(0.005), answers.due_at(0.015)) == (0.01, 0.015)
    assert due(answers, 0.0099) == []
    assert due(answers, 0.01) == [10, 12]
    group = repeat(answers)
    assert [each.number for each in group.kept] == [10, 12]
    assert group[1:] == (Qos.DEFAULT, 3, False, 0)
    assert answers.wanted == {}
    answers.left(group, 0.001)
    assert message.n_repeats == 2
    report = answers.report()
    assert (report.pdus, report.airtime_s) == (2, 0.001)
    assert counts(answers) == (3, 0, 0, 0)


@pytest.mark.parametrize(
    ("dst", "n_others", "due_at"), [(255, 1, 0.01), (255, 2, 0.02), (2, 5, 0.01)]
)
def test_what_is_for_all_waits_a_moment_for_others_who_ask(dst, n_others, due_at):
    answers = make()
    send(answers, 10, dst=dst)
    ask(answers, 10, n_others=n_others)
    assert answers.due_at(0.0) == due_at
    ask(answers, 10, asker=3, at=0.015, n_others=n_others)
    assert answers.due_at(0.0) == due_at


def test_questions_that_cannot_be_answered_are_counted_by_reason():
    answers = make()
    send(answers, 10, dst=3)
    send(answers, 11, dst=3, hop=2)
    send(answers, 12, message=outgoing(expires_at=0.01))
    ask(answers, 9)
    assert counts(answers) == (1, 1, 0, 0)
    ask(answers, 10)
    assert counts(answers) == (2, 2, 0, 0), "it is for another robot"
    ask(answers, 11)
    assert counts(answers) == (3, 2, 0, 0), "a relay may need it"
    ask(answers, 12, at=0.0099)
    assert (counts(answers), len(answers.wanted)) == ((4, 2, 0, 0), 2)
    ask(answers, 12, at=0.01)
    assert counts(answers) == (5, 2, 1, 0)
    ask(answers, 8, 10, is_asked=False)
    ask(answers, 12, is_asked=False)
    assert counts(answers) == (5, 2, 2, 0), "nobody has asked"
    off = make(share=0.0)
    send(off, 10)
    ask(off, 10)
    assert (off.is_on, off.wanted, counts(off)) == (False, {}, (0, 0, 0, 0))
    assert not make(has_control=False).is_on


def test_one_robot_takes_a_part_of_the_places_only():
    answers = make(is_sealed=True)
    numbers = range(10, 210)
    send(answers, *numbers)
    ask(answers, *numbers, asker=2)
    assert counts(answers) == (200, 0, 0, 72)
    ask(answers, *numbers, asker=2)
    assert counts(answers) == (400, 0, 0, 144), "those that wait do so already"
    ask(answers, *numbers, asker=3)
    assert len(answers.wanted) == 128
    ask(answers, *numbers[-72:], asker=4)
    assert (len(answers.wanted), counts(answers)) == (200, (672, 0, 0, 216))
    for asker in range(5, 15):
        numbers = range(100 * asker, 100 * asker + 100)
        send(answers, *numbers)
        ask(answers, *numbers, asker=asker)
    assert len(answers.wanted) == 1024


@pytest.mark.parametrize(("ahead", "is_stale"), [(128, False), (129, True)])
def test_what_is_far_behind_could_be_taken_for_a_new_one_unless_it_is_sealed(ahead, is_stale):
    for answers, is_left in ((make(), not is_stale), (make(is_sealed=True), True)):
        send(answers, 10)
        ask(answers, 10)
        assert (due(answers, next_number=10 + ahead) == [10]) == is_left
        assert counts(answers) == (1, int(not is_left), 0, 0)
        assert bool(answers.wanted) == is_left
        # The same where it has not been asked for yet.
        send(answers, 10 + ahead - 1)
        answers.wanted.clear()
        ask(answers, 10)
        assert bool(answers.wanted) == is_left


@pytest.mark.parametrize(("ahead", "is_stale"), [(150, False), (151, True)])
def test_of_a_relayed_pdu_too(ahead, is_stale):
    answers = make()
    send(answers, 0, message=relayed(7000))
    send(answers, 0, message=relayed(7000 + ahead))
    send(answers, 0, message=relayed(6990))
    send(answers, 0, message=relayed(9000, src=8))
    send(answers, 0, message=relayed(8000, told=False))
    ask(answers, 7000, src=9)
    assert bool(answers.wanted) != is_stale
    group = answers.group(answers.due(0.02, 0), 0.02, 9)
    assert (group.is_relayed if group else is_stale) is True
    ask(answers, 8000, src=9)
    assert counts(answers)[1] == 1 + is_stale, "its number is not known"


def test_what_is_too_old_or_has_expired_is_not_sent_again():
    answers = make()
    send(answers, 10)
    send(answers, 11, message=outgoing(expires_at=0.5))
    ask(answers, 10, 11)
    assert due(answers, 0.49) == [10, 11]
    assert (due(answers, 0.5), counts(answers)) == ([10], (2, 0, 1, 0))
    assert due(answers, 0.8) == [10]
    assert (due(answers, 0.801), counts(answers)) == ([], (2, 1, 1, 0))
    send(answers, 12, at=1.0)
    ask(answers, 10, at=1.0)
    assert counts(answers) == (3, 1, 1, 0), "kept for a second, and wanted again"
    answers.expire(1.001)
    ask(answers, 10, 12, at=1.002)
    assert counts(answers) == (5, 2, 1, 0)


def test_of_several_classes_and_rates_the_most_urgent_comes_alone():
    answers = make()
    for number, qos, mcs in (
        (10, Qos.BULK, 3), (11, Qos.URGENT, 3), (12, Qos.URGENT, 2), (13, Qos.URGENT, 3),
    ):  # fmt: skip
        send(answers, number, qos=qos, mcs=mcs)
    ask(answers, 10, 11, 12, 13)
    assert due(answers) == [11, 12, 13]
    answers.set_slower([0, 0, 0, 2])
    group = repeat(answers)
    assert ([each.number for each in group.kept], group.qos, group.mcs) == (
        [11, 13], Qos.URGENT, 2,
    )  # fmt: skip
    group = repeat(answers)
    assert ([each.number for each in group.kept], group.mcs) == ([12], 0)
    answers.set_slower([0, 0])
    assert repeat(answers).mcs == 3, "no slower one is known"
    assert answers.group(answers.due(0.02, 0), 0.02, 9) is None


def test_what_is_on_its_way_is_not_wanted_until_it_is_over():
    answers = make()
    send(answers, 10)
    ask(answers, 10)
    repeat(answers, 0.02, 0.004)
    ask(answers, 10, at=0.024)
    assert answers.wanted == {}
    ask(answers, 10, at=0.0241)
    assert due(answers, 0.03) == [10]


def test_a_burst_that_did_not_leave_costs_nothing_and_waits_again():
    answers = make(share=0.05)
    send(answers, 10, 11)
    ask(answers, 10)
    group = repeat(answers, 0.02, 0.105)
    first_free_at = 0.02 + 0.005 / 0.05
    ask(answers, 11, at=0.03)
    assert answers.due_at(0.03) == pytest.approx(first_free_at)
    assert due(answers, first_free_at - 1e-3) == []
    assert due(answers, first_free_at + 1e-3) == [11]
    answers.not_left(group, 0.03)
    assert answers.due_at(0.03) == 0.03
    assert due(answers, 0.04) == [11, 10]
    answers.not_left(group, 0.03)
    assert len(answers.wanted) == 2
    group = repeat(answers, 0.05, 0.02)
    answers.left(group, 0.02)
    answers.not_left(group, 0.06)
    assert answers.wanted == {}, "its outcome is known"


def test_what_others_repeat_uses_up_the_share_but_no_more_than_can_be_saved():
    for n, busy_s in ((1, 0.0), (10, 0.2), (200, 2.0)):
        answers = make(share=0.05)
        send(answers, 10)
        answers.others_repeat(Repeat(3, 1, 0, n), 0.01, 0.0)
        ask(answers, 10)
        assert answers.due_at(0.0) == pytest.approx(max(0.01, busy_s))


@pytest.mark.parametrize(
    ("qos", "lifespan_s", "has_control", "is_twice"),
    [
        (Qos.URGENT, 0.099, True, True),
        (Qos.URGENT, 0.1, True, False),
        (Qos.LATENCY, 0.05, True, False),
        (Qos.URGENT, 0.05, False, False),
    ],
)
def test_short_lived_messages_of_some_classes_are_sent_twice_unasked(
    qos, lifespan_s, has_control, is_twice
):
    """They wait for no share of the air, nor does their second time count as such."""
    answers = make(share=0.0, twice=[Qos.URGENT], has_control=has_control)
    send(answers, 10, qos=qos, message=outgoing(expires_at=lifespan_s))
    assert bool(answers.wanted) == is_twice
    if is_twice:
        assert answers.due_at(0.0) == 0.005
        assert (due(answers, 0.0049), due(answers, 0.005)) == ([], [10])
        repeat(answers, 0.005, 10.0)
        send(answers, 11, qos=qos, message=outgoing(expires_at=lifespan_s))
        assert due(answers, 0.005) == [11]


def test_where_both_wait_the_time_is_that_of_the_first_that_may():
    answers = make(share=0.05, twice=[Qos.URGENT])
    send(answers, 10)
    answers.others_repeat(Repeat(3, 1, 0, 14), 0.01, 0.0)
    ask(answers, 10, at=0.001)
    busy_until = 0.05 / 0.05
    assert answers.due_at(0.0) == pytest.approx(busy_until)
    send(answers, 11, qos=Qos.URGENT, message=outgoing(expires_at=0.05))
    assert answers.due_at(0.0) == 0.005
    assert due(answers, 0.006) == [11]


def test_the_robot_that_got_least_comes_first():
    answers = make()
    send(answers, *range(10, 20))
    ask(answers, 10, asker=2)
    repeat(answers, airtime_s=0.002)
    ask(answers, 11, asker=3)
    ask(answers, 11, asker=4)
    repeat(answers, airtime_s=0.002)
    ask(answers, 12, 15, asker=2)
    ask(answers, 13, asker=3)
    ask(answers, 14, asker=2)
    ask(answers, 14, asker=4)
    assert [each.number for each in repeat(answers, most=9).kept] == [13, 14, 12, 15]
    ask(answers, 16, asker=9)
    ask(answers, 17, asker=3)
    assert [each.number for each in repeat(answers, most=1).kept] == [16]
    assert list(answers.wanted) == [(1, 17)]


def test_what_nobody_asked_for_comes_as_for_one_that_got_nothing():
    answers = make(twice=[Qos.DEFAULT])
    send(answers, 9, 10, 12)
    send(answers, 11, message=outgoing(expires_at=0.05))
    ask(answers, 10, asker=2)
    repeat(answers, most=1)
    ask(answers, 9, asker=2)
    ask(answers, 12, asker=3)
    assert [each.number for each in repeat(answers).kept] == [11, 12, 9]


def test_what_was_repeated_for_a_robot_fades():
    answers = make()
    send(answers, *range(10, 20))
    ask(answers, 10, asker=2)
    repeat(answers, airtime_s=0.002)
    for _ in range(69):
        answers.expire(0.02)
    ask(answers, 11, asker=3)
    repeat(answers, airtime_s=0.001)
    ask(answers, 12, asker=3)
    ask(answers, 13, asker=2)
    assert [each.number for each in repeat(answers).kept] == [13, 12], "half of 2 ms is less"


def test_what_was_announced_comes_first_and_alone_and_is_announced_twice_at_most():
    answers = make()
    send(answers, 10, 11, 12)
    ask(answers, 10, 11, 12)
    group = answers.group(answers.due(0.02, 100), 0.02, 9)
    chosen = group._replace(kept=group.kept[1:])
    answers.announced(chosen, 0.02, 0.001)
    again = answers.group(answers.due(0.03, 100), 0.03, 9)
    assert ([each.number for each in again.kept], again.announced) == ([11, 12], 2)
    assert answers.group(answers.due(0.03, 100), 0.03, 1).announced == 1
    later = answers.group(answers.due(0.471, 100), 0.471, 9)
    assert (len(later.kept), later.announced) == (3, 0), "it does not count any more"
    answers.announced(chosen, 0.48, 0.001)
    assert len(answers.wanted) == 3
    answers.announced(chosen, 0.49, 0.001)
    assert list(answers.wanted) == [(1, 10)]


def test_an_announcement_takes_air():
    answers = make(share=0.05)
    send(answers, 10)
    ask(answers, 10)
    answers.announced(answers.group(answers.due(0.02, 100), 0.02, 9), 0.02, 0.11)
    assert answers.due_at(0.02) == pytest.approx(0.02 + 0.01 / 0.05)


def test_what_another_robot_repeats_or_a_restarted_one_had_sent_is_not_wanted():
    answers = make()
    send(answers, 10)
    for number in (500, 501):
        send(answers, 0, message=relayed(number))
    ask(answers, 10)
    ask(answers, 500, 501, src=9)
    answers.heard(9, 500)
    answers.heard(9, 499)
    assert list(answers.wanted) == [(1, 10), (9, 501)]
    answers.restarted(9)
    assert list(answers.wanted) == [(1, 10)]
    ask(answers, 501, src=9)
    assert counts(answers) == (4, 1, 0, 0)
    send(answers, 0, message=relayed(20))
    ask(answers, 20, src=9)
    assert (9, 20) in answers.wanted, "it counts anew"
    answers.restart()
    assert answers.wanted == {}
    ask(answers, 10)
    assert counts(answers)[:2] == (6, 2)


def test_only_what_holds_messages_and_stays_true_is_kept():
    def is_kept(answers, number=10):
        before = counts(answers)[1]
        ask(answers, number)
        return counts(answers)[1] == before

    answers = make()
    answers.sent((10,), (pdu(10),), (), [[]], [Qos.DEFAULT], 3, 0.0)
    assert not is_kept(answers)
    send(answers, 10, message=outgoing(is_bare=True))
    assert not is_kept(answers)
    for record, lasts in ((Frame(1, 0, 2, 3), False), (Stamp(0, 1, 5), True)):
        for is_postponed in (True, False):
            answers = make()
            send(answers, 10, octets=pdu(10, record), is_postponed=is_postponed)
            assert is_kept(answers) == (lasts or not is_postponed)
    sealed = bytes([pdu(10)[0] | 1]) + pdu(10, Frame(1, 0, 2, 3))[1:]
    answers = make()
    send(answers, 10, octets=sealed, is_postponed=True)
    assert is_kept(answers)


def cut(message, entry_id=5, total=2):
    message.cut(entry_id, 10, total, 0.0)
    return message


def test_nothing_is_repeated_under_an_entry_id_that_was_taken_again():
    entry_ids = TopicEntryIds(Random(1), 0.6)
    kept_pdus = KeptPdus(entry_ids, has_numbers=True)
    entries = [
        Entry(0, 5, 0, 2, b"ab"), Entry(0, 6, 0, 1, b"cd"), Entry(PARTS, 7, 0, 1, b"ef"),
        Entry(20, 8, 1, 2, b"gh"),
    ]  # fmt: skip
    records = (
        Stamp(0, 6, 1), Stamp(2, 9, 1), Parity(14, 7, 2, 1, 0, 0, 2, 4, b"xy"), Frame(1, 0, 2, 3),
        Parity(0, 5, 2, 1, 0, 0, 2, 4, b"xy"),
    )  # fmt: skip
    octets = pdu(10, *records, entries=entries)
    kept = kept_pdus.keep(10, octets, octets, 3, Qos.DEFAULT, [outgoing(), cut(outgoing())], 0.0)
    assert [each[:2] for each in kept.fragments] == [
        (0, 5), (PARTS, 7), (20, 8), (2, 9), (PARTS, 7), (0, 5),
    ]  # fmt: skip
    assert kept_pdus.may_repeat(kept)
    whole = kept_pdus.keep(11, octets, octets, 3, Qos.DEFAULT, [outgoing()], 0.0)
    assert whole.fragments == [], "short messages are in one PDU"
    plain = KeptPdus(entry_ids, has_numbers=False)
    found = plain.keep(12, octets, octets, 3, Qos.DEFAULT, [cut(outgoing())], 0.0).fragments
    assert (14, 8) in [each[:2] for each in found]
    while not entry_ids.times_taken(0, 5):
        entry_ids.take(outgoing(), 0.0)
    assert not kept_pdus.may_repeat(kept)
    assert kept_pdus.may_repeat(whole)


def test_a_pdu_whose_entry_id_was_taken_again_is_not_wanted_any_more():
    entry_ids = TopicEntryIds(Random(1), 0.6)
    answers = Answers(
        RepeatParams(share=FREE), 1, entry_ids, has_control=True, has_numbers=True, is_sealed=False
    )
    octets = [pdu(n, entries=[Entry(0, n, 0, 2, b"ab")]) for n in (10, 11)]
    for number in (10, 11):
        message = cut(outgoing(), number)
        send(answers, number, message=message, octets=octets[number - 10])
    ask(answers, 10, 11)
    while not entry_ids.times_taken(0, 10):
        entry_ids.take(outgoing(), 0.0)
    found = [n for n in (10, 11) if not entry_ids.times_taken(0, n)]
    group = answers.group(answers.due(0.02, 100), 0.02, 9)
    assert ([each.number for each in group.kept] if group else []) == found
    assert list(answers.wanted) == [(1, n) for n in found]
    assert counts(answers)[1] == 2 - len(found)


def test_an_entry_id_rests_anew_when_its_fragment_is_repeated():
    entry_ids = TopicEntryIds(Random(1), 0.6)
    kept_pdus = KeptPdus(entry_ids, has_numbers=True)
    messages = [outgoing() for _ in range(256)]
    for message in messages:
        cut(message, entry_ids.take(message, 0.0))
        entry_ids.retire(message, 0.0)
    octets = pdu(10, entries=[Entry(0, messages[0].entry_id, 0, 2, b"ab")])
    kept = kept_pdus.keep(10, octets, octets, 3, Qos.DEFAULT, messages[:1], 0.0)
    kept_pdus.renew_ids(kept, 0.5)
    free = [entry_ids.take(outgoing(), 0.7) for _ in range(256)]
    assert set(range(256)) - set(free) == {messages[0].entry_id}


def test_memory_for_what_is_kept_has_a_bound():
    kept_pdus = KeptPdus(TopicEntryIds(Random(1), 0.6), has_numbers=True)
    octets = build(Pdu(0, False, 1, 255, 0, 1, [Entry(0, 1, 0, 1, bytes(2034))]), 2047)
    fit = (1 << 20) // 2047
    for number in range(fit + 5):
        kept_pdus.keep(number, octets, octets, 3, Qos.DEFAULT, [outgoing()], 0.1)
        kept_pdus.keep(number, octets, octets, 3, Qos.DEFAULT, [outgoing()], 0.1)
        kept_pdus.forget(0.1)
    assert [n for n in range(fit + 5) if kept_pdus.find(1, n)] == list(range(5, fit + 5))
    other = relayed(3, at=0.5)
    assert kept_pdus.keep(3, b"", b"", 3, Qos.DEFAULT, [other], 9.0)[2:4] == (other.payload, 0.5)
    kept_pdus.forget_source(1)
    assert kept_pdus.find(1, 10) is None
    assert kept_pdus.find(9, 3).is_relayed
    for number in range(fit - 1):
        kept_pdus.keep(number, octets, octets, 3, Qos.DEFAULT, [outgoing()], 0.75)
    kept_pdus.forget(1.5)
    assert kept_pdus.find(9, 3), "a second old"
    kept_pdus.forget(1.501)
    assert kept_pdus.find(9, 3) is None
    assert kept_pdus.find(1, 0)
    kept_pdus.clear()
    assert kept_pdus.find(1, 0) is None
    kept_pdus.forget(9.0)


def group_of(*numbered):
    """(number, time of sending, when its message expires) of PDUs kept."""
    kept_pdus = KeptPdus(TopicEntryIds(Random(1), 0.6), has_numbers=True)
    kept = [
        kept_pdus.keep(n, pdu(n), pdu(n), 3, Qos.DEFAULT, [outgoing(expires_at=end)], at)
        for n, at, end in numbered
    ]
    return RepeatGroup(kept, Qos.DEFAULT, 3, False)


def test_records_name_runs_of_pdus_that_were_sent_together():
    group = group_of(
        (10, 0.0, 1.0), (11, 0.0, 1.0), (12, 0.1, 1.0), (14, 0.1, 1.0), (15, 0.1, 0.3)
    )  # fmt: skip
    runs = [Repeat(1, 10, 2001, 2), Repeat(1, 12, 1001, 1), Repeat(1, 14, 1001, 2)]
    for room, n, named in ((30, 3, 5), (29, 2, 3), (20, 2, 3), (19, 1, 2), (10, 1, 2), (9, 0, 0)):
        records, told = group.told(0.20005, room)
        assert records == runs[:n]
        assert [each.number for each in told.kept] == [10, 11, 12, 14, 15][:named]
    assert [each.number for each in group.alive(0.3).kept] == [10, 11, 12, 14]
    assert len(group.alive(0.2999).kept) == 5
    shuffled = group._replace(kept=group.kept[::-1])
    assert [each.number for each in shuffled.first(3).kept] == [12, 14, 15]
    (first,), _ = group.told(-1.0, 10)
    assert first.held_100us == 0
    (first,), _ = group.told(99.0, 10)
    assert first.held_100us == 0xFFFF


def test_a_pdu_lives_as_long_as_one_of_its_messages():
    kept_pdus = KeptPdus(TopicEntryIds(Random(1), 0.6), has_numbers=True)
    for lives, end in (((1.0,), 1.0), ((1.0, 3.0, 2.0), 3.0)):
        messages = [outgoing(expires_at=each) for each in lives]
        kept = kept_pdus.keep(10, pdu(10), pdu(10), 3, Qos.DEFAULT, messages, 0.0)
        assert kept.worth_until() == end
