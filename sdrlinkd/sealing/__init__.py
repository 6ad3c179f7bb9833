"""Sealed PDUs: nobody without the team's key sends, and nothing old counts as new.

This package owns keys in memory, the numbers of our sealed PDUs, and what is known about each
source. It never reads a clock, a file or the air: all of that is given to it. The wire document
defines the format and the rules in section 11.
"""

from sdrlinkd.sealing.clear import InTheClear
from sdrlinkd.sealing.keys import FINGERPRINT_SIZE, KEY_SIZE, Key
from sdrlinkd.sealing.opener import Opened
from sdrlinkd.sealing.params import SecurityParams
from sdrlinkd.sealing.remembered import Memory, Remembered
from sdrlinkd.sealing.sealing import Sealing
from sdrlinkd.sealing.words import words_of

__all__ = [
    "FINGERPRINT_SIZE",
    "KEY_SIZE",
    "InTheClear",
    "Key",
    "Memory",
    "Opened",
    "Remembered",
    "Sealing",
    "SecurityParams",
    "words_of",
]
