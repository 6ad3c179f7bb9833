"""Reassembly: all complete messages and nothing else, in bounded memory, losses by name."""

import tracemalloc
from collections import Counter
from itertools import pairwise, product
from random import Random

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sdrlinkd.wire import PARTS, Entry, Parity, Part, Reassembly, ReassemblyLimits
from tests.laws import law

SEED = 53
SUPERSEDED = "rx_partial_superseded"
TIMEOUT = "rx_partial_timeout"
EVICTED = "rx_partial_evicted"
MEMORY = "rx_partial_memory"


def lost_of(reassembly):
    """What was given up: (source, topic id, reason)."""
    return [(each.src, each.topic_id, each.reason) for each in reassembly.take_lost()]


octet = st.integers(0, 255)


def make(**limits):
    return Reassembly(ReassemblyLimits(**limits))


def fragments(topic_id, entry_id, parts):
    return [Entry(topic_id, entry_id, i, len(parts), part) for i, part in enumerate(parts)]


@st.composite
def arrivals(draw):
    """Messages of several sources, with their fragments shuffled and some duplicated.

    A copy comes before the message is complete; later it would be a fragment of a new one.
    """
    keys = st.tuples(octet, st.integers(0, 15), octet)
    parts = st.lists(st.binary(max_size=6), min_size=1, max_size=6)
    messages = draw(st.dictionaries(keys, parts, min_size=1, max_size=8))
    order = draw(
        st.permutations(
            [
                (src, entry)
                for (src, topic_id, entry_id), parts in messages.items()
                for entry in fragments(topic_id, entry_id, parts)
            ]
        )
    )
    missing = Counter((src, entry.topic_id, entry.entry_id) for src, entry in order)
    seen = {}
    events = []
    for src, entry in order:
        key = (src, entry.topic_id, entry.entry_id)
        events.append((src, entry))
        seen.setdefault(key, []).append(entry)
        missing[key] -= 1
        open_keys = [k for k in seen if missing[k]]
        if open_keys:
            copied = draw(st.lists(st.sampled_from(open_keys), max_size=2))
            events += [(k[0], draw(st.sampled_from(seen[k]))) for k in copied]
    return messages, events


@pytest.mark.slow
@law(300)
@given(arrivals())
def test_any_order_with_copies_yields_exactly_the_messages(case):
    messages, events = case
    reassembly = make()
    got = {}
    for src, entry in events:
        whole = reassembly.add(src, entry, 0.0)
        if whole is not None:
            key = (src, entry.topic_id, entry.entry_id)
            assert key not in got
            got[key] = whole
    assert got == {key: b"".join(parts) for key, parts in messages.items()}
    assert lost_of(reassembly) == []
    assert reassembly.held == reassembly.held_bytes == 0
    assert reassembly.started == len(messages)


class Model:
    """Clause 5.3 in its plainest form, without memory limits."""

    def __init__(self, timeout):
        self.timeout = timeout
        self.held = {}
        self.lost = []

    def add(self, src, entry, now):
        key = (src, entry.topic_id, entry.entry_id)
        if key in self.held:
            total, parts, _ = self.held[key]
            same = parts.get(entry.index, entry.payload) == entry.payload
            if total != entry.total or not same:
                del self.held[key]
                self.lost.append((src, entry.topic_id, SUPERSEDED))
            elif entry.index in parts:
                return None
        _, parts, _ = self.held.setdefault(key, (entry.total, {}, now))
        parts[entry.index] = entry.payload
        self.held[key] = (entry.total, parts, now)
        if len(parts) < entry.total:
            return None
        del self.held[key]
        return b"".join(payload for _, payload in sorted(parts.items()))

    def expire(self, now):
        for key, (_, _, at) in list(self.held.items()):
            if now - at >= self.timeout:
                del self.held[key]
                self.lost.append((key[0], key[1], TIMEOUT))


@st.composite
def few_entries(draw):
    total = draw(st.integers(1, 4))
    index = draw(st.integers(0, total - 1))
    topic_id, entry_id = draw(st.integers(0, 1)), draw(st.integers(0, 1))
    return Entry(topic_id, entry_id, index, total, draw(st.sampled_from([b"", b"a", b"b"])))


