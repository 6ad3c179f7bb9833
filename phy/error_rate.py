"""What SNR each MCS needs in white noise, and the packet error rate that an SNR gives.

SNR is mean burst power over noise power in the sample band; a burst that is not found loses all
its PDUs. A PDU is coded at its MCS's rate: where the burst's last symbol has room, there is more
parity, and a short PDU alone in its burst needs up to 1.5 dB less than told here. Of a PDU in n
codewords with k bits of it each, with x = sqrt(900 / k),

    PER = 1 − found · (1 − p)^n        p = Q((snr − half − 0.62 (x − 1)) / (spread x^0.7))

Measured with the modem itself: ±5 kHz of carrier offset at 1 Msps, its clock error with it, random
phase; every 0.4 dB, 200 to 3000 PDUs each. SNR in dB at PER 50, 10 and 1 %, by bytes of the PDU:

    MCS        64              220             1024
     0    −2.2 −1.6 −1.0   −2.1 −1.6 −0.9   −1.9 −1.5 −0.9
     1     0.8  1.4  2.0    0.8  1.3  1.9    1.1  1.5  2.1
     2     3.9  4.5  5.1    3.8  4.2  4.7    3.9  4.3  4.7
     3     6.0  6.5  7.0    6.1  6.5  7.1    6.4  6.8  7.2
     4     9.9 10.6 11.2    9.8 10.3 10.8    9.9 10.3 10.8
     5    13.8 14.6 15.1   13.9 14.4 15.0   13.9 14.3 14.8
     6    15.3 16.0 16.6   15.1 15.7 16.2   15.3 15.7 15.9
     7    16.8 17.5 18.2   16.9 17.4 18.0   17.0 17.4 17.9
     8    20.6 21.4 22.3   20.3 20.9 21.7   20.4 21.0 21.5
     9    22.3 23.2 24.0   22.3 23.0 23.7   22.6 23.2 23.7

The law is within 0.4 dB of all of them, and within 0.7 dB at 16 bytes. One point again (MCS, bytes,
dB, PDUs; found, PER):

    python -c 'from tests.phy.test_error_rate import measured; print(measured(1, 220, 1.9, 1600))'
"""

import math
from functools import lru_cache

from phy.layout import layout
from phy.numerology import OFDM_64_16

REFERENCE_BITS = 900
# By MCS: SNR in dB at which a codeword of so many bits fails half the time; spread in dB.
HALF_LOST = (
    (-2.52, 0.44),
    (0.45, 0.51),
    (3.45, 0.52),
    (5.72, 0.51),
    (9.56, 0.50),
    (13.35, 0.61),
    (14.87, 0.54),
    (16.42, 0.59),
    (20.01, 0.67),
    (21.94, 0.69),
)
# Short codes need more, and tell less sharply: by sqrt(900 / k).
SHORT_NEEDS_DB, SHORT_SPREADS = 0.62, 0.7
# Preamble and header: SNR in dB at which half are read, and the spread of a normal law.
HALF_FOUND = (-3.76, 1.10)

_LOWEST_DB, _HIGHEST_DB = -30.0, 60.0


def burst_found_rate(snr_db: float) -> float:
    """Probability that preamble and header of a burst are read, 0 … 1."""
    return 1 - _tail(snr_db, *HALF_FOUND)


def pdu_lost_rate(mcs: int, snr_db: float, pdu_bytes: int) -> float:
    """Probability that a PDU of a burst that is found is not heard, 0 … 1.

    Raises ValueError for an MCS or size that no header can tell.
    """
    half_db, spread, n_codewords = _threshold(mcs, pdu_bytes)
    lost = _tail(snr_db, half_db, spread)
    return 1.0 if lost == 1 else -math.expm1(n_codewords * math.log1p(-lost))


def pdu_error_rate(mcs: int, snr_db: float, pdu_bytes: int) -> float:
    """Probability that a PDU is not heard, 0 … 1; ValueError as there."""
    lost, missed = pdu_lost_rate(mcs, snr_db, pdu_bytes), _tail(snr_db, *HALF_FOUND)
    return missed + (1 - missed) * lost


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


@lru_cache(maxsize=256)
def _threshold(mcs: int, pdu_bytes: int) -> tuple[float, float, int]:
    """(SNR in dB at which a codeword fails half the time, its spread, codewords) of a PDU."""
    form = layout(OFDM_64_16, mcs, 1, pdu_bytes).form
    half_db, spread = HALF_LOST[mcs]
    shortness = math.sqrt(REFERENCE_BITS * form.n_codewords / form.n_bits)
    half_db += SHORT_NEEDS_DB * (shortness - 1)
    return half_db, spread * shortness**SHORT_SPREADS, form.n_codewords


def _tail(snr_db: float, half_db: float, spread: float) -> float:
    """Q((snr − half) / spread)."""
    return 0.5 * math.erfc((snr_db - half_db) / (spread * math.sqrt(2)))
