"""RT-WMP: a token protocol with priorities of the whole network, on a simulated channel.

    network = Network(3, [(0, 1), (1, 2)], PAPER, seed=1)
    network.send(Message(1, src=0, dst=2, octets=1024, priority=9, at=0.0))
    network.run(1.0)

Sources: D. Tardioli and J. L. Villarroel, "Real Time Communications over 802.11: RT-WMP", MASS
2007; the Pound paper, IV-C; for field sizes, queue and times the authors' program,
github.com/dantard/unizar-rt-wmp-ros-pkg. The program adds to the published protocol; the classes
say which of its additions are here.
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
