"""Explains why a device is not available, in sentences that say what to do."""

from backends.soapy.binding.api import DriverError, Library
from backends.soapy.binding.device_args import driver_of
from backends.soapy.binding.library import MODULES, driver_name, has_module


def is_driver_missing(library: Library, args: str, error: DriverError) -> bool:
    """Whether a device could not be opened because no module has its driver."""
    driver = driver_of(args)
    return bool(driver) and not has_module(library, driver) and "no match" in str(error)


def no_radio(args: str) -> str:
    """Why `args` cannot name a radio; empty if they may."""
    if driver_of(args) != "null":
        return ""
    return (
        f'soapy.device: got "{args}", which is built into SoapySDR and not a radio: it neither '
        "sends nor receives; allowed: a radio's driver, such as driver=hackrf; `sdrlinkctl "
        "radio probe` lists the attached radios"
    )


def why_not(library: Library, args: str, error: DriverError) -> str:
    """Why no device could be opened with `args`, and what to do."""
    driver = driver_of(args)
    text = str(error)
    if is_driver_missing(library, args, error):
        there = ", ".join(sorted(map(driver_name, library.modules()))) or "none"
        return (
            f'soapy.device: got "{args}", but SoapySDR has no driver "{driver}" (its drivers: '
            f"{there}); install its module{_package(driver)}, or name another driver"
        )
    if any(word in text.lower() for word in ("busy", "in use", "claimed")):
        return (
            f'soapy.device: got "{args}", but the device is in use ({text}); stop the other '
            "program, or name another device by its serial"
        )
    others = [_named(each) for each in _found(library)]
    offered = f"; found here: {'; '.join(others)}" if others else "; no device was found here"
    return (
        f'soapy.device: got "{args}", but there is no such device ({text}){offered}. Plug it in, '
        "check that you may open it (udev rules), and run: sdrlinkctl radio probe"
    )


def not_installed(error: DriverError) -> str:
    """Why SoapySDR is not available, and what to do."""
    return (
        f"SoapySDR is not installed ({error}); on Debian: apt-get install libsoapysdr0.8 "
        "soapysdr-tools and the radio's soapysdr-module-…"
    )


def _package(driver: str) -> str:
    name = MODULES.get(driver, "").lower()
    return f" (on Debian: apt-get install soapysdr-module-{name})" if name else ""


def _found(library: Library) -> list[dict[str, str]]:
    try:
        return library.enumerate("")
    except DriverError:
        return []


def _named(device: dict[str, str]) -> str:
    keys = ("driver", "serial", "label")
    return ",".join(f"{key}={device[key]}" for key in keys if device.get(key))
