"""Third-party systems, measured next to ours in the same run.

`pound` is what a robot team would use instead of our link; `latency` connects a companion computer
to a flight controller; `modems` are other OFDM modems; `radio` is how others read a radio. Each
package belongs to the benchmark of its name, `modems` to `phy_per` and `phy_speed`. A benchmark
imports its peers; a peer imports no benchmark. Some ends run with another interpreter than ours, so
this file uses the standard library only.
"""
