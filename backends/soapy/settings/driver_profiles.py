"""What is known of drivers without a device at hand: one table, a row a driver."""

from typing import NamedTuple


class DriverProfile(NamedTuple):
    """What a driver does that it does not tell, or not before its device is open."""

    least_rate_hz: float = 0.0
    """The slowest rate that works; some drivers claim to go slower, and do not."""
    transfer: int = 0
    """Samples that it moves at once; 0: few."""
    in_flight: int = 0
    """Transfers that it takes ahead of the antenna."""
    full_duplex: bool = True
    """It receives while it sends, and stamps its samples."""


PROFILES = {
    "bladerf": DriverProfile(),
    "hackrf": DriverProfile(least_rate_hz=2e6, transfer=131_072, in_flight=4, full_duplex=False),
    "lime": DriverProfile(),
    "uhd": DriverProfile(),
    "usrp": DriverProfile(),
}
"""The profile of each driver known here, by its name in lower case."""

UNKNOWN = DriverProfile()
"""The profile of any other driver: a radio that sends while it listens, and keeps time."""


def profile_of(driver: str) -> DriverProfile:
    """The profile of a driver by its name in any case; UNKNOWN where there is none."""
    return PROFILES.get(driver.lower(), UNKNOWN)
