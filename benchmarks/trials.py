"""Sends bursts through a radio's imperfections and noise, and counts the lost ones."""

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.stats import beta

from phy import FrontEnd, FrontEndParams, Path, PathParams, PduHeard, Receiver, Transmitter

LEAD_IN = 300
LEVEL_DBFS = -15.0
"""Mean burst power at the converter."""
PPM = 40.0
CONFIDENCE = 0.95


@dataclass(frozen=True)
class Air:
    """The channel between a transmitter and a receiver of bursts.

    The crystals differ by ±`ppm`, which shifts centre frequency and sample rate. The transmitter
    has an image of -36 dB and a leak of -35 dBc. The receiver has an image of -34 dB, DC of -25 dBc
    and 8 bits, with bursts at -15 dBFS. The oscillators have -90 dBc/Hz at 10 kHz.
    """

    rate_hz: float = 5e6
    centre_hz: float = 2.4e9
    profile: str = "awgn"
    doppler_hz: float = 0.0
    ppm: float = PPM


def bursts(
    air: Air, mcs: int, n_bytes: int, snr_db: float, seed: int, n_pdus: int = 1
) -> Iterator[tuple[list[bytes], NDArray[np.complex64]]]:
    """Endless bursts: the PDUs of each, and what a receiver samples of it, after some noise.

    SNR is the burst's mean power over that of the noise in the sample band. A fading channel is
    drawn anew for each burst; its mean power counts.
    """
    rng = np.random.default_rng(seed)
    transmitter, front_end = Transmitter(), _front_end(snr_db, rng)
    while True:
        pdus = [rng.bytes(n_bytes) for _ in range(n_pdus)]
        yield pdus, _received(air, transmitter.modulate(pdus, mcs), front_end, rng)


def frames(
    air: Air, wave: NDArray[np.complex64], snr_db: float, seed: int
) -> Iterator[NDArray[np.complex64]]:
    """Another modem's frame `wave` `[n]` of mean power 1, again and again, as in `bursts`."""
    rng = np.random.default_rng(seed)
    front_end = _front_end(snr_db, rng)
    while True:
        yield _received(air, wave, front_end, rng)


def _front_end(snr_db: float, rng: np.random.Generator) -> FrontEnd:
    front = FrontEndParams(
        noise_dbfs=LEVEL_DBFS - snr_db, image_db=34.0, dc_dbfs=LEVEL_DBFS - 25.0, bits=8
    )
    return FrontEnd(front, rng)


def _received(
    air: Air, wave: NDArray[np.complex64], front_end: FrontEnd, rng: np.random.Generator
) -> NDArray[np.complex64]:
    """What a receiver samples of a burst, after some noise."""
    params = PathParams(
        rate_hz=air.rate_hz,
        centre_hz=air.centre_hz,
        profile=air.profile,
        doppler_hz=air.doppler_hz,
        clock_ppm=rng.uniform(-air.ppm, air.ppm),
        loss_db=-LEVEL_DBFS,
        image_db=36.0,
        leak_db=35.0,
        phase_noise_dbc_hz=-90.0,
    )
    _, x = Path(params, rng).carry(wave)
    lead = np.zeros(LEAD_IN + int(rng.integers(64)), np.complex64)
    return front_end.receive(np.concatenate((lead, x.astype(np.complex64))))


@dataclass(frozen=True)
class ErrorRate:
    """How many of `n` trials failed: `errors`."""

    n: int
    errors: int

    @property
    def share(self) -> float:
        """The observed error rate."""
        return self.errors / self.n

    @property
    def bound(self) -> float:
        """Upper bound of the error rate with 95 % confidence (Clopper and Pearson)."""
        if self.errors == self.n:
            return 1.0
        return float(beta.ppf(CONFIDENCE, self.errors + 1, self.n - self.errors))


def error_rate(
    air: Air, mcs: int, n_bytes: int, snr_db: float, seed: int, n: int, enough: int
) -> ErrorRate:
    """Run trials with bursts of one PDU until `enough` errors, at most `n`."""
    return lost_of(air, bursts(air, mcs, n_bytes, snr_db, seed), n, enough)


def lost_of(
    air: Air, stream: Iterator[tuple[list[bytes], NDArray[np.complex64]]], n: int, enough: int
) -> ErrorRate:
    """Count the PDUs that are lost of the first `n` bursts, or until `enough` are."""
    receiver = Receiver(max_frequency=air.ppm * 1e-6 * air.centre_hz / air.rate_hz)
    tried, errors, missing = 0, 0, set[bytes]()
    for _, (pdus, x) in zip(range(n), stream, strict=False):
        heard = {event.data for event in receiver.push(x) if isinstance(event, PduHeard)}
        # The end of a burst may only be reported with the first samples of the next.
        errors += len(missing - heard)
        missing = set(pdus) - heard
        tried += len(pdus)
        if errors >= enough:
            break
    heard = {event.data for event in receiver.flush() if isinstance(event, PduHeard)}
    return ErrorRate(tried, errors + len(missing - heard))


def needed_snr_db(
    rate_at: Callable[[float, int, int], ErrorRate],
    guess_db: float,
    error_rate: float,
    n: int,
    surely: bool = True,
) -> tuple[float, int]:
    """(SNR in dB from which on the error rate is `surely` below `error_rate`, trials).

    `rate_at(snr_db, n, enough)` measures. The SNR changes in steps of a quarter dB until the 95 %
    bounds (else the observed rates) enclose the rate, followed by a straight line between their
    logarithms.
    """
    if surely and error_rate < 3 / n:
        raise ValueError(f"{n} trials cannot show an error rate of {error_rate}")
    enough, trials = max(10, round(n * error_rate)), 0
    step, known = 0.25, dict[float, float]()

    def bound(snr_db: float) -> float:
        nonlocal trials
        if snr_db not in known:
            measured = rate_at(snr_db, n, 2 * enough)
            trials += measured.n
            seen = max(measured.share, 0.3 / measured.n)
            known[snr_db] = measured.bound if surely else seen
        return known[snr_db]

    low = high = step * round(guess_db / step)
    while bound(high) > error_rate:
        high += step
    low = high - step
    while bound(low) <= error_rate:
        low -= step
    high = low + step
    above, below = math.log(bound(low)), math.log(bound(high))
    return low + step * (above - math.log(error_rate)) / (above - below), trials
