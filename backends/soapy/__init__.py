"""Real radios, through SoapySDR (https://github.com/pothosware/SoapySDR)."""

from backends.soapy.radio import SoapyRadio
from backends.soapy.settings import SoapySettings

__all__ = ["SoapyRadio", "SoapySettings"]
