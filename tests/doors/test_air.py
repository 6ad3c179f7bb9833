"""The air of a team with a key, and the UDP port at which GNU Radio hands it over."""

import contextlib
import os
from random import Random

import pytest

from benchmarks.fleet.pdu_air import PduAir
from sdrlinkd.cli import run
from sdrlinkd.client import Publisher, Subscriber
from sdrlinkd.keyring import create_key_file, new_key
from sdrlinkd.sealing import Key, Remembered, Sealing, SecurityParams
from sdrlinkd.wire import BROADCAST, SEAL_OVERHEAD, Entry, Pdu, build, crc16
from tests.conftest import ETC, daemons
from tests.waiting import wait_for

MINE, FORGED = b"\0\1\0\0mine", b"\0\1\0\0forged"
ROBOT, OPERATOR, SIZE = 2, 1, 220
TOPICS = [line.split(",")[0] for line in (ETC / "registry.csv").read_text().splitlines()]
OTHER_TEAM = Key(0, bytes(32))


class Recorded(PduAir):
    """An air on which somebody listens."""

    def __init__(self, robots):
        self.sent = []
        super().__init__(robots)

    def _carry(self, src, pdu):
        self.sent.append((src, pdu))
        super()._carry(src, pdu)


class Team:
    """Two robots with one key, of which the first commands the second."""

    def __init__(self, folder, start_daemon, stack):
        create_key_file(folder / "team.key", new_key(0))
        self.air = stack.enter_context(Recorded((OPERATOR, ROBOT)))
        self.operator, self.robot = (self._start(each, folder, start_daemon) for each in (1, 2))
        self.out = stack.enter_context(Publisher(self.operator.directory))
        self.heard = stack.enter_context(
            Subscriber(f"/rx_robot_{OPERATOR}/cmd_vel", runtime_dir=self.robot.directory)
        )
        wait_for(lambda: ROBOT in self.operator.snapshot().link.security.proven)
        wait_for(lambda: OPERATOR in self.robot.snapshot().link.security.proven)

    def _start(self, robot, folder, start_daemon):
        text = (
            f'namespace = "robot_{robot}"\nregistry = "{ETC / "registry.csv"}"\n'
            f'backend = "gnuradio"\n{self.air.settings(robot)}pdu_size = {SIZE}\n'
            f'[security]\nmode = "seal"\nkeys = "{folder}/keys_{robot}.toml"\n'
            f'state_dir = "{folder}/state_{robot}"\n'
        )
        config = folder / f"robot_{robot}.toml"
        config.write_text(text)
        given = ["key", "install", "--new", str(folder / "team.key"), "--config", str(config)]
        assert run(given) == 0
        return start_daemon(text)

    def obeys_its_operator(self):
        self.out.send(f"/robot_{OPERATOR}/cmd_vel", MINE)
        message = self.heard.receive(10)
        return message is not None and message.payload == MINE and message.is_sealed


@pytest.fixture(scope="module")
def team(tmp_path_factory):
    with contextlib.ExitStack() as stack:
        start = stack.enter_context(daemons(tmp_path_factory))
        yield Team(tmp_path_factory.mktemp("team"), start, stack)


def a_command(seq, size):
    entry = Entry(TOPICS.index("cmd_vel"), seq, 0, 1, FORGED)
    return build(Pdu(0, False, OPERATOR, BROADCAST, seq, 1, [entry]), size)


def in_the_clear(_team):
    return [a_command(seq, SIZE) for seq in range(20)]


def with_another_teams_key(_team):
    sealing = Sealing(
        OPERATOR, SIZE, SecurityParams(mode="seal"), [OTHER_TEAM],
        Remembered({OTHER_TEAM.fingerprint: 1 << 25}), os.urandom,
    )  # fmt: skip
    sealing.memory.written(sealing.memory.wanted(0.0))
    sealing.may_send(0.0, 0, 1)
    return [sealing.seal(a_command(seq, SIZE - SEAL_OVERHEAD), 1.0) for seq in range(20)]


def recorded(team):
    return [pdu for src, pdu in team.air.sent if src == OPERATOR][-200:]


def changed(team):
    chance = Random(4)
    found = []
    for pdu in recorded(team):
        octets = bytearray(pdu)
        for at in (3, chance.randrange(5, 9), chance.randrange(11, SIZE - 10)):
            octets[at] ^= chance.randrange(1, 256)
        found.append(bytes(octets[:-2]) + crc16(bytes(octets[:-2])).to_bytes(2, "big"))
    return found


STRANGERS = (in_the_clear, with_another_teams_key, recorded, changed)


@pytest.mark.slow
@pytest.mark.parametrize("stranger", STRANGERS)
def test_who_has_no_key_commands_nobody_and_who_has_it_does(stranger, team):
    assert all(team.obeys_its_operator() for _ in range(10))
    before = team.robot.snapshot().link.rx.pdus_dropped
    forged = stranger(team)
    assert len(forged) >= 10
    for pdu in forged:
        team.air.forge(ROBOT, pdu)

    def refused():
        dropped = team.robot.snapshot().link.rx.pdus_dropped
        return sum(dropped.values()) - sum(before.values())

    wait_for(lambda: refused() >= len(forged))
    assert team.heard.receive(0.2) is None
    assert team.obeys_its_operator()
    assert team.robot.snapshot().link.security.halted == ""
