"""The bus and the control socket: files that belong to the daemon's user and group."""

import os
import shutil
import tempfile
from pathlib import Path

import pytest

from sdrlinkd.client import ControlClient, Publisher
from tests.doors.accounts import OTHER_ACCOUNTS, done_by
from tests.programs import Daemon

NAME = "/robot_1/cmd_vel"
CDR, TWIST = b"\0\1\0\0", "geometry_msgs/msg/Twist"
REGISTRY = Path(__file__).parents[2] / "etc" / "registry.csv"
GROUP = 65533
"""A group of the daemon's alone, if this is root."""


@pytest.fixture(scope="module")
def daemon():
    """A daemon whose sockets are where everybody may look."""
    base = Path(tempfile.mkdtemp(prefix="doors-"))
    base.chmod(0o755)
    runtime = base / "run"
    runtime.mkdir(mode=0o750)
    if OTHER_ACCOUNTS:
        os.chown(runtime, -1, GROUP)
        # What is made there belongs to the group, as with systemd's RuntimeDirectory.
        runtime.chmod(0o2750)
    config = base / "sdrlinkd.toml"
    config.write_text(
        f'namespace = "robot_1"\nregistry = "{REGISTRY}"\n[bus]\nruntime_dir = "{runtime}"\n'
    )
    started = Daemon(runtime, config, base / "log")
    try:
        publishes(started.at_work())
        yield started
        started.ends_well()
    finally:
        started.kill()
        shutil.rmtree(base)


def publishes(daemon):
    with Publisher(daemon.directory, timeout_s=2.0) as out:
        out.send(NAME, CDR + bytes(48), type=TWIST)
        out.flush()


def sets(daemon):
    with ControlClient(daemon.directory, 2.0) as control:
        control.ask("set", {"topic": NAME, "priority": 9})


def reads(daemon):
    with ControlClient(daemon.directory, 2.0) as control:
        control.ask("status")


def priority(daemon):
    with daemon.control() as control:
        return control.ask("policy", {"topic": NAME})["priority"]


@pytest.mark.slow
def test_the_group_publishes_and_reads_its_owner_and_root_change_and_others_do_nothing(daemon):
    """What counts is the effect: a message that is accepted, a policy that is another one."""
    before, accepted = priority(daemon), daemon.snapshot().link.tx.accepted
    for account in OTHER_ACCOUNTS:
        for work in (publishes, reads, sets):
            assert not done_by(account, [], lambda work=work: work(daemon)), work
        assert (priority(daemon), daemon.snapshot().link.tx.accepted) == (before, accepted)
        for work, is_done in ((publishes, True), (reads, True), (sets, False)):
            assert done_by(account, [GROUP], lambda work=work: work(daemon)) is is_done, work
        accepted += 1
        assert (priority(daemon), daemon.snapshot().link.tx.accepted) == (before, accepted)
    publishes(daemon)
    sets(daemon)
    assert (priority(daemon), daemon.snapshot().link.tx.accepted) == (9, accepted + 1)
