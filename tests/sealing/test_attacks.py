"""A recorder that plays what it hears, or what it kept from others, again and again."""

from random import Random

import pytest

from sdrlinkd.sealing import SecurityParams
from sdrlinkd.wire import TAG_SIZE, Contact, delayed, parse, parse_sealed, read_control_entries
from tests.laws import one_in, trials
from tests.sealing.attacks import CDR, NUMBERED, Commands, Recorder, chain, command, judge, pair
from tests.sealing.team import KEY, Robot, Team


@pytest.mark.slow
@pytest.mark.parametrize("restarts", one_in(2, [True, False]))
@pytest.mark.parametrize(("make", "victim"), [(pair, 2), (chain, 3)])
def test_recordings_gain_nothing(make, victim, restarts):
    chance = Random(7)
    team = make()
    recorder = Recorder(team, victim, chance)
    team.run(trials(200), Commands(team, chance, restarts))
    found = judge(team.robots[victim])
    assert recorder.played > trials(10_000)
    assert found["delivered"] > trials(100)
    for gain in ("twice", "past its lifespan", "too young"):
        assert found[gain] == 0, (gain, found)
    for robot in team.robots.values():
        assert robot.link.audit() == []


@pytest.mark.slow
def test_what_one_life_has_heard_no_other_one_hears_again():
    """A message that the recorder plays within its lifespan, to a robot that has just restarted."""
    team = pair()
    source, victim = team.robots.values()
    for robot in team.robots.values():
        robot.start(0.0)
    team.run(3.0, lambda _: None)
    for number in range(60):
        played_after_s = 0.04 + 0.004 * number
        recorded = []

        def passes(receiver, data, recorded=recorded):
            if receiver == victim.id:
                recorded.append((team.now, data))
            return True

        team.tamper = passes
        sent_at = team.now
        source.link.submit(0, command(number, sent_at), source.clock(sent_at))
        team.run(0.02, lambda _: None)
        assert NUMBERED.unpack(victim.heard[-1].payload[len(CDR) :])[0] == number
        victim.stop()
        victim.start(team.now)
        team.tamper = lambda *_: True
        for at, data in recorded:
            for lie_s in (-0.12, 0.0, 0.12):
                held = delayed(data, max(0, round(1e6 * (played_after_s + lie_s))))
                team.plays_at(at + played_after_s, victim.id, data)
                team.plays_at(at + played_after_s, victim.id, held)
        team.run(2.0, lambda _: None)
    assert judge(victim)["twice"] == 0
    assert judge(victim)["delivered"] == 60


class Delayer:
    """Keeps every PDU from both ends and plays it after `after_s`, from the first one on."""

    def __init__(self, team, after_s, lies):
        self.team, self.after_s, self.lies = team, after_s, lies
        team.tamper = self.passes

    def passes(self, receiver, data):
        held = round(1e6 * self.after_s) if self.lies else 0
        self.team.plays_at(self.team.now + self.after_s, receiver, delayed(data, held))
        return False


@pytest.mark.slow
@pytest.mark.parametrize("lies", [False, True])
@pytest.mark.parametrize("after_s", [0.1, 0.2, 1.0])
@pytest.mark.parametrize(("make", "victim"), [(pair, 2), (chain, 3)])
def test_a_delay_from_the_first_pdu_on_hides_no_age(make, victim, after_s, lies):
    team = make()
    Delayer(team, after_s, lies)
    team.run(20, Commands(team, Random(3), restarts=False))
    found = judge(team.robots[victim])
    assert found["too young"] == found["twice"] == found["past its lifespan"] == 0


def has_contact(data):
    """Whether a PDU in the mode auth holds a CONTACT; everyone can see that."""
    pdu = parse_sealed(data, len(data))
    inner = pdu.inner(lambda _nonce, body, _associated: body[:-TAG_SIZE])
    records = read_control_entries(parse(inner, len(inner), is_intact=True)).records
    return any(isinstance(record, Contact) for record in records)


@pytest.mark.slow
@pytest.mark.parametrize("off_s", [0.0, 1.0, 25.0, 29.0])
def test_a_new_life_does_not_pass_for_the_old_one(off_s):
    """All of it comes so late that its leap in T would not show, and its CONTACTs never come."""
    params = SecurityParams(mode="auth")
    team = Team(Robot(1, [KEY], params), Robot(2, [KEY], params))
    source, victim = team.robots.values()
    team.run(5.0, Commands(team, Random(3), restarts=False))
    newest = source.sealing.memory.at_stop().floors[KEY.fingerprint]
    stopped_at = team.now
    source.stop()
    team.run(off_s)
    before = source.clock(stopped_at)
    source.start(team.now)
    # How far T leaps: from what the source last used to the floor and beyond.
    leap_s = newest / 32 + 30 - before - off_s
    delayer = Delayer(team, leap_s, lies=False)
    team.tamper = lambda receiver, data: not has_contact(data) and delayer.passes(receiver, data)
    team.run(leap_s + 10.0, Commands(team, Random(4), restarts=False))
    found = judge(victim)
    assert found["too young"] == found["past its lifespan"] == 0
