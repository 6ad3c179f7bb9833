"""Fig. 20 and 21: a control loop over our link, with 64 KB now and then beside y.

The plant and the large messages are at robot 1, the controller is at robot 2, both directions on
one half-duplex channel. The circuit, the controller and the local run are those of the peers'
measurements.
"""

import struct

import numpy as np
from numpy.typing import NDArray

from benchmarks.peers.pound.control import (
    EVERY,
    GAIN,
    LARGE,
    LARGE_PERIOD_S,
    SETPOINT,
    SMALL,
    TICK_S,
    plant,
    rms_mv,
)
from benchmarks.pound.ours import CDR, Air, simulate
from benchmarks.pound.tables import BLOCK_3N_S, TURNAROUND_S
from benchmarks.worlds.arrivals import Arrival
from sdrlinkd.link import Delivered, Overrides, Qos
from sdrlinkd.wire import make_registry

REGISTRY = make_registry([(name, "std_msgs/msg/UInt8MultiArray") for name in ("y", "u", "bulk")])
Y, U, BULK = range(3)
_DOUBLE = struct.Struct("<d")
PDU_SIZE = 288
"""The least size at which 64 KB fit into 255 fragments, nearly: y and u are short."""
TWO = Air(
    policy="minislot", full_duplex=False, turnaround_s=TURNAROUND_S, max_burst_s=0.01,
    block_s=BLOCK_3N_S, pdu_size=PDU_SIZE,
)  # fmt: skip


def rms_vs_local_mv(phase_s: float, seed: int, seconds: float, air: Air = TWO) -> float:
    """RMS difference to the local run, in mV."""
    return rms_mv(run_loop(phase_s, seed, round(seconds / TICK_S), air))


def run_loop(phase_s: float, seed: int, ticks: int, air: Air = TWO) -> NDArray[np.float64]:
    """Vc(k) in V at each step, `[ticks]`."""
    a, b = plant(TICK_S)
    x, vc = np.zeros(2), np.zeros(ticks)
    held_u = 0.0
    fast, slow = Overrides(qos=Qos.LATENCY), Overrides(qos=Qos.BULK)

    def tick(k: int) -> None:
        nonlocal x
        vc[k] = x[0]
        if k % EVERY == 0:
            simulation.submit(1, Y, _message(float(vc[k])), fast)
        x = a @ x + b * held_u
        if k + 1 < ticks:
            simulation.call((k + 1) * TICK_S, lambda: tick(k + 1))

    def listen(node: int, message: Delivered, _: float) -> None:
        nonlocal held_u
        if node == 2 and message.topic_id == Y:
            simulation.submit(2, U, _message(GAIN * (SETPOINT - _value(message.payload))), fast)
        elif node == 1 and message.topic_id == U:
            held_u = _value(message.payload)

    n_large = int(ticks * TICK_S / LARGE_PERIOD_S)
    large = [
        Arrival(phase_s + i * LARGE_PERIOD_S, BULK, CDR + bytes(LARGE + 4), slow)
        for i in range(n_large)
    ]
    simulation = simulate(REGISTRY, air, {1: 0.0, 2: 0.0}, {1: large}, listen, seed)
    simulation.call(0.0, lambda: tick(0))
    simulation.run(ticks * TICK_S)
    return vc


def _message(value: float) -> bytes:
    """A float64 in a message of SMALL bytes."""
    return CDR + _DOUBLE.pack(value) + bytes(SMALL - len(CDR) - _DOUBLE.size)


def _value(payload: bytes) -> float:
    value: float = _DOUBLE.unpack_from(payload, len(CDR))[0]
    return value
