"""The modem: PDUs through OFDM and a radio."""

from sdrlinkd.modem.airtimes import Airtimes
from sdrlinkd.modem.link import ModemLink
from sdrlinkd.modem.presumed import PresumedRadio, access_words, presume_radio
from sdrlinkd.modem.radios import check_airtime, make_modem, make_radio
from sdrlinkd.modem.traits import carrier_traits

__all__ = [
    "Airtimes",
    "ModemLink",
    "PresumedRadio",
    "access_words",
    "carrier_traits",
    "check_airtime",
    "make_modem",
    "make_radio",
    "presume_radio",
]
