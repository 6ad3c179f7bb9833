"""The modem's cost: samples per second of one core's time, compared with other modems.

CPU time of this thread, best of several rounds. Bursts with random PDUs follow one another after
GAP samples of noise, at 30 dB. In brackets: scaled by the speed of liquid-dsp in the same run,
relative to its speed on the machine on which the targets were set.
"""

import math
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from benchmarks.absent import attempt
from benchmarks.peers.modems import GnuRadio, Liquid
from benchmarks.report import Row, main
from phy import MCS_TABLE, FrontEnd, FrontEndParams, Receiver, Transmitter

GAP = 100
SNR_DB = 30.0
BLOCK = 8192
QPSK12, QAM64_34 = 1, 6
# Msps of liquid-dsp 1.5.0 without a code on the reference machine: [bits, bytes] to (tx, rx).
_LIQUID_THERE = {(2, 64): (126.0, 23.2), (2, 220): (109.0, 22.4), (6, 220): (87.0, 21.4)}
_LIQUID_NOISE_THERE = 67.0


@dataclass(frozen=True)
class Peers:
    """Msps of other modems, measured once; (tx, rx) by bits per subcarrier and bytes."""

    liquid: dict[tuple[int, int], tuple[float, float]]
    gnuradio: dict[tuple[int, int], tuple[float, float]]
    noise: dict[str, float]

    def beside(self, way: int, bits: int, n_bytes: int) -> dict[str, float]:
        """Figures of the other modems; `way` 0 sends, 1 receives."""
        found = {"liquid-dsp": self.liquid, "GNU Radio": self.gnuradio}
        key = (bits, n_bytes)
        return {name: speeds[key][way] for name, speeds in found.items() if key in speeds}

    def scale(self, way: int, bits: int, n_bytes: int) -> float | None:
        """Speed of liquid-dsp here relative to the reference machine."""
        here = self.liquid.get((bits, n_bytes))
        return here[way] / _LIQUID_THERE[bits, n_bytes][way] if here else None


def measure(seed: int, quick: bool) -> Iterator[Row]:
    """Measure the rows of receiver, transmitter and latency."""
    rounds = 3 if quick else 20
    peers = measure_peers(seed)
    yield _search("search_msps_noise", 200.0, _noise(seed), rounds, peers)
    yield _search("search_msps_gfsk_+20db", 55.0, _neighbors(seed), rounds, peers)
    yield _receive("rx_msps_16x220B_qpsk12", QPSK12, 16, 220, 80.0, seed, rounds, peers)
    yield _receive("rx_msps_16x220B_64qam34", QAM64_34, 16, 220, 35.0, seed, rounds, peers)
    yield _receive("rx_msps_1x64B_qpsk12", QPSK12, 1, 64, 30.0, seed, rounds, peers)
    yield _transmit(seed, rounds, peers)
    yield _latency(seed, 20 * rounds, peers)


def measure_peers(seed: int) -> Peers:
    """Measure the other modems; those that cannot be are reported and left out."""
    liquid, gnuradio = Liquid(), GnuRadio()
    peers = Peers({}, {}, {})
    with attempt(liquid.name):
        for bits, n_bytes in _LIQUID_THERE:
            peers.liquid[bits, n_bytes] = liquid.speed("none", bits, n_bytes)
        peers.noise[liquid.name] = liquid.noise_msps(10**7, seed)
    with attempt(gnuradio.name):
        for n_bytes in (64, 220):
            peers.gnuradio[2, n_bytes] = gnuradio.speed(2, n_bytes, 1000, seed)
        peers.noise[gnuradio.name] = gnuradio.noise_msps(2 * 10**6, seed)
    return peers


def _best_s(work: Callable[[], object], rounds: int) -> float:
    """The least CPU time of this thread over several rounds."""
    best = float("inf")
    for _ in range(rounds):
        begin = time.thread_time()
        work()
        best = min(best, time.thread_time() - begin)
    return best


def _hear(receiver: Receiver, x: NDArray[np.complex64]) -> None:
    for first in range(0, len(x), BLOCK):
        receiver.push(x[first : first + BLOCK])


def _noise(seed: int) -> list[NDArray[np.complex64]]:
    front_end = FrontEnd(FrontEndParams(noise_dbfs=0.0), np.random.default_rng(seed))
    return [front_end.receive(np.zeros(1 << 20, np.complex64))]


def _neighbors(seed: int) -> list[NDArray[np.complex64]]:
    """Neighbors that send all the time, 20 dB over the noise: 20 and 4 samples per bit."""
    signals = []
    for n_samples in (20, 4):
        rng = np.random.default_rng(seed)
        front_end = FrontEnd(FrontEndParams(noise_dbfs=0.0), rng)
        signals.append(front_end.receive(10 * gfsk(rng, 1 << 19, n_samples)))
    return signals


