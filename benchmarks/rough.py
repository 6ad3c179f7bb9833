"""The modem in rough air: joined in mid-stream, after strong signals, in motion, through steps.

Bursts are impaired as `benchmarks.trials` says. A share of lost PDUs meets its target if its upper
95 % bound does; with --quick, the share itself.
"""

import sys
from collections.abc import Iterator
from itertools import islice
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from benchmarks.absent import attempt
from benchmarks.peers.modems import Liquid
from benchmarks.report import Row, exactly, main
from benchmarks.trials import LEAD_IN, Air, ErrorRate, bursts, frames, lost_of
from phy import SENSE_WINDOW, EnergyDetector, Excisor, Jammer, PduHeard, Receiver, Transmitter

QPSK12, QAM64_34 = 1, 6
SNR_DB = 25.0
# Rate, Doppler, PDUs of a burst and their octets, largest share lost. A burst of 5 PDUs of 64 B
# lasts 5 ms, the longest by default.
_MOVING = (
    (5e6, 100.0, 1, 1500, 0.02),
    (5e6, 200.0, 1, 1500, 0.06),
    (1e6, 40.0, 1, 220, 0.005),
    (1e6, 100.0, 1, 220, 0.04),
    (1e6, 40.0, 5, 64, 0.01),
    (1e6, 40.0, 4, 220, 0.02),
)


class _Jammed(NamedTuple):
    """A jammer, its power above the burst's, the bursts, and the largest share lost."""

    name: str
    kind: Literal["tone", "narrow", "sweep", "pulses"]
    power_db: float
    n_tones: int
    target: float | None
    mcs: int = QPSK12
    n_bytes: int = 64
    snr_db: float = 15.0


_JAMMED = (
    _Jammed("cw_lost_0db", "tone", 0, 1, 0.005),
    _Jammed("cw_lost_20db", "tone", 20, 1, 0.005),
    _Jammed("cw_lost_40db", "tone", 40, 1, 0.005),
    _Jammed("three_tones_lost_10db", "tone", 10, 3, 0.005),
    _Jammed("narrow_lost_10db", "narrow", 10, 1, 0.005),
    _Jammed("sweep_10ms_lost_10db", "sweep", 10, 1, 0.005),
    _Jammed("sweep_10ms_lost_10db_220B_25db", "sweep", 10, 1, 0.005, QPSK12, 220, 25.0),
    _Jammed("pulses_2pct_lost_0db", "pulses", 0, 1, 0.02),
    _Jammed("pulses_2pct_lost_10db", "pulses", 10, 1, 0.03),
    _Jammed("pulses_2pct_0db_64qam34_220B_25db", "pulses", 0, 1, None, QAM64_34, 220, 25.0),
    _Jammed("cw_20db_64qam34_220B_25db", "tone", 20, 1, 0.015, QAM64_34, 220, 25.0),
    _Jammed("three_tones_10db_64qam34_220B_25db", "tone", 10, 3, 0.05, QAM64_34, 220, 25.0),
)
_JAMMERS: tuple[Literal["tone", "narrow", "sweep", "pulses", "noise"], ...] = (
    "tone", "narrow", "sweep", "pulses", "noise",
)  # fmt: skip
_JAMMED_HZ, _SETTLED, _AT_ONCE = 1e6, 20_000, 10
_DUTY, _PERIOD_S = 0.02, {"tone": 1.0, "narrow": 1.0, "sweep": 0.01, "pulses": 0.001}
_LIQUID_FRAMES, _LIQUID_PPM = 300, 1.0
_HEADER = 600
"""Samples of a burst after which it is surely in its payload."""
_PATIENCE_S = 0.04
"""As the modem of a daemon has it."""


def measure(seed: int, quick: bool) -> Iterator[Row]:
    """Measure all rows."""
    yield from exactly(_rows(seed, quick))


