"""How much of a core a node takes here: a daemon runs, on its modem and simulated noise."""

import os
import tempfile
import time
from pathlib import Path
from typing import NamedTuple

import msgspec
import tomli_w

from sdrlinkd.client import Publisher
from sdrlinkd.config import ModemParams
from sdrlinkd.demo import daemon_process, snapshot_of, wait_until_up
from sdrlinkd.doctor.finding import Finding, bad, good_if
from sdrlinkd.errors import UserError

MOST = 0.8
"""The rest of a core is for what comes at once."""
SNR_DB = 15.0
TOPIC, TYPE = "load", "std_msgs/UInt8MultiArray"
_MESSAGE = bytes(1000)
_AHEAD = 200
"""Messages that wait while the air is full."""


class Headroom(NamedTuple):
    """Shares of one core that a daemon takes, by the time of the samples.

    Other programs that hold it up do not make them look small.
    """

    rate_hz: float
    silent: float
    """Share while nobody sends: the search alone."""
    full: float
    """Share while the air is full: every burst is made, and received."""
    samples_lost: int
    """Samples lost while the air was full: the receiver did not keep up."""


def headroom_found(modem: ModemParams, pdu_size: int, seconds: float) -> Finding:
    """The finding on CPU headroom: measured, or why it cannot be."""
    try:
        return check_headroom(measure_headroom(modem, pdu_size, seconds))
    except UserError as error:
        said = str(error).splitlines()[-1]
        return bad("CPU headroom", f"could not start a daemon to measure: {said}", "fix that first")


def measure_headroom(modem: ModemParams, pdu_size: int, seconds: float) -> Headroom:
    """Run a daemon for `seconds`, half of that on a silent air. Raises UserError."""
    with tempfile.TemporaryDirectory(prefix="sdrlinkd-doctor-") as name:
        folder = Path(name)
        daemon = daemon_process(_config(folder, modem, pdu_size))
        try:
            daemon.start()
            wait_until_up(daemon, folder)
            pid = int((folder / "lock").read_text())
            first = _Spent.by(pid, folder)
            _run(seconds / 2, None)
            middle = _Spent.by(pid, folder)
            with Publisher(folder) as out:
                _run(seconds / 2, out)
            last = _Spent.by(pid, folder)
            return Headroom(
                modem.rate_hz,
                middle.share_since(first, modem.rate_hz),
                last.share_since(middle, modem.rate_hz),
                last.lost - middle.lost,
            )
        finally:
            daemon.stop()


def check_headroom(found: Headroom) -> Finding:
    """Whether the modem keeps up with the samples where the air is full."""
    lost = f"; {found.samples_lost} samples dropped" if found.samples_lost else ""
    return good_if(
        found.full <= MOST and not found.samples_lost, "CPU headroom",
        f"at {found.rate_hz / 1e6:g} Msps a daemon takes {100 * found.full:.0f} % of a core on a "
        f"full channel, {100 * found.silent:.0f} % on a silent one{lost}",
        f"lower modem.rate_hz at all robots, such as {found.rate_hz / 2e6:g} Msps",
    )  # fmt: skip


def _config(folder: Path, modem: ModemParams, pdu_size: int) -> Path:
    (folder / "registry.csv").write_text(f"{TOPIC},{TYPE}\n")
    config = folder / "sdrlinkd.toml"
    config.write_text(
        tomli_w.dumps(
            {
                "backend": "loopback",
                "drain_s": 0.0,
                "bus": {"runtime_dir": str(folder)},
                "link": {"pdu_size": pdu_size},
                "topic": {TOPIC: {"depth": _AHEAD}},
                "channel": {"snr_db": SNR_DB},
                "modem": msgspec.to_builtins(modem),
            }
        )
    )
    return config


def _run(seconds: float, out: Publisher | None) -> None:
    """Let `seconds` pass; with `out`, the daemon's queue never runs dry."""
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        if out is not None:
            for _ in range(_AHEAD):
                out.send(f"/robot_1/{TOPIC}", _MESSAGE)
        time.sleep(0.02)


class _Spent(NamedTuple):
    """What a daemon has spent and done since it began."""

    cpu_s: float
    samples: int
    lost: int

    @classmethod
    def by(cls, pid: int, folder: Path) -> "_Spent":
        """What the daemon of process `pid` has spent, with its sockets in `folder`."""
        counters = snapshot_of(folder).carrier.counters
        fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
        cpu_s = (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")
        return cls(cpu_s, counters.get("samples", 0), counters.get("samples_lost", 0))

    def share_since(self, earlier: "_Spent", rate_hz: float) -> float:
        """CPU time since `earlier`, as a share of the time of the samples that came."""
        return (self.cpu_s - earlier.cpu_s) * rate_hz / max(1, self.samples - earlier.samples)
