"""The SNR that the modem needs, compared with other modems and with the bound for any code.

SNR is a burst's mean power over the noise power in the sample band. "impaired": see
`benchmarks.trials`. Rows in dB give the SNR at which the error rate is surely below the one in
their name.
"""

import argparse
import sys
from collections.abc import Callable, Iterator
from contextlib import closing
from functools import partial
from pathlib import Path

import numpy as np

from backends import RecordingReader, describe
from benchmarks.absent import attempt
from benchmarks.bound import needed_es_n0_db
from benchmarks.peers.modems import GnuRadio, Liquid
from benchmarks.report import Row, exactly, main
from benchmarks.trials import Air, ErrorRate, bursts, error_rate, needed_snr_db
from phy import MCS_TABLE, OFDM_64_16, FrontEnd, FrontEndParams, PduHeard, Receiver, layout
from phy.ldpc import decode, encode, new_workspace

PER_SUBCARRIER_DB = 10 * np.log10(OFDM_64_16.n_fft / OFDM_64_16.n_used)
"""Es/N0 of a subcarrier relative to the SNR in the sample band."""

BPSK12, QPSK12, QPSK34, QAM16_12, QAM64_34 = 0, 1, 2, 3, 6

_TYPES = {".cf32": "cf32_le", ".i16": "ci16_le", ".u8": "cu8"}
# Row, MCS, bytes, target in dB.
_KNEES = (
    ("64B_qpsk12", QPSK12, 64, 1.7),
    ("220B_bpsk12", BPSK12, 220, -1.4),
    ("220B_qpsk12", QPSK12, 220, 1.6),
    ("220B_16qam12", QAM16_12, 220, 7.0),
    ("220B_64qam34", QAM64_34, 220, 16.3),
)


def measure(seed: int, quick: bool, recordings: Path | None = None) -> Iterator[Row]:
    """Measure all rows; the one about recordings only if there are any."""
    yield from exactly(_rows(seed, quick))
    if recordings:
        yield from exactly([false_pdus_in(recordings)])


