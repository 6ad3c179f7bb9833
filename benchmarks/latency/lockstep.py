"""115 bytes 200 times per second each way, in the air's time: links and modems in one process."""

import asyncio
import struct
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from backends import AirParams, RadioParams
from benchmarks.peers.latency.daemons import Air
from benchmarks.worlds.arrivals import Arrival
from benchmarks.worlds.samples import DATA, Station, play
from sdrlinkd.config import ModemParams
from sdrlinkd.link import AccessParams, ClockParams
from sdrlinkd.modem import Airtimes
from sdrlinkd.pdulink import Heard

AIR = Air()
PPM = {1: 8.0, 2: -6.0}
BLOCK_S = 1e-4
CDR = b"\0\1\0\0"
_AT = struct.Struct("<d")


class LockStep(NamedTuple):
    """Latencies and errors of ages, in s."""

    latencies_s: np.ndarray
    age_errors_s: np.ndarray
    airtime_s: float
    """Airtime of a burst with one PDU."""


class _Stamped(Station):
    """A station that records the latency of messages in the air's time, and by their age."""

    def __init__(self, *arguments: object, pace: float, **more: object) -> None:
        super().__init__(*arguments, **more)  # type: ignore[arg-type]
        self._pace = pace
        self.latencies_s: list[float] = []
        self.errors_s: list[float] = []

    def heard(self, pdus: Sequence[Heard]) -> None:
        """Take PDUs from the air, and record the latency of their messages."""
        now = self.modem.now()
        for data, at, snr_db, ended_at, _ in pdus:
            for message in self.link.hear(data, at, snr_db, now, ended_at):
                (sent_at,) = _AT.unpack_from(message.payload, len(CDR))
                age_s = self.link.delivered(message, now)
                true_s = now / self._pace - sent_at
                self.latencies_s.append(true_s)
                if age_s is not None:
                    self.errors_s.append(age_s - true_s)


def airtime_s() -> float:
    """The airtime of a burst with one PDU, in s."""
    modem = ModemParams(rate_hz=AIR.rate_hz, mcs=AIR.mcs, block_s=BLOCK_S)
    return Airtimes(modem, AIR.pdu_size).airtime_s(AIR.mcs, 1)


def measure(seed: int, seconds: float, size: int = 115, rate_hz: float = 200.0) -> LockStep:
    """Measure between two full-duplex radios at 5 Msps."""
    modem = ModemParams(rate_hz=AIR.rate_hz, mcs=AIR.mcs, block_s=BLOCK_S)
    stations = asyncio.run(_run(seed, seconds, size, rate_hz, modem))
    return LockStep(
        np.concatenate([each.latencies_s for each in stations]),
        np.concatenate([each.errors_s for each in stations]),
        airtime_s(),
    )


async def _run(
    seed: int, seconds: float, size: int, rate_hz: float, modem: ModemParams
) -> list[_Stamped]:
    air = AirParams(rate_hz=AIR.rate_hz, snr_db=25.0, block_s=BLOCK_S)
    radios = {node: RadioParams(full_duplex=True, clock_ppm=ppm) for node, ppm in PPM.items()}
    rng = np.random.default_rng(seed)

    def make(node: int, radio: object) -> _Stamped:
        phase_s, pace = rng.uniform(0, 1 / rate_hz), 1 + 1e-6 * PPM[node]
        times = phase_s + np.arange(round(seconds * rate_hz)) / rate_hz
        # The link counts time by its own crystal.
        arrivals = [
            Arrival(float(at * pace), DATA, CDR + _AT.pack(at) + rng.bytes(size - 12))
            for at in times
        ]
        return _Stamped(
            node, radio, AccessParams(), modem, AIR.pdu_size, arrivals, 100 * seed + node,
            ClockParams(), pace=pace,
        )  # fmt: skip

    return await play(air, radios, make, seconds + 0.1, seed)
