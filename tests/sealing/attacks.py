"""Robots under attack: what is recorded of them, and what counts as taken in."""

import struct
from collections import Counter

from sdrlinkd.link import RelayParams
from sdrlinkd.sealing import SecurityParams
from sdrlinkd.wire import delayed
from tests.sealing.team import KEY, LIFESPAN_S, STEP_S, Robot, Team

LIMIT_S = 0.13
PLAYED_AFTER_S = (0.2, 5.0, 60.0)
RATE_HZ = 20.0
CDR = b"\0\1\0\0"
NUMBERED = struct.Struct(">Id")


class Recorder:
    """Hears all PDUs, keeps some from `victim`, and plays all of them to it later.

    Each is played as it was, and with a `held` that is the true delay.
    """

    def __init__(self, team, victim, chance, share=0.5):
        self.team, self.victim, self.chance, self.share = team, victim, chance, share
        self.played = 0
        team.tamper = self.passes

    def passes(self, receiver, data):
        if receiver != self.victim:
            return True
        for after_s in PLAYED_AFTER_S:
            at = self.team.now + after_s
            self.team.plays_at(at, self.victim, data)
            held = data if not data[0] & 1 else delayed(data, round(1e6 * after_s))
            self.team.plays_at(at, self.victim, held)
            self.played += 2
        return self.chance.random() >= self.share


def command(number, now):
    return CDR + NUMBERED.pack(number, now)


class Commands:
    """Robot 1 commands at RATE_HZ; both ends and the relay restart now and then."""

    def __init__(self, team, chance, restarts):
        self.team, self.chance, self.restarts = team, chance, restarts
        self.sent_at = {}
        self.next_at = 0.0

    def __call__(self, now):
        source = self.team.robots[1]
        if source.is_on and now >= self.next_at:
            self.next_at = now + 1 / RATE_HZ
            number = len(self.sent_at)
            self.sent_at[number] = now
            source.link.submit(0, command(number, now), source.clock(now))
        if self.restarts and self.chance.random() < STEP_S / 20:
            robot = self.chance.choice(list(self.team.robots.values()))
            if robot.is_on:
                robot.stop()
            else:
                robot.start(now)
        for robot in self.team.robots.values():
            if not robot.is_on and self.chance.random() < STEP_S / self.chance.choice((0.5, 10)):
                robot.start(now)


def judge(victim):
    """Counts what an attacker achieved at a robot."""
    found = Counter()
    seen = Counter()
    for heard in victim.heard:
        number, sent_at = NUMBERED.unpack(heard.payload[len(CDR) :])
        age_s = heard.at - sent_at
        seen[heard.src, number] += 1
        found["delivered"] += 1
        found["past its lifespan"] += age_s > LIFESPAN_S + LIMIT_S
        found["too young"] += heard.age_s < age_s - LIMIT_S - STEP_S
        found["at most"] = max(found["at most"], round(1e3 * (age_s - heard.age_s)))
    found["twice"] = sum(n > 1 for n in seen.values())
    return found


def chain(mode="seal"):
    """1 is heard by 2, 2 by 3; 2 relays."""
    params = SecurityParams(mode=mode)
    relay = RelayParams(policy="flood")
    robots = [
        Robot(1, [KEY], params, hop_limit=3, drift=4e-5),
        Robot(2, [KEY], params, relay, hop_limit=3),
        Robot(3, [KEY], params, hop_limit=3, drift=-4e-5),
    ]
    return Team(*robots, hears=lambda a, b: abs(a - b) == 1)


def pair():
    return Team(Robot(1, [KEY], drift=4e-5), Robot(2, [KEY], drift=-4e-5))