# Quarters of a second are exact in binary, so both sides round alike.
steps = st.lists(st.tuples(st.integers(0, 3), st.integers(0, 1), few_entries()), max_size=60)


@pytest.mark.slow
@law(300)
@given(steps)
def test_agrees_with_the_plainest_form(steps):
    reassembly = make(timeout_s=1.0)
    model = Model(1.0)
    now = 100.0
    delivered = 0
    lost = 0
    for quarters, src, entry in steps:
        now += quarters / 4
        reassembly.expire(now)
        model.expire(now)
        whole = reassembly.add(src, entry, now)
        assert whole == model.add(src, entry, now)
        delivered += whole is not None
        given_up = lost_of(reassembly)
        assert sorted(given_up) == sorted(model.lost)
        model.lost.clear()
        lost += len(given_up)
        assert reassembly.held == len(model.held)
        assert reassembly.started == delivered + reassembly.held + lost
    reassembly.expire(now + 1.0)
    assert reassembly.held == reassembly.held_bytes == 0


def test_sources_and_topics_do_not_mix():
    reassembly = make()
    keys = list(product((0, 9), (0, 7), (1, 2)))
    for src, topic_id, entry_id in keys:
        first = Entry(topic_id, entry_id, 0, 2, bytes([src, topic_id, entry_id]))
        assert reassembly.add(src, first, 0.0) is None
    assert reassembly.held == 8
    for src, topic_id, entry_id in keys:
        last = Entry(topic_id, entry_id, 1, 2, b"!")
        assert reassembly.add(src, last, 0.0) == bytes([src, topic_id, entry_id]) + b"!"
    assert lost_of(reassembly) == []


@pytest.mark.parametrize("is_sealed", list(product((True, False), repeat=3)))
def test_a_message_is_sealed_if_all_of_it_was(is_sealed):
    """Its fragments, and its parity, even if no octet of that was needed."""
    reassembly = make()
    sealed_first, sealed_parity, sealed_last = is_sealed
    reassembly.add(1, Entry(3, 7, 0, 2, b"a"), 0.0, 1, is_sealed=sealed_first)
    parity = Parity(3, 7, 2, 1, 0, 0, 1, 2, b"p")
    held = reassembly.hold(1, parity, 0.0, 2, is_sealed=sealed_parity)
    whole = reassembly.add(1, Entry(3, 7, 1, 2, b"b"), 0.0, 3, is_sealed=sealed_last)
    assert whole == b"ab"
    counts = (sealed_first, sealed_last, *([sealed_parity] if held is not None else []))
    assert reassembly.is_sealed == all(counts)
    assert held is not None
    reassembly.add(1, Entry(3, 8, 0, 1, b"c"), 0.0, 4, is_sealed=sealed_last)
    assert reassembly.is_sealed == sealed_last


@pytest.mark.parametrize("is_sealed", [(True, True), (True, False), (False, True)])
def test_a_large_message_is_sealed_if_all_of_its_parts_were(is_sealed):
    reassembly = make()
    for at, sealed in enumerate(is_sealed):
        assert reassembly.add(1, Entry(PARTS, at, 0, 1, b"x"), 0.0, at, is_sealed=sealed) == b"x"
        joined = reassembly.join(1, at, Part(20, 5, at, 2, b"data"), 0.0)
    assert joined.payload == b"datadata"
    assert reassembly.is_sealed == all(is_sealed)


@pytest.mark.parametrize("total", [2, 255])
def test_fragments_need_not_be_alike(total):
    reassembly = make()
    parts = [bytes([i]) * (i % 3) for i in range(total)]
    got = [reassembly.add(1, entry, 0.0) for entry in reversed(fragments(2, 3, parts))]
    assert got == [None] * (total - 1) + [b"".join(parts)]


def test_single_fragment_leaves_nothing_behind():
    reassembly = make()
    assert reassembly.add(1, Entry(0, 5, 0, 1, b""), 0.0) == b""
    assert reassembly.add(1, Entry(0, 5, 0, 1, b"x"), 0.0) == b"x"
    assert (reassembly.started, reassembly.held, reassembly.held_bytes) == (2, 0, 0)


