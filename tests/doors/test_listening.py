"""Every socket at which a program of ours listens has a row in the table of doors."""

import contextlib
import socket
from pathlib import Path

import pytest

from benchmarks.fleet.field import free_endpoint
from sdrlinkd.keyring import new_authority, zenoh_file
from sdrlinkd.process import Process, module
from tests.doors.sockets import listening
from tests.programs import sdrlinkctl
from tests.waiting import wait_for

TABLE = Path(__file__).parents[2] / "docs" / "security.md"
# The sockets of each program, and the words by which the table names its door.
DOORS = {
    "daemon": ({"unix in", "unix in-pub", "unix out", "unix ctl"}, "bus, control socket"),
    "daemon with gnuradio": (
        {"unix in", "unix in-pub", "unix out", "unix ctl", "udp"}, "`gnuradio`",
    ),
    "hub": ({"unix air", "unix sky"}, "`sdrlink-ether`"),
    "gateway": ({"tcp"}, "`sdrlink-gateway`"),
    "page": ({"tcp"}, "`sdrlinkctl web`"),
    "exporter": ({"tcp"}, "`sdrlinkctl exporter`"),
    "Foxglove bridge": ({"tcp", "tcp local"}, "Foxglove bridge"),
}  # fmt: skip


def free_port():
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        return free.getsockname()[1]


@contextlib.contextmanager
def daemon(start, _folder):
    yield start().pid


@contextlib.contextmanager
def daemon_with_gnuradio(start, _folder):
    ends = f'send = "127.0.0.1:{free_port()}"\nreceive = "127.0.0.1:{free_port()}"\n'
    yield start(
        f'backend = "gnuradio"\n[gnuradio]\ntransport = "udp"\nrate_bit_s = 1e6\n{ends}'
    ).pid


@contextlib.contextmanager
def hub(_start, folder):
    with Process(module("sdrlinkd.cli.ether", "--dir", folder), name="hub") as running:
        yield running.pid


@contextlib.contextmanager
def gateway(start, folder):
    file = folder / "base.json5"
    file.write_text(zenoh_file(new_authority(), "base", 1))
    fleet = f'[fleet]\nlisten = ["{free_endpoint("tls")}"]\nzenoh = "{file}"\ndown = ["x"]\n'
    command = module("sdrlinkd.cli.gateway", "--config", start(fleet).config)
    with Process(command, name="gateway") as running:
        yield running.pid


def serving(*command):
    """A program of sdrlinkctl's that serves at 127.0.0.1, beside a daemon."""

    @contextlib.contextmanager
    def run(start, _folder):
        at = ("--runtime-dir", start().directory, "--listen", "127.0.0.1:0")
        with sdrlinkctl(*command, *at) as running:
            running.line()
            yield running.pid

    return run


PROGRAMS = {
    "daemon": daemon, "daemon with gnuradio": daemon_with_gnuradio, "hub": hub,
    "gateway": gateway, "page": serving("web"), "exporter": serving("exporter"),
    "Foxglove bridge": serving("bridge", "foxglove", "--publish", "/x"),
}  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize("name", PROGRAMS)
def test_a_program_listens_at_its_doors_alone_and_the_table_has_them(name, start_daemon, tmp_path):
    sockets, words = DOORS[name]
    rows = [line for line in TABLE.read_text().splitlines() if line.startswith("| ")]
    assert any(words in line for line in rows), f"docs/security.md has no row for {words}"
    with PROGRAMS[name](start_daemon, tmp_path) as pid:
        with contextlib.suppress(AssertionError):
            wait_for(lambda: listening(pid) >= sockets)
        assert listening(pid) == sockets
