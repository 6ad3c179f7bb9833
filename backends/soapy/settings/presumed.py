"""Presumes what a device can do before it is opened."""

from typing import NamedTuple

from backends.base import Capabilities
from backends.soapy.binding import parse_device_args
from backends.soapy.settings.device_info import DeviceInfo
from backends.soapy.settings.driver_profiles import PROFILES, profile_of
from backends.soapy.settings.soapy_settings import SoapySettings, in_flight


class Presumed(NamedTuple):
    """What a radio should be able to do; `driver` is empty if its driver is unknown."""

    capabilities: Capabilities
    driver: str


def presume(settings: SoapySettings) -> Presumed:
    """Presume a device's properties from its driver, or from the model that a test radio imitates.

    An unknown device is presumed to be full duplex, with time stamps.
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
