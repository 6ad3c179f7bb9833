"""Looking into recordings of samples: spectra, points, PDUs."""

from sdrlinkd.iq.modem_info import McsInfo, ModemInfo, modem_info
from sdrlinkd.iq.recording import IqRecording, Points
from sdrlinkd.iq.spectrum import Spectrum, spectrum_of

__all__ = [
    "IqRecording",
    "McsInfo",
    "ModemInfo",
    "Points",
    "Spectrum",
    "modem_info",
    "spectrum_of",
]
