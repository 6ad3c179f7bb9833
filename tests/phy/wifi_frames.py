"""An 802.11a transmitter written after the standard's text, independent of the modem."""

import zlib

import numpy as np


def signs(subcarriers, text):
    """±1 by subcarrier, without 0."""
    values = [1 if sign == "+" else -1 for sign in text]
    return dict(zip([k for k in subcarriers if k], values, strict=True))


# Signs of (1 + j) on subcarriers -24, -20, … 24 but 0, and the long training on -26 … 26 (17.3.3).
SHORT_SIGNS = "+-+--+--++++"
LONG_SIGNS = "++--++-+-++++++--++-+-++++" + "+--++-+-+-----++--+-+-++++"
SHORT = signs(range(-24, 25, 4), SHORT_SIGNS)
LONG = signs(range(-26, 27), LONG_SIGNS)
# SIGNAL's bits, bits per subcarrier, puncturing of A and B (table 17-6).
RATES = {
    6: (0b1101, 1, "11"), 9: (0b1111, 1, "111001"), 12: (0b0101, 2, "11"),
    18: (0b0111, 2, "111001"), 24: (0b1001, 4, "11"), 36: (0b1011, 4, "111001"),
    48: (0b0001, 6, "1110"), 54: (0b0011, 6, "111001"),
}  # fmt: skip
PILOTS = {-21: 1, -7: 1, 7: 1, 21: -1}
DATA = [k for k in range(-26, 27) if k and k not in PILOTS]


def register(state, n):
    """Output of x^7 + x^4 + 1 from the seven bits of `state`, the newest last."""
    out = []
    for _ in range(n):
        bit = state[-7] ^ state[-4]
        out.append(bit)
        state = [*state[1:], bit]
    return out


def coded(bits, pattern):
    """The K=7 code (133, 171), punctured."""
    out, past = [], [0] * 6
    for bit in bits:
        window = [bit, *past]
        out.append(sum(window[i] for i in (0, 2, 3, 5, 6)) % 2)
        out.append(sum(window[i] for i in (0, 1, 2, 3, 6)) % 2)
        past = window[:6]
    return [bit for i, bit in enumerate(out) if pattern[i % len(pattern)] == "1"]


def interleaved(bits, per_carrier):
    """The two permutations of a symbol's bits (17.3.5.7)."""
    n, s = len(bits), max(per_carrier // 2, 1)
    out = [0] * n
    for k, bit in enumerate(bits):
        i = (n // 16) * (k % 16) + k // 16
        out[s * (i // s) + (i + n - 16 * i // n) % s] = bit
    return out


def point(bits):
    """A point with Gray-coded levels on both axes (17.3.5.8)."""
    levels = {1: [-1, 1], 2: [-3, -1, 3, 1], 3: [-7, -5, -1, -3, 7, 5, 1, 3]}
    if len(bits) == 1:
        return 2 * bits[0] - 1
    half = len(bits) // 2
    scale = {1: 2, 2: 10, 3: 42}[half] ** -0.5
    number = [int("".join(map(str, part)), 2) for part in (bits[:half], bits[half:])]
    return scale * complex(*(levels[half][each] for each in number))


def in_time(subcarriers):
    """64 samples in the standard's scale."""
    bins = np.zeros(64, complex)
    for k, value in subcarriers.items():
        bins[k] = value
    return np.fft.ifft(bins)


def symbol(bits, per_carrier, number, turn=1):
    """One OFDM symbol with its prefix; SIGNAL is number 0. Data are rotated by `turn`."""
    spread = interleaved(bits, per_carrier)
    groups = [spread[i : i + per_carrier] for i in range(0, len(spread), per_carrier)]
    subcarriers = {k: turn * point(group) for k, group in zip(DATA, groups, strict=True)}
    polarity = 1 - 2 * register([1] * 7, 127)[number % 127]
    subcarriers |= {k: polarity * sign for k, sign in PILOTS.items()}
    return prefixed(subcarriers)


def prefixed(subcarriers):
    """A symbol of these subcarriers with its prefix."""
    body = in_time(subcarriers)
    return np.concatenate((body[-16:], body))


def with_fcs(body):
    return body + zlib.crc32(body).to_bytes(4, "little")


def training():
    """Ten short segments, and the long symbols with their prefix."""
    short = in_time({k: (13 / 6) ** 0.5 * (1 + 1j) * sign for k, sign in SHORT.items()})
    long = in_time(LONG)
    return [np.tile(short, 3)[:160], long[32:], long, long]


def signal(code, n_bytes):
    """SIGNAL's symbol."""
    head = [int(bit) for bit in f"{code:04b}0"] + [n_bytes >> i & 1 for i in range(12)]
    head += [sum(head) % 2] + [0] * 6
    return symbol(coded(head, "11"), 1, 0)


def ht_bits(mcs, n_bytes, wide):
    """HT-SIG's 48 bits with its CRC, computed by long division (19.3.9.4.4)."""
    bits = [mcs >> i & 1 for i in range(7)] + [int(wide)] + [n_bytes >> i & 1 for i in range(16)]
    bits += [1, 1, 1, 0, 0, 0, 0, 0, 0, 0]
    rest = [bit ^ (i < 8) for i, bit in enumerate(bits + [0] * 8)]
    for i in range(len(bits)):
        if rest[i]:
            for power in (8, 2, 1, 0):
                rest[i + 8 - power] ^= 1
    return bits + [1 - bit for bit in rest[-8:]] + [0] * 6


def ht_frame(mcs, n_bytes, wide=False, greenfield=False, n_symbols=7):
    """An 802.11n frame with arbitrary symbols as data and training."""
    ht = coded(ht_bits(mcs, n_bytes, wide), "11")
    parts, first = training(), 0
    if not greenfield:
        # A length at 6 Mbit/s that covers what follows.
        parts.append(signal(RATES[6][0], 3 * (2 + n_symbols) - 3))
        first = 1
    parts += [symbol(ht[48 * i : 48 * i + 48], 1, first + i, turn=1j) for i in range(2)]
    rng = np.random.default_rng(mcs)
    parts += [symbol(list(rng.integers(0, 2, 48)), 1, first + 2 + i) for i in range(n_symbols)]
    return (np.concatenate(parts) * 64 / np.sqrt(52)).astype(np.complex64)


def frame(psdu, mbps, seed=(1, 0, 1, 1, 1, 0, 1)):
    """Samples of a whole frame, at mean power 1."""
    code, per_carrier, pattern = RATES[mbps]
    parts = [*training(), signal(code, len(psdu))]
    data = [0] * 16 + [octet >> i & 1 for octet in psdu for i in range(8)]
    n_coded = 48 * per_carrier
    n_data = n_coded * len(pattern) // (2 * pattern.count("1"))
    n_symbols = -(-(len(data) + 6) // n_data)
    n_bits = n_symbols * n_data
    scrambler = register(list(seed), n_bits)
    padded = data + [0] * (n_bits - len(data))
    mixed = [bit ^ white for bit, white in zip(padded, scrambler, strict=True)]
    mixed[len(data) : len(data) + 6] = [0] * 6
    sent = coded(mixed, pattern)
    for number in range(n_symbols):
        bits = sent[number * n_coded : (number + 1) * n_coded]
        parts.append(symbol(bits, per_carrier, number + 1))
    samples = np.concatenate(parts) * 64 / np.sqrt(52)
    return samples.astype(np.complex64)
