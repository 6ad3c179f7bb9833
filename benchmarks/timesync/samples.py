"""Sample clocks of two robots on the simulated air: the links' estimates, and the truth."""

import asyncio
from collections.abc import Sequence

import numpy as np

from backends import AirParams, Radio, RadioParams
from benchmarks.worlds.samples import Station, play
from sdrlinkd.config import ModemParams
from sdrlinkd.link import AccessParams, ClockParams

RATE_HZ = 1e6
PPM = {1: 12.0, 2: -9.0}
SNR_DB = 20.0
HZ = 5.0
PDU_SIZE = 256
EACH_S = 0.5
SETTLING_S = 5.0


class SampleClocks:
    """Measured errors in s, and bounds."""

    def __init__(self) -> None:
        self.errors_s: list[float] = []
        self.bounds_s: list[float] = []

    @property
    def rms_us(self) -> float:
        """RMS of the errors in µs."""
        return float(1e6 * np.sqrt(np.mean(np.square(self.errors_s))))


def measure(seed: int, seconds: float) -> SampleClocks:
    """Compare both robots' estimates of each other, from 5 s on, twice per second."""
    air = AirParams(rate_hz=RATE_HZ, snr_db=SNR_DB, block_s=0.002)
    radios = {node: RadioParams(full_duplex=True, clock_ppm=ppm) for node, ppm in PPM.items()}
    modem = ModemParams(rate_hz=RATE_HZ, mcs=1, block_s=air.block_s)
    clock = ClockParams(period_s=1 / HZ, share=0.5)
    found = SampleClocks()

    def make(node: int, radio: Radio) -> Station:
        return Station(node, radio, AccessParams(), modem, PDU_SIZE, (), 100 * seed + node, clock)

    def look(stations: Sequence[Station]) -> None:
        for station, other in zip(stations, reversed(stations), strict=True):
            _look(station, other.link.own_id, found)

    at_s = np.arange(SETTLING_S, seconds + EACH_S / 2, EACH_S).tolist()
    asyncio.run(play(air, radios, make, seconds, seed, look, at_s))
    return found


def _look(station: Station, other: int, found: SampleClocks) -> None:
    own = station.link.own_id
    now = station.modem.now()
    estimate = station.link.clock_estimate(other, now)
    if estimate is None:
        raise RuntimeError(f"robot {own} has no estimate of robot {other}'s clock")
    # Both sample counts began at the air's time 0.
    paces = [1 + 1e-6 * PPM[node] for node in (own, other)]
    truth_s = now * (1 - paces[1] / paces[0])
    found.errors_s.append(estimate.offset(now) - truth_s)
    found.bounds_s.append(estimate.bound(now))
