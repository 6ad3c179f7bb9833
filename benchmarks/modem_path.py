"""The modem in a daemon: its latency in real time, and its speed relative to real time."""

import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np

import phy
from benchmarks.daemons import daemon_at_work
from benchmarks.report import Row, main
from sdrlinkd.client import Publisher, Subscriber

RATE_HZ = 5e6
MCS = 1
PDU_SIZE = 1024
ODOM = b"\0\1\0\0" + bytes(720)
PERIOD_S = 1 / 30
BLOCK = 5000  # number of samples that the daemon hands over at once
SNR_DB = 15.0
CLOCK_PPM = 10.0


def measure(seed: int, quick: bool) -> Iterator[Row]:
    """Measure all rows; `quick` takes about a tenth of the trials."""
    phy.warm_up()
    yield from latency_rows(seed, 40 if quick else 600)
    yield rx_row(seed, 15 if quick else 150)
    yield tx_row(seed, 15 if quick else 150)


def latency_rows(seed: int, messages: int) -> list[Row]:
    """Wall time from a producer through one daemon, its modem and a paced loopback."""
    latencies = _latencies(seed, messages, "loopback")
    direct = _latencies(seed, messages, "direct")
    airtime_ms = phy.layout(phy.OFDM_64_16, MCS, 1, PDU_SIZE).n_samples / RATE_HZ * 1e3
    note = (
        f"724 B at 30 Hz, each a PDU of {PDU_SIZE} B: {airtime_ms:.2f} ms on the air "
        f"({phy.MCS_TABLE[MCS].name}, {RATE_HZ / 1e6:g} Msps)"
    )
    peers = {"airtime": airtime_ms}
    return [
        Row(
            "odom_30hz_latency_ms_p50", float(np.median(latencies)), "ms", 8.0, "less", messages,
            peers={**peers, "direct_link": float(np.median(direct))}, note=note,
        ),
        Row(
            "odom_30hz_latency_ms_p99", float(np.quantile(latencies, 0.99)), "ms", 20.0, "less",
            messages, peers={**peers, "direct_link": float(np.quantile(direct, 0.99))}, note=note,
        ),
    ]  # fmt: skip


def rx_row(seed: int, bursts: int) -> Row:
    """Samples received per CPU second, relative to real time: contiguous bursts, 15 dB, 10 ppm."""
    ratios = {
        name: _rx_ratio(seed, bursts, size, n_pdus)
        for name, (size, n_pdus) in {
            "1x1024B": (1024, 1), "16x64B": (64, 16), "1x64B": (64, 1), "noise": (0, 0),
        }.items()
    }  # fmt: skip
    return Row(
        "rx_realtime_ratio_5msps", ratios.pop("1x1024B"), "ratio", 3.0, "more", bursts,
        peers=ratios, note="1 PDU of 1024 B a burst, QPSK 1/2, no pause between bursts",
    )  # fmt: skip


def tx_row(seed: int, bursts: int) -> Row:
    """Samples made per CPU second, relative to real time."""
    ratios = {
        name: _tx_ratio(seed, bursts, size, n_pdus)
        for name, (size, n_pdus) in {
            "1x1024B": (1024, 1), "16x64B": (64, 16), "1x64B": (64, 1)
        }.items()
    }  # fmt: skip
    return Row(
        "tx_realtime_ratio_5msps", ratios.pop("1x1024B"), "ratio", 5.0, "more", bursts,
        peers=ratios, note="1 PDU of 1024 B a burst, QPSK 1/2",
    )  # fmt: skip


def _latencies(seed: int, messages: int, backend: str) -> list[float]:
    with tempfile.TemporaryDirectory() as folder:
        directory = Path(folder)
        (directory / "registry.csv").write_text("odom,nav_msgs/Odometry\n")
        config = directory / "sdrlinkd.toml"
        config.write_text(
            f'backend = "{backend}"\nseed = {seed}\n[bus]\nruntime_dir = "{folder}"\n'
            f"[link]\npdu_size = {PDU_SIZE}\n"
            f"[modem]\nrate_hz = {RATE_HZ}\nmcs = {MCS}\n"
            f"[channel]\nsnr_db = {SNR_DB}\nclock_ppm = {CLOCK_PPM}\n"
        )
        with (
            daemon_at_work(config) as runtime_dir,
            Subscriber("/rx_robot_1/odom", runtime_dir=runtime_dir) as subscriber,
            Publisher(runtime_dir) as publisher,
        ):
            return _paced(publisher, subscriber, messages)


def _paced(publisher: Publisher, subscriber: Subscriber, messages: int) -> list[float]:
    latencies = []
    due = time.monotonic()
    for _ in range(messages):
        due += PERIOD_S
        time.sleep(max(0.0, due - time.monotonic()))
        began = time.perf_counter()
        publisher.send("/robot_1/odom", ODOM)
        if subscriber.receive(5) is None:
            raise RuntimeError("a message did not arrive")
        latencies.append((time.perf_counter() - began) * 1e3)
    return latencies


def _rx_ratio(seed: int, bursts: int, size: int, n_pdus: int) -> float:
    rng = np.random.default_rng(seed)
    front_end = phy.FrontEnd(phy.FrontEndParams(noise_dbfs=-SNR_DB), rng)
    params = phy.PathParams(RATE_HZ, 2.45e9, clock_ppm=CLOCK_PPM)
    path, transmitter = phy.Path(params, rng), phy.Transmitter()
    pieces = [np.zeros(10_000, np.complex64)]
    for _ in range(bursts):
        if n_pdus:
            pdus = [rng.bytes(size) for _ in range(n_pdus)]
            pieces.append(path.carry(transmitter.modulate(pdus, MCS))[1])
        else:
            pieces.append(np.zeros(15_000, np.complex64))
    samples = front_end.receive(np.concatenate(pieces))

    def receive() -> None:
        receiver = phy.Receiver(max_frequency=1e5 / RATE_HZ)
        for at in range(0, len(samples), BLOCK):
            receiver.push(samples[at : at + BLOCK])
        if receiver.counters["pdus_good"] < bursts * n_pdus:
            raise RuntimeError(f"PDUs were lost: {receiver.counters}")

    return len(samples) / _cpu_s(receive) / RATE_HZ


def _tx_ratio(seed: int, bursts: int, size: int, n_pdus: int) -> float:
    rng = np.random.default_rng(seed)
    transmitter = phy.Transmitter()
    waiting = [[rng.bytes(size) for _ in range(n_pdus)] for _ in range(bursts)]
    n_samples = len(transmitter.modulate(waiting[0], MCS)) * bursts
    cpu_s = _cpu_s(lambda: [transmitter.modulate(pdus, MCS) for pdus in waiting])
    return n_samples / cpu_s / RATE_HZ


def _cpu_s(work: Callable[[], object]) -> float:
    """CPU time of `work`, the median of five runs."""
    spent = []
    for _ in range(5):
        began = time.process_time()
        work()
        spent.append(time.process_time() - began)
    return float(np.median(spent))


if __name__ == "__main__":
    sys.exit(main("modem_path", measure))
