"""The SNR that each MCS needs in white noise, and the packet error rate at a given SNR.

SNR is mean burst power over noise power in the sample band; a burst that is not found loses all its
PDUs. A PDU is coded at its MCS's rate. If the burst's last symbol has room, the PDU gets more
parity: a short PDU alone in its burst needs up to 1.5 dB less than given here. For a PDU of n
codewords with k bits of it each, with x = sqrt(900 / k),

    PER = 1 − found · (1 − p)^n        p = Q((snr − half − 0.50 (x − 1)) / (spread x^1.03))

Measured with the modem itself: ±5 kHz of frequency offset at 1 Msps with the matching clock error,
random phase; every 0.4 dB, 200 to 2000 PDUs each. SNR in dB at PER 50, 10 and 1 %, by PDU size in
bytes:

    MCS        64              220             1024
     0    −2.8 −2.3 −1.9   −2.7 −2.4 −2.0   −2.5 −2.3 −2.0
     1     0.3  0.8  1.2    0.3  0.6  1.0    0.5  0.8  1.0
     2     3.5  4.0  4.4    3.4  3.7  4.1    3.5  3.6  3.9
     3     5.5  6.0  6.5    5.6  5.9  6.2    5.8  6.0  6.2
     4     9.6 10.2 10.7    9.4  9.8 10.2    9.4  9.7  9.9
     5    13.3 14.0 14.6   13.4 13.8 14.2   13.3 13.6 13.9
     6    14.7 15.4 16.0   14.7 15.1 15.5   14.7 15.0 15.4
     7    16.3 17.0 17.5   16.4 16.9 17.4   16.5 16.8 17.1
     8    19.9 20.6 21.3   19.7 20.2 20.7   19.8 20.1 20.4
     9    21.6 22.4 23.1   21.7 22.2 22.8   21.9 22.3 22.7

The formula is within 0.3 dB of all of them, and within 0.6 dB at 16 bytes. To measure one point
again (MCS, bytes, dB, PDUs; prints found, PER):

    python -c 'from tests.phy.test_error_rate import measured; print(measured(1, 220, 1.9, 1600))'
"""

import math
from functools import lru_cache

from phy.layout import layout
from phy.numerology import OFDM_64_16

REFERENCE_BITS = 900
# By MCS: SNR in dB at which half of the codewords of REFERENCE_BITS fail; its spread in dB.
HALF_LOST = (
    (-2.95, 0.29),
    (0.1, 0.32),
    (3.21, 0.33),
    (5.33, 0.36),
    (9.21, 0.38),
    (13.04, 0.45),
    (14.44, 0.42),
    (16.09, 0.46),
    (19.5, 0.49),
    (21.45, 0.50),
)
# Short codes need more SNR and have a flatter slope: by sqrt(900 / k).
SHORT_NEEDS_DB, SHORT_SPREADS = 0.50, 1.03
# Preamble and header: SNR in dB at which half are read, and the spread of a normal distribution.
HALF_FOUND = (-4.4, 1.08)

_LOWEST_DB, _HIGHEST_DB = -30.0, 60.0


def burst_found_rate(snr_db: float) -> float:
    """Probability that preamble and header of a burst are read, 0 … 1."""
    return 1 - _tail(snr_db, *HALF_FOUND)


def pdu_lost_rate(mcs: int, snr_db: float, pdu_bytes: int) -> float:
    """Probability that a PDU is lost in a burst that was found, 0 … 1.

    Raises ValueError for an MCS or size that no header can express.
    """
    half_db, spread, n_codewords = _threshold(mcs, pdu_bytes)
    lost = _tail(snr_db, half_db, spread)
    return 1.0 if lost == 1 else -math.expm1(n_codewords * math.log1p(-lost))


def pdu_error_rate(mcs: int, snr_db: float, pdu_bytes: int) -> float:
    """Probability that a PDU is lost, 0 … 1, including bursts that are not found.

    Raises ValueError for an MCS or size that no header can express.
    """
    lost, missed = pdu_lost_rate(mcs, snr_db, pdu_bytes), _tail(snr_db, *HALF_FOUND)
    return missed + (1 - missed) * lost


def needed_snr_db(mcs: int, pdu_bytes: int, per: float = 0.01) -> float:
    """SNR in dB at which `pdu_error_rate` is `per`.

    Raises ValueError for an MCS or size that no header can express, and for a `per` outside 0 … 1.
    """
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
    """(SNR in dB at which half of the codewords fail, its spread, codewords) of a PDU."""
    form = layout(OFDM_64_16, mcs, 1, pdu_bytes).form
    half_db, spread = HALF_LOST[mcs]
    shortness = math.sqrt(REFERENCE_BITS * form.n_codewords / form.n_bits)
    half_db += SHORT_NEEDS_DB * (shortness - 1)
    return half_db, spread * shortness**SHORT_SPREADS, form.n_codewords


def _tail(snr_db: float, half_db: float, spread: float) -> float:
    """Tail of the normal distribution, Q((snr − half) / spread)."""
    return 0.5 * math.erfc((snr_db - half_db) / (spread * math.sqrt(2)))
