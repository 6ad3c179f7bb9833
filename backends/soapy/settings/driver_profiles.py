"""What is known of drivers without their devices: one table, a row per driver."""

from typing import NamedTuple


class DriverProfile(NamedTuple):
    """Properties of a driver that it does not report, or only once its device is open."""

    least_rate_hz: float = 0.0
    """The lowest rate that works; some drivers wrongly claim lower ones."""
    transfer: int = 0
    """Number of samples that the driver moves at once; 0: few."""
    in_flight: int = 0
    """Number of transfers that the driver accepts ahead of the antenna."""
    full_duplex: bool = True
    """Whether the device receives while it sends, and stamps its samples."""


PROFILES = {
    "bladerf": DriverProfile(),
    "hackrf": DriverProfile(least_rate_hz=2e6, transfer=131_072, in_flight=4, full_duplex=False),
    "lime": DriverProfile(),
    "uhd": DriverProfile(),
    "usrp": DriverProfile(),
}
"""The profile of each known driver, by its name in lower case."""

UNKNOWN = DriverProfile()
"""The profile of any other driver: full duplex, with time stamps."""


def profile_of(driver: str) -> DriverProfile:
    """The profile of a driver by its name in any case; UNKNOWN if there is none."""
    return PROFILES.get(driver.lower(), UNKNOWN)
