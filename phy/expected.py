"""What the bursts of a link look like, and what may be spent on signals that look otherwise."""

from typing import NamedTuple


class OtherLink(NamedTuple):
    """What the headers of another link tell: its network, and the length of its PDUs in bytes."""

    network: int
    pdu_bytes: int


class Expected(NamedTuple):
    """The PDU length and the longest burst of our network, and a budget for everything else.

    Every robot on a link has the same PDU length and the same bound. So a header of our network
    that tells otherwise is false, and whoever believes it is deaf for as long as it says. An
    acquisition that brings no PDU costs one of `misses` in reserve; `every` samples give one back.
    Peaks that come while there is none are skipped, so that a flood of preambles costs a bounded
    share of the processor.
    """

    pdu_bytes: int
    longest: int
    """Number of samples of the longest burst."""
    every: int
    misses: int = 100
