"""Large messages are joined from their parts; what is given up has a name, and memory a bound."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sdrlinkd.wire import (
    PARTS,
    Entry,
    Lost,
    Parity,
    Part,
    Reassembly,
    ReassemblyLimits,
    build_part,
    parse_part,
)
from tests.laws import law

SRC, TOPIC = 7, 3
NO_ENTRY = -1
LOST, SUPERSEDED = "rx_part_lost", "rx_partial_superseded"


def make(**limits):
    return Reassembly(ReassemblyLimits(**limits))


def take(reassembly, part, entry_id, now=0.0, src=SRC, later_s=0.0):
    """A part comes in two fragments, `later_s` apart; what that completes."""
    octets = build_part(part)
    halves = Entry(PARTS, entry_id, 0, 2, octets[:3]), Entry(PARTS, entry_id, 1, 2, octets[3:])
    assert reassembly.add(src, halves[0], now) is None
    whole = reassembly.add(src, halves[1], now + later_s)
    return reassembly.join(src, entry_id, parse_part(whole), now + later_s)


def part(at, n, number=1, topic_id=TOPIC, size=10):
    return Part(topic_id, number, at, n, bytes([at]) * size)


@law(60)
@given(st.integers(1, 5).flatmap(lambda n: st.permutations(range(n))), st.data())
def test_parts_in_any_order_with_copies_are_one_message(order, data):
    reassembly, n = make(), len(order)
    for came, at in enumerate(order, 1):
        joined = take(reassembly, part(at, n), 100 + at, 0.01 * came, later_s=0.005)
        assert (joined is None) == (came < n)
        if joined is None:
            assert (reassembly.started, reassembly.held) == (1, 1)
            before = reassembly.held_bytes
            again = data.draw(st.sampled_from(order[:came]))
            assert take(reassembly, part(again, n), 200 + again, 0.01 * came) is None
            assert reassembly.held_bytes == before, "a copy takes no room"
    assert joined[:2] == (TOPIC, b"".join(bytes([at]) * 10 for at in range(n)))
    assert joined.number == 1
    assert joined.entry_id in (100 + n - 1, 200 + n - 1), "that of a copy does as well"
    assert reassembly.began_at == pytest.approx(0.01), "the first fragment of all"
    assert (reassembly.started, reassembly.held, reassembly.held_bytes) == (1, 0, 0)
    assert reassembly.take_lost() == []


def test_a_part_of_one_fragment_does_not_count_as_a_message():
    reassembly = make()
    octets = build_part(part(0, 2))
    assert reassembly.add(SRC, Entry(PARTS, 5, 0, 1, octets), 1.0) == octets
    assert (reassembly.started, reassembly.held, reassembly.began_at) == (0, 0, 1.0)
    assert reassembly.join(SRC, 5, part(0, 2), 1.0) is None
    assert (reassembly.started, reassembly.held) == (1, 1)


def test_another_count_of_parts_is_another_message():
    reassembly = make()
    take(reassembly, part(0, 3), 40)
    take(reassembly, part(0, 2), 41)
    assert reassembly.take_lost() == [Lost(SRC, TOPIC, (PARTS, NO_ENTRY), SUPERSEDED)]
    take(reassembly, part(2, 3), 42)
    assert reassembly.take_lost() == [Lost(SRC, TOPIC, (PARTS, NO_ENTRY), SUPERSEDED)]
    take(reassembly, part(0, 2), 43)
    assert reassembly.take_lost() == [Lost(SRC, TOPIC, (PARTS, 42), SUPERSEDED)]
    assert (reassembly.started, reassembly.held) == (4, 1)
    assert take(reassembly, part(1, 2), 44).entry_id == 44
    assert (reassembly.held, reassembly.held_bytes) == (0, 0)


def test_a_message_waits_for_its_parts_as_long_as_any_part_comes():
    reassembly = make(timeout_s=1.0)
    take(reassembly, part(1, 2), 50, 0.0)
    for at in (0.9, 1.8, 2.7):
        reassembly.add(SRC, Entry(PARTS, 60, int(at), 9, b"x"), at)
        reassembly.expire(at)
        assert reassembly.take_lost() == []
    reassembly.expire(3.69)
    assert reassembly.held == 1
    reassembly.expire(3.7)
    lost = reassembly.take_lost()
    assert lost == [Lost(SRC, PARTS, (PARTS, 60), LOST), Lost(SRC, TOPIC, (PARTS, 50), LOST)]
    assert (reassembly.held, reassembly.held_bytes) == (0, 0)


@pytest.mark.parametrize("overtaken", [True, False])
def test_a_message_that_a_later_one_of_its_topic_overtakes_waits_four_timeouts(overtaken):
    reassembly = make(timeout_s=1.0)
    take(reassembly, part(0, 2, number=1), 10, 0.0)
    other = part(0, 99, number=2, topic_id=TOPIC if overtaken else TOPIC + 1)
    for step in range(1, 50):
        at = step / 8
        take(reassembly, other._replace(part=step), 10 + step, at)
        reassembly.expire(at)
        is_lost = overtaken and at >= 4.0
        assert reassembly.held == (1 if is_lost else 2), at
    assert reassembly.take_lost() == [Lost(SRC, TOPIC, (PARTS, NO_ENTRY), LOST)] * overtaken
    reassembly.expire(at + 0.99)
    assert reassembly.take_lost() == []
    reassembly.expire(at + 1.0)
    assert len(reassembly.take_lost()) == (1 if overtaken else 2)
    assert (reassembly.held, reassembly.held_bytes) == (0, 0)


def test_what_is_held_is_known_by_its_entry_id_or_that_of_its_last_part():
    reassembly = make()
    assert not reassembly.holds(SRC, TOPIC, 5)
    reassembly.add(SRC, Entry(TOPIC, 5, 0, 2, b"a"), 0.0)
    take(reassembly, part(0, 2), 8)
    take(reassembly, part(1, 3, number=2), 9)
    take(reassembly, part(2, 3, number=2), 10)
    held = [
        (src, topic_id, entry_id)
        for src in (SRC, SRC + 1) for topic_id in (TOPIC, TOPIC + 1, PARTS)
        for entry_id in range(12) if reassembly.holds(src, topic_id, entry_id)
    ]  # fmt: skip
    assert held == [(SRC, TOPIC, 5), (SRC, PARTS, 10)]


def test_all_of_a_source_is_forgotten_and_nothing_of_others():
    reassembly = make()
    for src in (SRC, SRC + 1):
        reassembly.add(src, Entry(TOPIC, 5, 0, 2, b"a"), 0.0)
        reassembly.add(src, Entry(PARTS, 6, 0, 2, b"a"), 0.0)
        take(reassembly, part(1, 2), 8, src=src)
    half = reassembly.held_bytes // 2
    reassembly.forget(SRC)
    assert reassembly.take_lost() == [
        Lost(SRC, TOPIC, (TOPIC, 5), SUPERSEDED),
        Lost(SRC, PARTS, (PARTS, 6), LOST),
        Lost(SRC, TOPIC, (PARTS, 8), SUPERSEDED),
    ]
    assert (reassembly.started, reassembly.held, reassembly.held_bytes) == (4, 2, half)
    reassembly.forget(SRC)
    reassembly.forget(99)
    assert reassembly.take_lost() == []
    assert reassembly.add(SRC + 1, Entry(TOPIC, 5, 1, 2, b"b"), 0.0) == b"ab"


@pytest.mark.parametrize("large_first", [True, False])
def test_what_is_silent_for_longest_goes_first_whether_large_or_not(large_first):
    size = 3000
    reassembly = make(source_bytes=8000)
    times = (0.0, 0.1) if large_first else (0.1, 0.0)
    for at in sorted(times):
        if at == times[0]:
            take(reassembly, part(0, 2, size=size), 8, at)
        else:
            reassembly.add(SRC, Entry(TOPIC, 5, 0, 2, bytes(size)), at)
    assert reassembly.held == 2
    reassembly.add(SRC, Entry(TOPIC, 6, 0, 2, bytes(size)), 0.2)
    stamped = (PARTS, NO_ENTRY) if large_first else (TOPIC, 5)
    assert reassembly.take_lost() == [Lost(SRC, TOPIC, stamped, "rx_partial_evicted")]
    assert 0 < reassembly.held_bytes <= 8000
    assert reassembly.held == 2


def test_a_part_counts_as_its_octets_and_some_more():
    reassembly = make()
    take(reassembly, part(0, 3, size=10), 8)
    small = reassembly.held_bytes
    take(reassembly, part(1, 3, size=10), 9)
    each = reassembly.held_bytes - small
    take(reassembly, part(0, 3, number=2, size=1010), 10)
    assert reassembly.held_bytes - 2 * small - each == 1000
    assert 10 < each < small
    for room in (0, -1):
        # A part needs room for its fragments, too, before it is joined.
        tight = make(source_bytes=2 * small + each + 1000 + room)
        take(tight, part(0, 3, size=10), 8, 0.0)
        take(tight, part(0, 3, number=2, size=1010), 10, 0.1)
        assert tight.join(SRC, 9, part(1, 3, size=10), 0.3) is None
        lost = Lost(SRC, TOPIC, (PARTS, NO_ENTRY), "rx_partial_evicted")
        assert tight.take_lost() == ([] if room == 0 else [lost])


def test_a_message_names_the_first_and_the_last_pdu_that_had_something_of_it():
    reassembly = make()
    assert reassembly.add(SRC, Entry(TOPIC, 1, 0, 1, b"a"), 0.0, 70) == b"a"
    assert reassembly.pdus == (70, 70)
    reassembly.add(SRC, Entry(TOPIC, 2, 0, 3, b"a"), 0.0, 12)
    reassembly.add(SRC, Entry(TOPIC, 2, 2, 3, b"c"), 0.1, 10)
    reassembly.hold(SRC, Parity(TOPIC, 2, 3, 1, 0, 0, 1, 3, b"x"), 0.2, 15)
    assert reassembly.add(SRC, Entry(TOPIC, 2, 1, 3, b"b"), 0.3, 13) == b"abc"
    assert (reassembly.pdus, reassembly.began_at) == ((10, 15), 0.0)
