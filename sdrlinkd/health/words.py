"""What carries the PDUs, and spans of time, as people say them."""

from sdrlinkd.reports import PduLinkReport

_NAMES = {
    "ether": "hub",
    "gnuradio": "flowgraph",
    "iqfile": "recording",
    "zmq": "sample stream",
}


def pdu_link_name(pdu_link: PduLinkReport) -> str:
    """The word for what carries the PDUs, which may be missing."""
    return _NAMES.get(pdu_link.kind, "radio")


def span(seconds: float) -> str:
    """A time span as people say it: `12 s`, `3 min 20 s`, `2 h 5 min`."""
    whole = round(seconds)
    if whole < 60:
        return f"{whole} s"
    if whole < 3600:
        return f"{whole // 60} min {whole % 60} s"
    return f"{whole // 3600} h {whole % 3600 // 60} min"


def percent(share: float) -> str:
    """A share as people say it: `4 %`; below one, with one digit more."""
    return f"{100 * share:.0f} %" if share >= 0.0095 else f"{100 * share:.1f} %"
