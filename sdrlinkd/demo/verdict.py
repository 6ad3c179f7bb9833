"""Judges whether a run delivered what its link should deliver, and if not, why."""

import phy
from sdrlinkd.demo.report import PhyResult, RunResult

CLEAN_PER = 1e-6
MARGIN_DB = 0.5
"""Margin in dB for errors of the model of packet errors."""
STOOD_STILL = 0.5
"""Losses are blamed on waiting for a CPU if it explains at least this share of them."""
SATURATED = 0.9


def is_clean(result: RunResult) -> bool:
    """Whether the run's channel loses no messages: no fading, and enough SNR for the MCS."""
    heard = result.phy
    if heard is None:
        return True
    snr_db = heard.snr_db - MARGIN_DB
    per = phy.pdu_error_rate(heard.mcs_index, snr_db, result.pdu_size)
    return heard.channel == "awgn" and per <= CLEAN_PER


def is_good(result: RunResult) -> bool:
    """Whether all messages that should arrive did so, unchanged, and the ledger adds up."""
    if not result.ledger_adds_up or (result.received and not result.bytes_identical):
        return False
    return result.received == result.sent or not is_clean(result)


def verdict(result: RunResult) -> str:
    """What is missing or wrong, and why, in a sentence; empty if the run was good."""
    missing = result.sent - result.received
    if missing <= 0:
        wrong = "" if result.bytes_identical else "received messages differ from those sent"
        wrong = wrong if result.ledger_adds_up else "its ledger does not add up"
        return wrong and f"{result.name}: {wrong}, which is a bug in sdrlinkd"
    text = f"{result.name}: {missing} of {result.sent} messages did not arrive: "
    heard = result.phy
    if heard is not None and (heard.samples_lost or (heard.busy or 0.0) > SATURATED):
        return text + _why_slow(heard, result.duration_s)
    if heard is not None and not is_clean(result):
        needed_db = phy.needed_snr_db(heard.mcs_index, result.pdu_size, CLEAN_PER) + MARGIN_DB
        fades = "" if heard.channel == "awgn" else f" with fading ({heard.channel})"
        return text + (
            f"{heard.mcs} loses nothing from {needed_db:.0f} dB upward, but this channel has "
            f"{heard.snr_db:g} dB{fades}"
        )
    named = ", ".join(f"{count} {name}" for name, count in result.dropped.items())
    return text + (named or "unknown reason, which is a bug in sdrlinkd")


def _why_slow(heard: PhyResult, duration_s: float) -> str:
    rate = f"{heard.rate_hz / 1e6:g} Msps"
    lost_s = heard.samples_lost / heard.rate_hz
    lost = "the receiver fell behind"
    if heard.samples_lost:
        lost = f"the receiver lost {lost_s:.1f} s of the {duration_s:.1f} s"
    waited = heard.waited or 0.0
    if (heard.busy or 0.0) - waited > SATURATED:
        return f"{lost}: the CPU is too slow for {rate}; try a lower --rate"
    if waited * duration_s > STOOD_STILL * lost_s:
        return (
            f"{lost}: other programs used the CPU for {waited * duration_s:.1f} s; end "
            f"them, or try a lower --rate than {rate}"
        )
    return f"{lost}: the daemon stalled; was it or the machine suspended?"