def _rows(seed: int, quick: bool) -> Iterator[Row]:
    for snr_db in (8.0, 25.0):
        for gap in (32, 200, 1000):
            yield _joined(gap, snr_db, seed, 30 if quick else 300)
    for rate_hz in (1e6, 5e6):
        yield _deaf_receiver(rate_hz, seed)
        yield _deaf_carrier_sense(rate_hz, seed)
    for place in _MOVING:
        row = _moving(*place, seed, quick)
        rate_hz, doppler_hz, n_pdus, n_bytes, _ = place
        if n_pdus == 1:
            with attempt("liquid-dsp"):
                # It finds no frame whose carrier is off by more than half a subcarrier.
                air = Air(rate_hz, profile="tdl-a", doppler_hz=doppler_hz, ppm=_LIQUID_PPM)
                row.peers["liquid-dsp g2412, equal clocks"] = _liquid_lost(air, n_bytes, seed)
        yield row
    for jammed in _JAMMED:
        row = _beside(jammed, seed, quick)
        if jammed.mcs == QPSK12:
            with attempt("liquid-dsp"):
                row.peers["liquid-dsp g2412"] = _liquid_jammed(jammed, seed)
        yield row
    yield _penalty(seed, quick)
    for profile in ("tdl-a", "tdl-c"):
        yield _clean_penalty(profile, seed, quick)
    for mcs, louder_db, target in ((QPSK12, 10, 0.97), (QAM64_34, 20, 0.9)):
        yield _second_burst(mcs, louder_db, target, seed, quick)
    for louder_db in (0, -6):
        yield _after_truncated(louder_db, seed, quick)
    yield _busy_beside_a_tone(seed)
    for rate_hz in (1e6, 5e6):
        yield _deaf_at_onset(rate_hz, seed)
    for step_db in (-3.0, -6.0):
        yield _step(step_db, seed, quick)
    yield _false_pdus(seed, 10**6 if quick else 10**9)


def _noise(rng: np.random.Generator, n: int, power: float = 1.0) -> NDArray[np.complex64]:
    parts = rng.standard_normal((n, 2), np.float32) * np.float32(np.sqrt(power / 2))
    return parts.view(np.complex64)[:, 0]


def _heard(receiver: Receiver, x: NDArray[np.complex64]) -> set[bytes]:
    events = receiver.push(x) + receiver.flush()
    return {event.data for event in events if isinstance(event, PduHeard)}


def _joined(gap: int, snr_db: float, seed: int, n: int) -> Row:
    """Receivers that begin anywhere in a stream of bursts, each `gap` samples after the last."""
    rng, transmitter = np.random.default_rng(seed), Transmitter()
    pdus = [[rng.bytes(220) for _ in range(4)] for _ in range(8)]
    parts = [transmitter.modulate(each, QPSK12) for each in pdus]
    begins = np.cumsum([0, *(len(part) + gap for part in parts[:-1])])
    x = np.concatenate([np.pad(part, (0, gap)) for part in parts])
    heard = sent = 0
    for start in rng.integers(0, begins[-3], n):
        got = _heard(Receiver(), (x + _noise(rng, len(x), 10 ** (-snr_db / 10)))[start:])
        # The first whole burst may be missed, whose preamble may come too soon.
        due = pdus[int(np.searchsorted(begins, start)) + 1 :]
        sent += 4 * len(due)
        heard += len(got & {pdu for each in due for pdu in each})
    name = f"joined_mid_stream_heard_gap{gap}_{snr_db:.0f}db"
    return Row(name, heard / sent, "share", 0.99, "more", n, note=f"{heard} of {sent} PDUs")


def _deaf_receiver(rate_hz: float, seed: int) -> Row:
    """How long after a strong signal a receiver still misses bursts, at the worst."""
    rng, transmitter = np.random.default_rng(seed), Transmitter()
    worst = 0.0
    for level_db in (10, 30, 60):
        receiver = Receiver()
        receiver.push(_noise(rng, 1 << 22, 0.01))
        receiver.push(_noise(rng, 1 << 22, 0.01 * 10 ** (level_db / 10)))
        end = receiver.next_index
        for _ in range(1000):
            burst = transmitter.modulate([rng.bytes(64)], QPSK12)
            x = np.concatenate((np.zeros(64), burst)).astype(np.complex64)
            begin = receiver.next_index + 64
            events = receiver.push(x + _noise(rng, len(x), 0.01))
            events += receiver.push(_noise(rng, 1024, 0.01))
            if any(isinstance(event, PduHeard) for event in events):
                worst = max(worst, (begin - end) / rate_hz)
                break
        else:
            worst = np.inf
    name = f"deaf_after_strong_signal_ms_receiver_{rate_hz * 1e-6:.0f}msps"
    return Row(name, 1e3 * worst, "ms", 5, "less", 3, note="+10, +30, +60 dB for 4 million samples")


