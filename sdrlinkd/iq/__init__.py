"""Recordings of samples: made from a radio, looked into."""

from sdrlinkd.iq.capture import Capture, CaptureReport, CaptureState, CaptureWish
from sdrlinkd.iq.modem_info import McsInfo, ModemInfo, modem_info
from sdrlinkd.iq.recording import IqRecording, Points
from sdrlinkd.iq.spectrum import Spectrum, spectrum_of

__all__ = [
    "Capture",
    "CaptureReport",
    "CaptureState",
    "CaptureWish",
    "IqRecording",
    "McsInfo",
    "ModemInfo",
    "Points",
    "Spectrum",
    "modem_info",
    "spectrum_of",
]
