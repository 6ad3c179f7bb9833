"""The events that a receiver reports, and the names of its counters."""

import math
from math import inf
from typing import NamedTuple

_LEAST_SNR = 1e-6
_BY_CHANCE = 0.25
"""Pilots that differ by chance, or as peaks were clipped, seem to hide so many bits: 0.75 dB."""


class BurstQuality(NamedTuple):
    """A burst's header, and how well the burst was received.

    `start` is the absolute index of the preamble's first sample. SNR is mean burst power over noise
    power in the sample band; EVM is that of the header's points.
    """

    start: int
    mcs: int
    n_pdus: int
    pdu_bytes: int
    network: int
    snr_db: float
    rssi_dbfs: float
    evm_db: float
    cfo: float
    """Frequency offset in cycles per sample."""

    @property
    def noise(self) -> float:
        """Power of the noise beside the burst, or up to twice that."""
        return 10 ** (self.rssi_dbfs / 10) / (1 + 10 ** (self.snr_db / 10))


class PduHeard(NamedTuple):
    """PDU `number` of a burst, with a correct CRC-32; `at` is the index after its last sample.

    With the last PDU comes the `doppler` of the echoes during the burst, in cycles per sample.
    """

    data: bytes
    number: int
    at: int
    burst: BurstQuality
    snr_db: float
    """SNR that its LLRs had: that of the burst, less what interference hid; see `snr_of_llrs`."""
    doppler: float | None = None


class BurstOver(NamedTuple):
    """The end of a burst whose header was read.

    `ending`: "whole", or why it ended early: "faded" (its power vanished), "cut" (samples are
    missing), "foreign" (another network's: not decoded), "displaced" (two others began in it).
    """

    burst: BurstQuality
    n_good: int
    ending: str


class Claim(NamedTuple):
    """The air that a burst takes, by its header: absolute indices, and the SNR of its preamble.

    The claim of a burst whose power vanished ends there.
    """

    start: int
    end: int
    snr_db: float = -inf


Event = PduHeard | BurstOver


def snr_of_llrs(snr_db: float, hidden: float) -> float:
    """The SNR in dB at which `hidden` bits fewer could be sent on a subcarrier than at `snr_db`.

    Interference hid them: its power on all subcarriers, samples and subcarriers that were cut. This
    does not depend on the MCS, so that rate control finds the one that the interference leaves, and
    then stays there. Clipped peaks hide bits, too: far above what an MCS needs, up to one.
    """
    if hidden < _BY_CHANCE:
        return snr_db
    left = (1 + 10 ** (snr_db / 10)) / 2**hidden - 1
    return round(10 * math.log10(max(left, _LEAST_SNR)), 3)


COUNTERS = (
    "samples",
    "samples_bad",
    "windows_notched",
    "windows_not_notched",
    "pulses_blanked",
    "gaps",
    "triggers",
    "preambles",
    "peaks_skipped",
    "headers_bad",
    "headers_refused",
    "bursts",
    "bursts_foreign",
    "bursts_faded",
    "bursts_cut",
    "bursts_displaced",
    "captures",
    "samples_searched_again",
    "pdus_good",
    "pdus_bad",
)
"""Names of a receiver's counters, which start at 0 and only grow."""
