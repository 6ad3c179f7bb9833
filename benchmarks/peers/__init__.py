"""Other people's systems, measured beside ours in the same run.

`pound` is what a robot team would use instead of our link; `latency` is what joins a companion
computer to a flight controller; `modems` are other OFDM modems; `radio` is how others read a radio.
Each room belongs to the benchmark of its name, `modems` to `phy_per` and `phy_speed`. A benchmark
imports its peers; a peer imports no benchmark. Some ends run by another interpreter than ours:
therefore this file needs nothing but the standard library.
"""
