"""RT-WMP: a token protocol with priorities of the whole network, on a simulated channel.

    network = Network(3, [(0, 1), (1, 2)], PAPER, seed=1)
    network.send(Message(1, src=0, dst=2, octets=1024, priority=9, at=0.0))
    network.run(1.0)

Published by D. Tardioli and J. L. Villarroel, "Real-Time Communications over 802.11: RT-WMP",
MASS 2007. What is here comes from the Pound paper, IV-C, which sums it up, and from the authors'
program, github.com/dantard/unizar-rt-wmp-ros-pkg, in its basic routing: sizes of fields, queue,
retries and times. Its pruning of links, power saving and bursts are not here.
"""

from benchmarks.peers.pound.rtwmp.bound import LoopBound, loop_bound
from benchmarks.peers.pound.rtwmp.frames import Frame, Kind, Message, size
from benchmarks.peers.pound.rtwmp.lqm import Lqm
from benchmarks.peers.pound.rtwmp.network import Network
from benchmarks.peers.pound.rtwmp.node import Node
from benchmarks.peers.pound.rtwmp.params import PAPER, Params
from benchmarks.peers.pound.rtwmp.routes import next_hop

__all__ = [
    "PAPER", "Frame", "Kind", "LoopBound", "Lqm", "Message", "Network", "Node", "Params",
    "loop_bound", "next_hop", "size",
]  # fmt: skip
