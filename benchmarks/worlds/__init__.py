"""Links on one simulated air, in lock-step, for benchmarks and tests.

    from benchmarks.worlds.arrivals import Arrival, poisson
    from benchmarks.worlds.bursts import Simulation
    from benchmarks.worlds.samples import Station, play, run

`bursts` simulates an air of bursts instead of samples: hours of many robots in seconds. `samples`
also has the modem and the radio of a daemon, sample by sample, and serves to verify `bursts`. Both
take the same arrivals. `burst_channel` and `flight` decide who receives which burst, from the
modem's error rates; no daemon uses them.
"""
