"""Makes the modem ready before it is needed."""

from functools import cache

import numpy as np

from phy import engine
from phy.channel import FrontEnd, FrontEndParams
from phy.mcs import MCS_TABLE


def warm_up(name: str = "auto", progress: engine.Progress | None = None) -> engine.Engine:
    """Choose the engine, build its library if there is none yet, and compute its tables.

    The build takes a minute, once: `progress(done, total)` is called first and after each kernel,
    and an exception from it ends the build. Raises `engine.EngineError` for an engine that cannot
    be used.
    """
    used = engine.use(name, progress)
    _compute_tables(used.name)
    return used


@cache
def _compute_tables(_: str) -> None:
    """Send and receive a burst of each MCS with the engine in use, once for each engine."""
    used = engine.in_use()
    transmitter, receiver = used.transmitter(), used.receiver()
    front_end = FrontEnd(FrontEndParams(noise_dbfs=-30.0), np.random.default_rng(0))
    for mcs in MCS_TABLE:
        receiver.push(front_end.receive(transmitter.modulate([bytes(32)], mcs.index)))
    receiver.flush()
