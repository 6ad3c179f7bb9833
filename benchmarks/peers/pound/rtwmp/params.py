"""The channel and the constants of the protocol."""

from typing import NamedTuple

from benchmarks.peers.pound.rtwmp.frames import PART


class Params(NamedTuple):
    """Times in s, sizes in octets. The defaults are those of the authors' program."""

    rate_bps: float = 6e6
    frame_overhead_s: float = 242e-6
    """What a frame takes besides its octets: in the program's own estimate of a frame's duration,
    preamble, interframe space and mean back-off of 802.11 together."""
    gap_s: float = 0.0
    """From the end of one frame to the start of the next at the earliest: the turnaround."""
    host_s: float = 0.0
    """From the end of a frame that was heard until the node has its next frame ready."""
    part_octets: int = PART
    """A longer message goes in parts, each with a loop of its own."""
    queue_depth: int = 50
    """Messages that a node keeps; a new one that finds the queue full is refused."""
    retries: int = 1
    """How often a frame is repeated that nobody was heard to forward."""
    ack_margin_s: float = 1e-3
    """Assumed: how much longer than the longest frame a node waits for that. The program waits for
    100 ms."""
    rest_s: float = 0.1
    """Assumed, from the program's 100 ms: how often a node that hears nobody tries to reach one."""
    search_loops: int = 8
    """Assumed: one loop in so many searches for a lost node. The program does it in each."""
    hold_s: float = 1.5
    """A link that nothing was heard on for so long is gone."""
    inactivity_s: float = 1.0
    """Silence after which node 0 makes a new token."""
    inactivity_step_s: float = 5.0
    """The same: what each further node waits beyond the one before."""
    returns: bool = False
    """Whether the token goes back to who began the loop before the authorization. The program does
    so; the published protocol, and its worst case, do not."""

    def frame_s(self, octets: int) -> float:
        """How long a frame takes on the channel."""
        return self.frame_overhead_s + 8 * octets / self.rate_bps

    def hop_s(self, octets: int) -> float:
        """The same, with what passes before the frame begins."""
        return self.host_s + self.gap_s + self.frame_s(octets)


PAPER = Params()
"""The paper's channel: 802.11a at 6 Mbit/s, raw frames, no time for the hosts."""