def test_timeout():
    reassembly = make(timeout_s=1.0)
    first, second, _ = fragments(4, 8, [b"a", b"b", b"c"])
    reassembly.add(1, first, 10.0)
    reassembly.add(1, second, 10.5)
    reassembly.expire(11.25)
    assert lost_of(reassembly) == []
    reassembly.expire(11.5)
    assert lost_of(reassembly) == [(1, 4, TIMEOUT)]
    assert lost_of(reassembly) == []
    assert reassembly.held == reassembly.held_bytes == 0


def test_a_copy_does_not_put_off_the_timeout():
    reassembly = make(timeout_s=1.0)
    first, *_ = fragments(4, 8, [b"a", b"b"])
    reassembly.add(1, first, 10.0)
    reassembly.add(1, first, 10.75)
    reassembly.expire(11.0)
    assert lost_of(reassembly) == [(1, 4, TIMEOUT)]


def test_timeouts_of_many_sources():
    reassembly = make(timeout_s=2.0)
    for src in range(8):
        reassembly.add(src, Entry(src, 0, 0, 2, b"a"), float(src))
    for src in range(8):
        reassembly.expire(src + 1.75)
        assert lost_of(reassembly) == []
        reassembly.expire(src + 2.0)
        assert lost_of(reassembly) == [(src, src, TIMEOUT)]


@pytest.mark.parametrize(
    "newer",
    [
        Entry(3, 7, 1, 4, b"b"),
        Entry(3, 7, 0, 4, b"a"),
        Entry(3, 7, 0, 3, b"A"),
        Entry(3, 7, 0, 3, b""),
        Entry(3, 7, 1, 2, b"b"),
    ],
    ids=["total", "total_same_octets", "octets", "no_octets", "fewer"],
)
def test_another_message_under_the_same_id(newer):
    reassembly = make()
    reassembly.add(1, Entry(3, 7, 0, 3, b"a"), 0.0)
    assert reassembly.add(1, newer, 0.5) is None
    assert lost_of(reassembly) == [(1, 3, SUPERSEDED)]
    assert (reassembly.started, reassembly.held) == (2, 1)
    parts = [b"x"] * newer.total
    parts[newer.index] = newer.payload
    got = [
        reassembly.add(1, entry, 0.5)
        for entry in fragments(3, 7, parts)
        if entry.index != newer.index
    ]
    assert got[-1] == b"".join(parts)
    assert reassembly.held_bytes == 0


def test_a_whole_message_under_the_same_id():
    reassembly = make()
    reassembly.add(1, Entry(3, 7, 0, 3, b"a"), 0.0)
    assert reassembly.add(1, Entry(3, 7, 0, 1, b"new"), 0.5) == b"new"
    assert lost_of(reassembly) == [(1, 3, SUPERSEDED)]
    assert (reassembly.started, reassembly.held, reassembly.held_bytes) == (2, 0, 0)


def cost_of(payload_size):
    """Memory cost of one held fragment of a message."""
    reassembly = make()
    reassembly.add(0, Entry(0, 0, 0, 2, bytes(payload_size)), 0.0)
    return reassembly.held_bytes


def test_the_message_silent_for_longest_is_evicted():
    # Room for three messages and one more fragment, but not for four messages.
    reassembly = make(source_bytes=4 * cost_of(100) - 1)
    for topic_id in (1, 2, 3):
        reassembly.add(5, Entry(topic_id, 0, 0, 9, bytes(100)), topic_id / 10)
    reassembly.add(5, Entry(1, 0, 1, 9, bytes(100)), 0.4)
    assert lost_of(reassembly) == []
    reassembly.add(5, Entry(4, 0, 0, 9, bytes(100)), 0.5)
    assert lost_of(reassembly) == [(5, 2, EVICTED)]
    assert reassembly.held == 3


def test_one_source_does_not_evict_another():
    reassembly = make(source_bytes=3 * cost_of(100))
    reassembly.add(1, Entry(0, 0, 0, 2, b"quiet"), 0.0)
    for entry_id in range(100):
        reassembly.add(2, Entry(0, entry_id, 0, 2, bytes(100)), 0.5)
    assert set(lost_of(reassembly)) == {(2, 0, EVICTED)}
    assert reassembly.add(1, Entry(0, 0, 1, 2, b"!"), 0.75) == b"quiet!"


