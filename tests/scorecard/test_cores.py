"""Rows without daemons: parsers, ledgers, sequence numbers, keys."""

import subprocess
import sys
import time
from collections import Counter
from pathlib import Path
from random import Random
from xml.etree import ElementTree

import pytest

from sdrlinkd.config import parse_config
from sdrlinkd.errors import ConfigError
from sdrlinkd.fleet import Election
from sdrlinkd.link import Outcome, Overrides
from sdrlinkd.link.receive import SequenceTrack
from sdrlinkd.wire import Entry, Pdu, build
from tests.fleet.elections import LEASE_S, SCORES, TICK_S, faulty, heals
from tests.fuzz.corpus import CORPUS
from tests.fuzz.mutate import mutate
from tests.fuzz.targets import TARGETS
from tests.link.world import make_link, next_burst, rx
from tests.scorecard.helpers import CDR, own_rss_mib
from tests.sealing.attacks import Commands, Recorder, judge, pair
from tests.sealing.machine import Machine
from tests.sealing.team import KEY, NEXT

pytestmark = pytest.mark.long
ROOT = Path(__file__).parents[2]

OUTCOMES = (Outcome.SENT,) * 4 + (Outcome.LATE, Outcome.LOST)
EVENTS = ("send", "send", "send", "time", "late", "disk", "restart", "anew")


def fuzz(name, lasting, chance):
    seeds = [path.read_bytes() for path in sorted((CORPUS / name).iterdir())]
    n = 0
    for _ in lasting():
        for _ in range(50):
            TARGETS[name](mutate(name, chance.choice(seeds), chance))
        n += 50
    return n


def test_row_5_pdus(lasting, figure):
    n = fuzz("pdu", lasting, Random(5)) + fuzz("link", lasting, Random(5))
    figure(
        5, "changed PDUs, alone and through a link", f"{n}, 0 crashes, all rebuilt octet by octet"
    )


def test_row_6_envelopes(lasting, figure):
    n = fuzz("bus", lasting, Random(6)) + fuzz("config", lasting, Random(6))
    figure(6, "changed envelopes and configurations", f"{n}, 0 crashes")


def test_row_7_incomplete_messages(lasting, figure):
    link, before, now, n = make_link(0, pdu_size=128), own_rss_mib(), 0.0, 0
    chance, sent = Random(7), Counter()
    for _ in lasting():
        now += 1e-3
        src = chance.randrange(1, 255)
        number = sent[src] = sent[src] + 1
        # Only the first fragment arrives, with other content each time.
        entry = Entry(0, number & 0xFF, 0, 9, CDR + chance.randbytes(100))
        link.hear(build(Pdu(0, False, src, 255, number & 0xFF, 1, [entry]), 128), now)
        n += 1
    link.handle_timers(now + 10)
    report, grown = rx(link), own_rss_mib() - before
    assert link.audit() == []
    assert report.held == 0
    assert report.started == sum(report.dropped.values()) + report.delivered == n
    assert grown < 64
    figure(
        7, "messages of 254 sources that never end", f"{n}, all by name, memory {grown:+.0f} MiB"
    )


def test_row_8_the_ledger(lasting, figure):
    link, chance, now, steps = make_link(pdu_size=128), Random(8), 0.0, 0
    for _ in lasting():
        steps += 1
        now += 0.002 * chance.random()
        what = chance.random()
        if what < 0.5:
            life = chance.choice((None, 0.01, 0.5))
            size = chance.choice((0, 40, 2000))
            link.submit(chance.randrange(3), CDR + bytes(size), now, Overrides(lifespan_s=life))
        elif what < 0.9:
            burst = next_burst(link, now)
            if burst is not None:
                link.confirm(burst, chance.choice(OUTCOMES), now)
        else:
            link.handle_timers(now)
        if steps % 500 == 0:
            assert link.audit() == []
    assert link.audit() == []
    figure(8, "random steps of the queue, audited every 500", f"{steps} steps, 0 discrepancies")


def test_row_9_sequence_numbers(lasting, figure):
    chance, track, lost, at, number, n = Random(9), SequenceTrack(), 0, 0.0, 0, 0
    track.heard(0, 0, 0.0, 0)
    pending = 0
    for _ in lasting():
        number, at = number + 1, at + 0.003
        if chance.random() < 0.001:
            number += (gap := chance.randrange(100, 3000))
            pending, at = pending + gap, at + 0.003 * gap
        if chance.random() < 0.2:
            pending += 1
            continue
        lost, pending = lost + pending, 0
        assert track.heard(number & 0xFF, number & 0xFFFF, at, number if number % 7 == 0 else None)
        assert not track.heard(number & 0xFF, number & 0xFFFF, at)
        n += 1
    number += 1
    while number % 7:
        number, pending, at = number + 1, pending + 1, at + 0.003
    lost += pending
    track.heard(number & 0xFF, number & 0xFFFF, at, number)
    assert track.lost == lost
    figure(
        9, "20 % loss, outages of up to 3000 PDUs, copies", f"{n} PDUs, {track.lost} losses counted"
    )


