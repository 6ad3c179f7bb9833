"""Selective repeat: asks others for the PDUs that are missing, and sends again what others lack.

This package keeps what was sent in the last second and what is missing of others. It decides what
to ask and what to repeat, and when. It sends nothing itself: bursts and records are made by
`transmit`.
"""

from sdrlinkd.link.repeat.answers import Answers
from sdrlinkd.link.repeat.asking import Asking
from sdrlinkd.link.repeat.group import RepeatGroup, Wanted
from sdrlinkd.link.repeat.kept import Kept
from sdrlinkd.link.repeat.params import RepeatParams

__all__ = [
    "Answers",
    "Asking",
    "Kept",
    "RepeatGroup",
    "RepeatParams",
    "Wanted",
]