def test_the_source_that_holds_most_pays_for_all():
    reassembly = make(source_bytes=1 << 20, total_bytes=10 * cost_of(100))
    for entry_id in range(6):
        reassembly.add(1, Entry(entry_id, entry_id, 0, 2, bytes(100)), 0.0)
    for src in range(2, 6):
        reassembly.add(src, Entry(9, 0, 0, 2, bytes(100)), 0.25)
    assert lost_of(reassembly) == []
    reassembly.add(6, Entry(9, 0, 0, 2, bytes(100)), 0.5)
    assert lost_of(reassembly) == [(1, 0, MEMORY)]


def test_a_message_too_large_for_the_bound_is_lost_by_name():
    reassembly = make(source_bytes=cost_of(10) - 1)
    assert reassembly.add(1, Entry(2, 0, 0, 2, bytes(10)), 0.0) is None
    assert lost_of(reassembly) == [(1, 2, EVICTED)]
    assert reassembly.held == reassembly.held_bytes == 0


@pytest.mark.slow
@pytest.mark.parametrize("sources", [1, 5, 254])
def test_the_ledger_adds_up_at_every_step(sources):
    rng = Random(SEED)
    bound = {"source_bytes": 20_000, "total_bytes": 60_000}
    reassembly = make(timeout_s=0.5, **bound)
    most = bound["source_bytes"] if sources == 1 else bound["total_bytes"]
    now = 0.0
    delivered = 0
    lost = Counter()
    for step in range(12_000):
        now += rng.choice((0.0, 0.0, 0.001, 0.01))
        if rng.randrange(400) == 0:
            now += 0.25
        if rng.randrange(20) == 0:
            reassembly.expire(now)
        total = rng.choice((1, 2, 2, 2, 3, 8, 255))
        entry = Entry(
            rng.randrange(3), rng.randrange(8), rng.randrange(total), total,
            bytes([rng.randrange(2)]) * rng.choice((0, 1, 40, 2000)),
        )  # fmt: skip
        delivered += reassembly.add(rng.randrange(sources), entry, now) is not None
        lost.update(reason for _, _, reason in lost_of(reassembly))
        where = f"seed {SEED} sources {sources} step {step}"
        assert reassembly.started == delivered + reassembly.held + lost.total(), where
        assert 0 <= reassembly.held_bytes <= most, where
        assert (reassembly.held == 0) == (reassembly.held_bytes == 0), where
    reassembly.expire(now + 0.5)
    lost.update(reason for _, _, reason in lost_of(reassembly))
    assert reassembly.held == reassembly.held_bytes == 0
    assert reassembly.started == delivered + lost.total()
    assert delivered > 1000
    kinds = {SUPERSEDED, TIMEOUT, EVICTED if sources < 254 else MEMORY}
    assert kinds <= set(lost), lost


@pytest.mark.slow
def test_flood_of_partial_messages_stays_bounded():
    reassembly = make()
    limits = ReassemblyLimits()
    lost = Counter()
    highest = 0
    for number in range(100_000):
        src, entry_id, topic_id = number % 254, number // 254 % 256, number // 65_024
        reassembly.add(src, Entry(topic_id, entry_id, 0, 255, bytes(200)), number * 1e-6)
        highest = max(highest, reassembly.held_bytes)
        if number % 1000 == 0:
            lost.update(lost_of(reassembly))
    lost.update(lost_of(reassembly))
    assert limits.total_bytes * 0.99 < highest <= limits.total_bytes
    assert {reason for _, _, reason in lost} == {MEMORY}
    assert reassembly.started == 100_000 == reassembly.held + lost.total()
    per_source = Counter()
    for (src, _, _), count in lost.items():
        per_source[src] += count
    assert all(abs(a - b) <= 2 for a, b in pairwise(per_source[src] for src in range(254)))
    reassembly.expire(2.0)
    assert reassembly.held == reassembly.held_bytes == 0


