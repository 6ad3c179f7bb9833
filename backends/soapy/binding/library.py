"""Which SoapySDR is installed on this machine, and which of its driver modules are loaded."""

import re
from pathlib import Path

from backends.soapy.binding.api import Library

MODULES = {
    "airspy": "airspy", "bladerf": "bladeRF", "hackrf": "HackRF", "lime": "LMS7",
    "plutosdr": "PlutoSDR", "remote": "remote", "rtlsdr": "rtlsdr", "uhd": "uhd",
}  # fmt: skip
"""Part of the file name of each driver's module; lowercase, it is part of Debian's package name."""
_FILE = re.compile(r"(?:.*/)?(?:lib)?(.+?)(?:Support)?\.so.*")


def driver_name(path: str) -> str:
    """The driver of a module, as in soapy.device: `hackrf` for `libHackRFSupport.so`."""
    name = _FILE.sub(r"\1", path)
    return next((driver for driver, part in MODULES.items() if part == name), name.lower())


def load_library() -> Library:
    """Load the official binding if possible, else the C library. Raises DriverError."""
    try:
        from backends.soapy.binding.official import OfficialLibrary
    except ImportError:
        return load_native_library()
    return OfficialLibrary()


def load_native_library() -> Library:
    """Load the C library, even if the official binding is available. Raises DriverError."""
    from backends.soapy.binding.native import NativeLibrary

    return NativeLibrary()


def has_module(library: Library, driver: str) -> bool | None:
    """Whether the driver's module is loaded; None: the name of its file is unknown."""
    wanted = MODULES.get(driver, driver).lower()
    if any(wanted in Path(each).name.lower() for each in library.modules()):
        return True
    return False if driver in MODULES else None
