"""What a device is to be set to, what is known of its driver, and what follows for sending.

This room owns the section `[soapy]` of a configuration, the table of drivers, and the arithmetic
from a device's nature to its lead, turnaround and TX windows. It only computes: it never opens a
device, loads no library and starts nothing.
"""

from backends.soapy.settings.checks import soapy_presumption, soapy_problem, soapy_unchecked
from backends.soapy.settings.device_info import DeviceInfo
from backends.soapy.settings.driver_profiles import profile_of
from backends.soapy.settings.params import SoapyParams
from backends.soapy.settings.presumed import Presumed, presume
from backends.soapy.settings.soapy_settings import SettingError, SoapySettings, in_flight
from backends.soapy.settings.tx_timing import (
    HANDOVER_S,
    TRAILING,
    TxHardware,
    TxTiming,
    timestamped_tx,
    timing_of,
)

__all__ = [
    "HANDOVER_S",
    "TRAILING",
    "DeviceInfo",
    "Presumed",
    "SettingError",
    "SoapyParams",
    "SoapySettings",
    "TxHardware",
    "TxTiming",
    "in_flight",
    "presume",
    "profile_of",
    "soapy_presumption",
    "soapy_problem",
    "soapy_unchecked",
    "timestamped_tx",
    "timing_of",
]
