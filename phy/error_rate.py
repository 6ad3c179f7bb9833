"""What SNR each MCS needs in white noise, and the packet error rate that an SNR gives.

SNR is mean burst power over noise power in the sample band, the PDU is the only one of its burst,
and a burst that is not found is a PDU lost. Errors in a PDU are as many as it is long:

    PER = 1 − found · exp(−ln 2 · bytes / 220 · exp(−steepness ((snr / snr_50)^0.8 − 1)))

Measured with the modem itself: ±5 kHz of carrier offset at 1 Msps, its clock error with it, random
phase; every 0.5 dB, 200 to 6000 bursts each. SNR in dB at PER 50, 10 and 1 %, by bytes of the PDU:

    MCS        64              220             1024
     0    −1.7 −0.7  0.1   −1.1 −0.3  0.5   −0.6  0.1  0.9
     1     1.3  2.2  3.2    2.0  2.8  3.5    2.6  3.3  4.0
     2     3.8  4.7  5.6    4.5  5.3  6.0    5.1  5.9  6.4
     3     6.4  7.5  8.5    7.2  8.2  9.2    7.9  8.8  9.7
     4     9.8 10.7 11.8   10.5 11.5 12.4   11.2 12.2 13.1
     5    13.4 14.7 15.9   14.4 15.6 16.8   15.3 16.4 17.4
     6    15.0 16.1 17.5   15.8 17.0 18.1   16.8 17.8 18.9

The law is within 0.2 dB of all of them. One point again (MCS, bytes, dB, bursts; found, PER):

    python -c 'from tests.phy.test_error_rate import measured; print(measured(1, 220, 3.5, 1600))'
"""

import math

from phy.layout import layout
from phy.numerology import OFDM_64_16

REFERENCE_BYTES = 220
# By MCS: SNR in dB at which a PDU of 220 bytes, its burst found, fails half the time; steepness.
HALF_LOST = (
    (-1.13, 12.2),
    (1.91, 11.4),
    (4.40, 11.5),
    (7.13, 9.3),
    (10.46, 9.7),
    (14.35, 8.0),
    (15.85, 8.3),
)
# 1 is the exponent that theory has, 0 a straight line over dB; this fits best.
BEND = 0.8
# Preamble and header: SNR in dB at which half are read, and the spread of a normal law.
HALF_FOUND = (-3.76, 1.10)

_LOWEST_DB, _HIGHEST_DB = -30.0, 60.0


def burst_found_rate(snr_db: float) -> float:
    """Probability that preamble and header of a burst are read, 0 … 1."""
    return 1 - _missed_rate(snr_db)


def pdu_error_rate(mcs: int, snr_db: float, pdu_bytes: int) -> float:
    """Probability that a PDU, alone in its burst, is not heard, 0 … 1.

    Raises ValueError for an MCS or size that no header can tell.
    """
    layout(OFDM_64_16, mcs, 1, pdu_bytes)
    half_db, steepness = HALF_LOST[mcs]
    ratio = 10 ** (BEND * min(snr_db - half_db, _HIGHEST_DB) / 10)
    errors = math.log(2) * pdu_bytes / REFERENCE_BYTES * math.exp(-steepness * (ratio - 1))
    missed = _missed_rate(snr_db)
    return missed + (1 - missed) * -math.expm1(-errors)


def needed_snr_db(mcs: int, pdu_bytes: int, per: float = 0.01) -> float:
    """SNR in dB at which `pdu_error_rate` is `per`; ValueError as there."""
    if not 0 < per < 1:
        raise ValueError(f"packet error rate: got {per}; allowed: more than 0 and less than 1")
    low, high = _LOWEST_DB, _HIGHEST_DB
    while high - low > 1e-6:
        middle = (low + high) / 2
        if pdu_error_rate(mcs, middle, pdu_bytes) > per:
            low = middle
        else:
            high = middle
    return high


def _missed_rate(snr_db: float) -> float:
    half_db, spread = HALF_FOUND
    return 0.5 * math.erfc((snr_db - half_db) / (spread * math.sqrt(2)))
