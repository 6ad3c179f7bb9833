"""Fig. 20 and 21: a control loop over our link, with 64 KB in the same direction now and then.

The plant is at robot 1, the controller at robot 2, both directions on one half-duplex channel. The
circuit, the controller and the local run are those of the peers' measurements.
"""

import struct

import numpy as np
from numpy.typing import NDArray

from benchmarks.peers.pound.control import (
    GAIN,
    LARGE,
    LARGE_PERIOD_S,
    PERIOD_S,
    SETPOINT,
    SMALL,
    local_loop,
    plant,
)
from benchmarks.pound.ours import CDR, Air, simulate
from benchmarks.pound.tables import BLOCK_3N_S
from benchmarks.worlds.arrivals import Arrival
from sdrlinkd.link import (
    BulkParams,
    ClassesParams,
    DefaultParams,
    Delivered,
    LatencyParams,
    Overrides,
    Qos,
)
from sdrlinkd.wire import make_registry

REGISTRY = make_registry([(name, "std_msgs/msg/UInt8MultiArray") for name in ("y", "u", "bulk")])
Y, U, BULK = range(3)
_DOUBLE = struct.Struct("<d")
CLASSES = ClassesParams(bulk=BulkParams(max_burst_s=0.003))
FIFO = ClassesParams(
    latency=LatencyParams(share=0.0), default=DefaultParams(share=0.0), bulk=BulkParams(share=0.0)
)
TWO = Air(policy="minislot", turnaround_s=1e-4, max_burst_s=0.01, block_s=BLOCK_3N_S)


def rms_vs_local_mv(phase_s: float, seed: int, seconds: float, with_classes: bool = True) -> float:
    """RMS difference to the local run, in mV."""
    ticks = round(seconds / PERIOD_S)
    error = run_loop(phase_s, seed, ticks, with_classes) - local_loop(ticks)
    return float(1e3 * np.sqrt(np.mean(error**2)))


def run_loop(
    phase_s: float, seed: int, ticks: int, with_classes: bool = True
) -> NDArray[np.float64]:
    """Vc(k) in V `[ticks]`; without classes all messages share one FIFO."""
    a, b = plant()
    x, vc = np.zeros(2), np.zeros(ticks)
    heard_u = held_u = 0.0
    fast = Overrides(qos=Qos.LATENCY if with_classes else Qos.DEFAULT)
    slow = Overrides(qos=Qos.BULK if with_classes else Qos.DEFAULT)

    def tick(k: int) -> None:
        nonlocal x, held_u
        if k:
            x = a @ x + b * held_u
        vc[k], held_u = x[0], heard_u
        simulation.submit(1, Y, _message(float(vc[k])), fast)
        if k + 1 < ticks:
            simulation.call((k + 1) * PERIOD_S, lambda: tick(k + 1))

    def listen(node: int, message: Delivered, _: float) -> None:
        nonlocal heard_u
        if node == 2 and message.topic_id == Y:
            simulation.submit(2, U, _message(GAIN * (SETPOINT - _value(message.payload))), fast)
        elif node == 1 and message.topic_id == U:
            heard_u = _value(message.payload)

    n_large = int(ticks * PERIOD_S / LARGE_PERIOD_S)
    large = [
        Arrival(phase_s + i * LARGE_PERIOD_S, BULK, CDR + bytes(LARGE + 4), slow)
        for i in range(n_large)
    ]
    air = TWO._replace(classes=CLASSES if with_classes else FIFO)
    simulation = simulate(REGISTRY, air, {1: 0.0, 2: 0.0}, {2: large}, listen, seed)
    simulation.call(0.0, lambda: tick(0))
    simulation.run(ticks * PERIOD_S)
    return vc


def _message(value: float) -> bytes:
    """A float64 in a message of SMALL bytes."""
    return CDR + _DOUBLE.pack(value) + bytes(SMALL - len(CDR) - _DOUBLE.size)


def _value(payload: bytes) -> float:
    value: float = _DOUBLE.unpack_from(payload, len(CDR))[0]
    return value
