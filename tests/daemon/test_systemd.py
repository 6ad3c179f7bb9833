"""The service units, and the daemon's notifications to the service manager."""

import os
import re
import shutil
import signal
import socket
import stat
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from sdrlinkd.process import Process, module
from tests.machine import lacks

ROOT = Path(__file__).parents[2]
UNITS = [ROOT / "systemd" / name for name in ("sdrlinkd.service", "sdrlinkd@.service")]
BESIDE = sorted((ROOT / "systemd").glob("sdrlink-*.service"))
"""Those of programs that run beside the daemon."""
# What may differ between the units for one node and for several.
OF_THE_NODE = {"ExecStart", "RuntimeDirectory", "StateDirectory"}
WATCHDOG_S = 0.3
PATIENCE_S = 30.0

needs_systemd_analyze = pytest.mark.skipif(
    shutil.which("systemd-analyze") is None,
    reason=lacks("systemd"),
)
each_unit = pytest.mark.parametrize("unit", [*UNITS, *BESIDE], ids=lambda unit: unit.name)


# The units.


@needs_systemd_analyze
@each_unit
def test_verify_has_nothing_to_say(unit: Path, tmp_path: Path):
    assert verify(runnable_copy(unit, tmp_path)) == (0, "")


@needs_systemd_analyze
def test_verify_notices_a_misspelt_key(tmp_path: Path):
    copy = runnable_copy(UNITS[0], tmp_path)
    copy.write_text(copy.read_text().replace("PrivateTmp=", "PrivteTmp="))
    assert "PrivteTmp" in verify(copy)[1]


@needs_systemd_analyze
@each_unit
def test_exposure_is_at_most_1_5(unit: Path):
    status, said = exposure(unit)
    assert status == 0, said


@needs_systemd_analyze
def test_a_bare_unit_is_too_exposed(tmp_path: Path):
    exec_starts = [line for line in UNITS[0].read_text().splitlines() if "ExecStart=/" in line]
    bare = tmp_path / UNITS[0].name
    bare.write_text("\n".join(["[Service]", *exec_starts, ""]))
    assert exposure(bare)[0] == 1


def test_both_units_are_hardened_alike():
    one, several = (service_lines(unit) for unit in UNITS)
    assert one == several
    assert len(one) > 40


@each_unit
def test_no_unit_leaves_a_core_dump_or_files_for_others(unit: Path):
    lines = service_lines(unit)
    assert "LimitCORE=0" in lines
    assert {"UMask=0007", "UMask=0077"} & set(lines)


def test_what_runs_beside_the_daemon_is_hardened_alike_and_serves_this_computer_alone():
    names = [unit.name for unit in BESIDE]
    assert names == [
        f"sdrlink-{each}.service" for each in ("exporter", "foxglove", "gateway", "web")
    ]
    hardening = {unit.read_text().split("AmbientCapabilities=")[1] for unit in BESIDE}
    assert len(hardening) == 1
    for unit in BESIDE:
        lines = service_lines(unit)
        if "gateway" in unit.name:
            # Its routers are elsewhere, and it proves itself to them.
            continue
        assert {"DynamicUser=yes", "IPAddressDeny=any", "IPAddressAllow=localhost"} <= set(lines)
        (program,) = [each for each in unit.read_text().splitlines() if "ExecStart=" in each]
        assert "exporter" in unit.name or " --token " in program


@pytest.mark.slow
@each_unit
def test_bad_configuration_is_not_restarted(unit: Path, tmp_path: Path):
    config = tmp_path / "bad.toml"
    config.write_text("no_such_key = 1\n")
    run = subprocess.run(
        [sys.executable, "-m", "sdrlinkd", "--config", config],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=False,
    )
    assert "no_such_key" in run.stderr
    assert f"RestartPreventExitStatus={run.returncode}" in service_lines(unit)


def runnable_copy(unit: Path, directory: Path) -> Path:
    """A copy with an ExecStart that exists on this host, as verify requires it."""
    text, replaced = re.subn(r"(?m)^ExecStart=\S+", f"ExecStart={sys.executable}", unit.read_text())
    assert replaced == 1
    copy = directory / unit.name
    copy.write_text(text)
    return copy


