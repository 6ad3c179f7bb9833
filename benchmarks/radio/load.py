"""A radio like a USRP under full load, at several rates."""

from collections.abc import Iterator
from typing import NamedTuple

from benchmarks.peers.radio import bare
from benchmarks.report import Row
from benchmarks.usrp_like import Span, under_load

RATES_MSPS = (1, 2, 5, 10)
SURE_MSPS = 5
"""The highest rate that any machine is expected to sustain."""


class Times(NamedTuple):
    """Duration of the measurement at each rate."""

    warm_up_s: float
    measured_s: float
    peer_s: float


WHOLE, QUICK = Times(2.0, 20.0, 5.0), Times(1.0, 4.0, 0.5)


def rows(seed: int, quick: bool) -> Iterator[Row]:
    """The four rows of each rate."""
    times = QUICK if quick else WHOLE
    threads = bare.lost_in_threads(RATES_MSPS, times.peer_s)
    flowgraphs = {} if quick else bare.flowgraph_cpu_pct(RATES_MSPS, times.peer_s)
    for msps in RATES_MSPS:
        spans = under_load(1e6 * msps, times.warm_up_s, times.measured_s, seed)
        lost = {name: of[msps] for name, of in threads.items()}
        yield from _rows_of(msps, spans, lost, flowgraphs.get(msps))


def _rows_of(
    msps: int, spans: list[Span], lost_a_s: dict[str, float], flowgraph: float | None
) -> Iterator[Row]:
    name = f"usrp_like_{msps}msps"
    target = 0.0 if msps <= SURE_MSPS else None
    rate_hz, one = 1e6 * msps, spans[0]
    on_air = min(span.count("samples_sent") / span.seconds / rate_hz for span in spans)
    sent, heard, bursts = (
        sum(span.link(*of) for span in spans)
        for of in (("tx", "pdus_sent"), ("rx", "pdus_heard"), ("tx", "bursts_sent"))
    )
    lost, underflows, late = (
        sum(span.count(each) for span in spans) for each in ("samples_lost", "underflows", "late")
    )
    note = f"both robots, {one.seconds:.1f} s; {heard} PDUs heard of {sent}"
    yield Row(f"{name}_lost_samples", lost, "samples", target, "less",
              round(rate_hz * sum(span.seconds for span in spans)),
              {"machine_stolen_pct": one.stolen_pct}
              | {each: a_second * one.seconds for each, a_second in lost_a_s.items()},
              note=f"{note}; {bare.THREADS}")  # fmt: skip
    yield Row(f"{name}_underflows", underflows, "bursts", target, "less", bursts,
              {"late": late, "on_air_pct": 100 * on_air}, note=note)  # fmt: skip
    for part, peers in (
        ("daemon", {}), ("radio_process", {} if flowgraph is None else {"gnu_radio": flowgraph})
    ):  # fmt: skip
        yield Row(f"{name}_{part}_cpu_pct", one.cpu_pct(part), "%", None, "less",
                  round(one.seconds), peers, note=NOTES[part])  # fmt: skip


NOTES = {
    "daemon": "of one core, user and system, robot 1's daemon and modem; trials: seconds",
    "radio_process": "of one core, user and system, robot 1's radio process with the test radio's "
    "driver, which simulates converters and air; gnu_radio: source and sink alone, no bursts, with "
    "the same driver; trials: seconds",
}
