"""How a burst gets from one antenna to another."""

from typing import NamedTuple


class Way(NamedTuple):
    """What `phy.PathParams` says of one burst, without the rates that all bursts share."""

    profile: str
    delay_spread_s: float
    loss_db: float
    delay_s: float
    clock_ppm: float
    doppler_hz: float = 0.0
