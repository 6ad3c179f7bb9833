"""The air of daemons on a hub."""

AIR = {"rate_hz": 1e6, "frequency_hz": 2.45e9, "block_s": 0.005}
