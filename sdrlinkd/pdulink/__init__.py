"""PDU links, which carry PDUs between nodes: their common interface, and the direct link."""

from sdrlinkd.pdulink.base import (
    AirSeen,
    BurstSeen,
    Carry,
    Heard,
    LineSeen,
    Observe,
    PduLink,
    PduListener,
)
from sdrlinkd.pdulink.direct import DirectLink
from sdrlinkd.pdulink.gnuradio import (
    GnuRadioLink,
    from_gnu_radio,
    make_gnuradio,
    to_gnu_radio,
    try_gnuradio,
)
from sdrlinkd.pdulink.impairment import Arrival, Impairment

__all__ = [
    "AirSeen",
    "Arrival",
    "BurstSeen",
    "Carry",
    "DirectLink",
    "GnuRadioLink",
    "Heard",
    "Impairment",
    "LineSeen",
    "Observe",
    "PduLink",
    "PduListener",
    "from_gnu_radio",
    "make_gnuradio",
    "to_gnu_radio",
    "try_gnuradio",
]
