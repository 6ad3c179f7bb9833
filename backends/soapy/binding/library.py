"""Which SoapySDR this machine has, and which of its driver modules are loaded."""

from pathlib import Path

from backends.soapy.binding.api import Library

MODULES = {
    "airspy": "airspy", "bladerf": "bladeRF", "hackrf": "HackRF", "lime": "LMS7",
    "plutosdr": "PlutoSDR", "remote": "remote", "rtlsdr": "rtlsdr", "uhd": "uhd",
}  # fmt: skip
"""What the file of a driver's module has in its name; in lower case, so has Debian's package."""


def load_library() -> Library:
    """The official binding where it can be loaded, else the C library. Raises DriverError."""
    try:
        from backends.soapy.binding.official import OfficialLibrary
    except ImportError:
        return load_native_library()
    return OfficialLibrary()


def load_native_library() -> Library:
    """The C library, also where the official binding is there. Raises DriverError."""
    from backends.soapy.binding.native import NativeLibrary

    return NativeLibrary()


def has_module(library: Library, driver: str) -> bool | None:
    """Whether the driver's module is loaded; None: of this one nobody knows its file's name."""
    wanted = MODULES.get(driver, driver).lower()
    if any(wanted in Path(each).name.lower() for each in library.modules()):
        return True
    return False if driver in MODULES else None
