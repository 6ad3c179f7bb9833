"""What the modem reports of itself and its radio."""

from collections.abc import Mapping

import phy
from backends import Radio
from sdrlinkd.config import ModemParams
from sdrlinkd.reports import PduLinkReport


def modem_report(
    kind: str,
    state: str,
    problem: str,
    params: ModemParams,
    radio: Radio,
    counters: Mapping[str, int],
    realtime_ratio: float,
    stream_end: int,
) -> PduLinkReport:
    """The report of a modem and its radio.

    `problem` is why the stream ended, empty if it runs; `stream_end` is the number of samples.
    """
    levels = radio.levels
    reason = problem
    if state == "down" and not problem:
        reason = radio.trouble or ("it delivers no samples" if stream_end else "")
    return PduLinkReport(
        kind=kind,
        state=state,
        detail=f"{phy.MCS_TABLE[params.mcs].name}, {params.rate_hz / 1e6:g} Msps, {radio.detail}, "
        f"CFO up to {params.searched_cfo_hz / 1e3:.3g} kHz",
        max_cfo_hz=round(params.searched_cfo_hz, 3),
        reason=reason,
        level_dbfs=None if levels is None else round(levels.power_dbfs, 1),
        clipped_pct=0.0 if levels is None else 100 * levels.clipped,
        counters={**radio.counters, **counters},
        realtime_ratio=round(realtime_ratio, 2) if realtime_ratio else None,
        notices=_notices(state, problem, params, radio, realtime_ratio, stream_end),
    )


def _notices(
    state: str,
    problem: str,
    params: ModemParams,
    radio: Radio,
    realtime_ratio: float,
    stream_end: int,
) -> list[str]:
    notices = [problem] if problem else []
    if state == "down" and not problem and stream_end:
        notices.append(f"the radio delivers no samples ({radio.detail}); messages stay queued")
    if radio.counters.get("overflows"):
        lost = radio.counters["samples_lost"]
        kept = 1 - lost / max(1, stream_end)
        notices.append(
            f"the receiver fell behind {radio.counters['overflows']} times and dropped {lost} "
            f"samples: it reaches {kept:.2f} of real time at {params.rate_hz / 1e6:g} Msps "
            f"(demodulation alone {realtime_ratio:.2f}); lower modem.rate_hz"
        )
    if state != "down" and not radio.capabilities.transmits:
        notices.append("this radio only receives: messages to send stay queued")
    return notices
