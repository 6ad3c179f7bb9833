"""Links from a companion computer to a flight controller (FCU): serial lines, agents, daemons.

    from benchmarks.peers.latency.table import PEERS, unavailable

A way is everything between the two ends. Each end is a process of its own (`endpoint`), some with
another interpreter than ours, so this file and everything that `endpoint` imports use the standard
library only. `ours` has our own daemons as one way among the others.
"""
