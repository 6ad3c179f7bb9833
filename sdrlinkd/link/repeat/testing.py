"""What tests look at, piece by piece; not part of the interface."""

from sdrlinkd.link.repeat.gaps import inside, parts
from sdrlinkd.link.repeat.kept import KeptPdus
from sdrlinkd.link.repeat.missing import Missing, Source

__all__ = [
    "KeptPdus",
    "Missing",
    "Source",
    "inside",
    "parts",
]
