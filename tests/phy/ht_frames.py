"""802.11n frames of the mixed format (IEEE 802.11-2020, 19.3): they begin as 802.11a's do."""

import numpy as np

from tests.phy.wifi_frames import LONG, RATES, SHORT, beginning, coded, in_time, prefixed, symbol


def least_first(value, n):
    """`n` bits of a number, the least first."""
    return [value >> i & 1 for i in range(n)]


def crc8(bits):
    """x^8 + x^2 + x + 1 from all ones, complemented."""
    register = 0xFF
    for bit in bits:
        feedback = bit ^ register >> 7
        register = register << 1 & 0xFF ^ (0b111 if feedback else 0)
    return [1 - (register >> i & 1) for i in range(7, -1, -1)]


def high_throughput_frame(psdu):
    """Samples of one stream of 20 MHz at mean power 1; data are QPSK points that nobody coded."""
    bits = np.unpackbits(np.frombuffer(psdu, np.uint8), bitorder="little")
    bits = np.concatenate((bits, np.zeros(-len(bits) % 104, np.uint8)))
    data = (2.0 * bits.reshape(-1, 52, 2) - 1) @ np.array([1, 1j]) / np.sqrt(2)
    # The rest in octets of 6 Mb/s: HT-SIG, its training and data.
    parts = beginning(RATES[6][0], 3 * (4 + len(data)) - 3)
    field = least_first(1, 7) + [0] + least_first(len(psdu), 16) + [1, 1, 1] + [0] * 7
    spread = coded(field + crc8(field) + [0] * 6, "11")
    parts += [symbol(spread[:48], 1, 1, 1j), symbol(spread[48:], 1, 2, 1j)]
    short = in_time({k: (13 / 6) ** 0.5 * (1 + 1j) * sign for k, sign in SHORT.items()})
    parts += [np.tile(short, 2)[:80], prefixed(LONG | {-28: 1, -27: 1, 27: -1, 28: -1})]
    carriers = [k for k in range(-28, 29) if k and k not in (-21, -7, 7, 21)]
    pilots = {-21: 1, -7: 1, 7: 1, 21: -1}
    parts += [prefixed(dict(zip(carriers, points, strict=True)) | pilots) for points in data]
    return (np.concatenate(parts) * 64 / np.sqrt(52)).astype(np.complex64)
