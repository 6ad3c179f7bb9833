"""A device's settings, what is known of its driver, and the timing of bursts.

This package owns the section `[soapy]` of a configuration, the table of drivers, and the
computation of lead, turnaround and TX windows from a device's properties. It only computes: it
never opens a device, loads no library and starts nothing.
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
