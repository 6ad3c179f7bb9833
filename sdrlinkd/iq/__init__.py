"""Recordings of samples: captured from a radio, analyzed, and replayed."""

from sdrlinkd.iq.capture import Capture, CaptureReport, CaptureState, CaptureWish
from sdrlinkd.iq.modem_info import McsInfo, ModemInfo, modem_info
from sdrlinkd.iq.recording import IqRecording, Points
from sdrlinkd.iq.replay import Replay, ReplayReport, ReplayState
from sdrlinkd.iq.replay_plan import ReplayPlan, plan_replay
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
    "Replay",
    "ReplayPlan",
    "ReplayReport",
    "ReplayState",
    "Spectrum",
    "modem_info",
    "plan_replay",
    "spectrum_of",
]
