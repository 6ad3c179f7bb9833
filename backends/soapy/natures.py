"""What is known of drivers without a device at hand."""

from typing import NamedTuple

from backends.base import Capabilities
from backends.soapy.library import named_in
from backends.soapy.settings import Found, SoapySettings, in_flight

TRANSFERS = {"hackrf": 131_072}
"""Samples that it moves at once."""
HALF_DUPLEX = ("hackrf",)
STAMPED = ("bladerf", "lime", "uhd", "usrp")
"""Drivers of full-duplex radios that stamp their samples."""


class Presumed(NamedTuple):
    """What a radio should be able to do; `driver` is empty where nothing is known of its driver."""

    capabilities: Capabilities
    driver: str


def presume(settings: SoapySettings) -> Presumed:
    """Of the device that `settings` name, by its driver, or by the model that a test radio plays.

    One that is not known is taken for a radio that sends while it listens, and keeps time.
    """
    named = named_in(settings.device.lower())
    known = [*TRANSFERS, *HALF_DUPLEX, *STAMPED]
    driver = next((named[key] for key in ("driver", "model") if named.get(key) in known), "")
    is_half = driver in HALF_DUPLEX
    transfer_s = TRANSFERS.get(driver, 0) / settings.rate_hz
    found = Found(
        driver=driver,
        hardware="",
        binding="",
        rate_hz=settings.rate_hz,
        frequency_hz=settings.frequency_hz,
        full_duplex=not is_half,
        has_time=not is_half,
        receives_in_s=max(settings.block_s, transfer_s),
        tx_transfer_s=transfer_s,
        in_flight=in_flight(settings, driver),
    )
    return Presumed(settings.capabilities(found), driver)
