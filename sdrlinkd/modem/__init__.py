"""The modem: PDUs through OFDM and a radio."""

from sdrlinkd.modem.link import ModemLink
from sdrlinkd.modem.radios import make_modem

__all__ = ["ModemLink", "make_modem"]
