"""PDU links, which carry PDUs between nodes: their common interface, and the direct link."""

from sdrlinkd.pdulink.base import Carry, Heard, PduLink, PduListener
from sdrlinkd.pdulink.direct import DirectLink
from sdrlinkd.pdulink.gnuradio import GnuRadioLink, from_gnu_radio, make_gnuradio, to_gnu_radio
from sdrlinkd.pdulink.impairment import Arrival, Impairment

__all__ = [
    "Arrival",
    "Carry",
    "DirectLink",
    "GnuRadioLink",
    "Heard",
    "Impairment",
    "PduLink",
    "PduListener",
    "from_gnu_radio",
    "make_gnuradio",
    "to_gnu_radio",
]
