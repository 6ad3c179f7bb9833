"""README's commands: each that runs in seconds works as printed, in the order of the page."""

import contextlib
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from sdrlinkd.client import ControlClient, NoDaemonError
from sdrlinkd.process import Process, wait_until
from tests.soapy_loopback import Bus, missing

ROOT = Path(__file__).parents[2]
BIN = Path(sys.executable).parent
PATIENCE_S = 120

# Why a command is not run here.
NOT_HERE = {
    r"make demo$": "takes a minute; the tests of `demo` run it",
    r".*sdrlinkctl demo --bag my_bag": "is about the reader's own recording",
    r".*sdrlinkctl lab ": "takes half a minute; the tests of `lab` run scenarios",
    r".*sdrlinkctl latency --runtime-dir .*…": "names the sockets of a running lab",
    r".*python -m benchmarks\.": "takes minutes; tests run benchmarks with --quick",
}
# Whose exit code is about this machine.
MAY_SAY_NO = re.compile(r"sdrlinkctl (radio probe|status)")
# Of a daemon that is started for them.
OF_A_DAEMON = re.compile(r"sdrlinkctl (set|why|status)")
ON_THE_TEST_RADIO = re.compile(
    r"SOAPY_SDR_PLUGIN_PATH|test-radio|soapy_loopback|driver=loopback|grep "
)


def commands(page):
    """What stands behind `$` in its blocks."""
    blocks = re.findall(r"^```\w*\n(.*?)^```$", (ROOT / page).read_text(), re.MULTILINE | re.DOTALL)
    return [line.removeprefix("$ ") for block in blocks for line in block.splitlines()
            if line.startswith("$ ")]  # fmt: skip


def here():
    """Those of README that run in seconds."""
    return [each for each in commands("README.md") if not any(re.match(k, each) for k in NOT_HERE)]


@pytest.fixture
def reader(tmp_path):
    """A checkout, as far as the commands need one, and a shell in it: exit code and screen."""
    (tmp_path / "etc").symlink_to(ROOT / "etc")
    environment = os.environ | {
        "SDRLINKD_RUNTIME_DIR": str(tmp_path / "run"),
        "PYTHONPATH": str(ROOT),
        "SOAPY_SDR_ROOT": "/nonexistent",
    }
    behind = []

    def shell(line):
        line = line.replace(".venv/bin/", f"{BIN}/").replace("/tmp/modules", f"{tmp_path}/modules")
        if line.startswith("export "):
            key, _, value = line.removeprefix("export ").partition("=")
            environment[key] = value
            return 0, ""
        if "sdrlinkd --config" in line:
            daemon = Process(
                ["/bin/sh", "-c", f"exec {line.removesuffix('&')}"], name=line,
                environment=environment, folder=tmp_path,
            )  # fmt: skip
            behind.append(daemon)
            daemon.start()
            wait_until(lambda: is_up(tmp_path / "run"), PATIENCE_S, daemon)
            return 0, daemon.log()
        done = subprocess.run(
            line, shell=True, cwd=tmp_path, env=environment, stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, timeout=PATIENCE_S,
            check=False,
        )  # fmt: skip
        return done.returncode, done.stdout

    yield shell
    for daemon in behind:
        assert daemon.stop(within_s=30) == 0, daemon.log()


def is_up(directory):
    """Whether the daemon is up."""
    with contextlib.suppress(NoDaemonError), ControlClient(directory, 0.5) as control:
        return control.ask("status")["carrier"]["state"] == "up"
    return False


def run_all(reader, lines):
    """Each works, and none ends in a traceback."""
    for line in lines:
        code, screen = reader(line)
        assert code == 0 or MAY_SAY_NO.search(line), f"{line}\n{screen}"
        assert "Traceback" not in screen
        assert "internal error" not in screen


def test_every_command_is_run_or_there_is_a_reason():
    assert len(here()) >= 12
    for pattern in NOT_HERE:
        assert any(re.match(pattern, each) for each in commands("README.md")), pattern


@pytest.mark.slow
def test_those_that_need_no_daemon(reader):
    lines = [
        each
        for each in here()
        if not (OF_A_DAEMON.search(each) or ON_THE_TEST_RADIO.search(each) or "sdrlinkd --" in each)
    ]
    assert any("plan --config" in each for each in lines)
    run_all(reader, lines)


def test_those_that_ask_a_daemon(reader):
    own = [each for each in here() if OF_A_DAEMON.search(each)]
    assert len(own) >= 2
    run_all(reader, [*(each for each in here() if "sdrlinkd --config etc/sdrlinkd" in each), *own])


@pytest.mark.slow
@pytest.mark.timeout(600)
@pytest.mark.skipif(bool(missing()), reason=missing())
def test_those_on_the_test_radio(reader):
    own = [each for each in here() if ON_THE_TEST_RADIO.search(each)]
    assert len(own) >= 6
    with Bus("readme"):
        run_all(reader, own)
