"""One gateway leads for each robot: soon, the best one, and again when it goes."""

import itertools
from random import Random

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sdrlinkd.fleet import TERMS, Claim, Election, score
from tests.fleet.elections import LEASE_S, SCORES, TICK_S, faulty, heals, term_of
from tests.laws import law

STEP_S = 0.02
DELAY_S = 0.01


class Fleet:
    """Gateways that hear one robot, and each other's claims after DELAY_S."""

    def __init__(self, scores):
        self.now = 0.0
        self.scores = dict(scores)
        self.elections = {gw: Election(gw, LEASE_S, 0.0) for gw in self.scores}
        self.cut = set()
        """Gateways that say and hear nothing."""
        self._in_flight = []
        self.led = []
        """(time, gateways that lead)."""

    def run(self, until):
        while self.now < until:
            self.now += STEP_S
            arrived = [each for each in self._in_flight if each[0] <= self.now]
            self._in_flight = [each for each in self._in_flight if each[0] > self.now]
            for _, src, claim in arrived:
                for gw, election in self.elections.items():
                    if gw != src and not {gw, src} & self.cut:
                        election.claimed(claim, self.now)
            for gw, election in self.elections.items():
                election.hear(self.scores[gw], self.now)
                if (claim := election.poll(self.now)) is not None:
                    self._in_flight.append((self.now + DELAY_S, gw, claim))
            self.led.append((self.now, [g for g, e in self.elections.items() if e.leads]))

    @property
    def leaders(self):
        return [gw for gw in self.led[-1][1] if gw not in self.cut]

    def lead_since(self, at):
        """Time after `at` until exactly one gateway led that is not cut off."""
        for now, leaders in self.led:
            if now > at and len(set(leaders) - self.cut) == 1:
                return now - at
        return None


def test_the_best_one_leads_after_its_time_to_listen():
    fleet = Fleet({7: 0.8, 8: 0.97, 9: 0.5})
    fleet.run(1.0)
    assert fleet.leaders == [8]
    assert fleet.lead_since(0.0) == pytest.approx(0.5, abs=0.1)


def test_a_leader_that_is_cut_off_is_replaced_after_the_lease():
    fleet = Fleet({7: 0.8, 8: 0.97, 9: 0.5})
    fleet.run(2.0)
    fleet.cut.add(8)
    fleet.run(5.0)
    assert fleet.leaders == [7]
    assert fleet.lead_since(2.0) <= LEASE_S + 0.35


def test_a_leader_whose_token_goes_is_replaced_at_once():
    fleet = Fleet({7: 0.8, 8: 0.97})
    fleet.run(2.0)
    fleet.cut.add(8)
    fleet.elections[7].gone(8, fleet.now)
    fleet.run(2.2)
    assert fleet.leaders == [7]


def test_a_leader_that_hears_the_robot_no_longer_says_so():
    fleet = Fleet({7: 0.8, 8: 0.97})
    fleet.run(2.0)
    fleet.scores[8] = None
    fleet.run(2.2)
    assert fleet.leaders == [7]


def test_one_that_is_clearly_better_takes_over_after_a_second():
    fleet = Fleet({7: 0.8, 8: 0.85})
    fleet.run(2.0)
    fleet.scores[7] = 0.93
    fleet.run(5.0)
    assert fleet.leaders == [8]
    fleet.scores[7] = 1.0
    fleet.run(5.9)
    assert fleet.leaders == [8]
    fleet.run(6.3)
    assert fleet.leaders == [7]


@pytest.mark.parametrize("less", [0.01, 0.09])
def test_a_leader_that_hears_less_than_before_goes_on_leading(less):
    """Its own word counts, whatever it said before."""
    fleet = Fleet({7: 0.8, 8: 0.85})
    fleet.run(2.0)
    fleet.scores[8] -= less
    fleet.run(8.0)
    assert {tuple(leaders) for at, leaders in fleet.led if at > 2.0} == {(8,)}
    assert fleet.elections[7].leader == 8


def test_two_that_claim_at_once_agree():
    fleet = Fleet({7: 0.9, 8: 0.9})
    fleet.run(1.0)
    assert fleet.leaders == [7]


@law(100)
@given(st.integers(0, 2**32))
def test_after_any_troubles_exactly_one_leads(seed):
    rng = Random(seed)
    fleet = Fleet({gw: rng.random() for gw in range(1, rng.randint(2, 6))})
    for _ in range(rng.randint(1, 20)):
        fleet.run(fleet.now + rng.uniform(0, 1.5))
        gw = rng.choice(list(fleet.scores))
        fleet.scores[gw] = rng.choice((None, rng.random()))
        fleet.cut = {each for each in fleet.scores if rng.random() < 0.2}
    fleet.cut = set()
    fleet.scores[1] = 0.5
    fleet.run(fleet.now + 4.0)
    for _, leaders in fleet.led[-round(1 / STEP_S) :]:
        assert len(leaders) == 1


