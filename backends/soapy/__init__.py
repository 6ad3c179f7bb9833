"""Real radios, through SoapySDR (https://github.com/pothosware/SoapySDR)."""

from backends.soapy.library import driver_of
from backends.soapy.natures import Presumed, presume
from backends.soapy.outlook import Outlook, outlook
from backends.soapy.params import SoapyParams
from backends.soapy.radio import SoapyRadio
from backends.soapy.setting_up import least_rate_hz
from backends.soapy.settings import SoapySettings
from backends.soapy.survey import DeviceSurvey, Survey, WaySurvey, survey

__all__ = [
    "DeviceSurvey",
    "Outlook",
    "Presumed",
    "SoapyParams",
    "SoapyRadio",
    "SoapySettings",
    "Survey",
    "WaySurvey",
    "driver_of",
    "least_rate_hz",
    "outlook",
    "presume",
    "survey",
]
