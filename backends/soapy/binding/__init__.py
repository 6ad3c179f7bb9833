"""SoapySDR itself: which library is installed, the calls that we need, and devices by name.

This package owns both bindings, the official one and the C library's, behind one set of protocols,
and explains why a device is not available. It never decides a device's settings, holds no thread,
and knows nothing of daemons, bursts or sample indices.
"""

from backends.soapy.binding.api import (
    CORRUPTION,
    END_BURST,
    ERRORS,
    HAS_TIME,
    NOT_SUPPORTED,
    OVERFLOW,
    RX,
    SAMPLE_BYTES,
    TIME_ERROR,
    TIMEOUT,
    TX,
    UNDERFLOW,
    DriverError,
    HostError,
    Library,
    Range,
    Stream,
    StreamResult,
    Values,
)
from backends.soapy.binding.device import DIRECTIONS, Device
from backends.soapy.binding.device_args import driver_of, parse_device_args
from backends.soapy.binding.diagnosis import is_driver_missing, no_radio, not_installed, why_not
from backends.soapy.binding.library import (
    driver_name,
    has_module,
    load_library,
    load_native_library,
)

__all__ = [
    "CORRUPTION",
    "DIRECTIONS",
    "END_BURST",
    "ERRORS",
    "HAS_TIME",
    "NOT_SUPPORTED",
    "OVERFLOW",
    "RX",
    "SAMPLE_BYTES",
    "TIMEOUT",
    "TIME_ERROR",
    "TX",
    "UNDERFLOW",
    "Device",
    "DriverError",
    "HostError",
    "Library",
    "Range",
    "Stream",
    "StreamResult",
    "Values",
    "driver_name",
    "driver_of",
    "has_module",
    "is_driver_missing",
    "load_library",
    "load_native_library",
    "no_radio",
    "not_installed",
    "parse_device_args",
    "why_not",
]