def _deaf_carrier_sense(rate_hz: float, seed: int) -> Row:
    """How long a robot that senses the air is quiet: signals that stay, levels that change."""
    rng, second = np.random.default_rng(seed), int(rate_hz)
    worst = 0.0
    for before, after in ((1.0, 100.0), (1e4, 1.0), (0.0, 1.0), (1e-6, 1.0), (1.0, 1e3)):
        sense = EnergyDetector(patience=round(_PATIENCE_S * rate_hz))
        sense.push(_noise(rng, second, before))
        changed = sense.next_index
        sense.push(_noise(rng, second, after))
        worst = max(worst, sense.busy_until - changed)
    name = f"deaf_after_strong_signal_ms_carrier_sense_{rate_hz * 1e-6:.0f}msps"
    note = "a signal stays, ends, begins in silence; the gain rises"
    return Row(name, 1e3 * max(worst, SENSE_WINDOW) / rate_hz, "ms", 50, "less", 5, note=note)


def _moving(
    rate_hz: float, doppler_hz: float, n_pdus: int, n_bytes: int, target: float, seed: int,
    quick: bool,
) -> Row:  # fmt: skip
    air = Air(rate_hz=rate_hz, profile="tdl-a", doppler_hz=doppler_hz)
    stream = bursts(air, QPSK12, n_bytes, SNR_DB, seed, n_pdus)
    n = 300 if quick else 3000
    lost = lost_of(air, stream, n, n * n_pdus)
    name = f"doppler_{doppler_hz:.0f}hz_{n_pdus}x{n_bytes}B_{rate_hz * 1e-6:.0f}msps_lost"
    return _lost(name, lost, target, "TDL-A 100 ns, 25 dB, QPSK 1/2, each burst whole", quick)


def _liquid_lost(air: Air, n_bytes: int, seed: int) -> float:
    """The share of frames that liquid-dsp loses on such a channel, with QPSK and rate 1/2."""
    liquid, heard = Liquid(), 0
    wave = liquid.frame("g2412", 2, n_bytes, seed)
    wave /= np.sqrt(np.mean(np.abs(wave) ** 2))
    stream = frames(air, wave, SNR_DB, seed)
    for _ in range(0, _LIQUID_FRAMES, 50):
        parts = [x for _, x in zip(range(50), stream, strict=False)]
        heard += liquid.heard(n_bytes, seed, np.concatenate([*parts, parts[0][:LEAD_IN]]))
    return 1 - heard / _LIQUID_FRAMES


def _beside(jammed: _Jammed, seed: int, quick: bool) -> Row:
    """Bursts beside a jammer, which has another frequency for every ten of them."""
    lost = _jammed_lost(jammed, seed, 300 if quick else 3000)
    note = f"{jammed.n_bytes} B, MCS {jammed.mcs}, {jammed.snr_db:g} dB"
    return _lost(jammed.name, lost, jammed.target, note, quick)