def gfsk(rng: np.random.Generator, n: int, samples_a_bit: int) -> NDArray[np.complex64]:
    """A Bluetooth-like signal `[n]`: Gaussian frequency shifts, index 0.5; mean power 1."""
    bits = rng.choice([-1.0, 1.0], -(-n // samples_a_bit) + 1)
    t = np.arange(-2 * samples_a_bit, 2 * samples_a_bit + 1) / samples_a_bit
    pulse = np.exp(-((t / 0.53) ** 2))
    wave = np.convolve(np.repeat(bits, samples_a_bit), pulse / pulse.sum(), "same")[:n]
    return np.exp(2j * np.pi * np.cumsum(wave) * 0.25 / samples_a_bit).astype(np.complex64)


def _search(
    name: str, target: float, signals: list[NDArray[np.complex64]], rounds: int, peers: Peers
) -> Row:
    """Search speed on the slowest of `signals`, which contain no burst, each after much noise.

    Each round has its own receiver: one that hears a signal for long takes it for noise.
    """
    msps, notes = [], []
    quiet = np.tile(_noise(seed=1)[0], 3)
    for x in signals:
        took_s, triggers = math.inf, 0
        for _ in range(rounds):
            receiver = Receiver()
            _hear(receiver, quiet)
            before = receiver.counters["triggers"]
            took_s = min(took_s, _best_s(partial(_hear, receiver, x), 1))
            triggers = receiver.counters["triggers"] - before
        msps.append(len(x) / took_s * 1e-6)
        notes.append(f"after noise: {1e6 * triggers / len(x):.0f} triggers in 10^6 samples")
    row = Row(name, min(msps), "Msps", target, "more", rounds, note=", ".join(notes))
    row.peers = dict(peers.noise)
    if "liquid-dsp" in peers.noise:
        row.like_for_like = row.value * _LIQUID_NOISE_THERE / peers.noise["liquid-dsp"]
    return row


def _stream(mcs: int, n_pdus: int, n_bytes: int, n_bursts: int, seed: int) -> NDArray[np.complex64]:
    rng = np.random.default_rng(seed)
    transmitter, parts = Transmitter(), []
    for _ in range(n_bursts):
        pdus = [rng.bytes(n_bytes) for _ in range(n_pdus)]
        parts += [np.zeros(GAP, np.complex64), transmitter.modulate(pdus, mcs)]
    front_end = FrontEnd(FrontEndParams(noise_dbfs=-SNR_DB), rng)
    return front_end.receive(np.concatenate(parts))


def _receive(
    name: str, mcs: int, n_pdus: int, n_bytes: int, target: float, seed: int, rounds: int,
    peers: Peers,
) -> Row:  # fmt: skip
    n_bursts = 400 // n_pdus
    x = _stream(mcs, n_pdus, n_bytes, n_bursts, seed)
    receiver = Receiver()
    _hear(receiver, x)
    took_s = _best_s(lambda: _hear(receiver, x), rounds)
    n_sent = (rounds + 1) * n_bursts * n_pdus
    if receiver.counters["pdus_good"] < 0.999 * n_sent:
        raise RuntimeError(f"seed {seed}: {receiver.counters}")
    bits = MCS_TABLE[mcs].modulation.bits
    row = Row(name, len(x) / took_s * 1e-6, "Msps", target, "more", rounds)
    row.peers = peers.beside(1, bits, n_bytes)
    scale = peers.scale(1, bits, n_bytes)
    row.like_for_like = None if scale is None else row.value / scale
    return row


def _transmit(seed: int, rounds: int, peers: Peers) -> Row:
    rng, transmitter = np.random.default_rng(seed), Transmitter()
    pdus = [rng.bytes(220) for _ in range(100)]
    n = len(transmitter.modulate(pdus[:1], QPSK12))
    took_s = _best_s(lambda: [transmitter.modulate([pdu], QPSK12) for pdu in pdus], rounds)
    row = Row("tx_msps_220B_qpsk12", len(pdus) * n / took_s * 1e-6, "Msps", 80.0, "more", rounds)
    row.peers = peers.beside(0, 2, 220)
    scale = peers.scale(0, 2, 220)
    row.like_for_like = None if scale is None else row.value / scale
    return row


def _latency(seed: int, n: int, peers: Peers) -> Row:
    """Median time from the samples of a whole burst, in one call, to its PDU's bytes."""
    x = _stream(QPSK12, 1, 220, n, seed).reshape(n, -1)
    receiver, took_s = Receiver(), []
    for burst in x:
        begin = time.perf_counter()
        receiver.push(burst)
        took_s.append(time.perf_counter() - begin)
    median = float(np.median(took_s)) * 1e6
    row = Row("rx_latency_us_220B_qpsk12", median, "µs", 60.0, "less", n)
    scale = peers.scale(1, 2, 220)
    row.like_for_like = None if scale is None else row.value * scale
    return row


if __name__ == "__main__":
    sys.exit(main("phy_speed", measure))
