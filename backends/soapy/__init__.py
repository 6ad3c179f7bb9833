"""Real radios, through SoapySDR (https://github.com/pothosware/SoapySDR).

This folder itself holds the daemon's side: SoapyRadio and what it knows of its radio process. The
daemon never loads SoapySDR or a driver: `radio_process` and `probe` do, in processes of their own.
"""

from backends.soapy.binding import driver_of
from backends.soapy.probe import (
    Assessment,
    DeviceProbe,
    DirectionProbe,
    ProbeReport,
    assess_device,
    probe_devices,
)
from backends.soapy.radio import SoapyRadio
from backends.soapy.settings import (
    SoapyParams,
    SoapySettings,
    soapy_presumption,
    soapy_problem,
    soapy_unchecked,
)

__all__ = [
    "Assessment",
    "DeviceProbe",
    "DirectionProbe",
    "ProbeReport",
    "SoapyParams",
    "SoapyRadio",
    "SoapySettings",
    "assess_device",
    "driver_of",
    "probe_devices",
    "soapy_presumption",
    "soapy_problem",
    "soapy_unchecked",
]
