"""What joins a companion computer to a flight controller (FCU): serial lines, agents, daemons.

    from benchmarks.peers.latency.table import PEERS, unavailable

A way is all that there is between the two ends. Each end is a process of its own (`endpoint`), some
by another interpreter than ours: therefore this file, and what `endpoint` imports, needs nothing
but the standard library. `ours` has our own daemons as one way among the others.
"""