def verify(unit: Path) -> tuple[int, str]:
    return systemd_analyze("verify", str(unit))


def exposure(unit: Path) -> tuple[int, str]:
    return systemd_analyze("security", "--offline=true", "--threshold=15", str(unit))


def systemd_analyze(*arguments: str) -> tuple[int, str]:
    """Exit status and all output of systemd-analyze."""
    run = subprocess.run(
        ["systemd-analyze", "--no-pager", *arguments],
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        check=False,
    )
    return run.returncode, run.stdout


def service_lines(unit: Path) -> list[str]:
    """The lines of [Service] that must not depend on the node."""
    section = unit.read_text().split("[Service]\n")[1].split("\n[")[0]
    lines = [line for line in section.splitlines() if line and not line.startswith("#")]
    return [line for line in lines if line.split("=")[0] not in OF_THE_NODE]


# The notifications.


class Manager:
    """Plays the service manager: starts the daemon and receives its notifications."""

    def __init__(self, sock: socket.socket, directory: Path):
        self.runtime_dir = directory / "run"
        self._config = directory / "sdrlinkd.toml"
        self._config.write_text(
            'namespace = "robot_1"\n'
            f'registry = "{ROOT / "etc" / "registry.csv"}"\n'
            "drain_s = 0.1\n"
            "[bus]\n"
            f'runtime_dir = "{self.runtime_dir}"\n'
        )
        self._socket = sock
        name = sock.getsockname()
        self._address = name if isinstance(name, str) else "@" + name[1:].decode()

    def daemon(self) -> Process:
        environment = os.environ | {
            "NOTIFY_SOCKET": self._address,
            "WATCHDOG_USEC": str(round(WATCHDOG_S * 1e6)),
        }
        command = module("sdrlinkd", "--config", self._config)
        return Process(command, environment=environment, folder=ROOT, umask=0o007)

    def wait_for(self, start: str) -> str:
        """Wait for the next state that starts with `start`."""
        until = time.monotonic() + PATIENCE_S
        while True:
            self._socket.settimeout(max(until - time.monotonic(), 0.001))
            state = self._socket.recv(4096).decode()
            if state.startswith(start):
                return state


@pytest.fixture(params=["path", "abstract"])
def manager(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[Manager]:
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as sock:
        # For an empty address the kernel chooses an abstract one.
        sock.bind(str(tmp_path / "notify") if request.param == "path" else "")
        yield Manager(sock, tmp_path)


@pytest.mark.slow
def test_ready_means_reachable_for_the_group(manager: Manager):
    with manager.daemon():
        manager.wait_for("READY=1")
        modes = {
            path.name: stat.S_IMODE(path.stat().st_mode)
            for path in manager.runtime_dir.glob("*.sock")
        }
        assert stat.S_IMODE(manager.runtime_dir.stat().st_mode) == 0o750
    assert modes == dict.fromkeys(["ctl.sock", "in-pub.sock", "in.sock", "out.sock"], 0o770)


@pytest.mark.realtime
@pytest.mark.parametrize("manager", ["abstract"], indirect=True)
def test_the_watchdog_is_fed_in_time(manager: Manager):
    feeds = 8
    with manager.daemon():
        manager.wait_for("READY=1")
        manager.wait_for("WATCHDOG=1")
        begun = time.monotonic()
        for _ in range(feeds):
            manager.wait_for("WATCHDOG=1")
        assert time.monotonic() - begun < feeds * WATCHDOG_S


@pytest.mark.slow
def test_the_status_line_begins_with_the_verdict(manager: Manager):
    with manager.daemon():
        assert "direct up" in manager.wait_for("STATUS=OK")


@pytest.mark.slow
def test_sigterm_is_an_orderly_stop(manager: Manager):
    with manager.daemon() as process:
        manager.wait_for("READY=1")
        process.send_signal(signal.SIGTERM)
        manager.wait_for("STOPPING=1")
        assert process.wait(PATIENCE_S) == 0
    assert not list(manager.runtime_dir.glob("*.sock"))