@pytest.mark.parametrize(
    ("per", "snr_db", "is_"),
    [
        (0.0, None, 1.0), (0.25, None, 0.75), (0.25, -3.0, 0.75), (0.25, 0.0, 0.75),
        (0.5, 20.0, 0.55), (0.5, 40.0, 0.6), (0.5, 60.0, 0.6), (1.0, 4.0, 0.01),
    ],
)  # fmt: skip
def test_what_counts_is_what_is_lost_and_then_the_snr(per, snr_db, is_):
    assert score(per, snr_db) == pytest.approx(is_)


def seen(elections, now):
    """What tells states apart: times since, and terms after that of the first gateway."""
    base = next(filter(None, map(term_of, elections.values())), 0)
    found = []
    for each in elections.values():
        for name, value in vars(each).items():
            if name == "_leader":
                found.append(value and (value.gw, (value.term - base) % TERMS, value.score))
            elif name == "_term":
                found.append(None if value is None else (value - base) % TERMS)
            elif name.endswith("_at"):
                found.append(None if value is None else round(min(30, (now - value) / TICK_S)))
    return tuple(found)


@pytest.mark.parametrize(
    ("faults", "ticks"),
    [
        (1, 12), pytest.param(2, 7, marks=pytest.mark.slow),
        pytest.param(2, 14, marks=pytest.mark.long), pytest.param(4, 5, marks=pytest.mark.long),
    ],
)  # fmt: skip
def test_in_every_state_that_faults_lead_to_the_election_heals(faults, ticks):
    """All places of up to so many claims lost or forged; every fourth tick, in all orders.

    Each robot has an election of its own, so one robot is enough.
    """
    start = {gw: Election(gw, LEASE_S, 0.0) for gw in SCORES}
    states, known, healed = {seen(start, 0.0): (start, 0)}, set(), 0
    for tick in range(ticks):
        now, after = tick * TICK_S, {}
        for elections, spent in states.values():
            orders = itertools.permutations(SCORES) if tick % 4 == 0 else [tuple(SCORES)]
            for order in orders:
                for more, next_ones in faulty(elections, now, order):
                    if spent + more > faults:
                        continue
                    key = seen(next_ones, now)
                    if key not in after or after[key][1] > spent + more:
                        after[key] = next_ones, spent + more
        states = after
        for key, (elections, _) in states.items():
            if key not in known:
                known.add(key)
                assert heals(elections, now + TICK_S), key
                healed += 1
    assert healed > 100


def led_by(gw, own_score=0.5, term=3, now=0.0, its_score=0.8):
    """Gateway 7's part where `gw` leads."""
    election = Election(7, LEASE_S, now)
    election.claimed(Claim(gw, term, its_score), now)
    election.hear(own_score, now)
    return election


def test_nobody_leads_at_first_and_a_gateway_listens_before_it_claims():
    election = Election(7, LEASE_S, 10.0)
    assert (election.leader, election.leads, election.score) == (None, False, None)
    assert election.poll(20.0) is None, "it does not hear the robot"
    election = Election(7, LEASE_S, 10.0)
    election.hear(0.6, 10.0)
    assert election.score == 0.6
    # 0.5 s to listen, and 0.1 s less a tenth of its score.
    assert election.poll(10.539) is None
    assert election.poll(10.541) == Claim(7, 1, 0.6)
    assert (election.leader, election.leads) == (7, True)
    best = Election(7, LEASE_S, 0.0)
    best.hear(1.1, 0.0)
    assert best.poll(0.499) is None
    assert best.poll(0.5) == Claim(7, 1, 1.1)


def test_a_leader_repeats_its_claim_with_the_score_of_the_moment():
    election = Election(7, LEASE_S, 0.0)
    election.hear(0.5, 0.0)
    first = election.poll(1.0)
    election.hear(0.7, 1.1)
    assert election.poll(1.299) is None
    assert first == Claim(7, 1, 0.5)
    assert election.poll(1.3) == Claim(7, 1, 0.7)
    assert election.leads
    assert election.poll(1.5) is None
    assert election.poll(1.61) == Claim(7, 1, 0.7)
    assert [election.poll(at) is None for at in (1.7, 9.0)] == [True, False]


def test_a_leader_that_hears_nothing_gives_up_once_and_claims_anew_later():
    election = Election(7, LEASE_S, 0.0)
    election.hear(0.5, 0.0)
    election.poll(1.0)
    election.hear(None, 1.1)
    assert election.poll(1.15) == Claim(7, 1, -1.0)
    assert (election.leader, election.leads) == (None, False)
    assert election.poll(1.2) is None
    election.hear(0.5, 1.2)
    assert election.poll(1.199) is None
    assert election.poll(1.201) == Claim(7, 2, 0.5)


