"""Measures how much of a CPU core a node needs, with a daemon on simulated noise."""

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
from sdrlinkd.family import family_cpu_s

MOST = 0.8
"""Largest load, as a share of a core; the rest is for peaks."""
SNR_DB = 15.0
TOPIC, TYPE = "load", "std_msgs/UInt8MultiArray"
_MESSAGE = bytes(1000)
_AHEAD = 200
"""Number of messages kept in the queue to fill the channel."""


class Headroom(NamedTuple):
    """Shares of one core that a daemon needs, relative to the time of the processed samples.

    So delays by other programs do not make the shares look small.
    """

    rate_hz: float
    silent: float
    """Share on a silent channel, for the search alone."""
    full: float
    """Share on a full channel, where every burst is both sent and received."""
    samples_lost: int
    """Samples lost on a full channel because the receiver did not keep up."""


def headroom_found(modem: ModemParams, pdu_size: int, seconds: float) -> Finding:
    """The finding on CPU headroom: the measurement, or why it is impossible."""
    try:
        return check_headroom(measure_headroom(modem, pdu_size, seconds))
    except UserError as error:
        said = str(error).splitlines()[-1]
        return bad("CPU headroom", f"could not start a daemon to measure: {said}", "fix that first")


def measure_headroom(modem: ModemParams, pdu_size: int, seconds: float) -> Headroom:
    """Run a daemon for `seconds`, half of them on a silent channel. Raises UserError."""
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
    """The finding on whether the modem keeps up with the samples on a full channel."""
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
    """Let `seconds` pass; with `out`, keep the daemon's queue filled meanwhile."""
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        if out is not None:
            for _ in range(_AHEAD):
                out.send(f"/robot_1/{TOPIC}", _MESSAGE)
        time.sleep(0.02)


class _Spent(NamedTuple):
    """CPU time of a daemon and its modem, and processed samples, since the start."""

    cpu_s: float
    samples: int
    lost: int

    @classmethod
    def by(cls, pid: int, folder: Path) -> "_Spent":
        """The figures of the daemon with process id `pid` and sockets in `folder`."""
        counters = snapshot_of(folder).carrier.counters
        return cls(family_cpu_s(pid), counters.get("samples", 0), counters.get("samples_lost", 0))

    def share_since(self, earlier: "_Spent", rate_hz: float) -> float:
        """CPU time since `earlier`, as a share of the time of the samples received since."""
        return (self.cpu_s - earlier.cpu_s) * rate_hz / max(1, self.samples - earlier.samples)
