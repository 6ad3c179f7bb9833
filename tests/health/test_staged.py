"""Faults of the list, done to whole daemons: what a person reads first, and how soon.

Those that need a full disk, a second robot with our key, jammers or a radio that can be unplugged
are told from snapshots (`test_faults.py`).
"""

import contextlib
import json
import os
import signal
import threading
import time
from pathlib import Path

import pytest

from backends import JammerParams, World
from sdrlinkd.cli import run
from sdrlinkd.cli.screens import verdict as first_lines
from sdrlinkd.client import Publisher
from sdrlinkd.keyring import create_key_file, new_key
from tests.backends.hubs import serving
from tests.daemon.ether import AIR
from tests.health.faults import IN_THE_CLEAR, SEALED
from tests.waiting import wait_for

pytestmark = [pytest.mark.long, pytest.mark.realtime]

PATIENCE_S = 60.0
WITHIN_S = 5.0
"""What the verdict should take; it is told, and a busy machine may take longer."""
CDR = b"\0\1\0\0"
ODOM = CDR + bytes(700)


class CutWorld(World):
    """An air of which hops can be cut, or lose a share of the bursts."""

    cut, loses, n = (), (), 0

    def hop(self, sender, receiver, t):
        self.n += 1
        if receiver in self.cut or ((sender, receiver) in self.loses and self.n % 3 == 0):
            return None
        return super().hop(sender, receiver, t)


class Stage:
    """A hub, and robots with configurations of their own."""

    def __init__(self, start_daemon, write_config, folder, stack):
        self._start, self._write, self.folder, self._stack = (
            start_daemon, write_config, folder, stack,
        )  # fmt: skip
        self.world = None

    def hub(self, **air):
        def make(*arguments):
            self.world = CutWorld(*arguments)
            return self.world

        self._hub = self._stack.enter_context(contextlib.ExitStack())
        self._hub.enter_context(
            serving(self.folder / "hub", **{**AIR, "snr_db": 25.0, **air}, world=make)
        )
        return self

    def end_hub(self):
        self._hub.close()

    def robot(self, number, more="", key="", mode="seal", top='registry = ""\n'):
        keys = self.folder / f"keys_{number}.toml"
        sections = f'[security]\nmode = "{mode}"\nkeys = "{keys}"\n' if key else ""
        network = "" if "network" in more else "network = 0\n"
        config = (
            f'{top}namespace = "robot_{number}"\nbackend = "ether"\n'
            f'[ether]\ndir = "{self.folder / "hub"}"\n[modem]\nrate_hz = 1e6\n{network}'
            f"{more}{sections}[access]\nnodes = [1, 2, 3]\n"
        )
        if key:
            secret = self.folder / f"{key}.key"
            if not secret.exists():
                create_key_file(secret, new_key(0))
            folder = self.folder / f"config_{number}"
            folder.mkdir()
            path = self._write(folder, config)
            assert run(["key", "install", "--new", str(secret), "--config", str(path)]) == 0
        return self._start(config)

    def team(self, n=2, **how):
        """Robots that hear each other."""
        robots = [self.robot(number, **how) for number in range(1, n + 1)]
        for number, daemon in enumerate(robots, 1):
            others = {*range(1, n + 1)} - {number}
            wait_for(lambda d=daemon, o=others: heard_by(d) >= o, PATIENCE_S)
        return robots

    def forget(self, number):
        """Delete the numbers of a robot's key."""
        for path in (self.folder / "state").rglob(f"robot-{number}-key-*"):
            path.unlink()

    def again_and_again(self, act):
        """Do something in the background until the test is over."""
        over = threading.Event()

        def work():
            while not over.is_set():
                act()

        thread = threading.Thread(target=work)
        thread.start()
        self._stack.callback(thread.join)
        self._stack.callback(over.set)


def heard_by(daemon):
    return {each.src for each in daemon.snapshot().link.neighbors}


def another_key(stage, at):
    stage.hub()
    return [stage.robot(number, key=f"team_{number}") for number in (1, 2)][at - 1]


def no_key(stage, at):
    stage.hub()
    return [stage.robot(1, key="team"), stage.robot(2)][at - 1]


def another_mode(stage, at):
    stage.hub()
    return [stage.robot(1, key="team"), stage.robot(2, key="team", mode="auth")][at - 1]


def lost_numbers(stage, at):
    robots = stage.hub().team(key="team")
    robots[1].stop()
    stage.forget(2)
    robots[1].at_work()
    return robots[at - 1]


def nothing(stage, _):
    return stage.hub().team()[0]


def nothing_sealed(stage, _):
    return stage.hub().team(key="team")[0]


def another_network(stage, _):
    stage.hub().robot(2, "network = 3\n")
    return stage.robot(1)


def another_size(stage, _):
    stage.hub().robot(2, "[link]\npdu_size = 512\n")
    return stage.robot(1)


def another_registry(stage, _):
    stage.hub()
    robots = []
    for number, kind in ((1, "Odometry"), (2, "Path")):
        path = stage.folder / f"{number}.csv"
        path.write_text(f"odom,nav_msgs/msg/{kind}\n")
        robots.append(stage.robot(number, top=f'registry = "{path}"\n'))
    return robots[0]


def switched_off(stage, _):
    one, two = stage.hub().team()
    two.stop()
    return one


def never_on(stage, _):
    return stage.hub().robot(1)


def antenna_off(stage, _):
    one, *_ = stage.hub().team(3)
    stage.world.cut = (1,)
    return one


