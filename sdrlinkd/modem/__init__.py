"""The modem: carries PDUs as OFDM bursts over a radio."""

from sdrlinkd.modem.airtimes import Airtimes
from sdrlinkd.modem.link import ModemLink
from sdrlinkd.modem.making import check_airtime, make_modem, modem_on
from sdrlinkd.modem.presumed import PresumedRadio, access_words, presume_radio
from sdrlinkd.modem.process import Loading, make_radio
from sdrlinkd.modem.traits import pdu_link_traits

__all__ = [
    "Airtimes",
    "Loading",
    "ModemLink",
    "PresumedRadio",
    "access_words",
    "check_airtime",
    "make_modem",
    "make_radio",
    "modem_on",
    "pdu_link_traits",
    "presume_radio",
]
