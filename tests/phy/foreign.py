"""Third-party signals: pulses of aeroplanes, codes of satellites below the noise, Wi-Fi."""

import numpy as np

from tests.phy.signals import noise, noisy, silence, turned
from tests.phy.wifi_frames import frame, ht_frame, with_fcs


def echoed(rng, x):
    """`x` through a room: three paths."""
    echoes = np.zeros(12, np.complex64)
    echoes[[0, 3, 11]] = 1, 0.4 * np.exp(2j * np.pi * rng.random()), 0.2
    return np.convolve(x, echoes).astype(np.complex64)


def aeroplanes(rng):
    """Mode S at 2 Msps: pulses of 0.5 µs whose positions encode 112 bits, with many levels."""
    head = np.zeros(16)
    head[[0, 2, 7, 9]] = 1
    parts = []
    for _ in range(200):
        bits = rng.integers(0, 2, 112)
        pulses = np.concatenate((head, np.stack((bits, 1 - bits), axis=1).reshape(-1)))
        pulse_train = pulses * 10 ** rng.uniform(-1.5, 0)
        parts += [
            turned(pulse_train, rng.uniform(-0.1, 0.1)),
            silence(int(rng.integers(100, 2000))),
        ]
    x = np.concatenate(parts)
    return x + noise(rng, len(x), 1e-4)


def satellites(rng):
    """Eight spreading codes of 1023 chips, 4 samples per chip, each 20 dB below the noise."""
    x = noise(rng, 40_000)
    for _ in range(8):
        chips = np.repeat(rng.choice([-1.0, 1.0], 1023), 4)
        x += 0.1 * turned(np.resize(chips, len(x)), rng.uniform(-1e-3, 1e-3))
    return x


def wifi(rng, make, snr_db):
    """Twelve frames through a room, with pauses; the access point has another clock."""
    parts = [silence(400)]
    for _ in range(12):
        psdu = with_fcs(rng.bytes(int(rng.integers(20, 400))))
        frequency = rng.uniform(-0.005, 0.005)
        parts += [turned(make(psdu), frequency), silence(int(rng.integers(100, 900)))]
    return noisy(rng, echoed(rng, np.concatenate(parts)), snr_db)


FOREIGN = {
    "aeroplanes": aeroplanes,
    "satellites": satellites,
    "wifi-6": lambda rng: wifi(rng, lambda psdu: frame(psdu, 6), 15),
    "wifi-24": lambda rng: wifi(rng, lambda psdu: frame(psdu, 24), 30),
    "wifi-54": lambda rng: wifi(rng, lambda psdu: frame(psdu, 54), 30),
    "wifi-n": lambda rng: wifi(rng, lambda psdu: ht_frame(1, len(psdu)), 25),
}
