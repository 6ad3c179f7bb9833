"""Plans a replay: which parts of a recording are sent, and at which power."""

import math
from typing import NamedTuple

from sdrlinkd.errors import UserError
from sdrlinkd.iq.recording import IqRecording, Progress
from sdrlinkd.iq.stretches import LEAST, Stretch, silence_of, stretches_of

LONGEST_S = 2.0
RATE_TOLERANCE = 1e-6
ROOM_S = 0.5


class ReplayPlan(NamedTuple):
    """The stretches of a recording that are not silence, and the gain for their samples."""

    stretches: list[Stretch]
    gain: float
    silence_dbfs: float
    room_s: float
    """Burst length in s; the radio's memory must have room for two such bursts."""


def plan_replay(
    recording: IqRecording,
    rate_hz: float,
    silence_dbfs: float | None,
    backoff_db: float | None,
    progress: Progress,
) -> ReplayPlan:
    """The plan for a modem with sample rate `rate_hz`. Raises UserError.

    `silence_dbfs` is the power below which samples are silence (None: a little above the quietest
    part). `backoff_db` is the mean power of the strongest stretch below full scale (None: as
    recorded).
    """
    _check_rate(recording, rate_hz)
    silence = silence_of(recording) if silence_dbfs is None else 10 ** (silence_dbfs / 10)
    found = stretches_of(recording, silence, round(LONGEST_S * rate_hz), progress)
    level_db = 10 * math.log10(max(silence, LEAST))
    if not found:
        raise UserError(
            f"{recording.info.path}: nothing in it exceeds {level_db:.1f} dBFS; allowed: "
            "a lower --silence-db"
        )
    longest_s = max(each.n for each in found) / rate_hz
    gain = _gain(recording, found, backoff_db)
    return ReplayPlan(found, gain, level_db, 1.5 * longest_s + ROOM_S)


def _check_rate(recording: IqRecording, rate_hz: float) -> None:
    stated = recording.info.rate_hz
    if stated is not None and abs(stated / rate_hz - 1) > RATE_TOLERANCE:
        raise UserError(
            f"{recording.info.path}: sampled at {stated:.10g} Hz, but the modem is set to "
            f"{rate_hz:.10g} Hz; allowed: modem.rate_hz (--rate) of the recording, with "
            "modem.oversampling (--oversampling) if the radio must be faster; or resample it"
        )


def _gain(recording: IqRecording, stretches: list[Stretch], backoff_db: float | None) -> float:
    power = max(max(each.power for each in stretches), LEAST)
    peak = max(each.peak for each in stretches)
    gain = 1.0 if backoff_db is None else 10 ** (-backoff_db / 20) / math.sqrt(power)
    if gain * peak > 1:
        least_db = math.ceil(10 * (20 * math.log10(peak) - 10 * math.log10(power))) / 10
        asked = "as recorded" if backoff_db is None else f"got {backoff_db:g}"
        raise UserError(
            f"{recording.info.path}: --backoff-db: {asked}; its peaks would be "
            f"{20 * math.log10(gain * peak):.1f} dB beyond full scale; allowed: at least "
            f"{least_db:.1f}"
        )
    return gain
