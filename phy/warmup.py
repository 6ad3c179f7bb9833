"""Compiles every kernel, or loads it from the cache, before the first burst needs it."""

import numpy as np

from phy.channel import Path, PathParams
from phy.mcs import MCS_TABLE
from phy.oversampling import Downsampler, upsample
from phy.receiver import Receiver
from phy.sensing import CarrierSense
from phy.transmitter import Transmitter


def warm_up() -> None:
    """Send a PDU through every MCS. Seconds on a fresh machine, a fraction of one later."""
    transmitter, receiver, sense = Transmitter(), Receiver(), CarrierSense()
    path = Path(PathParams(rate_hz=1e6, carrier_hz=1e9, clock_ppm=1.0), np.random.default_rng(0))
    for mcs in MCS_TABLE:
        _, samples = path.carry(transmitter.modulate([bytes(32)], mcs.index))
        receiver.push(samples)
        sense.push(samples)
        receiver.flush()
    Downsampler(2).push(upsample(samples, 2))