def heard_badly(stage, _):
    one, _ = stage.hub().team()
    stage.world.loses = ((1, 2),)
    name = declared(one, 1)

    def publish():
        with Publisher(one.directory) as out:
            for _ in range(10):
                out.send(name, ODOM)
                time.sleep(0.1)

    stage.again_and_again(publish)
    return one


def declared(daemon, robot, **policy):
    with daemon.control() as control:
        name = f"/robot_{robot}/odom"
        control.ask("declare", {"name": name, "type": "nav_msgs/msg/Odometry"})
        if policy:
            control.ask("set", {"topic": name, **policy})
    return name


def lagging(stage, _):
    one, _ = stage.hub().team()

    def stutter():
        one.send_signal(signal.SIGSTOP)
        time.sleep(0.5)
        one.send_signal(signal.SIGCONT)
        time.sleep(0.3)

    stage.again_and_again(stutter)
    return one


def starved(stage, _):
    one, _ = stage.hub().team()
    (modem,) = Path(f"/proc/{one.pid}/task/{one.pid}/children").read_text().split()[:1]

    def starve():
        for number, wait_s in ((signal.SIGSTOP, 1.5), (signal.SIGCONT, 0.5)):
            with contextlib.suppress(ProcessLookupError):
                os.kill(int(modem), number)
            time.sleep(wait_s)

    stage.again_and_again(starve)
    return one


def clipping(stage, _):
    return stage.hub(snr_db=95.0).team()[0]


def tone(stage, _):
    return stage.hub(jammer=[JammerParams(over_noise_db=20, offset_hz=1.1e5)]).team()[0]


def overload(stage, _):
    one, _ = stage.hub().team()
    name = declared(one, 1, lifespan_s=0.5, depth=0)

    def flood():
        with Publisher(one.directory) as out:
            for _ in range(300):
                out.send(name, CDR + bytes(5000))
                time.sleep(0.002)

    stage.again_and_again(flood)
    return one


def backlog(stage, robot):
    """A robot whose odometry waits for ever longer; (both robots)."""
    robots = stage.hub().team()
    name = declared(robots[robot - 1], robot, history="keep_all", lifespan_s=1e4, queue_bytes=0)

    def fill():
        with Publisher(robots[robot - 1].directory) as out:
            for _ in range(500):
                out.send(name, ODOM)
                time.sleep(0.003)

    stage.again_and_again(fill)
    return robots


def odometry_waits(stage, _):
    return backlog(stage, 1)[0]


def odometry_is_old(stage, _):
    return backlog(stage, 2)[0]


def hub_gone(stage, _):
    one, _ = stage.hub().team()
    stage.end_hub()
    return one


def stopping(stage, _):
    one, _ = stage.hub().team(top='registry = ""\ndrain_s = 6\n')
    name = declared(one, 1, history="keep_all", lifespan_s=1e4)
    with Publisher(one.directory) as out:
        for _ in range(2000):
            out.send(name, ODOM)
        out.flush(20)
    one.send_signal(signal.SIGTERM)
    return one


STAGES = {
    "nothing, with a key": nothing_sealed,
    "robot 2 has another key": another_key,
    "robot 2 has no key": no_key,
    "robot 2 has the key in the mode auth": another_mode,
    "robot 2 lost the numbers of its key": lost_numbers,
    "nothing, without a key": nothing,
    "robot 2 has another network id": another_network,
    "robot 2 has another PDU size": another_size,
    "robot 2 has another registry": another_registry,
    "robot 2 is switched off": switched_off,
    "robot 2 was never on": never_on,
    "the antenna of robot 1 is off": antenna_off,
    "robot 2 hears robot 1 badly": heard_badly,
    "two busy processes beside robot 1": starved,
    "the event loop of robot 1 lags": lagging,
    "the gain of robot 1 is too high": clipping,
    "a tone fills robot 1's band in part": tone,
    "robot 1 sends more than the air carries": overload,
    "odometry waits 40 s in robot 1's queue": odometry_waits,
    "odometry of robot 2 is 44 s old": odometry_is_old,
    "the hub is gone": hub_gone,
    "robot 1 stops": stopping,
}
FAULTS = [
    pytest.param(fault, seal, id=f"{fault.done}, at {fault.at}")
    for seal, faults in (("sealed", SEALED), ("in the clear", IN_THE_CLEAR))
    for fault in faults
    if fault.done in STAGES
]


@pytest.fixture
def stage(start_daemon, write_config, tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    with contextlib.ExitStack() as stack:
        yield Stage(start_daemon, write_config, tmp_path, stack)


@pytest.mark.parametrize(("fault", "seal"), FAULTS)
def test_the_first_line_of_a_daemon_is_that_of_the_list(stage, fault, seal, record_property):
    daemon = STAGES[fault.done](stage, fault.at)
    began, line = time.monotonic(), ""
    wanted = f"{fault.level}, {seal}" + (f": {fault.reason}" if fault.reason else "")
    while time.monotonic() < began + PATIENCE_S:
        line = " ".join(first_lines(daemon.snapshot(), 300, whole=True).plain.split())
        if line.startswith(wanted) if fault.reason else line == wanted:
            break
        time.sleep(0.05)
    took_s = time.monotonic() - began
    record_property("fault", json.dumps([fault.done, fault.at, round(took_s, 1), line]))
    print(f"{took_s:.1f} s: {line}")  # noqa: T201  # `-s` shows how soon
    assert line.startswith(wanted), f"after {took_s:.0f} s: {line}"