@pytest.mark.parametrize("payload_size", [0, 1, 200])
@pytest.mark.parametrize("per_message", [1, 40])
def test_memory_is_not_more_than_accounted_for(payload_size, per_message):
    reassembly = make()
    tracemalloc.start()
    try:
        for number in range(2000):
            src, topic_id, entry_id = number % 2, number // 512, number // 2 % 256
            for index in range(per_message if number < 100 else 1):
                payload = bytes([number & 0xFF]) * payload_size
                reassembly.add(src, Entry(topic_id, entry_id, index, 255, payload), 0.0)
        # What other threads of the suite allocate does not count.
        places = [tracemalloc.Filter(True, place) for place in (__file__, "*/sdrlinkd/wire/*")]
        found = tracemalloc.take_snapshot().filter_traces(places).statistics("filename")
    finally:
        tracemalloc.stop()
    used = sum(each.size for each in found)
    assert 0.5 * reassembly.held_bytes < used <= reassembly.held_bytes


PARITY = Parity(3, 7, 3, 2, 0, 0, 10, 25, bytes(10))


@pytest.mark.parametrize(
    "other",
    [
        {"n_parity": 3, "number": 1},
        {"k": 11, "number": 1},
        {"size": 26, "number": 1},
        {"total": 4, "number": 1},
        {"data": bytes(9), "number": 1},
        {"number": 0},
        {"topic_id": 4, "number": 1},
        {"entry_id": 8, "number": 1},
    ],
)
def test_parity_that_does_not_fit_what_is_held_is_not_kept(other):
    """A message would be computed from pieces that do not belong together."""
    reassembly = make()
    reassembly.add(1, Entry(3, 7, 0, 3, bytes(10)), 0.0)
    assert reassembly.hold(1, PARITY, 0.0) is not None
    before = reassembly.held_bytes
    assert reassembly.hold(1, PARITY._replace(**other), 0.5) is None
    assert reassembly.hold(2, PARITY._replace(number=1), 0.5) is None, "of another robot"
    assert reassembly.held_bytes == before
    reassembly.expire(0.9)
    held = reassembly.hold(1, PARITY._replace(number=1), 0.9)
    assert held.parity == {0: {0: PARITY.data, 1: PARITY.data}}
    assert held.shape == (2, 10, 25)


def test_parity_alone_and_parity_of_what_is_silent_is_not_kept():
    reassembly = make(timeout_s=1.0)
    assert reassembly.hold(1, PARITY, 0.0) is None
    reassembly.add(1, Entry(3, 7, 0, 3, bytes(10)), 0.0)
    assert reassembly.hold(1, PARITY, 1.0) is None
    reassembly.expire(1.0)
    assert reassembly.held == reassembly.held_bytes == 0


def test_parity_is_a_sign_of_life_and_takes_as_much_room_as_a_fragment():
    reassembly = make(timeout_s=1.0)
    reassembly.add(1, Entry(3, 7, 0, 9, bytes(10)), 0.0)
    sizes = [reassembly.held_bytes]
    reassembly.add(1, Entry(3, 7, 1, 9, bytes(10)), 0.5)
    sizes.append(reassembly.held_bytes)
    reassembly.hold(1, PARITY._replace(total=9), 0.9)
    sizes.append(reassembly.held_bytes)
    assert sizes[2] - sizes[1] == sizes[1] - sizes[0]
    reassembly.expire(1.8)
    assert reassembly.held == 1
    reassembly.expire(1.9)
    assert reassembly.held == reassembly.held_bytes == 0


def test_no_fragment_joins_a_message_past_its_timeout():
    reassembly = Reassembly(ReassemblyLimits(timeout_s=1.0))
    reassembly.add(1, Entry(1, 1, 0, 2, b"old"), 0.0)
    assert reassembly.add(1, Entry(1, 1, 1, 2, b"new"), 5.0) is None
    assert lost_of(reassembly) == [(1, 1, "rx_partial_timeout")]


def test_expires_at_its_very_moment():
    reassembly = Reassembly(ReassemblyLimits(timeout_s=0.1))
    reassembly.add(1, Entry(1, 1, 0, 2, b"a"), 64.0)
    reassembly.expire(64.0 + 0.1)
    assert reassembly.held == 0


def test_nothing_held_nothing_due():
    reassembly = Reassembly(ReassemblyLimits())
    for entry in (Entry(1, 1, 0, 2, b"a"), Entry(1, 1, 1, 2, b"b")):
        reassembly.add(1, entry, 0.0)
    reassembly.expire(float("inf"))
    assert lost_of(reassembly) == []
