"""transient_local: a late joiner gets the last messages, for little airtime."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sdrlinkd.link import Outcome, Overrides, TopicPolicy
from sdrlinkd.link.queue import Kept, Latched
from sdrlinkd.link.topics import MOST_KEYS
from tests.link.world import compose, compose_at, make_link, topic_of

LATCHED = TopicPolicy(durability="transient_local")
MAP = b"\0\1\0\0map"


def exchange(links, now):
    """All robots send and hear; what each received by (to, from, payload)."""
    got = []
    for link in links:
        while burst := compose(link, now, 8):
            link.confirm(burst, Outcome.SENT, now)
            for pdu in burst.pdus:
                for other in links:
                    if other is not link:
                        got += [(other.own_id, m.src, m.payload) for m in other.hear(pdu, now)]
    for link in links:
        link.handle_timers(now)
    return got


def run(links, begin, steps):
    return [each for i in range(steps) for each in exchange(links, begin + 0.1 * i)]


def team(n, **more):
    links = [make_link(i, pdu_size=220, beacon_s=0.3, seed=i, **more) for i in range(1, n + 1)]
    links[0].set_policies({0: LATCHED})
    return links


def test_a_robot_that_comes_late_gets_the_last_message_and_no_one_else_does():
    one, two, late = team(3)
    one.submit(0, b"\0\1\0\0old", 0.0)
    one.submit(0, MAP, 0.0)
    assert [each[2] for each in run([one, two], 0.0, 10)][:2] == [b"\0\1\0\0old", MAP]
    assert run([one, two, late], 2.0, 10) == [(3, 1, MAP)]
    assert topic_of(one, 0).reoffered == 2  # to 2, whom it had not heard, and to 3
    assert one.audit() == late.audit() == []


def test_a_robot_that_starts_anew_gets_it_again():
    one, two = team(2)
    one.submit(0, MAP, 0.0)
    run([one, two], 0.0, 10)
    again = make_link(2, pdu_size=220, beacon_s=0.3, seed=77)
    assert (2, 1, MAP) in run([one, again], 2.0, 12)


def test_several_who_come_together_are_served_at_once():
    links = team(5)
    links[0].submit(0, MAP, 0.0)
    run(links[:1], 0.0, 5)
    got = run(links, 2.0, 10)
    assert sorted(each[0] for each in got) == [2, 3, 4, 5]
    assert topic_of(links[0], 0).reoffered == 1


def test_a_topic_that_is_volatile_is_not_offered_again():
    one, late = team(2)
    one.set_policies({})
    one.submit(0, MAP, 0.0)
    run([one], 0.0, 5)
    assert run([one, late], 2.0, 10) == []


def test_a_topic_that_was_made_volatile_is_not_offered_again():
    one, late = team(2)
    one.submit(0, MAP, 0.0)
    run([one], 0.0, 5)
    one.set_policies({1: LATCHED})
    assert run([one, late], 2.0, 10) == []


def test_what_is_too_old_is_not_offered():
    one, late = team(2)
    one.set_policies({0: TopicPolicy(durability="transient_local", lifespan_s=1.0)})
    one.submit(0, MAP, 0.0)
    run([one], 0.0, 5)
    assert run([one, late], 2.0, 10) == []


def test_it_takes_two_per_cent_of_the_air_at_most():
    """A robot comes every 300 ms; the map takes a second on the air."""
    one = make_link(1, pdu_size=220, beacon_s=0.0)
    one.set_policies({0: LATCHED})
    compose_at(one, 10_000)
    one.submit(0, bytes(10_000), 0.0)
    for i in range(200):
        now = 0.3 * i
        guest = make_link(2 + i, pdu_size=220, seed=i)
        guest.submit(1, bytes(8), now)
        for pdu in compose(guest, now, 1).pdus:
            one.hear(pdu, now)
        one.handle_timers(now + 0.25)
    assert topic_of(one, 0).reoffered == pytest.approx(1 + 60 * 0.02, abs=0.5)


def latched(link, depth=0, topic_id=0):
    """Let `link` keep the last `depth` messages of each key of a topic."""
    link.set_policies({topic_id: TopicPolicy(durability="transient_local", depth=depth)})


def keyed(link, *messages, topic_id=0):
    """Submit (key, text) messages of a topic."""
    for key, text in messages:
        link.submit(topic_id, b"\0\1\0\0" + text.encode(), 0.0, Overrides(key=key))


def late_gets(links, now=2.0):
    """What the last of `links`, which comes late, receives, in order."""
    run(links[:1], 0.0, 5)
    late = links[-1].own_id
    return [payload[4:].decode() for to, _, payload in run(links, now, 20) if to == late]


@pytest.mark.parametrize(
    ("depth", "sent", "owed"),
    [
        (0, [("a", "1"), ("b", "2"), ("c", "3")], "123"),
        (1, [("a", "1"), ("b", "2"), ("a", "3")], "23"),
        (2, [("a", "1"), ("b", "2"), ("a", "3"), ("a", "4")], "234"),
        (0, [("", "1"), ("", "2"), ("a", "3")], "23"),
    ],
)
def test_a_late_joiner_is_owed_the_last_of_every_producer_in_their_order(depth, sent, owed):
    links = team(2)
    latched(links[0], depth)
    keyed(links[0], *sent)
    assert "".join(late_gets(links)) == owed
    assert links[0].audit() == []


def test_what_is_repeated_for_one_producer_displaces_nothing_of_another():
    """A queue depth of 1 holds for each key, also where messages wait together."""
    one = make_link(1, pdu_size=220)
    latched(one, 1)
    keyed(one, ("a", "1"), ("b", "2"), ("c", "3"), ("b", "4"))
    other = make_link(2, pdu_size=220)
    heard = [m for pdu in compose(one, 0.0, 8).pdus for m in other.hear(pdu, 0.0)]
    assert [each.payload[4:] for each in heard] == [b"1", b"3", b"4"]
    assert topic_of(one, 0).dropped == {"tx_superseded": 1}
    assert one.audit() == []


def test_of_too_many_producers_the_one_silent_for_longest_goes():
    links = team(2)
    latched(links[0])
    keyed(links[0], *((f"k{i}", f"{i} ") for i in range(MOST_KEYS)), ("k0", "0' "), ("new", "new"))
    told = "".join(late_gets(links)).split()
    assert told == [*(str(i) for i in range(2, MOST_KEYS)), "0'", "new"]


@given(
    st.lists(st.tuples(st.sampled_from("abc"), st.integers(0, 9)), max_size=30),
    st.integers(0, 4),
)
def test_any_order_of_any_producers(sent, depth):
    links = team(2)
    latched(links[0], depth)
    keyed(links[0], *((key, f"{key}{number};") for key, number in sent))
    numbered = list(enumerate(sent))
    kept = [
        (at, each)
        for at, each in numbered
        if at in [i for i, other in numbered if other[0] == each[0]][-max(1, depth) :]
    ]
    assert "".join(late_gets(links)) == "".join(f"{key}{number};" for _, (key, number) in kept)
    assert links[0].audit() == []


def test_a_message_that_comes_while_older_ones_are_owed_comes_after_them_too():
    """Whoever is new ends with the newest."""
    links = [make_link(i, pdu_size=220, beacon_s=0.3, seed=i) for i in (1, 2)]
    one, late = links
    latched(one, 3)
    keyed(one, ("", "1"), ("", "2"))
    run([one], 0.0, 5)
    got = []
    for i in range(40):
        got += exchange(links, 2.0 + 0.1 * i)
        if i == 1:
            one.submit(0, b"\0\1\0\0003", 2.15, Overrides())
    heard = [payload[4:] for to, _, payload in got if to == late.own_id]
    assert heard[-3:] == [b"1", b"2", b"3"]


def test_memory_is_bounded_by_dropping_what_is_oldest():
    """First the other keys, the one silent for longest first, then the key's older messages."""
    for most, left in ((1000, "ab1 ba1 ab2 ba2"), (350, "ba1 ba2"), (150, "ba2"), (50, "ba2")):
        latched = Latched(most)
        for text in ("ab1", "ba1", "ab2", "ba2"):
            payload = text.encode().ljust(100)
            latched.keep(0, Kept(payload, 0.0, Overrides(key=text[0])), 4)
        latched.newcomer(2, 0.0)
        assert list(latched.due(0.1, 1e9)) == [], "others may follow"
        offered = [each.kept.payload.strip().decode() for each in latched.due(1.0, 1e9)]
        assert " ".join(offered) == left
