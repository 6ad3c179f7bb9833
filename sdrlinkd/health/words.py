"""Words for people: the PDU link's name, time spans, shares."""

from sdrlinkd.reports import LineReport, PduLinkReport, VerdictReport

_NAMES = {
    "ether": "hub",
    "gnuradio": "flowgraph",
    "iqfile": "recording",
    "loopback": "loopback",
    "zmq": "sample stream",
}


def pdu_link_name(pdu_link: PduLinkReport) -> str:
    """The word for the PDU link, for sentences on its absence."""
    return _NAMES.get(pdu_link.kind, "radio")


def first_line(verdict: VerdictReport) -> str:
    """The verdict in one line: level, protection, and the first of its reasons."""
    more = f"; + {len(verdict.reasons) - 1} more" if len(verdict.reasons) > 1 else ""
    told = ": ".join([f"{verdict.level}, {verdict.protection}", *verdict.reasons[:1]])
    return told + more


def span(seconds: float) -> str:
    """A time span as text: `12 s`, `3 min 20 s`, `2 h 5 min`, `400 d`."""
    whole = round(seconds)
    if whole < 60:
        return f"{whole} s"
    if whole < 3600:
        return f"{whole // 60} min {whole % 60} s"
    if whole < 100 * 3600:
        return f"{whole // 3600} h {whole % 3600 // 60} min"
    return f"{whole // 86400} d"


def percent(share: float) -> str:
    """A share as text: `4 %`; below 1 %, with one more digit."""
    return f"{100 * share:.0f} %" if share >= 0.0095 else f"{100 * share:.1f} %"


def line_told(line: LineReport) -> str:
    """A tone or narrow signal that is cut out: where, and how strong."""
    where = "a sweep" if line.sweeps else f"a line at {line.offset_hz / 1e3:+.0f} kHz"
    if line.over_noise_db is None:
        return f"{where}, {line.level_dbfs:.0f} dBFS"
    return f"{where}, {line.over_noise_db:.0f} dB over the noise"
