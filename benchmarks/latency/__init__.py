"""The evaluation of the Sensors 2023 paper: messages between a companion computer and an FCU.

    from benchmarks.latency.session import run

A session measures one way between the two ends; the ways are in `benchmarks.peers.latency`.
"""
