"""When we say our number, and whom we name."""

from math import inf

import pytest

from sdrlinkd.sealing.testing import Contacts, Peers
from sdrlinkd.wire import Contact, Met

NUMBER = bytes(range(8))


def heard(n, at=10.0, lead_s=0.5):
    """Peers 1 to `n`, each heard at `at`; one more without a number."""
    peers = Peers(lambda _src, _kid: 0)
    for src in range(1, n + 1):
        peers.of(src).number = bytes([src]) * 8
        peers.of(src).least.add(lead_s, at)
    peers.of(99).least.add(lead_s, at)
    return peers


def test_a_contact_names_whom_we_have_heard_and_how_far_ahead_we_are():
    contacts = Contacts(NUMBER)
    assert (contacts.due_at, contacts.prefix) == (0.0, NUMBER[:4])
    peers = heard(2)
    assert contacts.record(10.0, 100, peers, 1.01) == Contact(
        NUMBER, (Met(1, b"\1" * 4, 97), Met(2, b"\2" * 4, 97))
    )
    assert contacts.record(69.9, 100, peers, -0.5).met[0].ahead == 0
    assert contacts.record(70.0, 100, peers, -0.5).met == (), "after a minute"


@pytest.mark.parametrize("sign", [1, -1])
def test_a_clock_that_is_too_far_away_is_not_told(sign):
    most_s = ((1 << 31) - 1) / 64
    for over_s, n in ((0.0, 1), (1.0, 0)):
        met = Contacts(NUMBER).record(10.0, 100, heard(1, lead_s=0.0), sign * (most_s + over_s)).met
        assert len(met) == n


@pytest.mark.parametrize(("room", "most"), [(9, 0), (18, 0), (19, 1), (36, 2), (37, 3), (999, 27)])
def test_where_not_all_fit_they_take_turns(room, most):
    contacts, peers = Contacts(NUMBER), heard(30)
    named = [contacts.record(10.0, room, peers, 0.0).met for _ in range(60)]
    assert {len(met) for met in named} == {most}
    in_order = [each.node for met in named for each in met]
    assert in_order == [i % 30 + 1 for i in range(60 * most)]


def periods(contacts, now, n, peers, room=200):
    found = []
    for _ in range(n):
        contacts.record(now, room, peers, 0.0)
        found.append(round(contacts.due_at - now, 9))
        now = contacts.due_at
    return found


def test_it_is_said_less_and_less_often_until_somebody_is_met():
    contacts, peers = Contacts(NUMBER), heard(1)
    usual = [0.4, 0.6, 1.0, 1.8, 3.4, 5.0, 5.0]
    assert periods(contacts, 10.0, 7, peers) == usual
    contacts.met_somebody(20.0)
    assert contacts.due_at == 20.0
    contacts.met_somebody(21.0)
    assert contacts.due_at == 20.0, "no later than it was"
    assert periods(contacts, 21.0, 7, peers) == usual


def test_where_they_take_turns_it_is_said_often_enough_for_a_proof():
    """Each of 20 robots three times in 60 s: one at a time, every second."""
    said = periods(Contacts(NUMBER), 10.0, 6, heard(20), room=19)
    assert said == [0.4, 0.6, 1.0, 1.2, 1.2, 1.2]
    assert periods(Contacts(NUMBER), 10.0, 6, heard(20), room=28)[-1] == 2.2
    assert periods(Contacts(NUMBER), 10.0, 6, heard(0))[-1] == 5.0


def test_it_hurries_once_in_five_seconds_if_it_is_not_due_anyway():
    contacts, peers = Contacts(NUMBER), heard(1)
    periods(contacts, 10.0, 6, peers)
    due_at = contacts.due_at
    contacts.hurry(due_at - 1.0)
    assert contacts.due_at == due_at, "it comes within a second"
    contacts.hurry(due_at - 1.1)
    assert contacts.due_at == due_at - 1.1
    assert periods(contacts, due_at, 6, peers)[0] == 0.4
    again = Contacts(NUMBER)
    again.due_at = inf
    for at, expected in ((1.0, 1.0), (6.0, inf), (6.1, 6.1)):
        again.hurry(at)
        assert again.due_at == expected
        again.due_at = inf
