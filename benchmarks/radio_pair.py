"""Two daemons, each with a test radio, that hear each other."""

import time
from collections.abc import Collection, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from benchmarks import daemons
from benchmarks.absent import PeerError
from benchmarks.loopback_radio import a_bus
from sdrlinkd.client import ControlClient
from sdrlinkd.family import family, family_cpu_s
from sdrlinkd.process import Process

ROBOTS = (1, 2)
CONFIG = """{tables}
[soapy]
tx_enabled = true
tx_gain_db = 40
rx_gain_db = 20
{soapy}
"""
DEVICE = 'device = "driver=loopback,bus={bus},unit={unit},model={model},noise_db=-50{more}"\n'


@dataclass(frozen=True)
class Look:
    """A daemon at one moment: its status, and CPU time so far.

    That of the daemon includes its modem process; that of the radio process stands apart.
    """

    at: float
    status: dict[str, Any]
    cpu_s: dict[str, float]

    def counter(self, name: str) -> int:
        """Value of one of its PDU link's counters."""
        return int(self.status["carrier"]["counters"][name])


@dataclass(frozen=True)
class Pair:
    """Socket folders and daemons, by robot."""

    folders: dict[int, Path]
    daemons: dict[int, Process]

    def look(self, robot: int) -> Look:
        """The daemon's current state. Raises PeerError if its radio process is gone."""
        daemon = self.daemons[robot]
        with ControlClient(self.folders[robot]) as control:
            status = control.ask("status")
        # The daemon, its modem, and the radio process of the modem.
        below = family(daemon.pid)
        if len(below) != 3:
            raise PeerError(f"{daemon.name} has {len(below) - 1} processes; {daemon.log()}")
        radio_s = family_cpu_s(below[2])
        cpu_s = {"daemon": family_cpu_s(daemon.pid) - radio_s, "radio_process": radio_s}
        return Look(time.monotonic(), status, cpu_s)


@contextmanager
def pair(
    model: str, topics: Collection[str], tables: str, soapy: str = "", more: str = ""
) -> Iterator[Pair]:
    """Run two daemons, from when both radios work. Raises PeerError.

    In TOML: `tables`, with that of the modem, and extra lines of `soapy`; `more` is for the device
    arguments.
    """
    config = CONFIG.format(tables=tables, soapy=soapy)
    with a_bus() as bus:
        own = {
            robot: DEVICE.format(bus=bus, unit=robot, model=model, more=more) for robot in ROBOTS
        }
        with daemons.running(
            "soapy", ROBOTS, topics, config, "", own=own, ready=daemons.is_up
        ) as running:
            yield Pair(running.folders, dict(zip(ROBOTS, running.processes, strict=True)))
