"""Links on one simulated air, in lock-step: the one place for benchmarks and tests.

    from benchmarks.worlds.arrivals import Arrival, poisson
    from benchmarks.worlds.bursts import Simulation
    from benchmarks.worlds.samples import Station, play, run

`bursts` has an air of bursts instead of samples: hours of many robots in seconds. `samples` has the
modem and the radio of a daemon, too, sample by sample: it is what `bursts` is checked against. Both
take the same arrivals. `burst_channel` and `flight` say who hears which burst, by the modem's error
rates: no daemon runs on them.
"""
