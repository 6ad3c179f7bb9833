"""What the modem reports of itself and its radio."""

import phy
from backends import Capabilities
from sdrlinkd.config import ModemParams
from sdrlinkd.modem.modem import ModemStatus
from sdrlinkd.reports import LineReport, OtherLinkReport, PduLinkReport

NO_SAMPLES = "it delivers no samples"
ON_ETHER = f"{NO_SAMPLES}: start it again if it has stopped, or end programs that take its CPU"


def modem_report(
    kind: str,
    state: str,
    problem: str,
    params: ModemParams,
    modem: ModemStatus,
    can: Capabilities | None,
    stream_end: int,
) -> PduLinkReport:
    """The report of a modem and its radio, which is open if it `can` do something.

    `problem` is why the stream ended, empty if it runs; `stream_end` is the number of samples.
    """
    reason = problem
    if state == "down" and not problem:
        reason = modem.trouble or (
            (ON_ETHER if kind == "ether" else NO_SAMPLES) if stream_end else ""
        )
    power_dbfs, ratio = modem.power_dbfs, modem.realtime_ratio
    return PduLinkReport(
        kind=kind,
        state=state,
        detail=f"{phy.MCS_TABLE[params.mcs].name}, {params.rate_hz / 1e6:g} Msps, {modem.detail}, "
        f"CFO up to {params.searched_cfo_hz / 1e3:.3g} kHz",
        max_cfo_hz=round(params.searched_cfo_hz, 3),
        reason=reason,
        level_dbfs=None if power_dbfs is None else round(power_dbfs, 1),
        clipped_pct=100 * modem.clipped,
        counters=dict(modem.counters),
        realtime_ratio=round(ratio, 2) if ratio else None,
        scheduling=modem.scheduling,
        engine=modem.engine,
        lines=[
            LineReport(
                offset_hz=round(line.offset_hz),
                level_dbfs=round(line.power_dbfs, 1),
                over_noise_db=None if line.over_noise_db is None else round(line.over_noise_db, 1),
                cut_pct=round(100 * line.width, 1),
                sweeps=line.moves,
            )
            for line in modem.lines
        ],
        network=params.network,
        others=[
            OtherLinkReport(network=each.network, pdu_size=each.pdu_bytes) for each in modem.others
        ],
        notices=_notices(state, problem, params, modem, can, stream_end),
    )


def _notices(
    state: str,
    problem: str,
    params: ModemParams,
    modem: ModemStatus,
    can: Capabilities | None,
    stream_end: int,
) -> list[str]:
    notices = [problem] if problem else []
    if state == "down" and not problem and stream_end:
        notices.append(f"the radio delivers no samples ({modem.detail}); messages stay queued")
    if modem.counters.get("overflows"):
        lost = modem.counters["samples_lost"]
        kept = 1 - lost / max(1, stream_end)
        notices.append(
            f"the receiver fell behind {modem.counters['overflows']} times and dropped {lost} "
            f"samples: it reaches {kept:.2f} of real time at {params.rate_hz / 1e6:g} Msps "
            f"(demodulation alone {modem.realtime_ratio:.2f}); lower modem.rate_hz"
        )
    if state != "down" and can is not None and not can.transmits:
        notices.append("this radio only receives: messages to send stay queued")
    if modem.advice:
        notices.append(modem.advice)
    return notices
