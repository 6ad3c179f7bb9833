"""Real radios, through SoapySDR (https://github.com/pothosware/SoapySDR)."""

from backends.soapy.radio import SoapyRadio
from backends.soapy.settings import SoapySettings
from backends.soapy.survey import DeviceSurvey, Survey, WaySurvey, survey
from backends.soapy.traits import lead_s

__all__ = [
    "DeviceSurvey",
    "SoapyRadio",
    "SoapySettings",
    "Survey",
    "WaySurvey",
    "lead_s",
    "survey",
]