def _jammed_lost(jammed: _Jammed, seed: int, n: int) -> ErrorRate:
    rng, transmitter, errors = np.random.default_rng(seed), Transmitter(), 0
    for _ in range(n // _AT_ONCE):
        pdus = [rng.bytes(jammed.n_bytes) for _ in range(_AT_ONCE)]
        x = _jam(jammed, [transmitter.modulate([pdu], jammed.mcs) for pdu in pdus], rng)
        receiver, excisor = Receiver(), Excisor()
        receiver.cuts = excisor.cuts
        events = receiver.push(excisor.push(x)) + receiver.push(excisor.flush())
        errors += len(set(pdus) - {each.data for each in events if isinstance(each, PduHeard)})
    return ErrorRate(n, errors)


def _liquid_jammed(jammed: _Jammed, seed: int) -> float:
    """The share of frames that liquid-dsp loses beside such a jammer, with QPSK and rate 1/2."""
    rng, liquid, heard = np.random.default_rng(seed), Liquid(), 0
    wave = liquid.frame("g2412", 2, jammed.n_bytes, seed)
    wave /= np.sqrt(np.mean(np.abs(wave) ** 2))
    for _ in range(_LIQUID_FRAMES // _AT_ONCE):
        heard += liquid.heard(jammed.n_bytes, seed, _jam(jammed, [wave] * _AT_ONCE, rng))
    return 1 - heard / _LIQUID_FRAMES


def _jam(
    jammed: _Jammed, waves: list[NDArray[np.complex64]], rng: np.random.Generator
) -> NDArray[np.complex64]:
    """Bursts of power 1 in noise, beside the jammer, which has begun long before."""
    gaps = rng.integers(1200, 1800, len(waves)).tolist()
    parts = [np.pad(wave, (gap, 0)) for wave, gap in zip(waves, gaps, strict=True)]
    x = np.pad(np.concatenate(parts), (_SETTLED, 3000))
    x = x + _noise(rng, len(x), 10 ** (-jammed.snr_db / 10))
    power_db = jammed.power_db - 10 * np.log10(jammed.n_tones)
    if jammed.kind == "pulses":
        # That of a jammer is while it sends.
        power_db -= 10 * np.log10(_DUTY)
    for _ in range(jammed.n_tones if jammed.power_db > -np.inf else 0):
        offset_hz = 0.0 if jammed.kind == "sweep" else rng.uniform(-0.4, 0.4) * _JAMMED_HZ
        width_hz = 3 / 64 * _JAMMED_HZ if jammed.kind == "narrow" else 0.0
        x = Jammer(
            jammed.kind, power_db, _JAMMED_HZ, int(rng.integers(1 << 30)),
            offset_hz=offset_hz, width_hz=width_hz, period_s=_PERIOD_S[jammed.kind], duty=_DUTY,
        ).add(x, int(rng.integers(10_000)))  # fmt: skip
    return x


def _penalty(seed: int, quick: bool) -> Row:
    """How much SNR a tone of +20 dB costs at a PER of 1e-2."""
    n, needed = 300 if quick else 3000, []
    for power_db in (-np.inf, 20.0):
        per: dict[float, float] = {}
        for snr_db in np.arange(0.0, 3.1, 0.25).tolist():
            jammed = _Jammed("", "tone", power_db, 1, 0.0, snr_db=snr_db)
            per[snr_db] = max(_jammed_lost(jammed, seed, n).share, 0.1 / n)
            if per[snr_db] < 0.01:
                break
        places, logs = list(per), np.log10(list(per.values()))
        needed.append(float(np.interp(2.0, -logs[-2:], places[-2:])))
    note = f"{needed[0]:.2f} dB without, {needed[1]:.2f} dB with; 64 B, QPSK 1/2"
    return Row("cw_penalty_db", needed[1] - needed[0], "dB", 0.5, "less", n, note=note)


def _clean_penalty(profile: str, seed: int, quick: bool) -> Row:
    """How many more bursts are lost behind the excisor where there is no jammer, but echoes."""
    air, n = Air(5e6, profile=profile), 300 if quick else 3000
    excisor, receivers = Excisor(), (Receiver(), Receiver())
    receivers[1].cuts = excisor.cuts
    heard: tuple[set[bytes], set[bytes]] = (set(), set())
    sent: set[bytes] = set()
    for pdus, x in islice(bursts(air, QAM64_34, 220, SNR_DB, seed), n):
        sent.update(pdus)
        for receiver, each, got in zip(receivers, (x, excisor.push(x)), heard, strict=True):
            got.update(event.data for event in receiver.push(each) if isinstance(event, PduHeard))
    heard[1].update(_heard(receivers[1], excisor.flush()))
    lost = [len(sent - each) for each in heard]
    note = f"{lost[0]} of {n} lost without the excisor, {lost[1]} behind it; 64QAM 3/4, 25 dB"
    name = f"excisor_clean_{profile}_lost_more"
    return Row(name, (lost[1] - lost[0]) / n, "share", 0.001, "less", n, note=note)


def _busy_beside_a_tone(seed: int) -> Row:
    """How much of the time a robot beside a tone takes the channel for busy, after 50 ms."""
    rng, sense, excisor = np.random.default_rng(seed), EnergyDetector(), Excisor()
    x = Jammer("tone", 20, _JAMMED_HZ, seed, offset_hz=1e5).add(_noise(rng, 2_000_000), 0)
    busy = 0
    for n, block in enumerate(np.split(x, 2000)):
        sense.push(excisor.push(block))
        busy += n >= 50 and sense.busy_until > sense.next_index - len(block)
    note = "tone 20 dB above the noise's power, blocks of 1 ms"
    return Row("cw_busy_share", busy / 1950, "share", 0.02, "less", 1950, note=note)


def _second_burst(mcs: int, louder_db: int, target: float, seed: int, quick: bool) -> Row:
    """Bursts that begin anywhere in the payload of another one, and are louder."""
    rng, transmitter = np.random.default_rng(seed), Transmitter()
    n, heard = 100 if quick else 1000, 0
    for _ in range(n):
        first = transmitter.modulate([rng.bytes(220) for _ in range(4)], mcs)
        pdu = rng.bytes(220)
        second = transmitter.modulate([pdu], mcs) * 10 ** (louder_db / 20)
        turn = 2j * np.pi * (rng.uniform(-0.01, 0.01) * np.arange(len(second)) + rng.random())
        at = int(rng.integers(_HEADER, len(first)))
        x = np.pad(first, (800, max(0, at + len(second) - len(first)) + 1500)).astype(np.complex64)
        x[800 + at : 800 + at + len(second)] += second * np.exp(turn)
        heard += pdu in _heard(Receiver(), x + _noise(rng, len(x), 10 ** (-SNR_DB / 10)))
    name = f"second_burst_heard_mcs{mcs}_{louder_db}db"
    return _heard_share(name, heard, n, target, "220 B in 4 x 220 B, 25 dB", quick)


def _after_truncated(louder_db: int, seed: int, quick: bool) -> Row:
    """Bursts right behind one that stops anywhere in its payload."""
    rng, transmitter = np.random.default_rng(seed), Transmitter()
    n, heard = 100 if quick else 1000, 0
    for _ in range(n):
        first = transmitter.modulate([rng.bytes(220) for _ in range(4)], QPSK12)
        pdu = rng.bytes(220)
        second = transmitter.modulate([pdu], QPSK12) * np.float32(10 ** (louder_db / 20))
        cut = int(rng.integers(_HEADER, len(first)))
        x = np.pad(np.concatenate((first[:cut], second)), (800, 1500))
        heard += pdu in _heard(Receiver(), x + _noise(rng, len(x), 10 ** (-SNR_DB / 10)))
    name = f"after_truncated_heard_{louder_db}db"
    return _heard_share(name, heard, n, 0.97, "220 B behind a part of 4 x 220 B, 25 dB", quick)


def _heard_share(name: str, heard: int, n: int, target: float, note: str, quick: bool) -> Row:
    """The share heard, of which the lower 95 % bound has to meet the target."""
    value = heard / n if quick else 1 - ErrorRate(n, n - heard).bound
    return Row(name, value, "share", target, "more", n, note=f"{heard} of {n} heard; {note}")


def _deaf_at_onset(rate_hz: float, seed: int) -> Row:
    """How long after a tone begins a robot beside it hears nothing, at the worst."""
    rng, transmitter, worst = np.random.default_rng(seed), Transmitter(), 0
    for _ in range(30):
        begin = int(rng.integers(20_000, 60_000))
        tone = Jammer("tone", 20, _JAMMED_HZ, seed, offset_hz=1e5, times=[(begin / _JAMMED_HZ, 1)])
        receiver, excisor, x = Receiver(), Excisor(), _noise(rng, begin + 60_000, 0.03)
        for at in range(100, len(x) - 2000, 1900):
            burst = transmitter.modulate([rng.bytes(64)], QPSK12)
            x[at : at + len(burst)] += burst
        receiver.cuts = excisor.cuts
        events = receiver.push(excisor.push(tone.add(x, 0)))
        # A burst that had begun before it may still be heard.
        ends = [each.at for each in events if isinstance(each, PduHeard)]
        worst = max(worst, min((at for at in ends if at > begin + 2000), default=len(x)) - begin)
    name = f"deaf_at_onset_of_a_tone_ms_{rate_hz * 1e-6:.0f}msps"
    return Row(
        name, 1e3 * worst / rate_hz, "ms", 50, "less", 30, note="20 dB stronger; 64 B, QPSK 1/2"
    )


def _step(step_db: float, seed: int, quick: bool) -> Row:
    """Bursts of four PDUs with a step of gain anywhere in the payload."""
    rng, transmitter, receiver = np.random.default_rng(seed), Transmitter(), Receiver()
    errors, n = 0, 300 if quick else 3000
    for _ in range(n):
        pdus = [rng.bytes(220) for _ in range(4)]
        burst = transmitter.modulate(pdus, QAM64_34).copy()
        burst[int(rng.integers(600, len(burst) - 200)) :] *= np.float32(10 ** (step_db / 20))
        x = np.pad(burst, (300, 1000))
        events = receiver.push(x + _noise(rng, len(x), 10 ** (-SNR_DB / 10)))
        errors += len(set(pdus) - {each.data for each in events if isinstance(each, PduHeard)})
    name = f"gain_step_64qam_{step_db:.0f}db_lost"
    note = "64QAM 3/4, 4 x 220 B, 25 dB before"
    return _lost(name, ErrorRate(4 * n, errors), 0.01, note, quick)


def _lost(name: str, lost: ErrorRate, target: float | None, note: str, quick: bool) -> Row:
    note = f"{lost.errors} of {lost.n} lost; {note}"
    value = lost.share if quick else lost.bound
    return Row(name, value, "share", target, "less", lost.n, note=note)


def _false_pdus(seed: int, n_samples: int) -> Row:
    """How often whatever a radio may bring but bursts is taken for a PDU, behind the excisor."""
    rng, told = np.random.default_rng(seed), 0
    receiver, excisor = Receiver(), Excisor()
    receiver.cuts = excisor.cuts
    block = 1 << 16
    while receiver.counters["samples"] < n_samples:
        x = _noise(rng, block, 10 ** rng.uniform(-6, 6)).copy()
        kind, at = rng.integers(6), int(rng.integers(block))
        if kind == 0:
            x[:] = 0
        elif kind == 1:
            np.clip(x.view(np.float32), -0.1, 0.1, out=x.view(np.float32))
        elif kind == 2:
            x[at:] *= np.float32(10 ** rng.uniform(-3, 3))
        elif kind == 3:
            x[at:] += np.complex64(10 ** rng.uniform(-3, 3))
        else:
            jammer = Jammer(
                _JAMMERS[int(rng.integers(len(_JAMMERS)))], rng.uniform(-60, 60), _JAMMED_HZ,
                int(rng.integers(1 << 30)), offset_hz=rng.uniform(-0.5, 0.5) * _JAMMED_HZ,
                width_hz=rng.uniform(0, 0.2) * _JAMMED_HZ, period_s=10 ** rng.uniform(-4, -1),
                duty=10 ** rng.uniform(-3, 0),
            )  # fmt: skip
            x[at:] = jammer.add(x[at:], 0)
        told += sum(isinstance(each, PduHeard) for each in receiver.push(excisor.push(x)))
    note = "silence, saturation, steps of level and DC, noise, every jammer; behind the excisor"
    n = receiver.counters["samples"]
    return Row("false_pdus", told, "PDUs", 0, "less", n, note=note)


if __name__ == "__main__":
    sys.exit(main("rough", measure))
