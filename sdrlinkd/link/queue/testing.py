"""What tests look at, piece by piece; not part of the interface."""

from sdrlinkd.link.queue.admission import Admission
from sdrlinkd.link.queue.child_frames import child_frames, key_of
from sdrlinkd.link.queue.parting import Parting

__all__ = [
    "Admission",
    "Parting",
    "child_frames",
    "key_of",
]
