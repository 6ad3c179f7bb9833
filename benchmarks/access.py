"""Medium access: two half-duplex robots on one channel, each with Poisson messages of 1 KB."""

import asyncio
import sys
from concurrent.futures import ProcessPoolExecutor
from typing import NamedTuple

import numpy as np

import phy
from backends import AirParams, RadioParams
from benchmarks.report import Row, main
from benchmarks.worlds.arrivals import poisson
from benchmarks.worlds.samples import DATA, STOP, run
from sdrlinkd.config import ModemParams
from sdrlinkd.link import AccessParams, Overrides, Qos

RATE_HZ = 5e6
MCS = 3
MESSAGE = 1024
PDU_SIZE = 1056  # a message with its STAMP
MAX_BURST_S = 0.005
SNR_DB = 25.0
NODES = 2
STOPS_PER_S = 10.0
STOP_SIZE = 16
URGENT = Overrides(qos=Qos.URGENT)
SETTLE_S = 1.5
TDMA_S = 2.0
AIRTIME_S = phy.layout(phy.OFDM_64_16, MCS, 1, PDU_SIZE).n_samples / RATE_HZ


class Case(NamedTuple):
    """A policy under a load; `load` is each robot's share of the air, in bursts of one message."""

    policy: str
    load: float
    turnaround_s: float = 1e-4
    block_s: float = 1e-4
    """Reaction time of a robot to what it hears."""
    stopping: int = 0
    """Number of robots that also send urgent messages."""
    persist: float = 0.02


class Result(NamedTuple):
    """Outcome of a case; delays in ms."""

    sent: int
    received: int
    bursts: int
    delay_mean_ms: float
    urgent_p99_ms: float
    urgent: int
    access: str
    frame_ms: float

    @property
    def pdr(self) -> float:
        """Messages delivered over messages sent."""
        return self.received / self.sent


CASES = {
    "none": Case("none", 0.4),
    "csma": Case("csma", 0.15),
    "minislot": Case("minislot", 0.4, block_s=5e-5),
    # Two simultaneous urgent messages wait for each other; one from a single robot waits for one
    # burst.
    "minislot_urgent": Case("minislot", 0.4, block_s=5e-5, stopping=1),
    "minislot_urgent_both": Case("minislot", 0.4, block_s=5e-5, stopping=2),
    "tdma": Case("tdma", 0.4),
    "tdma_urgent": Case("tdma", 0.4, stopping=2),
    "tdma_ta10ms": Case("tdma", 0.4, turnaround_s=1e-2),
}


def measure(seed: int, quick: bool) -> list[Row]:
    """Measure all rows; `quick` takes a tenth of the time, or less."""
    duration_s, urgent_s = (0.5, 1.0) if quick else (20.0, 20.0)
    with ProcessPoolExecutor() as pool:
        # Quantiles need more messages than means.
        lengths = {name: urgent_s if case.stopping else duration_s for name, case in CASES.items()}
        # Messages wait for the first frame, which makes the mean of a short run.
        lengths["tdma"] = max(lengths["tdma"], TDMA_S)
        waiting = {
            name: pool.submit(simulate, CASES[name], lengths[name], seed)
            for name in sorted(CASES, key=lambda name: -lengths[name])
        }
        found = {name: each.result() for name, each in waiting.items()}
    none, csma = found["none"], found["csma"]
    minislot, tdma, slow = found["minislot"], found["tdma"], found["tdma_ta10ms"]
    minislot_urgent, tdma_urgent = found["minislot_urgent"], found["tdma_urgent"]
    own_ms = 1e3 * AIRTIME_S
    return [
        _row("csma_2x15pct_pdr", csma.pdr, "ratio", 0.96, "more", csma,
             {"none_at_2x40pct": none.pdr, "delay_ms_mean": csma.delay_mean_ms}),
        _row("minislot_2x40pct_pdr", minislot.pdr, "ratio", 0.999, "more", minislot,
             {"none": none.pdr}),
        _row("minislot_2x40pct_delay_ms", minislot.delay_mean_ms, "ms", 10.0, "less", minislot,
             {"airtime": own_ms}),
        _row("minislot_urgent_latency_ms_p99", minislot_urgent.urgent_p99_ms, "ms",
             1e3 * MAX_BURST_S + own_ms, "less", minislot_urgent,
             {"airtime": own_ms, "both_send_them": found["minislot_urgent_both"].urgent_p99_ms}),
        _row("tdma_2x40pct_pdr", tdma.pdr, "ratio", 0.999, "more", tdma, {"none": none.pdr}),
        _row("tdma_2x40pct_delay_ms", tdma.delay_mean_ms, "ms", 22.0, "less", tdma,
             {"airtime": own_ms}),
        _row("tdma_urgent_latency_ms_p99", tdma_urgent.urgent_p99_ms, "ms",
             tdma_urgent.frame_ms, "less", tdma_urgent, {"airtime": own_ms}),
        _row("tdma_2x40pct_pdr_ta10ms", slow.pdr, "ratio", 0.999, "more", slow,
             {"delay_ms_mean": slow.delay_mean_ms, "slot_ms": slow.frame_ms / NODES}),
        _row("none_2x40pct_pdr", none.pdr, "ratio", 0.9, "less", none, {}),
    ]  # fmt: skip


def simulate(case: Case, duration_s: float, seed: int) -> Result:
    """Simulate one policy; runs in a process of its own."""
    rng = np.random.default_rng(seed)
    air = AirParams(rate_hz=RATE_HZ, block_s=case.block_s, snr_db=SNR_DB)
    radios = {
        node: RadioParams(
            full_duplex=False, turnaround_s=case.turnaround_s, clock_ppm=rng.uniform(-10, 10)
        )
        for node in range(1, NODES + 1)
    }
    access = AccessParams(policy=case.policy, nodes=list(radios), persist=case.persist, force=True)  # type: ignore[arg-type]
    modem = ModemParams(rate_hz=RATE_HZ, mcs=MCS, max_burst_s=MAX_BURST_S)
    arrivals = {
        node: sorted(
            [
                *poisson(rng, DATA, case.load / AIRTIME_S, MESSAGE, duration_s),
                *poisson(
                    rng, STOP, STOPS_PER_S * (node <= case.stopping), STOP_SIZE, duration_s, URGENT
                ),
            ]
        )
        for node in radios
    }
    until_s = duration_s + SETTLE_S
    stations = asyncio.run(run(air, radios, access, modem, PDU_SIZE, arrivals, until_s, seed))
    got = [each for station in stations for each in station.got]
    data = [1e3 * each.age_s for each in got if each.topic_id == DATA]
    urgent = [1e3 * each.age_s for each in got if each.topic_id == STOP]
    policy = stations[0].access
    return Result(
        sent=sum(station.sent for station in stations),
        received=len(got),
        bursts=sum(station.bursts for station in stations),
        delay_mean_ms=float(np.mean(data)) if data else float("inf"),
        urgent_p99_ms=float(np.quantile(urgent, 0.99)) if urgent else float("inf"),
        urgent=len(urgent),
        access=policy.state,
        frame_ms=1e3 * policy.round_s,
    )


def _row(
    name: str, value: float, unit: str, target: float, better: str, result: Result,
    peers: dict[str, float],
) -> Row:  # fmt: skip
    trials = result.urgent if "urgent" in name else result.sent
    return Row(
        name, value, unit, target, better, trials, peers=peers,  # type: ignore[arg-type]
        note=f"{result.access}; {result.bursts} bursts", exact=True,
    )  # fmt: skip


if __name__ == "__main__":
    sys.exit(main("access", measure))