def _rows(seed: int, quick: bool) -> Iterator[Row]:
    n = 2000 if quick else 10_000
    peers = _peers_at_64_bytes(seed, 60 if quick else 1000)
    for knee in _KNEES:
        row = _knee(*knee, seed, n)
        row.peers |= peers
        yield row
        peers = {}  # measured at the first knee only
    # With fewer trials, the 95 % bound alone takes up the margin.
    yield _tdl_a(seed, max(n, 5000))
    yield _gap_to_bound(seed, max(n, 5000))
    yield _headers(seed, n)
    yield _doppler(seed, n // 10)
    yield _false_pdus(seed, 10**6 if quick else 10**9)


def _knee(name: str, mcs: int, n_bytes: int, target_db: float, seed: int, n: int) -> Row:
    def rate_at(snr_db: float, most: int, enough: int) -> ErrorRate:
        return error_rate(Air(), mcs, n_bytes, snr_db, seed, most, enough)

    snr_db, trials = needed_snr_db(rate_at, target_db - 0.5, 0.01, n)
    row = Row(f"snr_db_per1e-2_{name}_impaired", snr_db, "dB", target_db, "less", trials)
    row.note = f"bound of any code at this length: {_bound_db(mcs, n_bytes, 0.01):.2f} dB"
    return row


def _bound_db(mcs: int, n_bytes: int, rate: float) -> float:
    """SNR that a PDU needs in the data subcarriers of its burst, with the best possible code."""
    plan = layout(OFDM_64_16, mcs, 1, n_bytes)
    n_subcarriers = plan.n_symbols * OFDM_64_16.n_data
    es_n0_db = needed_es_n0_db(MCS_TABLE[mcs], 8 * n_bytes, n_subcarriers, rate)
    return float(es_n0_db - PER_SUBCARRIER_DB)


def _peers_at_64_bytes(seed: int, n: int) -> dict[str, float]:
    """SNR at which others lose 1 % of 64 B on QPSK, impaired only by a frequency offset."""
    found: dict[str, float] = {}
    liquid, gnuradio = Liquid(), GnuRadio()
    with attempt(liquid.name):
        for code, guess_db in (("none", 11.0), ("g2412", 7.0)):
            lost = partial(liquid.errors, code, 2, 64)
            found[f"{liquid.name} {code}"] = _peer_knee(lost, guess_db, seed, n)
    with attempt(gnuradio.name):
        lost = partial(gnuradio.errors, 2, 64)
        found[f"{gnuradio.name} uncoded"] = _peer_knee(lost, 18.5, seed, n)
    return found


def _peer_knee(lost: Callable[[float, int, int], int], guess_db: float, seed: int, n: int) -> float:
    def rate_at(snr_db: float, most: int, _enough: int) -> ErrorRate:
        return ErrorRate(most, lost(snr_db, most, seed))

    return round(needed_snr_db(rate_at, guess_db, 0.01, n, surely=False)[0], 2)


def _tdl_a(seed: int, n: int) -> Row:
    air = Air(rate_hz=20e6, profile="tdl-a")

    def rate_at(snr_db: float, most: int, enough: int) -> ErrorRate:
        return error_rate(air, QPSK12, 220, snr_db, seed, most, enough)

    snr_db, trials = needed_snr_db(rate_at, 7.0, 0.1, n // 5)
    name = "snr_db_per1e-1_220B_qpsk12_tdl-a100ns_20msps"
    return Row(name, snr_db, "dB", 7.5, "less", trials, note="impaired, drawn anew for each burst")


def _gap_to_bound(seed: int, n: int) -> Row:
    """The gap of the code alone: bits over a perfectly known channel."""
    plan = layout(OFDM_64_16, QPSK34, 1, 220)
    rng, work = np.random.default_rng(seed), new_workspace()
    n_subcarriers = plan.coded_bits / plan.mcs.modulation.bits

    def rate_at(es_n0_db: float, most: int, enough: int) -> ErrorRate:
        no, tried, errors = 10 ** (-es_n0_db / 10), 0, 0
        while tried < most and errors < enough:
            bits = rng.integers(0, 2, (500, plan.form.n_bits), np.uint8)
            sent = (1 - 2.0 * encode(bits, plan.form)) / np.sqrt(2)
            got = sent + rng.standard_normal(sent.shape) * np.sqrt(no / 2)
            llr = np.clip(np.rint(8 * 4 / np.sqrt(2) * got / no), -511, 511).astype(np.int16)
            wrong = decode(llr, plan.form, work) != np.packbits(bits, axis=1)
            errors += int(np.count_nonzero(wrong.any(axis=1)))
            tried += len(bits)
        return ErrorRate(tried, errors)

    needed_db, trials = needed_snr_db(rate_at, 4.75, 1e-3, 10 * n)
    bound_db = needed_es_n0_db(plan.mcs, 8 * 220, n_subcarriers, 1e-3)
    name = "gap_to_bound_db_220B_qpsk34_per1e-3"
    note = f"Es/N0 {needed_db:.2f} dB, bound {bound_db:.2f} dB"
    return Row(name, needed_db - bound_db, "dB", 1.2, "less", trials, note=note)


def _headers(seed: int, n: int) -> Row:
    receiver = Receiver(max_frequency=Air().centre_hz * 40e-6 / Air().rate_hz)
    stream = bursts(Air(), BPSK12, 9, -2.0, seed)
    for _, (_, x) in zip(range(n), stream, strict=False):
        receiver.push(x)
    receiver.flush()
    row = Row("header_ok_at_-2db", receiver.counters["bursts"] / n, "share", 0.98, "more", n)
    liquid = Liquid()
    with attempt(liquid.name):
        row.peers[f"{liquid.name} at -1 dB"] = liquid.headers(-1.0, 500, seed) / 500
    return row


def _doppler(seed: int, n: int) -> Row:
    air = Air(profile="tdl-a", doppler_hz=40.0)
    measured = error_rate(air, QPSK12, 1500, 25.0, seed, n, n)
    name = "doppler_40hz_1500B_qpsk12_5msps_per"
    return Row(name, measured.share, "share", 0.02, "less", n, note="at 25 dB, TDL-A 100 ns")


def _false_pdus(seed: int, n_samples: int) -> Row:
    """Noise alone: how often it is taken for a burst, or worse, for a PDU."""
    block = 1 << 20
    front_end = FrontEnd(FrontEndParams(noise_dbfs=-10.0), np.random.default_rng(seed))
    receiver, silence = Receiver(), np.zeros(block, np.complex64)
    told = 0
    for _ in range(-(-n_samples // block)):
        events = receiver.push(front_end.receive(silence))
        told += sum(isinstance(event, PduHeard) for event in events)
    counters = receiver.counters
    note = f"headers {counters['bursts']}, preambles {counters['preambles']}"
    n = counters["samples"]
    return Row("false_pdus_1e9_noise", told, "PDUs", 0, "less", n, note=note)


def false_pdus_in(recordings: Path) -> Row:
    """False PDUs in third-party signals, at whatever rate they were recorded."""
    told, n, names = 0, 0, []
    for path in sorted(recordings.iterdir()):
        if path.suffix not in _TYPES:
            continue
        info = describe(path, _TYPES[path.suffix], None)
        names.append(path.name)
        receiver = Receiver(None, 0.1)
        with closing(RecordingReader(info)) as reader:
            for first in range(0, info.n_samples, 1 << 18):
                events = receiver.push(reader.read(first, 1 << 18))
                told += sum(isinstance(event, PduHeard) for event in events)
        n += info.n_samples
    return Row("false_pdus_recordings", told, "PDUs", 0, "less", n, note=", ".join(names))


if __name__ == "__main__":
    own = argparse.ArgumentParser(add_help=False)
    own.add_argument(
        "--recordings", type=Path, metavar="DIR",
        help="also look for PDUs in recordings of others: .cf32, .i16, .u8",
    )  # fmt: skip
    sys.exit(main("phy_per", measure, own))
