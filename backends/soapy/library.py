"""Which SoapySDR there is, and what is wrong where a device cannot be had."""

from pathlib import Path

from backends.soapy.surface import DriverError, Library

MODULES = {
    "airspy": "airspy", "bladerf": "bladeRF", "hackrf": "HackRF", "lime": "LMS7",
    "plutosdr": "PlutoSDR", "remote": "remote", "rtlsdr": "rtlsdr", "uhd": "uhd",
}  # fmt: skip
"""What the file of a driver's module has in its name; in lower case, so has Debian's package."""


def load_library() -> Library:
    """The official binding where it can be loaded, else the C library. Raises DriverError."""
    try:
        from backends.soapy.official import OfficialLibrary
    except ImportError:
        from backends.soapy.native import NativeLibrary

        return NativeLibrary()
    return OfficialLibrary()


def named_in(args: str) -> dict[str, str]:
    """`driver=hackrf,serial=…` by key; of two values the first."""
    pairs = (part.partition("=") for part in reversed(args.split(",")))
    return {key.strip(): value.strip() for key, _, value in pairs}


def driver_of(args: str) -> str:
    """`hackrf` of `driver=hackrf,serial=…`; empty where none is named."""
    return named_in(args).get("driver", "")


def has_module(library: Library, driver: str) -> bool | None:
    """Whether the driver's module is loaded; None: of this one nobody knows its file's name."""
    wanted = MODULES.get(driver, driver).lower()
    if any(wanted in Path(each).name.lower() for each in library.modules()):
        return True
    return False if driver in MODULES else None


def is_driver_missing(library: Library, args: str, error: DriverError) -> bool:
    """Whether a device could not be opened because no module has its driver."""
    driver = driver_of(args)
    return bool(driver) and not has_module(library, driver) and "no match" in str(error)


def no_radio(args: str) -> str:
    """Why what `args` names is no radio; empty where it may be one."""
    if driver_of(args) != "null":
        return ""
    return (
        f'soapy.device: got "{args}", which is built into SoapySDR and is no radio: it neither '
        "sends nor receives; allowed: a radio's driver, such as driver=hackrf; those here are "
        "shown by: sdrlinkctl radio probe"
    )


def why_not(library: Library, args: str, error: DriverError) -> str:
    """Why no device could be opened by `args`, and what to do."""
    driver = driver_of(args)
    text = str(error)
    if is_driver_missing(library, args, error):
        there = ", ".join(sorted(Path(each).name for each in library.modules())) or "none"
        return (
            f'soapy.device: got "{args}", but SoapySDR has no driver "{driver}" (its modules: '
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
        "see that you may open it (udev rules), and look with: sdrlinkctl radio probe"
    )


def not_installed(error: DriverError) -> str:
    """Why there is no SoapySDR, and what to do."""
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