@pytest.mark.parametrize(
    ("claim", "leader"),
    [
        (Claim(8, 4, 0.1), 8), (Claim(8, 3, 0.81), 8), (Claim(8, 3, 0.79), 5),
        (Claim(8, 2, 1.0), 5), (Claim(8, 3, 0.8), 5), (Claim(4, 3, 0.8), 4),
        (Claim(5, 1, 0.1), 5), (Claim(7, 9, 1.0), 5), (Claim(8, 9, -1.0), 5),
        (Claim(5, 3, -1.0), None), (Claim(8, 9, -0.99), 8),
    ],
)  # fmt: skip
def test_a_claim_counts_that_beats_the_leaders(claim, leader):
    election = led_by(5)
    election.claimed(claim, 0.1)
    assert election.leader == leader


def test_the_next_term_is_above_all_that_were_claimed():
    election = led_by(5, own_score=0.0)
    election.claimed(Claim(8, 9, -1.0), 0.1)
    election.claimed(Claim(8, 2, 0.1), 0.1)
    election.gone(5, 0.2)
    assert election.poll(0.299) is None
    assert election.poll(0.301) == Claim(7, 10, 0.0)


def test_a_leader_that_says_nothing_is_lost_after_the_lease():
    election = led_by(5, own_score=1.0, now=10.0, its_score=1.0)
    election.claimed(Claim(5, 3, 1.0), 10.5)
    assert election.poll(11.5) is None
    assert election.leader == 5
    # It is vacant from now on.
    assert election.poll(11.51) == Claim(7, 4, 1.0)
    patient = led_by(5, own_score=0.5, now=10.0)
    assert patient.poll(11.01) is None
    assert patient.leader is None
    assert patient.poll(11.059) is None
    assert patient.poll(11.061) == Claim(7, 4, 0.5)
    deaf = led_by(5, own_score=None, now=10.0)
    assert deaf.poll(11.01) is None
    assert deaf.leader is None
    assert deaf.poll(20.0) is None


def test_only_the_leader_can_go_and_never_oneself_by_a_word_of_others():
    election = led_by(5)
    election.gone(8, 0.1)
    assert election.leader == 5
    election.gone(5, 0.1)
    assert election.leader is None
    election.gone(5, 5.0)
    assert election.poll(0.2) == Claim(7, 4, 0.5), "since the first time"
    election.gone(7, 0.3)
    assert election.leads


def test_who_is_better_by_a_margin_for_a_second_takes_over():
    election = led_by(5, own_score=0.95, its_score=0.8)
    for now in (0.5, 0.99):
        election.claimed(Claim(5, 3, 0.8), now)
        election.hear(0.95, now)
        assert election.poll(now) is None
    assert election.poll(1.0) == Claim(7, 4, 0.95)
    assert election.leads
    assert election.poll(1.1) is None
    # Its own claim does not make it better than itself, and lasts until it is beaten.
    election.hear(2.0, 1.2)
    assert election.poll(1.25) is None
    election.claimed(Claim(5, 5, 0.1), 1.26)
    assert (election.leader, election.leads) == (5, False)
    election.hear(0.2, 1.3)
    election.hear(0.21, 1.4)
    election.claimed(Claim(5, 5, 0.1), 2.2)
    assert election.poll(2.39) is None
    assert election.poll(2.4) == Claim(7, 6, 0.21)


def test_a_margin_that_was_lost_for_a_moment_counts_anew():
    election = led_by(5, own_score=0.95, its_score=0.8)
    election.hear(0.9, 0.5)
    election.hear(0.95, 0.6)
    election.claimed(Claim(5, 3, 0.8), 0.9)
    assert election.poll(1.59) is None
    assert election.poll(1.6) == Claim(7, 4, 0.95)
    election = led_by(5, own_score=0.95, its_score=0.8)
    election.gone(5, 0.5)
    election.claimed(Claim(8, 9, 0.8), 0.51)
    election.claimed(Claim(8, 9, 0.8), 0.9)
    assert election.poll(1.2) is None, "it was better than another one"


@law(100)
@given(
    st.lists(st.builds(Claim, st.integers(0, 5), st.integers(0, 9), st.floats(-2, 2)), max_size=20)
)
def test_any_claims_leave_one_answer(claims):
    election = Election(1, LEASE_S, 0.0)
    for number, claim in enumerate(claims):
        election.claimed(claim, 0.01 * number)
        election.poll(0.01 * number)
    assert election.leader is None or election.leader in {claim.gw for claim in claims}