def test_row_14_configurations(lasting, figure):
    chance, n, refused = Random(14), 0, 0
    seeds = [path.read_bytes() for path in sorted((CORPUS / "config").iterdir())]
    for _ in lasting():
        text = mutate("config", chance.choice(seeds), chance).decode("utf-8", "replace")
        n += 1
        try:
            parse_config(text, "robot.toml")
        except ConfigError as problem:
            refused += 1
            told = str(problem)
            assert "\n" not in told.strip()
            assert told.startswith("robot.toml")
    assert refused > n / 20
    figure(14, "changed configurations", f"{n}, of which {refused} refused, in one line each")


def test_row_15_numbers_over_restarts(lasting, figure):
    chance, numbers, restarts = Random(15), 0, 0
    for _ in lasting():
        machine = Machine()
        for _ in range(60):
            kind = chance.choice(EVENTS)
            value = {
                "send": chance.randrange(1, 200), "time": 3 * chance.random(),
                "late": chance.random(), "disk": chance.choice(("works", "full", "power cut")),
                "restart": [KEY, NEXT],
            }.get(kind)  # fmt: skip
            machine.do(kind, value)
            restarts += kind == "restart"
        numbers += len(machine.used)
    figure(15, "restarts with power cuts and full disks", f"{restarts}, {numbers} numbers, 0 twice")


def test_row_21_doors(tmp_path, figure):
    """All of `tests/doors`: each is closed to strangers, and open to its people."""
    told = tmp_path / "doors.xml"
    command = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", f"--junitxml={told}"]
    done = subprocess.run(
        [*command, "tests/doors"], cwd=ROOT, check=False, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stdout[-2000:]
    suite = ElementTree.parse(told).getroot()[0]
    assert suite.get("skipped") == "0"
    figure(21, "strangers at every door", f"{suite.get('tests')} attempts, none came in")


def test_row_22_robots_that_lost_their_disks(lasting, figure):
    """A life lasts for half a day at most; one in three ends with another disk."""
    chance, lives, lost, refused, numbers = Random(22), 0, 0, 0, 0
    for _ in lasting():
        machine = Machine(chance.random())
        for _ in range(200):
            keys = [KEY] if chance.random() < 0.5 else [KEY, NEXT]
            if chance.random() < 1 / 3:
                machine.do("lose", (keys, *(chance.random() < 0.7 for _ in range(3))))
                lost += 1
            else:
                machine.do("restart", keys)
            machine.do("time", 25.0)
            for _ in range(chance.randrange(1, 6)):
                machine.do("send", 20)
                machine.do("time", 10_000 * chance.random() ** 3)
            refused += machine.sealing.is_lost
            lives += 1
        numbers += len(machine.used)
    figure(
        22, "robots that lost their disks",
        f"{lost} of {lives} lives, {refused} of them without clock and company sent nothing, "
        f"{numbers} numbers, 0 twice",
    )  # fmt: skip


def test_row_23_election(lasting, figure):
    """Three gateways; claims are lost and forged without end, and then no more."""
    chance, walks, faults = Random(23), 0, 0
    for _ in lasting():
        elections = {gw: Election(gw, LEASE_S, 0.0) for gw in SCORES}
        now = 0.0
        for _ in range(chance.randrange(1, 40)):
            order = chance.sample(sorted(SCORES), len(SCORES))
            more, elections = chance.choice(list(faulty(elections, now, order)))
            now, faults = now + TICK_S, faults + more
        assert heals(elections, now)
        walks += 1
    figure(
        23, "claims of gateways lost and forged",
        f"{walks} walks, {faults} faults; each time one leader within a lease",
    )  # fmt: skip


def test_row_17_recordings(seconds, figure):
    chance, team = Random(17), pair()
    recorder = Recorder(team, 2, chance)
    began = time.monotonic()
    commands = Commands(team, chance, True)
    until = 20.0
    while time.monotonic() - began < seconds:
        team.run(until, commands)
        until += 20.0
    found = judge(team.robots[2])
    for gain in ("twice", "past its lifespan", "too young"):
        assert found[gain] == 0, (gain, found)
    figure(
        17, "recordings played to a robot with a key",
        f"{recorder.played} plays: 0 obeyed twice, 0 too old, 0 too young",
    )  # fmt: skip
