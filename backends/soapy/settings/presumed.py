"""What a device should be able to do, before it is opened."""

from typing import NamedTuple

from backends.base import Capabilities
from backends.soapy.binding import parse_device_args
from backends.soapy.settings.device_info import DeviceInfo
from backends.soapy.settings.driver_profiles import PROFILES, profile_of
from backends.soapy.settings.soapy_settings import SoapySettings, in_flight


class Presumed(NamedTuple):
    """What a radio should be able to do; `driver` is empty where nothing is known of its driver."""

    capabilities: Capabilities
    driver: str


def presume(settings: SoapySettings) -> Presumed:
    """Presume of the device that `settings` name, by its driver or the model a test radio plays.

    One that is not known is taken for a radio that sends while it listens, and keeps time.
    """
    named = parse_device_args(settings.device.lower())
    driver = next((named[key] for key in ("driver", "model") if named.get(key) in PROFILES), "")
    profile = profile_of(driver)
    transfer_s = profile.transfer / settings.rate_hz
    found = DeviceInfo(
        driver=driver,
        hardware="",
        binding="",
        rate_hz=settings.rate_hz,
        frequency_hz=settings.frequency_hz,
        full_duplex=profile.full_duplex,
        has_time=profile.full_duplex,
        receives_in_s=max(settings.block_s, transfer_s),
        tx_transfer_s=transfer_s,
        in_flight=in_flight(settings, driver),
    )
    return Presumed(settings.capabilities(found), driver)
