"""One gateway leads for each robot: soon, the best one, and again when it goes."""

from random import Random

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sdrlinkd.fleet import Claim, Election, score
from tests.laws import law

LEASE_S = 1.0
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


def test_what_counts_is_what_is_lost_and_then_the_snr():
    assert score(0.0, None) < score(0.0, 10.0) < score(0.0, 40.0) == score(0.0, 60.0)
    assert score(0.5, 40.0) < score(0.1, 0.0)


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
