"""The assessment of the Sensors 2023 paper: messages between a companion computer and an FCU.

    from benchmarks.latency.peers.table import PEERS, unavailable
    from benchmarks.latency.session import run

Some endpoints run by another interpreter than ours: therefore this file, and what `endpoint`
imports, needs nothing but the standard library.
"""
