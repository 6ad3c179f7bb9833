"""What a robot team would use instead, over two network namespaces and a slow channel.

    from benchmarks.peers.pound.namespaces import available, network
    from benchmarks.peers.pound.runs import outage, run_peer, saturate
    from benchmarks.peers.pound.control import control_loop, local_loop

Each end of a peer is a process of its own, some with another interpreter than ours, so this file
and everything that `endpoint` imports use the standard library only.
"""

from benchmarks.peers.pound.table import PEERS, unavailable

__all__ = ["PEERS", "unavailable"]
